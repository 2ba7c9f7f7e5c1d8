#!/usr/bin/python3
"""Force `MyName`: a wind that takes bodies along,

    f = c (u - v)      c: coefficient, N s/m;  u: wind, v: velocity of the centre of mass, m/s, world

Alone it brings a body of mass m to the wind's velocity: u - v = (u - v_0) exp(-c t/m). Stiff where c h/m is not small.

A plugin is a class derived from that of its slot, and its worker process is main(). It declares itself once, receives a
request as numpy arrays, and assigns the arrays of the reply. The answer depends on the request and the settings alone:
the same request gives the same bytes, so keep nothing between calls but caches that can be made again.
"""

import numpy

from gravitas_worker import Force, Property, Refusal, Type, check_finite, forces_of, main


def wind_force(coefficient, wind, velocity):
    """Of all bodies at once: a row of `velocity` each."""
    return coefficient * (wind - velocity)


class MyNamePlugin(Force):
    # What a scene may write. Parsing, checking, defaults and `gravitas describe` come from here, so a property has its unit,
    # its bounds and a sentence. More kinds of properties: gravitas_worker/declaration.py.
    name = "MyName"
    version = "1.0"
    meaning = "A wind that takes bodies along."
    types = [
        Type("MyName", "Force at the centre of mass, linear in its velocity relative to a wind.", [
            Property.number("Coefficient", "N*s/m", at_least=0.0, required=True, meaning="Force per relative speed."),
            Property.vector("Wind", "m/s", "world", default=(0.0, 0.0, 0.0), meaning="Velocity of the wind."),
        ])
    ]

    # The question of the slot. An application is a force that acts on a body: one row of the request, one of the reply, in
    # the same order (schemas/gravitas/stage/v1/force.proto). For a request that is impossible raise Refusal with the reason.
    def wrenches(self, request, reply, host):
        check_finite("linear_velocity", request.linear_velocity)
        count = len(request.application)
        wrench = numpy.zeros((count, 6))  # force and torque about the centre of mass, world
        for _, values, rows, bodies in forces_of(self, request):
            wrench[rows, :3] = wind_force(values.Coefficient, values.Wind, request.linear_velocity[bodies])
        if not numpy.isfinite(wrench).all():
            raise Refusal("a force that is not finite: a coefficient, a wind or a velocity is too large")
        reply.wrench = wrench
        reply.impulse = numpy.zeros((count, 6))
        reply.potential = numpy.zeros(count)
        # no CONSTANT_WRENCH: it changes with the state; no HAS_POTENTIAL: it has none
        reply.flags = numpy.zeros(count, numpy.uint32)


if __name__ == "__main__":
    main(MyNamePlugin)
