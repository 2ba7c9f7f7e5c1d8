"""Rotations as rows (w, x, y, z), and vectors, many at a time."""

import numpy

from complementarity import cross, dot


def rotation(q):
    """Matrices."""
    w, x, y, z = (q[..., i] for i in range(4))
    rows = [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]
    return numpy.stack([numpy.stack(row, axis=-1) for row in rows], axis=-2)


def conjugate(q):
    return q * numpy.array([1.0, -1.0, -1.0, -1.0])


def product(p, q):
    scalar = p[..., 0] * q[..., 0] - dot(p[..., 1:], q[..., 1:])
    vector = p[..., :1] * q[..., 1:] + q[..., :1] * p[..., 1:] + cross(p[..., 1:], q[..., 1:])
    return numpy.concatenate([scalar[..., None], vector], axis=-1)


def rotation_vector(q):
    """Along the shorter arc."""
    q = numpy.where(q[..., :1] < 0, -q, q)
    sine = numpy.sqrt(dot(q[..., 1:], q[..., 1:]))
    angle = 2 * numpy.arctan2(sine, q[..., 0])
    return q[..., 1:] * numpy.where(sine > 0, angle / numpy.where(sine > 0, sine, 1.0), 2.0)[..., None]


def turn_by(rotation_vector):
    """Quaternions."""
    angle = numpy.sqrt(dot(rotation_vector, rotation_vector))[:, None]
    share = numpy.where(angle > 0, numpy.sin(0.5 * angle) / numpy.where(angle > 0, angle, 1.0), 0.5)
    return numpy.hstack([numpy.cos(0.5 * angle), share * rotation_vector])


def unit(vector, otherwise):
    """Of unit length; `otherwise` where it has no direction."""
    size = numpy.sqrt(dot(vector, vector))[:, None]
    return numpy.where(size > 1e-12, vector / numpy.where(size > 0, size, 1.0), otherwise)


def sum_along(axes, amounts):
    return (amounts[:, 0, None] * axes[:, 0] + amounts[:, 1, None] * axes[:, 1]) + amounts[:, 2, None] * axes[:, 2]


def turned_by(vector, rotation_vector):
    """Rodrigues."""
    angle = numpy.sqrt(dot(rotation_vector, rotation_vector))[:, None]
    axis = rotation_vector / angle
    return (numpy.cos(angle) * vector + numpy.sin(angle) * cross(axis, vector)
            + (1 - numpy.cos(angle)) * dot(axis, vector)[:, None] * axis)


def tangent_of(normal):
    """A unit vector across each: away from the smallest component."""
    axis = numpy.eye(3)[numpy.abs(normal).argmin(axis=1)] if len(normal) else normal
    across = cross(normal, axis)
    return across / numpy.sqrt(dot(across, across))[:, None]
