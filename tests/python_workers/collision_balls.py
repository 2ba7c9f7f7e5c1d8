#!/usr/bin/python3
"""The collision of balls: one contact a pair, in closed form.

    n along c_b - c_a,   depth = r_a + r_b - |c_b - c_a|,   the point midway between the two surfaces

An ordinary plugin of the slot `collision`, in a worker process of its own.
"""

import numpy

from gravitas_worker import NONE, Collision, Property, Refusal, Type, check_finite, check_indices, main
from gravitas_worker.declaration import Values
from rotations import rotation

_UP = numpy.array([0.0, 1.0, 0.0])


def _cross(a, b):
    return numpy.stack([a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1], a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2],
                        a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]], axis=1)


def _turned(orientation, vector):
    matrix = rotation(orientation)
    return matrix[:, :, 0] * vector[:, :1] + matrix[:, :, 1] * vector[:, 1:2] + matrix[:, :, 2] * vector[:, 2:]


class Balls(Collision):
    name = "PythonBalls"
    version = "1.0"
    meaning = "Balls, one contact a pair."
    types = [
        Type("Sphere", "All points within a distance of the origin.", [
            Property.number("Radius", "m", above=0.0, required=True, meaning="That distance."),
        ])
    ]

    def _radii(self, request):
        begin = request.shape_parameter_begin.astype(numpy.int64)
        check_indices("shape_parameter_begin", request.shape_parameter_begin, len(request.shape_parameter) + 1)
        radii = numpy.zeros(len(request.shape_type))
        for shape, identity in enumerate(request.shape_type):
            if int(identity) != self.types[0].id:
                raise Refusal(f"column shape_type, row {shape}: no type of this plugin")
            if begin[shape] > begin[shape + 1]:
                raise Refusal(f"column shape_parameter_begin, row {shape + 1}: smaller than the row before")
            radii[shape] = Values(self.types[0].properties, request.shape_parameter[begin[shape]:begin[shape + 1]]).Radius
        return radii

    def manifolds(self, request, reply, host):
        radii = self._radii(request)
        bodies = len(request.position)
        check_indices("pair", request.pair, bodies)
        check_indices("body_shape", request.body_shape, len(radii), none_allowed=True)
        for name in ("position", "orientation", "geometry_position", "linear_velocity", "angular_velocity"):
            check_finite(name, getattr(request, name))
        if (request.body_shape[request.pair] == NONE).any():
            raise Refusal("column pair: a body without a shape")
        a, b = request.pair[:, 0], request.pair[:, 1]
        centre = request.position + _turned(request.orientation, request.geometry_position)
        radius_a, radius_b = radii[request.body_shape[a]], radii[request.body_shape[b]]
        way = centre[b] - centre[a]
        distance = numpy.sqrt(way[:, 0] * way[:, 0] + way[:, 1] * way[:, 1] + way[:, 2] * way[:, 2])
        depth = radius_a + radius_b - distance
        touches = numpy.nonzero(depth >= -request.margin)[0]
        a, b, way, distance, depth = a[touches], b[touches], way[touches], distance[touches], depth[touches]
        # where centres meet, b is taken to be above a
        normal = numpy.where(distance[:, None] > 0, way / numpy.where(distance > 0, distance, 1.0)[:, None], _UP)
        point = centre[a] + (radius_a[touches] - 0.5 * depth)[:, None] * normal

        def velocity(body):
            return request.linear_velocity[body] + _cross(request.angular_velocity[body], point - request.position[body])

        reply.contact_pair = touches.astype(numpy.uint32)
        reply.feature = numpy.zeros(len(touches), numpy.uint32)
        reply.normal, reply.point, reply.depth = normal, point, depth
        reply.relative_velocity = velocity(b) - velocity(a)


if __name__ == "__main__":
    main(Balls)
