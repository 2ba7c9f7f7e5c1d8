#!/usr/bin/python3
"""What the integrator is known to do: by itself, before `gravitas check`, and in the motions of my_name.gravitas."""

import unittest

from known_result import Conforms, expect_near, motions, numpy  # noqa: F401

from plugin import rotated, turned_back, turned_by


class KnownResults(unittest.TestCase):
    # a quarter turn about z takes x to y
    def test_turning(self):
        q = turned_by(numpy.array([[1.0, 0, 0, 0]]), numpy.array([[0, 0, 0.5 * numpy.pi]]))
        expect_near(rotated(q, numpy.array([[1.0, 0, 0]])), [[0, 1, 0]], 1e-15)

    # 1 kg on a spring of 100 N/m, let go at 1 m, and a body thrown up at 5 m/s under 10 m/s^2; h = 0.01 s
    def test_motion(self):
        samples = motions("my_name.gravitas")
        motion = {"Oscillator": (0, 1.0, 0.0, lambda x: -100.0 * x), "Thrown": (1, 0.0, 5.0, lambda x: -10.0)}
        for body, (axis, x, v, acceleration) in motion.items():
            self.assertEqual(len(samples[body]), 201)
            for _, position, velocity, *_ in samples[body][1:]:
                v += 0.01 * acceleration(x)
                x += 0.01 * v
                # rounding of two hundred steps
                expect_near(position[axis], x, 1e-12)
                expect_near(velocity[axis], v, 1e-11)

    # a free top with the moments (1, 1, 2) kg m^2 that turns with (1, 0, 2) rad/s: its angular momentum L, (1, 0, 4) N m s,
    # stays, and its axis z goes about that with L/(1 kg m^2)
    def test_turning_motion(self):
        samples = motions("my_name.gravitas")["Spinning"]
        self.assertEqual(len(samples), 201)
        moments, momentum, z = numpy.array([[1.0, 1, 2]]), numpy.array([[1.0, 0, 4]]), numpy.array([[0.0, 0, 1]])
        for time, _, _, q, w in samples:
            q, w = q[None], w[None]
            # rounding of two hundred steps
            expect_near(rotated(q, moments * turned_back(q, w)), momentum, 1e-12)
            # attitudes are of order 1: 0.019 after two seconds
            precession = turned_by(numpy.array([[1.0, 0, 0, 0]]), time * momentum)
            expect_near(rotated(q, z), rotated(precession, z), 0.03)


if __name__ == "__main__":
    unittest.main()
