#!/usr/bin/python3
"""What the force is known to do: by itself, before `gravitas check`, and in the motion that my_name.gravitas comes to."""

import csv
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

BUILD = pathlib.Path(os.environ.get("GRAVITAS_BUILD", "@GRAVITAS_BUILD@"))
FOLDER = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(BUILD / "lib/python"))
sys.dont_write_bytecode = True

import numpy  # noqa: E402

from plugin import wind_force  # noqa: E402

WIND = numpy.array([3.0, 0.0, -1.0])


def gravitas(*words):
    environment = dict(os.environ, PYTHONPATH=str(BUILD / "lib/python"))
    ended = subprocess.run([BUILD / "bin/gravitas", *words], cwd=FOLDER, env=environment, text=True,
                           stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    assert ended.returncode == 0, ended.stdout


class KnownResults(unittest.TestCase):
    def test_force(self):
        velocity = numpy.array([[1.0, 2.0, -1.0], [3.0, 0.0, -1.0]])
        numpy.testing.assert_array_equal(wind_force(2.0, WIND, velocity), [[4.0, -4.0, 0.0], [0.0, 0.0, 0.0]])

    def test_conforms(self):
        gravitas("check", "/usr/bin/python3 -B plugin.py", "--quick")

    # 2 kg at rest, c = 1 N s/m, h = 0.01 s: symplectic Euler takes c h/m of what the velocity lacks in every step, and moves
    # with the new velocity
    def test_motion(self):
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "motion.csv")
            gravitas("run", "my_name.gravitas", "--trajectory", file, "--quiet")
            with open(file) as rows:
                samples = list(csv.DictReader(rows))
        self.assertEqual(len(samples), 101)
        v, x = numpy.zeros(3), numpy.zeros(3)
        for sample in samples[1:]:
            v = v + 0.01 * 1.0 / 2.0 * (WIND - v)
            x = x + 0.01 * v
            # rounding of a hundred steps
            numpy.testing.assert_allclose([float(sample[k]) for k in ("vx", "vy", "vz")], v, rtol=0, atol=1e-13)
            numpy.testing.assert_allclose([float(sample[k]) for k in ("px", "py", "pz")], x, rtol=0, atol=1e-13)


if __name__ == "__main__":
    unittest.main()
