#!/usr/bin/python3
"""Collision `MyName`: balls and half-spaces, one contact a pair, in closed form.

    balls         n = (c_b - c_a)/|c_b - c_a|,  depth = r_a + r_b - |c_b - c_a|,  point = c_a + (r_a - depth/2) n
    half-space    depth = r - n.(c - o),        point = c - (r - depth/2) n,      o, n: its surface and outward normal

A contact names the point midway between the two surface points, the unit normal from a to b, and the depth, above 0 where
the two overlap and below 0 for a gap.

A plugin is a class derived from that of its slot, and its worker process is main(). It declares itself once, receives a
request as numpy arrays, and assigns the arrays of the reply. The answer depends on the request and the settings alone:
the same request gives the same bytes, so keep nothing between calls but caches that can be made again.
"""

import numpy

from gravitas_worker import NONE, Collision, Property, Refusal, Type, Values, check_finite, check_indices, main

UP = numpy.array([0.0, 1.0, 0.0])


def rotated(q, v):
    """Vectors turned by quaternions (w, x, y, z), a row each."""
    twice = 2.0 * numpy.cross(q[..., 1:], v)
    return v + q[..., :1] * twice + numpy.cross(q[..., 1:], twice)


def dot(a, b):
    # written out: a sum whose order numpy does not choose
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def touch_of_balls(centre_a, radius_a, centre_b, radius_b):
    """(point, normal, depth); where the centres meet, b is taken to be above a."""
    way = centre_b - centre_a
    distance = numpy.sqrt(dot(way, way))
    normal = way / distance if distance > 0.0 else UP
    depth = radius_a + radius_b - distance
    return centre_a + (radius_a - 0.5 * depth) * normal, normal, depth


def touch_of_halfspace(surface, normal, centre, radius):
    """The same of a half-space a and a ball b."""
    depth = radius - dot(normal, centre - surface)
    return centre - (radius - 0.5 * depth) * normal, normal, depth


class MyNamePlugin(Collision):
    # Shapes as the scene language has them; a scene with others is refused by their names. Times of impact, rays and outlines
    # are capabilities, and methods, of their own.
    name = "MyName"
    version = "1.0"
    meaning = "Balls and half-spaces, in closed form."
    types = [
        Type("Sphere", "All points within a distance of the origin.", [
            Property.number("Radius", "m", above=0.0, required=True, meaning="That distance."),
        ]),
        Type("Halfspace", "All points with y <= 0.", []),
    ]

    # The question of the slot: the contacts of the pairs, in their order, as far as their surfaces are no further apart than the
    # margin (schemas/gravitas/stage/v1/collision.proto). What is impossible is refused with the reason.
    def manifolds(self, request, reply, host):
        radii = self._radii(request)
        check_indices("pair", request.pair, len(request.position))
        check_indices("body_shape", request.body_shape, len(radii), none_allowed=True)
        for name in ("position", "orientation", "geometry_position", "geometry_orientation", "linear_velocity",
                     "angular_velocity"):
            check_finite(name, getattr(request, name))
        if (request.body_shape[request.pair] == NONE).any():
            raise Refusal("column pair: a body without a shape")
        # where shapes lie in the world, and where half-spaces point to
        centre = request.position + rotated(request.orientation, request.geometry_position)
        up = rotated(request.orientation, rotated(request.geometry_orientation, numpy.broadcast_to(UP, centre.shape)))

        found = []
        for row, (a, b) in enumerate(request.pair.tolist()):
            host.mark_progress()
            radius_a, radius_b = radii[request.body_shape[a]], radii[request.body_shape[b]]
            if radius_a is None and radius_b is None:
                continue
            if radius_a is None:
                point, normal, depth = touch_of_halfspace(centre[a], up[a], centre[b], radius_b)
            elif radius_b is None:
                point, normal, depth = touch_of_halfspace(centre[b], up[b], centre[a], radius_a)
                normal = -normal
            else:
                point, normal, depth = touch_of_balls(centre[a], radius_a, centre[b], radius_b)
            if depth >= -request.margin:
                velocity_a, velocity_b = (request.linear_velocity[body]
                                          + numpy.cross(request.angular_velocity[body], point - request.position[body])
                                          for body in (a, b))
                found.append((row, normal, point, depth, velocity_b - velocity_a))
        self._write(found, reply)

    def _radii(self, request):
        """Of each shape; None for a half-space."""
        begin = request.shape_parameter_begin.astype(numpy.int64)
        check_indices("shape_parameter_begin", begin, len(request.shape_parameter) + 1)
        radii = []
        for shape, identity in enumerate(request.shape_type.tolist()):
            served = next((served for served in self.types if served.id == identity), None)
            if served is None:
                raise Refusal(f"column shape_type, row {shape}: no type of this plugin")
            if begin[shape] > begin[shape + 1]:
                raise Refusal(f"column shape_parameter_begin, row {shape + 1}: smaller than the row before")
            values = Values(served.properties, request.shape_parameter[begin[shape]:begin[shape + 1]])
            radii.append(getattr(values, "Radius", None))
        return radii

    def _write(self, found, reply):
        count = len(found)
        vectors = numpy.array([contact[1:3] + contact[4:] for contact in found]).reshape(count, 3, 3)
        depth = numpy.array([contact[3] for contact in found], float)
        if not (numpy.isfinite(vectors).all() and numpy.isfinite(depth).all()):
            raise Refusal("a contact that is not finite: sizes, positions or velocities are too large")
        reply.contact_pair = numpy.array([contact[0] for contact in found], numpy.uint32)
        reply.feature = numpy.zeros(count, numpy.uint32)
        reply.normal, reply.point, reply.relative_velocity = vectors[:, 0], vectors[:, 1], vectors[:, 2]
        reply.depth = depth


if __name__ == "__main__":
    main(MyNamePlugin)
