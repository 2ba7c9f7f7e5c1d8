#!/usr/bin/python3
"""What the space is known to find: by itself, before `gravitas check`, and in what comes of its pairs in my_name.gravitas."""

import unittest

from known_result import Conforms, expect_near, motions, numpy  # noqa: F401

from plugin import partners


class KnownResults(unittest.TestCase):
    def test_partners(self):
        # closed bounds: 0 and 1 meet in a corner, 2 is away, 3 has none, 4 is no number
        lower = numpy.array([[0, 0, 0], [1, 1, 1], [5, 0, 0], [-numpy.inf] * 3, [numpy.nan] * 3], float)
        upper = numpy.array([[1, 1, 1], [2, 2, 2], [6, 1, 1], [numpy.inf] * 3, [numpy.nan] * 3], float)
        found = [list(partners(lower, upper, a)) for a in range(5)]
        self.assertEqual(found, [[1, 3], [3], [3], [], []])

    # of two equal balls that meet head-on without loss each goes on with the other's velocity; the others go on as before
    def test_motion(self):
        samples = motions("my_name.gravitas")
        known = {"Striking": (-1, 0, 0), "Struck": (2, 0, 0), "Passing": (2, 0, 0), "Far": (0, 3, 0)}
        for body, right in known.items():
            self.assertEqual(len(samples[body]), 101)
            # where iterations end
            expect_near(samples[body][-1][2], right, 1e-9)


if __name__ == "__main__":
    unittest.main()
