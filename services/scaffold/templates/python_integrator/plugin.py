#!/usr/bin/python3
"""Integrator `MyName`: symplectic Euler, order 1. With h the time step, c the damping, and forces at the start of the step:

    v' = e^(-c h) (v + h f/m)              w* = e^(-c h) (w + h I^-1 tau)
    x' = x + h v'                          q' = exp(h w*) q
    L' = e^(-c h) (I w + h tau)            w' = I'^-1 L',    I' the inertia at q'

Angular momentum is exact, attitudes are of order 1. An oscillator stays bounded for h w < 2, and grows without bound beyond.
A body that cannot be turned about each of its axes keeps w*.

A plugin is a class derived from that of its slot, and its worker process is main(). It declares itself once, receives a
request as numpy arrays, and assigns the arrays of the reply. The answer depends on the request and the settings alone:
the same request gives the same bytes, so keep nothing between calls but caches that can be made again. sin, cos and exp are
those of this machine's libraries: another may round them otherwise.
"""

import numpy

from gravitas_worker import KINEMATIC, MOVABLE, Integrator, Refusal, check_finite, main


def rotated(q, v):
    """Vectors turned by quaternions (w, x, y, z), a row each."""
    twice = 2.0 * numpy.cross(q[:, 1:], v)
    return v + q[:, :1] * twice + numpy.cross(q[:, 1:], twice)


def turned_back(q, v):
    return rotated(q * numpy.array([1.0, -1.0, -1.0, -1.0]), v)


def dot(a, b):
    # written out: a sum whose order numpy does not choose
    return a[:, :1] * b[:, :1] + a[:, 1:2] * b[:, 1:2] + a[:, 2:3] * b[:, 2:3]


def turned_by(q, way):
    """exp(way) q, way a rotation vector in the world; what is not turned keeps its bits."""
    angle = numpy.sqrt(dot(way, way))
    share = numpy.where(angle > 0.0, numpy.sin(0.5 * angle) / numpy.where(angle > 0.0, angle, 1.0), 0.5)
    w, v = numpy.cos(0.5 * angle), share * way
    turned = numpy.hstack([w * q[:, :1] - dot(v, q[:, 1:]), w * q[:, 1:] + q[:, :1] * v + numpy.cross(v, q[:, 1:])])
    size = numpy.sqrt(turned[:, :1] * turned[:, :1] + dot(turned[:, 1:], turned[:, 1:]))
    return numpy.where(angle > 0.0, turned / size, q)


class MyNamePlugin(Integrator):
    # Settings would be `properties`, whose values __init__ gets.
    name = "MyName"
    version = "1.0"
    meaning = "Symplectic Euler: position with the new velocity."
    # share of an impulse's effect on the velocity that moves the pose within the step
    theta = 1.0

    # The question of the slot: from S_n to the trial state S*, without joints and contacts, which the solver puts right
    # (schemas/gravitas/stage/v1/integrator.proto).
    def integrate(self, request, reply, host):
        x, q, v, w = request.position, request.orientation, request.linear_velocity, request.angular_velocity
        for name in ("position", "orientation", "linear_velocity", "angular_velocity", "wrench", "damping"):
            check_finite(name, getattr(request, name))
        h = request.time_step
        # unless they are the same in all states, wrenches are asked for
        wrench = request.wrench if request.wrench_is_constant else host.derivative(request.time, x, q, v, w)
        force, torque = wrench[:, :3], wrench[:, 3:]

        with numpy.errstate(all="ignore"):
            kept = numpy.where(request.damping > 0.0, numpy.exp(-request.damping * h), 1.0)[:, None]
            next_v = kept * (v + h * request.inverse_mass[:, None] * force)
            kick = rotated(q, request.inverse_inertia * turned_back(q, torque))
            next_w = kept * (w + h * kick)
            next_q = turned_by(q, h * next_w)
            momentum = kept * (rotated(q, request.inertia * turned_back(q, w)) + h * torque)
            turns = (request.inverse_inertia > 0.0).all(axis=1)[:, None]
            end_w = numpy.where(turns, rotated(next_q, request.inverse_inertia * turned_back(next_q, momentum)), next_w)

            # kinematic bodies go on with their velocities, immovable ones stay
            is_movable = (request.flags & MOVABLE != 0)[:, None]
            moves = is_movable | (request.flags & KINEMATIC != 0)[:, None]
            v, w, end_w = (numpy.where(is_movable, new, old) for new, old in ((next_v, v), (next_w, w), (end_w, w)))
            x = numpy.where(moves, x + h * v, x)
            q = numpy.where(moves, turned_by(q, h * w), q)
        for numbers in (x, q, v, end_w):
            if not numpy.isfinite(numbers).all():
                raise Refusal("a state that is not finite: wrenches, velocities or the time step are too large")
        reply.position, reply.orientation, reply.linear_velocity, reply.angular_velocity = x, q, v, end_w
        reply.error_estimate = 0.0
        reply.plugin_state = numpy.zeros(0)


if __name__ == "__main__":
    main(MyNamePlugin)
