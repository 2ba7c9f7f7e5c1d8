"""Turns the benchmark program's JSON into a table and a drawing.

    tabulate.py build/bench.json FOLDER      writes FOLDER/RESULTS.md and FOLDER/cost_per_step.svg
"""
import json
import sys
from pathlib import Path

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt

TO_MICROSECONDS = {"ns": 1e-3, "us": 1.0, "ms": 1e3, "s": 1e6}

# What is promised: benchmark, what it is, counter or None for its time, bound, unit.
BOUNDS = [
    ("empty_call/direct/real_time", "stage call, direct", None, 0.1, "us"),
    ("empty_call/shm/real_time", "stage call, shm, hot", None, 1.1, "us"),
    ("sleeping_call/shm/iterations:300/manual_time", "stage call, shm, sleeping worker", None, 100, "us"),
    ("empty_call/grpc/real_time", "stage call, gRPC, one body", None, None, "us"),
    ("integrate_call/direct/1000/real_time", "Integrate, 1000 bodies, direct", None, None, "us"),
    ("integrate_call/shm/1000/real_time", "Integrate, 1000 bodies, shm", None, None, "us"),
    ("integrate_call/grpc/1000/real_time", "Integrate, 1000 bodies, gRPC", None, 400, "us"),
    ("integrate_call/grpc/10000/real_time", "Integrate, 10,000 bodies, gRPC", None, 3000, "us"),
    ("free_body/direct/real_time", "step of one free body, direct", None, 0.3, "us"),
    ("free_body/shm/real_time", "step of one free body, shm", None, None, "us"),
    ("free_body/grpc/real_time", "step of one free body, gRPC", None, None, "us"),
    ("four_derivatives/direct/1/real_time", "step with four derivatives, one body, direct", None, None, "us"),
    ("four_derivatives/shm/1/real_time", "step with four derivatives, one body, shm", None, None, "us"),
    ("four_derivatives/grpc/1/real_time", "step with four derivatives, one body, gRPC", None, None, "us"),
    ("four_derivatives/shm/1000/real_time", "step with four derivatives, 1000 bodies, shm", None, None, "us"),
    ("resting/awake/10000/real_time", "step of 10,000 boxes at rest on the ground, direct, awake", None, None, "us"),
    ("resting/asleep/10000/real_time", "the same, asleep", None, 10, "us"),
    ("resting/visited/10000/real_time", "the same, asleep but for a ball that flies past", None, None, "us"),
    ("start_to_first_step/iterations:20/real_time", "exec to the end of a run of one step, five workers", None, 150e3,
     "us"),
    ("pile_in_workers/cheap/iterations:100/real_time", "validation in a step of pile1000, shm", "validation_percent", 3,
     "%"),
    ("pile_in_workers/physics/iterations:100/real_time", "the same with the physics checked in every step",
     "validation_percent", None, "%"),
    ("checkpoints/iterations:200/real_time", "a checkpoint every 100 steps of pile1000 and its journal, direct", "percent",
     2, "%"),
    *((f"recovery/{fault}/iterations:1/repeats:1", f"{what}, {name}", counter, bound, "us")
      for fault, what, noticed in (("kill", "killed in a call, shm", 1500), ("segv", "the same, SIGSEGV", 500),
                                   ("abort", "the same, abort", 500), ("kill_grpc", "killed in a call, gRPC", 1500))
      for name, counter, bound in (("noticed: median", "noticed_median_us", noticed),
                                   ("noticed to answered by a warm standby: median", "recovery_median_us", 2e3),
                                   ("delay of the step: median", "delay_median_us", 2e3),
                                   ("delay of the step: p99", "delay_p99_us", 10e3))),
    *((f"recovery/{fault}/iterations:1/repeats:1", f"{what}, noticed to answered by a warm standby: {name}", counter, bound, "us")
      for fault, what in (("hang", "hanging, shm"), ("nan", "answering NaN, shm"))
      for name, counter, bound in (("median", "recovery_median_us", 2e3), ("p99", "recovery_p99_us", 10e3))),
    ("recovery/kill_cold/iterations:1/repeats:1", "killed in a call, shm, no standby, delay of the step: median",
     "delay_median_us", 25e3, "us"),
    ("recovery/kill_cold/iterations:1/repeats:1", "the same: p99", "delay_p99_us", None, "us"),
    *((f"swap_pause/{carrier}/iterations:1/repeats:1", f"pause of a swap, {carrier}: {name}", counter, bound, "us")
      for carrier in ("direct", "shm", "grpc")
      for name, counter, bound in (("median", "pause_median_us", 200), ("p99", "pause_p99_us", None))),
    ("memory/iterations:1/real_time", "memory of a body, all slots direct", "bytes_per_body", None, "B"),
    ("memory/iterations:1/real_time", "resident memory of a worker", "megabytes_per_worker", None, "MB"),
]


