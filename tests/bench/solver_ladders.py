"""Error against time of the solvers on problems whose answers are known, as table, CSV and drawing.

    solver_ladders.py GRAVITAS FOLDER       writes FOLDER/SOLVERS.md, FOLDER/solvers.csv and FOLDER/solvers.svg

Each solver climbs a ladder of settings (its time step by halves, Sequential also its number of sweeps). The error is a
share of the right answer, or a length as a share of the bodies' size; a run that ends badly or is off by more than its own
size has failed, and is drawn hollow at the edge. Time is the median step's, times the steps of a simulated second.
"""
import csv
import json
import math
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

from ladders import Rung, panels, write_csv

G = 9.81
GRAVITY = 'Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = %s } }'
LADDER = [1 / 30, 1 / 60, 1 / 120, 1 / 240, 1 / 480, 1 / 960, 1 / 1920, 1 / 3840]
SWEEPS = [2, 5, 20, 80, 320, 1280]
TABLE_STEPS = {"1/60": 1 / 60, "1/240": 1 / 240, "1/1000": 1 / 1000}
SOLVERS = ["Sequential", "Newton", "Direct"]
FAILED = 1.0
MOST_SECONDS = 20  # of processor time


def vector(*numbers):
    return "{" + ", ".join(repr(float(x)) for x in numbers) + "}"


def scene(shapes, materials, forces, bodies, joints, duration):
    return (
        f"Geometries {{ {shapes} }}\nMaterials {{ {materials} }}\nForces {{ {forces} }}\n"
        f"Simulator {{ CustomProperties {{ Duration = {duration!r} }} }}\n"
        f"Environment {{ Space {{ Bodies {{\n{bodies}}} }} Constraints {{\n{joints}}} }}\n"
    )


def shape(kind, name, properties):
    return f'Geometry {{ Type = "{kind}" Id = "{name}" CustomProperties {{ {properties} }} }}'


def material(name, mu):
    return f'Material {{ Id = "{name}" StaticFrictionCoefficient = {mu!r} }}'


def body(name, position, mass, geometry="", surface="", forces=("Down",), more=""):
    touching = f'GeometryId = "{geometry}" Material = "{surface}" ' if geometry else ""
    pushed = ", ".join(f'"{force}"' for force in forces)
    return (
        f'Body {{ Id = "{name}" {touching}Mass = {mass!r} {more} KineticProperties {{ Position = {vector(*position)} '
        f"CanSleep = false }} Forces = {{ {pushed} }} }}\n"
    )


def ground(surface):
    return f'Body {{ Id = "Ground" GeometryId = "Floor" Material = "{surface}" Immovable = true }}\n'


FLOOR = shape("Halfspace", "Floor", "")


# Each problem: its scene, and its error from the last state (name -> position, velocity) and the report.


