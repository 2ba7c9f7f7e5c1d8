"""What a solver refuses in a request, and the modes of axes that it knows."""

import numpy

from gravitas_worker import Refusal, check_finite, check_indices

FREE, LOCKED, LIMITED, UNILATERAL, FRICTION, DRIVEN = range(6)
ANGULAR, SWING, TWIST = 1 << 12, 1 << 14, 1 << 16


def check_request(r):
    """Refuses what cannot be computed with, column by column."""
    bodies, least = len(r.flags), {}
    if not (0 < r.time_step < numpy.inf):
        raise Refusal(f"time_step is {r.time_step:g}; allowed: finite, above 0")
    if not 0 <= r.theta <= 1:
        raise Refusal(f"theta is {r.theta:g}; allowed: 0 to 1")
    for name in ("inverse_mass", "inverse_inertia", "compliance", "damping", "maximum_force", "contact_material"):
        least[name] = 0.0
    for name, column in vars(r).items():
        if not isinstance(column, numpy.ndarray) or column.dtype.kind != "f":
            continue
        check_finite(name, column)
        check_range(name, column, least.get(name, -numpy.inf), numpy.inf)
    check_range("correction", r.correction, 0.0, 1.0)
    check_range("restitution", r.restitution, 0.0, 1.0)
    check_range("contact_material", r.contact_material[:, 0], 0.0, 1.0)
    for name in ("orientation", "trial_orientation", "axes", "contact_normal"):
        column = getattr(r, name)
        check_range(f"{name} (its norm)", numpy.sqrt((column * column).sum(axis=1)), 1 - 1e-6, 1 + 1e-6)
    check_indices("discrepancy_body", r.discrepancy_body, bodies, none_allowed=True)
    check_indices("contact_body", r.contact_body, bodies)
    for name in ("discrepancy_body", "contact_body"):
        pairs = getattr(r, name)
        if (pairs[:, 0] == pairs[:, 1]).any():
            raise Refusal(f"column {name}: a body is paired with itself")
    modes = numpy.stack([r.mode >> 4 * i & 0xF for i in range(3)], axis=-1)
    if (modes > DRIVEN).any() or not numpy.isin(r.mode & ~0xFFF, (0, ANGULAR, ANGULAR | SWING, ANGULAR | TWIST)).all():
        raise Refusal("column mode: a mode that does not exist")
    if ((modes == LIMITED) & (r.lower > r.upper)).any():
        raise Refusal("column lower: above upper")


def check_range(name, column, low, high):
    bad = ~((column >= low) & (column <= high))
    if bad.any():
        row = int(numpy.argwhere(bad)[0][0])
        raise Refusal(f"column {name}, row {row}: {float(column[bad][0]):g}; allowed: {low:g} to {high:g}")
