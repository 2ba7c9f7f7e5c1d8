"""Turns what the benchmark program says of spaces into tables and a drawing.

    tabulate_spaces.py build/bench.json FOLDER      writes FOLDER/SPACES.md and FOLDER/spaces.svg
"""
import json
import math
import sys
from pathlib import Path

from tabulate import microseconds, plt, shown

LAYOUTS = [f"{layout}/{motion}" for layout in ("sparse", "dense", "mixed") for motion in ("still", "few", "moving")]


def spaces(runs):
    """Layout -> space -> number of bodies -> microseconds; the median where there are several runs."""
    curves = {layout: {} for layout in LAYOUTS}
    for run in runs:
        parts = run["run_name"].split("/")
        if parts[0] == "space" and run.get("aggregate_name", "median") == "median":
            curves[f"{parts[2]}/{parts[3]}"].setdefault(parts[1], {})[int(parts[4])] = microseconds(run)
    return curves


def growth(points):
    """Exponent of n between the two largest numbers of bodies."""
    before, last = sorted(points)[-2:]
    return math.log(points[last] / points[before]) / math.log(last / before)


def tables(context, repetitions, curves):
    """A table for each layout, and where DynamicBVH is not the fastest of all."""
    lines = [
        "# What finding pairs costs",
        "",
        f"Made by `deploy/bench` on {context['date'][:10]}: {context['num_cpus']} cores at "
        f"{context['mhz_per_cpu']} MHz, load {context['load_avg'][0]:.1f} at the start. Microseconds of processor time a call, "
        f"the mean of calls in a row, {'measured once' if repetitions == 1 else f'the median of {repetitions}'}. "
        "`space_bench.cc` says what the bodies are. The last "
        "column is the exponent of n between the last two numbers of bodies.",
        "",
        "Bullet's two are beside ours where libbullet-dev is installed. What is not there was left out of the run: it "
        "takes too long (`Basic` with 100,000 bodies some 25 s a call). Bullet's sweep takes two minutes to put 100,000 bodies "
        "in: those calls are measured where `GRAVITAS_LONG_BENCHMARKS` is set.",
        "",
    ]
    for layout, by_space in curves.items():
        counts = sorted({n for points in by_space.values() for n in points})
        lines += [f"| {layout.replace('/', ', ')} | " + " | ".join(str(n) for n in counts) + " | growth |",
                  "| --- |" + " --- |" * (len(counts) + 1)]
        for space, points in by_space.items():
            cells = " | ".join(shown(points[n]) if n in points else "" for n in counts)
            lines.append(f"| {space} | {cells} | {growth(points):.2f} |")
        slower = [f"{space} with {n}" for n in counts for space, points in by_space.items()
                  if n in points and points[n] < by_space["DynamicBVH"][n]]
        lines += ["", "`DynamicBVH` is the fastest with every number of bodies." if not slower else
                  "Faster than `DynamicBVH`: " + ", ".join(slower) + " **missed**.", ""]
    return "\n".join(lines + ["![cost of finding pairs](spaces.svg)", ""])


def draw(curves, path):
    figure, all_axes = plt.subplots(3, 3, figsize=(14, 11), sharex=True, sharey=True)
    for axes, (layout, by_space) in zip(all_axes.flat, curves.items()):
        for space, points in by_space.items():
            bodies = sorted(points)
            axes.loglog(bodies, [points[n] for n in bodies], marker="o",
                        linestyle="--" if space.startswith("Bullet") else "-", label=space)
        axes.set_title(layout.replace("/", ", "))
        axes.grid(True, which="major", alpha=0.3)
    for axes in all_axes[-1]:
        axes.set_xlabel("bodies")
    for axes in all_axes[:, 0]:
        axes.set_ylabel("call [µs]")
    all_axes[0][0].legend()
    figure.tight_layout()
    figure.savefig(path, metadata={"Date": None})


def main():
    report = json.loads(Path(sys.argv[1]).read_text())
    curves = spaces(report["benchmarks"])
    repetitions = max(run["repetitions"] for run in report["benchmarks"] if run["run_name"].startswith("space/"))
    folder = Path(sys.argv[2])
    (folder / "SPACES.md").write_text(tables(report["context"], repetitions, curves))
    draw(curves, folder / "spaces.svg")


main()
