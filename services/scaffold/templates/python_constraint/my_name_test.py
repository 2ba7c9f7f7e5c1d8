#!/usr/bin/python3
"""What the joint is known to do: by itself, before `gravitas check`, and in the motion that my_name.gravitas comes to."""

import unittest

from known_result import Conforms, expect_near, motions, numpy  # noqa: F401

from plugin import frame_along, projection, rotated


class KnownResults(unittest.TestCase):
    def test_projection(self):
        origin, normal = numpy.array([1.0, 2, 3]), numpy.array([0.0, 1, 0])
        for way in (0.0, 5.0):
            point = numpy.array([1 + way, 2.25, 3 - way])
            expect_near(point - projection(origin, normal, point), [0, 0.25, 0], 1e-15)

    def test_frames(self):
        for normal in ([0.6, 0.8, 0], [1, 0, 0], [-1, 0, 0], [-0.9999999, 0.0004472136, 0], [-1, 1e-8, 0],
                       [-1, 0, 1e-170]):
            normal = numpy.array(normal, float) / numpy.linalg.norm(normal)
            q = frame_along(normal)
            expect_near(q @ q, 1.0, 1e-15)
            expect_near(rotated(q, numpy.array([1.0, 0, 0])), normal, 1e-15)

    # a bead on a slope with the normal (3, 4, 0)/5, g = 10 m/s^2, h = 0.01 s: what is left of g along the slope is
    # (4.8, -3.6, 0) m/s^2, and symplectic Euler moves with the new velocity
    def test_motion(self):
        samples = motions("my_name.gravitas")["Bead"]
        self.assertEqual(len(samples), 101)
        along = numpy.array([4.8, -3.6, 0])
        for n, (_, position, velocity, *_) in enumerate(samples):
            # rounding of a hundred steps
            expect_near(velocity, 0.01 * n * along, 1e-12)
            expect_near(position, 0.5e-4 * n * (n + 1) * along, 1e-12)


if __name__ == "__main__":
    unittest.main()
