#!/usr/bin/python3
"""What the integrator is known to do: by itself, before `gravitas check`, and in the motions of my_name.gravitas."""

import unittest

from known_result import Conforms, expect_near, motions, numpy  # noqa: F401

from plugin import rotated, turned_by


class KnownResults(unittest.TestCase):
    # a quarter turn about z takes x to y
    def test_turning(self):
        q = turned_by(numpy.array([[1.0, 0, 0, 0]]), numpy.array([[0, 0, 0.5 * numpy.pi]]))
        expect_near(rotated(q, numpy.array([[1.0, 0, 0]])), [[0, 1, 0]], 1e-15)

    # 1 kg on a spring of 100 N/m, let go at 1 m, and a body thrown up at 5 m/s under 10 m/s^2; h = 0.01 s
    def test_motion(self):
        samples = motions("my_name.gravitas")
        self.assertEqual(len(samples["Oscillator"]), 201)
        motion = {"Oscillator": (0, 1.0, 0.0, lambda x: -100.0 * x), "Thrown": (1, 0.0, 5.0, lambda x: -10.0)}
        for body, (axis, x, v, acceleration) in motion.items():
            for _, position, velocity in samples[body][1:]:
                v += 0.01 * acceleration(x)
                x += 0.01 * v
                # rounding of two hundred steps
                expect_near(position[axis], x, 1e-12)
                expect_near(velocity[axis], v, 1e-11)


if __name__ == "__main__":
    unittest.main()