def rolling():
    """PROBLEMS 18: a plate under 25 balls is pushed along 60 degrees; mean error of the velocities."""
    push = (math.cos(math.pi / 3), 0.0, math.sin(math.pi / 3))
    bodies = ground("Hard") + body("Plate", (0, 0.5, 0), 10.0, "Plate", "Hard", ("Down", "Push"))
    for i in range(25):
        bodies += body(f"S{i}", (-4 + 2 * (i % 5), 1.5, -4 + 2 * (i // 5)), 1.0, "Ball", "Rubber")
    shapes = shape("Box", "Plate", "HalfExtents = {10, 0.5, 10}") + shape("Sphere", "Ball", "Radius = 0.5") + FLOOR
    forces = GRAVITY % vector(0, -G, 0)
    forces += f' Force {{ Type = "Basic" Id = "Push" CustomProperties {{ Force = {vector(*(150 * x for x in push))} }} }}'
    a = (150.0 - 0.4 * 35.0 * G) / (10.0 + 2.0 / 7.0 * 25.0)

    def error(state, report, time):
        sum_of_squares = 0.0
        for name, (_, velocity) in state.items():
            speed = (1.0 if name == "Plate" else 2.0 / 7.0) * a * time
            sum_of_squares += sum((v - speed * p) ** 2 for v, p in zip(velocity, push))
        return math.sqrt(sum_of_squares / len(state)) / (a * time)

    return scene(shapes, material("Hard", 0.4) + material("Rubber", 1.6), forces, bodies, "", 0.5), error


def incline():
    """PROBLEMS 20: on 26.565 degrees a box at mu = 0.5 + 1e-6 stays and another at 0.49 slides."""
    slope = math.atan(0.5)
    gravity = GRAVITY % vector(G * math.sin(slope), -G * math.cos(slope), 0)
    bodies = ground("Even") + body("Sticks", (0, 0.1, 0), 1.0, "Box", "Sticks")
    bodies += body("Slides", (0, 0.1, 1), 1.0, "Box", "Slides")
    materials = material("Even", 0.5) + material("Sticks", (0.5 + 1e-6) ** 2 / 0.5) + material("Slides", 0.49**2 / 0.5)
    shapes = shape("Box", "Box", "HalfExtents = {0.1, 0.1, 0.1}") + FLOOR

    def error(state, report, time):
        right = G * (math.sin(slope) - 0.49 * math.cos(slope)) * time
        return max(abs(state["Slides"][1][0] / right - 1), math.dist(state["Sticks"][0], (0, 0.1, 0)) / 0.2)

    return scene(shapes, materials, gravity, bodies, "", 2.0), error


def creep():
    """PROBLEMS 22: a 45 g capsule of r = 4 mm between two pads with 20 times the force it takes; sliding a second, in radii."""
    force = 20.0 * 0.045 * G / (2.0 * 0.7)
    bodies = body("Left", (-0.014, 0, 0), 0.1, "Pad", "Rubber", ("Right",))
    bodies += body("Right", (0.014, 0, 0), 0.1, "Pad", "Rubber", ("Left",))
    bodies += body("Held", (0, 0, 0), 0.045, "Capsule", "Rubber")
    shapes = shape("Box", "Pad", "HalfExtents = {0.01, 0.02, 0.02}")
    shapes += shape("Capsule", "Capsule", "Radius = 0.004 Height = 0.02")
    forces = GRAVITY % vector(0, -G, 0)
    for name, push in (("Right", force), ("Left", -force)):
        forces += f' Force {{ Type = "Basic" Id = "{name}" CustomProperties {{ Force = {vector(push, 0, 0)} }} }}'
    joints = ""
    for guide, pad in (("G1", "Left"), ("G2", "Right")):
        joints += (
            f'Constraint {{ Type = "Slider" Id = "{guide}" Body2 = "{pad}" CustomProperties {{ BindPoint = {{0, 0, 0}} '
            "Axis = {1, 0, 0} } }\n"
        )

    def error(state, report, time):
        return math.dist(state["Held"][0], (0, 0, 0)) / time / 0.004

    return scene(shapes, material("Rubber", 0.7), forces, bodies, joints, 1.0), error


def stack():
    """PROBLEMS 28: ten cubes of 1 kg under 1000 kg; the largest way from where they stood, in edges."""
    bodies = ground("Wood")
    for i in range(11):
        bodies += body(f"C{i}", (0, 0.5 + i, 0), 1000.0 if i == 10 else 1.0, "Cube", "Wood")
    shapes = shape("Box", "Cube", "HalfExtents = {0.5, 0.5, 0.5}") + FLOOR

    def error(state, report, time):
        return max(math.dist(state[f"C{i}"][0], (0, 0.5 + i, 0)) for i in range(11))

    return scene(shapes, material("Wood", 0.5), GRAVITY % vector(0, -G, 0), bodies, "", 1.0), error


def chain():
    """PROBLEMS 28, PEERS chain20: twenty links of 1 kg and 1000 kg at their end, from 45 degrees; the joint gap, in links."""
    c = math.sqrt(0.5)
    half = -3 * math.pi / 8
    attitude = f"Orientation = {vector(math.cos(half), 0, 0, math.sin(half))}"
    at = lambda s: (s * c, -s * c, 0.0)
    moments = f"PrincipalMoments = {vector(0.26 / 12, 0.02 / 12, 0.26 / 12)}"
    bodies = ""
    for i in range(20):
        bodies += body(f"L{i}", at(0.25 + 0.5 * i), 1.0, more=moments).replace("CanSleep", f"{attitude} CanSleep")
    bodies += body("Load", at(10.5), 1000.0, more="PrincipalMoments = {100, 100, 100}")
    joints = ""
    for i in range(21):
        first = f'Body1 = "L{i - 1}" ' if i else ""
        second = "Load" if i == 20 else f"L{i}"
        joints += (
            f'Constraint {{ Type = "Spherical" Id = "J{i}" {first}Body2 = "{second}" CustomProperties {{ '
            f"BindPoint = {vector(*at(0.5 * i))} }} }}\n"
        )

    def error(state, report, time):
        return report["max_joint_error"] / 0.5

    return scene("", "", GRAVITY % vector(0, -G, 0), bodies, joints, 1.0), error


PROBLEMS = {"18 rolling": rolling, "20 incline": incline, "22 creep": creep, "28 stack": stack, "28 chain": chain}


def last_state(path):
    state, time = {}, 0.0
    with open(path, newline="") as file:
        for row in csv.DictReader(file):
            time = float(row["time"])
            state[row["body"]] = (
                tuple(float(row[k]) for k in ("px", "py", "pz")),
                tuple(float(row[k]) for k in ("vx", "vy", "vz")),
            )
    return state, time


def limit_time():
    resource.setrlimit(resource.RLIMIT_CPU, (MOST_SECONDS, MOST_SECONDS))


def run(gravitas, folder, text, step, overrides, sample_every=1000):
    """Runs a scene. Returns its report, or None, and why it failed; the trajectory is folder/trajectory.csv."""
    path = folder / "problem.gravitas"
    path.write_text(text)
    command = [gravitas, "run", path, "--hosting", "direct", "--quiet", "--dt", repr(step), "--sample-every", repr(sample_every)]
    command += ["--trajectory", folder / "trajectory.csv", "--report", folder / "report.json"]
    for override in overrides:
        command += ["--set", override]
    done = subprocess.run(command, capture_output=True, preexec_fn=limit_time, check=False, cwd=folder)
    if done.returncode != 0:
        return None, f"more than {MOST_SECONDS} s" if done.returncode < 0 else f"exit {done.returncode}"
    return json.loads((folder / "report.json").read_text()), ""


def measure(gravitas, folder, problem, solver, step, sweeps):
    """One run: error, microseconds of a simulated second, steps."""
    text, error = PROBLEMS[problem]()
    sweeps_of = [f"Solver.Iterations={sweeps}"] if sweeps else []
    report, why = run(gravitas, folder, text, step, [f"Solver={solver}"] + sweeps_of)
    if report is None:
        return {"error": math.inf, "us_per_second": math.inf, "steps": 0, "failed": why}
    state, time = last_state(folder / "trajectory.csv")
    off = error(state, report, time)
    return {
        "error": off,
        "us_per_second": report["microseconds_per_step"]["median"] / step,
        "steps": report["steps"],
        "failed": "" if off < FAILED else "off by more than its size",
    }


def ladder(solver):
    """Settings: time step and, where it is not the default, the number of sweeps."""
    settings = [(step, 0) for step in LADDER]
    if solver == "Newton":
        return settings + [(1 / 7680, 0), (1 / 15360, 0)]
    return settings + [(1 / 240, sweeps) for sweeps in SWEEPS]


def shown(run):
    return f"**failed** ({run['failed']})" if run["failed"] else f"{run['error']:.1e}"


def table(rows):
    lines = [
        "# What the solvers reach",
        "",
        "Made by `tests/bench/solver_ladders.py build/release/bin/gravitas tests/bench`, which `deploy/bench` runs, too:",
        "integrator SemiImplicitEuler, hosting direct, default settings. The error is a share of the right answer or of the",
        "bodies' size; the problems are described below and in `solver_ladders.py`. All runs, with their",
        f"times, stand in `solvers.csv`, error against time in `solvers.svg`. Load of the machine: {os.getloadavg()[1]:.1f}.",
        "",
        "| problem | solver | " + " | ".join(TABLE_STEPS) + " |",
        "| --- | --- |" + " --- |" * len(TABLE_STEPS),
    ]
    for problem in PROBLEMS:
        for solver in SOLVERS:
            cells = [shown(rows[problem, solver, step, 0]) for step in TABLE_STEPS.values()]
            lines.append(f"| {problem} | {solver} | " + " | ".join(cells) + " |")
    lines += ["", "The problems:", ""]
    lines += [f"- {name}: {make.__doc__.split(': ', 1)[1]}" for name, make in PROBLEMS.items()]
    return "\n".join(lines) + "\n"


def curves(rows, problem):
    """By solver: its steps, and its numbers of sweeps at one step."""
    drawn = {}
    for solver in SOLVERS:
        for step, sweeps in ladder(solver):
            run = rows[problem, solver, step, sweeps]
            seconds = run["us_per_second"] / 1e6 if math.isfinite(run["us_per_second"]) else 0.0
            label = f"{sweeps} sweeps" if sweeps else f"{step:.1e} s"
            rungs = drawn.setdefault(f"{solver}, sweeps at 1/240 s" if sweeps else solver, [])
            rungs.append(Rung(label, run["error"], seconds, run["failed"]))
    return drawn


def main():
    gravitas, folder = Path(sys.argv[1]).resolve(), Path(sys.argv[2])
    rows = {}
    with tempfile.TemporaryDirectory() as scratch:
        for problem in PROBLEMS:
            for solver in SOLVERS:
                for step, sweeps in ladder(solver) + [(step, 0) for step in TABLE_STEPS.values()]:
                    key = (problem, solver, step, sweeps)
                    if key not in rows:
                        rows[key] = measure(gravitas, Path(scratch), problem, solver, step, sweeps)
                        print(problem, solver, f"{step:.3g} s", sweeps or "", shown(rows[key]), file=sys.stderr)
    write_csv(folder / "solvers.csv",
              ["problem", "solver", "time_step", "iterations", "error", "us_per_simulated_second", "steps", "failed"],
              [[problem, solver, repr(step), sweeps or "default", run["error"], run["us_per_second"], run["steps"], run["failed"]]
               for (problem, solver, step, sweeps), run in rows.items()])
    (folder / "SOLVERS.md").write_text(table(rows))
    panels(PROBLEMS, lambda problem: curves(rows, problem), folder / "solvers.svg", figsize=(4 * len(PROBLEMS), 4), sharey=True)


if __name__ == "__main__":
    main()
