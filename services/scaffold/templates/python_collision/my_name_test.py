#!/usr/bin/python3
"""What the collision is known to find: by itself, before `gravitas check`, and in what comes of it in my_name.gravitas."""

import unittest

from known_result import Conforms, expect_near, motions, numpy  # noqa: F401

from plugin import touch_of_balls, touch_of_halfspace


class KnownResults(unittest.TestCase):
    def test_contacts(self):
        point, normal, depth = touch_of_balls(numpy.array([1.0, 0, 0]), 2.0, numpy.array([3.5, 0, 0]), 1.0)
        expect_near(numpy.hstack([point, normal, depth]), [2.75, 0, 0, 1, 0, 0, 0.5], 1e-15)
        point, normal, depth = touch_of_balls(numpy.zeros(3), 1.0, numpy.zeros(3), 1.0)
        expect_near(numpy.hstack([normal, depth]), [0, 1, 0, 2], 0)
        point, normal, depth = touch_of_halfspace(numpy.array([7.0, 0, -2]), numpy.array([0.0, 1, 0]),
                                                  numpy.array([3, 1.25, 4]), 1.0)
        expect_near(numpy.hstack([point, depth]), [3, 0.125, 4, -0.25], 1e-15)

    # of two equal balls that meet head-on without loss each goes on with the other's velocity, and one that is dropped without
    # bounce comes to rest on its radius
    def test_motion(self):
        samples = motions("my_name.gravitas")
        self.assertEqual(len(samples["Dropped"]), 101)
        # where iterations end
        expect_near(samples["Striking"][-1][2], [-1, 0, 0], 1e-9)
        expect_near(samples["Struck"][-1][2], [2, 0, 0], 1e-9)
        expect_near(samples["Dropped"][-1][1], [0, 0.5, 9], 1e-8)
        expect_near(samples["Dropped"][-1][2], [0, 0, 0], 1e-8)


if __name__ == "__main__":
    unittest.main()
