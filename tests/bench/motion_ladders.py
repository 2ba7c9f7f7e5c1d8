"""Error against work of the integrators on five problems of motion, as table, CSV and drawing; and where they are stable.

    motion_ladders.py TEST_NUMERICS CELLS FOLDER    writes CELLS/motion.csv, stability.csv: every run and cell;
                                                    FOLDER/MOTION.md, motion.csv, motion.svg, stability.svg
    motion_ladders.py - CELLS FOLDER                the same from the CSV of CELLS

The runs are those of tests/numerics/ladders_test.cc, the map that of tests/numerics/stability_test.cc.
"""
import csv
import math
import os
import platform
import shutil
import subprocess
import sys
from pathlib import Path

from ladders import Rung, order_of, panel, save
from tabulate import plt

WANTED = (1e-3, 1e-6, 1e-9)
STABLE, STABLE_MEASURED, LATTICE_STABLE = 1.0 + 1e-9, 1.0 + 2e-5, 1.0 + 1e-4
ZETA_OF_NONE = 5e-4  # where a logarithmic axis shows 0


def climbed(path):
    """Problem -> method -> rows."""
    problems = {}
    with open(path, newline="") as file:
        for row in csv.DictReader(file):
            problems.setdefault(f"{row['number']} {row['problem']}", {}).setdefault(row["method"], []).append(row)
    return problems


def rungs(rows, work):
    return [
        Rung(f"{float(row['value']):.2g}", float(row["error"]), work(row), row["failed"])
        for row in rows
    ]


def cpu(row):
    return float(row["cpu_median_s"]) / float(row["simulated_s"])


def evaluations(row):
    return float(row["evaluations"])


def time_to(ladder, wanted):
    times = [rung.work for rung in ladder if not rung.failed and rung.error <= wanted]
    return f"{1e3 * min(times):.3g}" if times else "–"


def shown_order(rows):
    if rows[0]["setting"] != "time_step_s":
        return "–"
    order = order_of(rungs(rows, cpu))
    return "–" if order is None else f"{order:.2f}"


def tables(problems):
    lines = [
        "# What the integrators reach",
        "",
        "Made by `tests/bench/motion_ladders.py build/release/bin/test_numerics tests/bench`, which `deploy/bench` runs, too:",
        "the step by halves, the accuracy of adaptive methods by sqrt(10). Hosting direct, one thread; jointed problems with",
        "simulator Smooth and solver Direct. Error at the end, as a share of the problem's size. Order: of the middle half of",
        "the ladder. All runs stand in `motion.csv`, what failed included; " + f"{platform.machine()}, {os.cpu_count()} cores.",
        "",
        "![error against work](motion.svg)",
        "",
        "CPU time to an error, ms per simulated second; – : no rung of the ladder reaches it.",
    ]
    for problem, methods in problems.items():
        lines += ["", f"## {problem}", "", "| integrator | 1e-3 | 1e-6 | 1e-9 | best error | order, theory | observed |",
                  "| --- | --- | --- | --- | --- | --- | --- |"]
        for method, rows in methods.items():
            ladder = rungs(rows, cpu)
            errors = [rung.error for rung in ladder if not rung.failed]
            best = f"{min(errors):.1e}" if errors else "none"
            lines.append(f"| {method} | " + " | ".join(time_to(ladder, wanted) for wanted in WANTED) +
                         f" | {best} | {rows[0]['order']} | {shown_order(rows)} |")
    return lines


def draw(problems, path):
    figure, axes = plt.subplots(2, len(problems), figsize=(4.4 * len(problems), 9.5), sharex=True, layout="constrained")
    for (upper, lower), (problem, methods) in zip(axes.T, problems.items()):
        panel(upper, {name: rungs(rows, cpu) for name, rows in methods.items()}, (1, 2, 4))
        panel(lower, {name: rungs(rows, evaluations) for name, rows in methods.items()})
        upper.set_title(problem)
        lower.set_xlabel("error (hollow: failed)")
    axes[0][0].set_ylabel("CPU s per simulated s")
    axes[1][0].set_ylabel("evaluations")
    axes[0][0].legend(fontsize=6)
    save(figure, path)


