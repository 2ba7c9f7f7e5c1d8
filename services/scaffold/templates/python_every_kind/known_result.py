"""For tests against results that are known beforehand: `gravitas check`, and what a run's trajectory holds."""

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


def gravitas(*words):
    environment = dict(os.environ, PYTHONPATH=str(BUILD / "lib/python"))
    ended = subprocess.run([BUILD / "bin/gravitas", *words], cwd=FOLDER, env=environment, text=True,
                           stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    assert ended.returncode == 0, ended.stdout


def motions(scene):
    """Of each body by its id: (time, position, velocity, attitude, angular velocity) at the start and after every step."""
    samples = {}
    with tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "motion.csv")
        gravitas("run", scene, "--trajectory", file, "--quiet")
        with open(file) as rows:
            for row in csv.DictReader(rows):
                x, v, q, w = (numpy.array([float(row[name + axis]) for axis in axes])
                              for name, axes in (("p", "xyz"), ("v", "xyz"), ("q", "wxyz"), ("w", "xyz")))
                samples.setdefault(row["body"], []).append((float(row["time"]), x, v, q, w))
    return samples


def expect_near(came, right, tolerance):
    numpy.testing.assert_allclose(came, right, rtol=0, atol=tolerance)


class Conforms(unittest.TestCase):
    def test_conforms(self):
        gravitas("check", "/usr/bin/python3 -B plugin.py", "--quick")
