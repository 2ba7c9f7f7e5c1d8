"""Error against time of the simulators on problems of impacts and stops, as table, CSV and drawing.

    impact_ladders.py GRAVITAS FOLDER       writes FOLDER/IMPACTS.md, FOLDER/impacts.csv and FOLDER/impacts.svg

Each method climbs a ladder of ten time steps, by halves. Errors are shares of the right answer or of the bodies' size; a
run that ends badly or is off by more than its own size has failed. Time is the mean step's, times the steps of a
simulated second.
"""
import csv
import math
import os
import random
import sys
import tempfile
from pathlib import Path

import numpy
from ladders import Rung, order_of, panels, write_csv
from solver_ladders import FLOOR, G, GRAVITY, MOST_SECONDS, body, ground, run, scene, shape, vector

LADDER = [1 / 8 / 2**k for k in range(10)]
METHODS = {
    "Basic, SemiImplicitEuler, Sequential": ["Simulator=Basic", "Integrator=SemiImplicitEuler", "Solver=Sequential"],
    "Basic, Verlet, Newton": ["Simulator=Basic", "Integrator=Verlet", "Solver=Newton"],
    "Substepping 10, Verlet, Newton": ["Simulator=Substepping", "Simulator.Substeps=10", "Integrator=Verlet", "Solver=Newton"],
    "Bisection, Verlet, Newton": ["Simulator=Bisection", "Integrator=Verlet", "Solver=Newton"],
    "Continuous, Verlet, Newton": ["Simulator=Continuous", "Integrator=Verlet", "Solver=Newton"],
    "Continuous to 1e-9, Verlet, Newton": ["Simulator=Continuous", "Simulator.Accuracy=1e-9", "Integrator=Verlet", "Solver=Newton"],
}
SAMPLE = 0.125  # s, of trajectories
FAILED = 1.0
WANTED = (1e-3, 1e-6, 1e-9)


def material(name, restitution, mu):
    return (
        f'Material {{ Id = "{name}" RestitutionCoefficient = {restitution!r} StaticFrictionCoefficient = {mu!r} }}'
    )


# Each problem: its scene, and its error from the trajectory (time -> name -> position) and the report.