def mapped(path):
    """Method -> world -> (k h^2, zeta) -> measured and theoretical amplification."""
    methods = {}
    with open(path, newline="") as file:
        for row in csv.DictReader(file):
            cells = methods.setdefault(row["method"], {}).setdefault(row["world"], {})
            cells[float(row["stiffness_kh2"]), float(row["zeta"])] = float(row["measured"]), float(row["theory"])
    return methods


def draw_stability(methods, path):
    """Colour: measured on one mass; line: the theory's limit; dots: the lattice, full where stable."""
    columns = math.ceil(len(methods) / 3)
    figure, axes = plt.subplots(3, columns, figsize=(3.7 * columns, 9), sharex=True, sharey=True, layout="constrained")
    for axis in axes.flat[len(methods):]:
        axis.set_visible(False)
    for axis, (method, worlds) in zip(axes.flat, methods.items()):
        cells = worlds["mass"]
        stiffness, zeta = sorted({k for k, _ in cells}), sorted({z for _, z in cells})
        shown_zeta = [max(z, ZETA_OF_NONE) for z in zeta]
        measured, theory = ([[math.log10(max(cells[k, z][i], 1e-9)) for k in stiffness] for z in zeta] for i in (0, 1))
        colours = axis.pcolormesh(stiffness, shown_zeta, measured, cmap="RdBu_r", vmin=-1, vmax=1, shading="nearest", rasterized=True)
        if max(map(max, theory)) > math.log10(STABLE):
            axis.contour(stiffness, shown_zeta, theory, levels=[math.log10(STABLE)], colors="black", linewidths=1)
        for (k, z), (grows, _) in worlds["lattice"].items():
            axis.plot(k, max(z, ZETA_OF_NONE), "o", color="black", markersize=2.5, fillstyle="full" if grows <= LATTICE_STABLE else "none")
        axis.set_xscale("log"), axis.set_yscale("log"), axis.set_title(method, fontsize=10)
    figure.supxlabel("k h²/m, of the lattice that of its stiffest mode")
    figure.supylabel("damping c / 2√(k m); the lowest row is 0")
    figure.colorbar(colours, ax=axes, label="log10 of the growth in a step, measured", shrink=0.6)
    save(figure, path)


def limits(methods):
    """Where the theory's amplification first exceeds 1, and the largest difference of what was measured."""
    lines = ["", "## Stability", "", "![map of stability](stability.svg)", "",
             "A damped spring: growth in a step, measured on the engine for 1 kg (colour) and for the stiffest mode of eight point",
             "masses on 28 springs (dots, full where stable), against the limit of the theory (line). Adaptive methods: one whole",
             "step; with their error control they shorten it. `deploy/bench` leaves all cells in `build/ladders/stability.csv`.",
             "Limit: smallest k h²/m that is not stable; agreement: cells of the mass that theory and engine call the same.", "",
             "| integrator | limit undamped | zeta 0.1 | zeta 1 | cells that agree |", "| --- | --- | --- | --- | --- |"]
    for method, worlds in methods.items():
        cells = worlds["mass"]
        zetas = sorted({z for _, z in cells})
        shown = []
        for wanted in (0.0, 0.1, 1.0):
            z = min(zetas, key=lambda found: abs(found - wanted))
            unstable = [k for (k, zeta), (_, theory) in cells.items() if zeta == z and theory > STABLE]
            shown.append("none" if not unstable else f"{min(unstable):.3g}")
        same = sum((measured > STABLE_MEASURED) == (theory > STABLE_MEASURED) for measured, theory in cells.values())
        lines.append(f"| {method} | " + " | ".join(shown) + f" | {same} of {len(cells)} |")
    return lines


def main():
    cells, folder = Path(sys.argv[2]), Path(sys.argv[3])
    if sys.argv[1] != "-":
        cells.mkdir(parents=True, exist_ok=True)
        environment = dict(os.environ, GRAVITAS_TABLES=str(cells))
        subprocess.run([sys.argv[1], "--gtest_brief=1", "--gtest_filter=Ladders.*:Stability.*"], env=environment, check=True)
    shutil.copy(cells / "motion.csv", folder)
    problems, methods = climbed(cells / "motion.csv"), mapped(cells / "stability.csv")
    draw(problems, folder / "motion.svg")
    draw_stability(methods, folder / "stability.svg")
    (folder / "MOTION.md").write_text("\n".join(tables(problems) + limits(methods)) + "\n")


if __name__ == "__main__":
    main()
