#!/usr/bin/python3
"""The force `Drag`: resistance of a medium at rest, linear and quadratic in the speed.

    f = -(c1 + c2 |v|) v        at the centre of mass, v its velocity in the world

An ordinary plugin of the slot `force`, in a worker process of its own; schemas/WIRE.md explains it line by line.
"""

import numpy

from gravitas_worker import Force, Property, Refusal, Type, check_finite, forces_of, main


class Drag(Force):
    name = "PythonDrag"
    version = "1.0"
    meaning = "Resistance of a medium at rest, linear and quadratic in the speed."
    types = [
        Type("Drag", "Resistance against the velocity of the centre of mass.", [
            Property.number("LinearCoefficient", "N*s/m", at_least=0.0, required=True,
                            meaning="Force per speed."),
            Property.number("QuadraticCoefficient", "N*s^2/m^2", at_least=0.0, default=0.0,
                            meaning="Force per squared speed."),
        ])
    ]

    def wrenches(self, request, reply, host):
        check_finite("linear_velocity", request.linear_velocity)
        count = len(request.application)
        wrench = numpy.zeros((count, 6))
        for _, values, rows, bodies in forces_of(self, request):
            velocity = request.linear_velocity[bodies]
            # written out: a sum whose order numpy does not choose
            squares = velocity * velocity
            speed = numpy.sqrt(squares[:, 0] + squares[:, 1] + squares[:, 2])
            strength = values.LinearCoefficient + values.QuadraticCoefficient * speed
            wrench[rows, :3] = -strength[:, None] * velocity
        if not numpy.isfinite(wrench).all():
            raise Refusal("a force that is not finite: a coefficient or a velocity is too large")
        reply.wrench = wrench
        reply.impulse = numpy.zeros((count, 6))
        reply.potential = numpy.zeros(count)
        reply.flags = numpy.zeros(count, numpy.uint32)


if __name__ == "__main__":
    main(Drag)
