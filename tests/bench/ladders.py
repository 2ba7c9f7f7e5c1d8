"""Draws error against work: what ladders of settings reach. solver_ladders.py and motion_ladders.py climb them."""
import csv
import math
from dataclasses import dataclass

from tabulate import plt

WORST, FINEST = 10.0, 1e-17  # edges of the axis of errors; failed runs stand at the worst
ROUNDING = 1e-15  # what references of 17 digits leave open, and doubles
MARKS = "osD^v<>ph*Xd8P"


@dataclass
class Rung:
    label: str  # the setting
    error: float
    work: float  # 0: unknown
    failed: str = ""


def guides(axis, slopes, corner):
    """Slopes of methods of an order, from (error, work): work grows as error^(-1/order)."""
    error, work = corner
    for order in slopes:
        end = error * 10.0 ** (-1.2 * min(order, 4))
        axis.loglog([error, end], [work, work * (error / end) ** (1.0 / order)], color="0.6", linewidth=0.8)
        axis.annotate(str(order), (end, work * (error / end) ** (1.0 / order)), color="0.5", fontsize=6)


def panel(axis, curves, slopes=()):
    """Curves: name -> rungs from the coarsest. Failures stand hollow at the edge, ends are labelled with their setting."""
    works = [rung.work for rungs in curves.values() for rung in rungs if rung.work > 0.0]
    axis.axvspan(FINEST, ROUNDING, color="0.93", zorder=0)
    for i, (name, rungs) in enumerate(curves.items()):
        style = {"color": f"C{i % 10}", "marker": MARKS[i % len(MARKS)], "markersize": 3.5}
        good = [rung for rung in rungs if not rung.failed and rung.work > 0.0]
        bad = [rung for rung in rungs if rung.failed and rung.work > 0.0]
        axis.loglog([max(r.error, FINEST) for r in good], [r.work for r in good], linewidth=1, linestyle="-" if i < 10 else "--", label=name, **style)
        axis.loglog([WORST] * len(bad), [r.work for r in bad], linestyle="none", fillstyle="none", **style)
        for rung, side in ((good[0], "left"), (good[-1], "right")) if good else ():
            axis.annotate(rung.label, (max(rung.error, FINEST), rung.work), fontsize=4.5, color=f"C{i % 10}", ha=side, va="bottom")
    if slopes and works:
        guides(axis, slopes, (1e-1, min(works) * 0.4))
    axis.set_xlim(FINEST * 0.3, WORST * 3)
    axis.grid(True, alpha=0.3)


def panels(problems, curves, path, slopes=(), **figure_options):
    """A panel a problem; curves(problem): those of panel()."""
    figure, axes = plt.subplots(1, len(problems), layout="constrained", **figure_options)
    for axis, problem in zip(axes, problems):
        panel(axis, curves(problem), slopes)
        axis.set_title(problem)
        axis.set_xlabel("error (hollow: failed)")
    axes[0].set_ylabel("s of time per simulated s")
    axes[0].legend(fontsize=6)
    save(figure, path)


def write_csv(path, head, rows):
    with open(path, "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(head)
        out.writerows(rows)


def save(figure, path):
    plt.rcParams["svg.hashsalt"] = path.stem
    figure.savefig(path, metadata={"Date": None})


def order_of(rungs):
    """Observed order: the slope of the middle half of those that are neither useless nor rounding; None where they are few."""
    good = [r for r in rungs if not r.failed and 1e-13 < r.error < 0.05]
    middle = good[len(good) // 4: len(good) - len(good) // 4]
    if len(middle) < 3:
        return None
    return math.log(middle[0].error / middle[-1].error) / math.log(float(middle[0].label) / float(middle[-1].label))
