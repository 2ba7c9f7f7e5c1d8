"""Turns what the program `peers` says into tables: Gravitas beside the engines that Debian ships, and what is wanted.

    tabulate_peers.py build/peers.json FOLDER      writes FOLDER/PEERS.md
"""
import json
import statistics
import sys
from pathlib import Path

from tabulate import shown

OURS, YARDSTICK = "Gravitas", "Bullet"

SCENES = {
    "one_body": "one body at rest in the air, no gravity",
    "freefall1000": "1000 balls of r = 0.5 m, 5 m apart, fall freely from (1, 2, 3) m/s for 1 s",
    "freetop": "moments of inertia (1, 2, 3) kg m², turning at (0.01, 5, 0.01) rad/s, for 10 s",
    "stack10": "ten cubes of 1 m and 1 kg on each other, 10 s",
    "stack20": "twenty of them",
    "massratio2": "one such cube under one of 1000 kg, 5 s",
    "massratio10": "nine such cubes under one of 1000 kg, 5 s",
    "chain20": "20 links of 0.5 m and 1 kg, ball joints, 1000 kg at their end, let go straight at 45 degrees, 5 s",
    "chain20_at_240": "the same at 1/240 s",
    "bounce": "a ball falls 1 m and loses nothing (e = 1), for 10 s",
    "slide": "a cube of 1 m slides from 5 m/s along its edges to a stop, right after 2.548 m",
    "slide30": "the same at 30 degrees to its edges",
    "balls666": "666 balls of r = 0.1 m fall in layers of 9 × 9 on an open floor, 2 s",
    "balls666_at_240": "the same at 1/240 s",
    "pyramid15": "120 cubes of 1 m in 15 rows, 0.02 m between neighbours, 5 s",
    "pile1000": "1000 cubes of 0.5 m at random attitudes fall into a pen of 8 m × 8 m, 5 s",
}

COLUMNS = {
    "worst_us": "worst µs",
    "error_m": "error, m",
    "energy_drift": "energy drift",
    "attitude_error_rad": "attitude error, rad",
    "stands": "stands",
    "sag_mm": "sag, mm",
    "gap_m": "joint gap, m",
    "tip_error_m": "tip error, m",
    "energy_error": "energy error",
    "distance_error": "distance error",
    "direction_error_deg": "direction error, °",
    "depth_mm": "deepest, mm",
    "settled_depth_mm": "deepest in the last second, mm",
    "lost": "bodies lost",
}

# What is wanted of ours. A time is a share of Bullet's for the same scene, or (µs, Bullet's µs where that was wanted, the
# scene whose step of Bullet's these are). A figure is its largest size; True: it is to stand.
WANTED = {
    "one_body": [("us_per_step", (0.3, 0.59, "one_body"))],
    "freefall1000": [("us_per_step", 0.2), ("error_m", 1e-12)],
    "freetop": [("us_per_step", (1.0, 0.59, "one_body")), ("energy_drift", 1e-12), ("attitude_error_rad", 1e-9)],
    "stack20": [("us_per_step", (40.0, 35.0, "stack20")), ("stands", True), ("sag_mm", 0.5)],
    "massratio10": [("us_per_step", (50.0, 0.59, "one_body")), ("stands", True), ("sag_mm", 0.5)],
    "chain20": [("us_per_step", (15.0, 18.3, "chain20")), ("gap_m", 1e-6)],
    "chain20_at_240": [("tip_error_m", 1e-6)],
    "bounce": [("energy_error", 1e-10)],
    "slide30": [("distance_error", 1e-6), ("direction_error_deg", 1e-6)],
    "balls666": [("us_per_step", 0.5), ("depth_mm", 20.0)],
    "balls666_at_240": [("depth_mm", 1.0)],
    "pyramid15": [("us_per_step", 0.45), ("depth_mm", 1.0)],
    "pile1000": [("us_per_step", 0.25), ("worst_us", 0.35), ("settled_depth_mm", 20.0)],
}


def results(report):
    """Scene -> engine -> its run, times being medians of the repetitions."""
    runs = {}
    for run in report["benchmarks"]:
        if run["run_type"] == "iteration":
            scene, engine = run["run_name"].split("/")[:2]
            runs.setdefault(scene, {}).setdefault(engine, []).append(run)
    return {scene: {engine: median(repeated) for engine, repeated in engines.items()} for scene, engines in runs.items()}


def median(runs):
    times = {name: statistics.median(run[name] for run in runs) for name in ("us_per_step", "worst_us") if name in runs[0]}
    return runs[0] | times


def has_failed(run):
    return run.get("error_occurred", False)


