#!/usr/bin/python3
"""What the force is known to do: by itself, before `gravitas check`, and in the motion that my_name.gravitas comes to."""

import unittest

from known_result import Conforms, expect_near, motions, numpy  # noqa: F401

from plugin import wind_force

WIND = numpy.array([3.0, 0.0, -1.0])


class KnownResults(unittest.TestCase):
    def test_force(self):
        velocity = numpy.array([[1.0, 2.0, -1.0], [3.0, 0.0, -1.0]])
        expect_near(wind_force(2.0, WIND, velocity), [[4.0, -4.0, 0.0], [0.0, 0.0, 0.0]], 0)

    # 2 kg at rest, c = 1 N s/m, h = 0.01 s: symplectic Euler takes c h/m of what the velocity lacks in every step, and moves
    # with the new velocity
    def test_motion(self):
        samples = motions("my_name.gravitas")["Leaf"]
        self.assertEqual(len(samples), 101)
        v, x = numpy.zeros(3), numpy.zeros(3)
        for _, position, velocity, *_ in samples[1:]:
            v = v + 0.01 * 1.0 / 2.0 * (WIND - v)
            x = x + 0.01 * v
            # rounding of a hundred steps
            expect_near(velocity, v, 1e-13)
            expect_near(position, x, 1e-13)


if __name__ == "__main__":
    unittest.main()
