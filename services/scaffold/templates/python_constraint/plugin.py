#!/usr/bin/python3
"""Constraint `MyName`: a point of body 2 stays in a plane of body 1.

       n ^      x2           x2: the point, fixed in body 2;  o, n: the plane, fixed in body 1
         |      |  error = n.(x2 - o)
    o ---+------x1-----      x1: the point's projection on the plane

One locked row along n takes one freedom of twelve: n.(v2 + w2 x r2 - v1 - w1 x r1) = 0. The axes across it are free, and there
x1 is told where x2 is: a joint pushes at the point midway between the two, which would else get an arm of half the way that the
body has gone (plugin_sdk/discrepancy.h of Gravitas has the form, and the signs).

A plugin is a class derived from that of its slot, and its worker process is main(). It declares itself once, receives a
request as numpy arrays, and assigns the arrays of the reply. The answer depends on the request and the settings alone:
the same request gives the same bytes, so keep nothing between calls but caches that can be made again.
"""

import numpy

from gravitas_worker import NONE, Constraint, Property, Refusal, Type, Values, check_finite, check_indices, main

LOCKED, FREE = 1, 0
UNLIMITED = numpy.finfo(float).max
BOUND = 9  # numbers of a joint: o and n in body 1, the point in body 2


def rotated(q, v):
    """A vector turned by a quaternion (w, x, y, z)."""
    twice = 2.0 * numpy.cross(q[1:], v)
    return v + q[0] * twice + numpy.cross(q[1:], twice)


def turned_back(q, v):
    return rotated(q * numpy.array([1.0, -1.0, -1.0, -1.0]), v)


def length(v):
    # written out: a sum whose order numpy does not choose
    return numpy.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])


def frame_along(n):
    """A quaternion whose first axis is a unit vector: the shortest turn from x to it, which against x has no axis of its own."""
    across = n[1] * n[1] + n[2] * n[2]
    if n[0] < 0.0 and across < 1e-300:
        return numpy.array([0.0, 0.0, 1.0, 0.0])
    # the same number of a unit vector, but 1 + n[0] cancels near -x
    w = across / (1.0 - n[0]) if n[0] < 0.0 else 1.0 + n[0]
    return normalized(numpy.array([w, 0.0, -n[2], n[1]]))


def normalized(q):
    return q / numpy.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])


def projection(origin, normal, point):
    way = point - origin
    return point - (normal[0] * way[0] + normal[1] * way[1] + normal[2] * way[2]) * normal


class MyNamePlugin(Constraint):
    # What a scene may write in the CustomProperties of such a joint; Body1 and Body2 stand beside them. Parsing, checking and
    # `gravitas describe` come from here. More kinds of properties: gravitas_worker/declaration.py.
    name = "MyName"
    version = "1.0"
    meaning = "A point that stays in a plane."
    types = [
        Type("MyName", "A point of body 2 stays in a plane that body 1 carries.", [
            Property.vector("BindPoint", "m", "world", required=True, meaning="The point, at the start."),
            Property.vector("Normal", "1", "world", required=True,
                            meaning="Normal of the plane at the start, of any length."),
        ])
    ]

    # First question, when the scene starts: what it says in world coordinates becomes numbers that are fixed in the bodies.
    # These come back with every second question; nothing else is remembered. What cannot be is refused, by its name.
    def bind(self, request, reply, host):
        self._check(request)
        begin = request.parameter_begin.astype(numpy.int64)
        check_indices("parameter_begin", begin, len(request.parameter) + 1)
        bound = []
        for joint in range(len(request.constraint_type)):
            if begin[joint] > begin[joint + 1]:
                raise Refusal(f"column parameter_begin, row {joint + 1}: smaller than the row before")
            values = Values(self.types[0].properties, request.parameter[begin[joint]:begin[joint + 1]])
            size = length(values.Normal)
            if not (size > 0.0 and numpy.isfinite(size)):
                raise Refusal("MyName: Normal has no direction")
            (x1, q1), (x2, q2) = self._poses(request, joint)
            bound += [turned_back(q1, values.BindPoint - x1), turned_back(q1, values.Normal / size),
                      turned_back(q2, values.BindPoint - x2)]
        reply.bound = self._finite(numpy.concatenate([numpy.zeros(0), *bound]))
        reply.bound_begin = BOUND * numpy.arange(len(request.constraint_type) + 1, dtype=numpy.uint32)

    # Second question, in every step: the discrepancies of each joint that holds, in a state of the bodies
    # (schemas/gravitas/stage/v1/constraint.proto). Solvers derive the rows from them.
    def discrepancies(self, request, reply, host):
        self._check(request)
        if (request.bound_begin != BOUND * numpy.arange(len(request.constraint_type) + 1)).any() or (
                len(request.bound) != BOUND * len(request.constraint_type)):
            raise Refusal(f"column bound: not {BOUND} numbers a joint")
        check_finite("bound", request.bound)
        joints = numpy.flatnonzero(request.intact)
        count = len(joints)
        point1, point2, axes = numpy.zeros((count, 3)), numpy.zeros((count, 3)), numpy.zeros((count, 4))
        for row, joint in enumerate(joints):
            (x1, q1), (x2, q2) = self._poses(request, joint)
            origin, normal, point = request.bound[BOUND * joint:BOUND * (joint + 1)].reshape(3, 3)
            normal = rotated(q1, normal)
            point2[row] = x2 + rotated(q2, point)
            point1[row] = projection(x1 + rotated(q1, origin), normal, point2[row])
            axes[row] = frame_along(normal / length(normal))
        reply.constraint = joints.astype(numpy.uint32)
        reply.point1, reply.point2, reply.axes = self._finite(point1), self._finite(point2), self._finite(axes)
        # modes of the three axes, four bits each from the lowest
        reply.mode = numpy.full(count, LOCKED | FREE << 4 | FREE << 8, numpy.uint32)
        reply.correction = numpy.ones(count)
        reply.restitution = numpy.zeros(count)
        reply.maximum_force = numpy.full((count, 3), UNLIMITED)
        for name in ("velocity", "lower", "upper", "compliance", "damping", "desired_acceleration"):
            setattr(reply, name, numpy.zeros((count, 3)))

    def _check(self, request):
        check_indices("constraint_body", request.constraint_body, len(request.position), none_allowed=True)
        for joint in numpy.flatnonzero(request.constraint_type != self.types[0].id):
            raise Refusal(f"column constraint_type, row {joint}: no type of this plugin")
        check_finite("position", request.position)
        check_finite("orientation", request.orientation)

    def _poses(self, request, joint):
        """Of its two bodies; the world is a body at the origin."""
        for body in request.constraint_body[joint]:
            if body == NONE:
                yield numpy.zeros(3), numpy.array([1.0, 0.0, 0.0, 0.0])
            else:
                yield request.position[body], request.orientation[body]

    def _finite(self, numbers):
        if not numpy.isfinite(numbers).all():
            raise Refusal("a point that is not finite: positions are too large")
        return numbers


if __name__ == "__main__":
    main(MyNamePlugin)