def medians(path):
    """Benchmark name -> its median run, or its only one."""
    report = json.loads(Path(path).read_text())
    runs = {}
    for run in report["benchmarks"]:
        if run.get("aggregate_name") == "median" or run.get("repetitions") == 1:
            runs[run["run_name"]] = run
    return report["context"], runs


def microseconds(run):
    return run["real_time"] * TO_MICROSECONDS[run["time_unit"]]


def shown(value):
    return f"{value:.3g}" if value < 1000 else f"{value:.0f}"


def table(context, runs):
    lines = [
        "# Benchmark results",
        "",
        f"Made by `deploy/bench` on {context['date'][:10]}: {context['num_cpus']} cores at "
        f"{context['mhz_per_cpu']} MHz, load {context['load_avg'][0]:.1f} at the start. Medians of five.",
        "",
        "| what | measured | promised |",
        "| --- | --- | --- |",
    ]
    for name, what, counter, bound, unit in BOUNDS:
        run = runs.get(name)
        if run is None:
            sys.exit(f"tabulate.py: no benchmark {name} in the report")
        value = run[counter] if counter else microseconds(run)
        promise = "" if bound is None else f"≤ {shown(bound)} {unit}" + ("" if value <= bound else " **missed**")
        lines.append(f"| {what} | {shown(value)} {unit} | {promise} |")
    lines += ["", "Cost per step against the number of bodies (free fall, space and collision at work), microseconds:", "",
              "| bodies | direct | shm | grpc |", "| --- | --- | --- | --- |"]
    curves = falling(runs)
    for bodies in sorted(curves["direct"]):
        lines.append(f"| {bodies} | " + " | ".join(shown(curves[c][bodies]) for c in curves) + " |")
    lines += ["", "![cost per step](cost_per_step.svg)", "",
              "What leaving out saves: a hundred bodies in free flight, microseconds a step (direct), processes and their memory",
              "(shm); below a use of one feature is added, that of joints far away, and at the top there is no engine at all:",
              "the same motion in a loop. Rays have nothing to be left out: who asks for one, beside a run, starts workers for it.", "",
              "| what runs | step | processes | memory |", "| --- | --- | --- | --- |"]
    for name, what in (("without_engine", "a loop, no engine"), ("plan/nothing", "what bodies in free flight need"),
                       ("plan/sleep", "the same, and they may fall asleep"), ("plan/joints", "the same, and a joint"),
                       ("plan/contacts", "the same, and all can collide: balls"),
                       ("plan/boxes", "the same, boxes, whose bounds turn with them")):
        run = runs[name + "/real_time"]
        lines.append(f"| {what} | {shown(microseconds(run))} us | {run.get('processes', 0):.0f} "
                     f"| {shown(run.get('megabytes', 0))} MB |")
    lines.append("")
    return "\n".join(lines)


def falling(runs):
    curves = {"direct": {}, "shm": {}, "grpc": {}}
    for name, run in runs.items():
        parts = name.split("/")
        if parts[0] == "falling":
            curves[parts[1]][int(parts[2])] = microseconds(run)
    return curves


def draw(runs, path):
    figure, axes = plt.subplots(figsize=(6.4, 4.2))
    for carrier, points in falling(runs).items():
        bodies = sorted(points)
        axes.loglog(bodies, [points[n] for n in bodies], marker="o", label=carrier)
    axes.set_xlabel("bodies")
    axes.set_ylabel("step [µs]")
    axes.set_title("Cost per step: n balls in free fall")
    axes.grid(True, which="major", alpha=0.3)
    axes.legend()
    figure.tight_layout()
    figure.savefig(path, metadata={"Date": None})


def main():
    context, runs = medians(sys.argv[1])
    folder = Path(sys.argv[2])
    (folder / "RESULTS.md").write_text(table(context, runs))
    draw(runs, folder / "cost_per_step.svg")


if __name__ == "__main__":
    main()