def bounce():
    """PROBLEMS 12: 49 balls fall 4.9 m and bounce; the share of their energy that is ever missing, or of 4.9 m by which one is off after 2.5 s."""
    bodies = ground("Steel")
    for i in range(49):
        bodies += body(f"B{i}", (i % 7, 5, i // 7), 10.0, "Ball", "Steel")
    shapes = shape("Sphere", "Ball", "Radius = 0.1") + FLOOR

    def error(trajectory, report):
        since_apex = 2.5 - 2.0 * math.sqrt(2.0 * 4.9 / G)
        right = 5.0 - 0.5 * G * since_apex**2
        end = trajectory[max(trajectory)]
        off = max(abs(end[f"B{i}"][1] - right) for i in range(49)) / 4.9
        return max(off, report["energy"]["max_relative_drift"])

    return scene(shapes, material("Steel", 1.0, 0.0), GRAVITY % vector(0, -G, 0), bodies, "", 2.5), error


def heap():
    """PROBLEMS 17: 216 balls settle in columns that are not quite straight; root of the mean sum of overlap^2, in radii, 1 s."""
    numbers = random.Random(6)
    at = lambda i: tuple(
        base + 0.21 * k + 1e-3 * numbers.random() for base, k in ((0, i % 6), (0.101, i // 36), (0, i // 6 % 6))
    )
    bodies = ground("Soap")
    for i in range(216):
        bodies += body(f"B{i}", at(i), 10.0, "Ball", "Soap")
    shapes = shape("Sphere", "Ball", "Radius = 0.1") + FLOOR

    def error(trajectory, report):
        sums = []
        for state in trajectory.values():
            at = numpy.array(list(state.values()))
            apart = numpy.linalg.norm(at[:, None, :] - at[None, :, :], axis=2)
            between = numpy.triu(numpy.maximum(0.0, 0.2 - apart), 1)
            sums.append((between**2).sum() + (numpy.maximum(0.0, 0.1 - at[:, 1]) ** 2).sum())
        return math.sqrt(sum(sums) / len(sums)) / 0.1

    return scene(shapes, material("Soap", 0.0, 0.0), GRAVITY % vector(0, -G, 0), bodies, "", 1.0), error


def stop():
    """PROBLEMS 21: a box slides to a stop at 30 degrees to its axes, mu = 0.3; how far from where it must stop, as a share of the way."""
    way = (math.cos(math.pi / 6), 0.0, math.sin(math.pi / 6))
    sliding = f"LinearVelocity = {vector(*(5 * x for x in way))} CanSleep"
    bodies = ground("Wood") + body("Box", (0, 0.2, 0), 2.0, "Box", "Wood").replace("CanSleep", sliding)
    shapes = shape("Box", "Box", "HalfExtents = {0.3, 0.2, 0.25}") + FLOOR

    def error(trajectory, report):
        length = 25.0 / (2.0 * 0.3 * G)
        end = trajectory[max(trajectory)]["Box"]
        return math.dist(end, (length * way[0], 0.2, length * way[2])) / length

    return scene(shapes, material("Wood", 0.0, 0.3), GRAVITY % vector(0, -G, 0), bodies, "", 2.0), error


PROBLEMS = {"12 bounce": bounce, "17 heap of 216": heap, "21 stop": stop}


def trajectory_of(path):
    trajectory = {}
    with open(path, newline="") as file:
        for row in csv.DictReader(file):
            trajectory.setdefault(float(row["time"]), {})[row["body"]] = tuple(float(row[k]) for k in ("px", "py", "pz"))
    return trajectory


def measure(gravitas, folder, problem, method, step):
    text, error = PROBLEMS[problem]()
    report, why = run(gravitas, folder, text, step, METHODS[method], SAMPLE)
    if report is None:
        # at least
        return Rung(f"{step:.2g}", math.inf, float(MOST_SECONDS), why)
    off = error(trajectory_of(folder / "trajectory.csv"), report)
    work = report["microseconds_per_step"]["mean"] / step / 1e6
    return Rung(f"{step:.2g}", off, work, "" if off < FAILED else "off by more than its size")


def time_to(rungs, wanted):
    times = [rung.work for rung in rungs if not rung.failed and rung.error <= wanted]
    return f"{1e3 * min(times):.3g}" if times else "–"


def table(rows):
    lines = [
        "# What the simulators reach",
        "",
        "Made by `tests/bench/impact_ladders.py build/release/bin/gravitas tests/bench`, which `deploy/bench` runs, too:",
        "ten time steps from 1/8 s by halves, hosting direct, default settings. All runs stand in `impacts.csv`, error against",
        f"time in `impacts.svg`. Load of the machine: {os.getloadavg()[1]:.1f}.",
        "",
        "![error against time](impacts.svg)",
        "",
        "Time to an error, ms per simulated second; – : no rung of the ladder reaches it. Order: of the middle half of the ladder, where errors fall.",
    ]
    for problem, make in PROBLEMS.items():
        lines += ["", f"## {problem}", "", make.__doc__.split(": ", 1)[1].capitalize(), ""]
        lines += ["| method | 1e-3 | 1e-6 | 1e-9 | best error | order | failed |", "| --- | --- | --- | --- | --- | --- | --- |"]
        for method in METHODS:
            rungs = rows[problem, method]
            good = [rung.error for rung in rungs if not rung.failed]
            order = order_of(rungs)
            cells = [time_to(rungs, wanted) for wanted in WANTED]
            cells += [f"{min(good):.1e}" if good else "–", "–" if order is None or order < 0.5 else f"{order:.2f}"]
            cells.append("; ".join(f"{rung.label} s: {rung.failed}" for rung in rungs if rung.failed and rung.failed != "not tried"))
            lines.append(f"| {method} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def main():
    gravitas, folder = Path(sys.argv[1]).resolve(), Path(sys.argv[2])
    rows = {}
    with tempfile.TemporaryDirectory() as scratch:
        for problem in PROBLEMS:
            for method in METHODS:
                rungs = rows[problem, method] = []
                for step in LADDER:
                    # three that took too long are enough
                    is_hopeless = len(rungs) > 2 and all(rung.failed.startswith(("more than", "not tried")) for rung in rungs[-3:])
                    rung = Rung(f"{step:.2g}", math.inf, 0.0, "not tried") if is_hopeless else measure(gravitas, Path(scratch), problem, method, step)
                    rungs.append(rung)
                    print(problem, method, rung.label, "s", rung.failed or f"{rung.error:.1e}", file=sys.stderr)
    write_csv(folder / "impacts.csv", ["problem", "method", "time_step", "error", "s_per_simulated_s", "failed"],
              [[problem, method, repr(step), rung.error, rung.work, rung.failed]
               for (problem, method), rungs in rows.items() for step, rung in zip(LADDER, rungs)])
    (folder / "IMPACTS.md").write_text(table(rows))
    panels(PROBLEMS, lambda problem: {method: rows[problem, method] for method in METHODS}, folder / "impacts.svg",
           slopes=(1, 2), figsize=(5 * len(PROBLEMS), 4.5))


if __name__ == "__main__":
    main()