def figure(run, name):
    value = run[name]
    if name == "stands":
        return "yes" if value else "**no**"
    if name in ("sag_mm", "worst_us", "lost") or name.endswith("_mm"):
        return shown(value) if value >= 0.001 or value == 0 else f"{value:.0e}"
    return f"{value:.1e}" if value else "0"


def row(cells):
    return "| " + " | ".join(cells) + " |"


def table(engines):
    names = [name for name in COLUMNS if any(name in run for run in engines.values())]
    titles = ["engine", "how", "µs per step"] + [COLUMNS[name] for name in names]
    lines = [row(titles), row(["---"] * len(titles))]
    for engine, run in engines.items():
        if has_failed(run):
            cells = [f"**{run['error_message']}**"] + [""] * len(names)
        else:
            cells = [shown(run["us_per_step"])] + [figure(run, name) if name in run else "" for name in names]
        lines.append(row([engine.replace("_", " "), run.get("label", "")] + cells))
    return lines


def verdict(is_met):
    return "met" if is_met else "**missed**"


def judged_time(name, bar, scene, all_runs):
    what = "time" if name == "us_per_step" else "worst step"
    ours = all_runs[scene][OURS][name]
    share, of, stated = bar, scene, ""
    if isinstance(bar, tuple):
        share, of = bar[0] / bar[1], bar[2]
        stated = f": {shown(bar[0])} µs where Bullet's takes {shown(bar[1])} µs"
    yardstick = all_runs.get(of, {}).get(YARDSTICK)
    if yardstick is None or has_failed(yardstick):
        return f"{what} {shown(ours)} µs: nothing of Bullet's to compare it with"
    ratio = ours / yardstick[name]
    where = "" if of == scene else f" in {of}"
    return f"{what} {shown(ratio)} × Bullet's{where} (wanted ≤ {shown(share)}{stated}; {shown(ours)} µs): {verdict(ratio <= share)}"


def judged(name, bar, scene, all_runs):
    run = all_runs[scene][OURS]
    if has_failed(run):
        return f"{COLUMNS.get(name, 'time')}: {verdict(False)} ({run['error_message']})"
    if name in ("us_per_step", "worst_us"):
        return judged_time(name, bar, scene, all_runs)
    if bar is True:
        return f"stands: {verdict(run[name] == 1)}"
    size = abs(run[name])
    return f"{COLUMNS[name]}: {figure(run | {name: size}, name)} (wanted ≤ {bar:g}): {verdict(size <= bar)}"


def document(context, all_runs):
    repetitions = max(run["repetitions"] for engines in all_runs.values() for run in engines.values())
    lines = [
        "# Beside other engines",
        "",
        f"Made by `deploy/bench` on {context['date'][:10]}: {context['num_cpus']} cores at {context['mhz_per_cpu']} MHz, load "
        f"{context['load_avg'][0]:.1f} at the start. `tests/bench/peers/` runs each scene with Gravitas and with what Debian ships",
        "of Bullet (`-float64`), ODE and MuJoCo: double precision, one thread, sleeping off, no damping, default settings, gravity",
        "9.81 m/s², friction 0.5, restitution 0 and steps of 1/60 s unless said. Gravitas is hosted direct, with the space",
        "`DynamicBVH` and plugins as each row names them. Times are of the processor, the mean of the steps of the whole run, "
        + ("measured once." if repetitions == 1 else f"the median of {repetitions} runs."),
        "",
        "Figures are of the whole run where they are largest, and of its end where they are energies, errors or `stands`: every",
        "centre within half an edge of its place. Sag is the most by which a centre was below it. Depth is the shortest way that",
        "parts two bodies, or one from a plane. What ends badly says how: `blew up` is a number that is none, or a body a million",
        "metres away. MuJoCo's arrays hold at most 2 GB in this version, too few for the pile (`could not create mjData`); with",
        "many bodies CG stands beside its default, Newton, whose matrix is dense.",
        "",
        "Below each table is what is wanted of Gravitas, as a share of Bullet's time in the same run. Where a want was stated in",
        "µs on another machine, the share is that of Bullet's there; where Bullet's time in that scene is not known, of its",
        "step of one body.",
    ]
    for scene, what in SCENES.items():
        if scene not in all_runs:
            continue
        lines += ["", f"## {scene}", "", what[0].upper() + what[1:] + ".", ""] + table(all_runs[scene])
        judgements = [f"- {judged(name, bar, scene, all_runs)}" for name, bar in WANTED.get(scene, [])]
        lines += [""] + judgements if judgements else []
    return "\n".join(lines) + "\n"


def main():
    report = json.loads(Path(sys.argv[1]).read_text())
    (Path(sys.argv[2]) / "PEERS.md").write_text(document(report["context"], results(report)))


main()
