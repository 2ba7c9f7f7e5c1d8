"""Rows of joints and contacts between bodies, and the problem that an island of them poses.

One form serves the pose change and the velocity. With x the displacement or velocity of the bodies, J the rows and
lambda their multipliers, y = J x + gamma lambda and x = x0 + M^-1 J^T lambda:

    law       y >= lower, lambda > 0 only where equal;  y <= upper, lambda < 0 only where equal;  |lambda| <= bound
    contact   0 <= lambda_n _|_ y_n - target >= 0,  |lambda_t| <= mu lambda_n against y_t,
              and turning friction about the normal and across it within its own bounds times lambda_n

Equalities that nothing softens or bounds (locked axes) are eliminated by factorisation, so chains cost no sweeps and
redundant rows do no harm. The rest is solved on what is left by projected Gauss-Seidel, which finds out who touches,
sticks, slides or pulls; now and then that guess is solved for as equations, and taken if it changes nothing any more.
Everything is dense: meant for islands of some hundred rows.
"""

import numpy

EPSILON = float(numpy.finfo(float).eps)
# Changes of this many units of rounding count as none.
STILLNESS = 128 * EPSILON
# Share of a row that must be left of it beside the others, squared.
INDEPENDENCE = 1e-10
# More equations than this are left to the sweeps.
MOST_EQUATIONS = 300


class Rows:
    """J, row by row: what it has for each of its two bodies, and M^-1 J^T."""

    def __init__(self, bodies, body1, body2, axis, point=None, point2=None):
        """Along a unit axis at a point that both bodies are pushed at, or each at its own, or about the axis where there
        is no point."""
        point2 = point if point2 is None else point2
        self.body1, self.body2 = body1, body2
        if point is None:
            linear, turn1, turn2 = numpy.zeros_like(axis), -axis, axis
        else:
            linear = axis
            turn1 = -cross(point - bodies.trial_position[body1], axis)
            turn2 = cross(point2 - bodies.trial_position[body2], axis)
        self.j1 = numpy.hstack([-linear, turn1])
        self.j2 = numpy.hstack([linear, turn2])
        self.push1 = numpy.hstack([-bodies.inverse_mass[body1, None] * linear, apply(bodies.inertia[body1], turn1)])
        self.push2 = numpy.hstack([bodies.inverse_mass[body2, None] * linear, apply(bodies.inertia[body2], turn2)])
        # what turns a rate of this row into m/s
        gyration = numpy.maximum(bodies.gyration[body1], bodies.gyration[body2])
        self.length = numpy.ones(len(axis)) if point is not None else gyration

    def part(self, index):
        part = object.__new__(Rows)
        part.__dict__ = {name: value[index] for name, value in self.__dict__.items()}
        return part

    @staticmethod
    def joined(*rows):
        joined = object.__new__(Rows)
        joined.__dict__ = {name: numpy.concatenate([r.__dict__[name] for r in rows]) for name in rows[0].__dict__}
        return joined

    def __len__(self):
        return len(self.body1)

    def along(self, x):
        return (self.j1 * x[self.body1]).sum(axis=1) + (self.j2 * x[self.body2]).sum(axis=1)

    def motion(self, x):
        """Largest sum of the magnitudes that J x is made of: what rounding goes by."""
        return float((self.motions(x) * self.length).max(initial=0.0))

    def motions(self, x):
        return numpy.abs(self.j1 * x[self.body1]).sum(axis=1) + numpy.abs(self.j2 * x[self.body2]).sum(axis=1)

    def push(self, multipliers, x):
        """x += M^-1 J^T lambda; a body whose multipliers are all zero keeps its bits."""
        acting = numpy.flatnonzero(multipliers)
        amounts = multipliers[acting, None]
        numpy.add.at(x, self.body1[acting], amounts * self.push1[acting])
        numpy.add.at(x, self.body2[acting], amounts * self.push2[acting])

    def response(self):
        """J M^-1 J^T."""
        out = numpy.zeros((len(self), len(self)))
        for near, j in ((self.body1, self.j1), (self.body2, self.j2)):
            for far, push in ((self.body1, self.push1), (self.body2, self.push2)):
                out += numpy.where(near[:, None] == far, j @ push.T, 0.0)
        return out


class Laws:
    """What is asked of rows; free until set."""

    def __init__(self, count):
        self.has_lower, self.has_upper = numpy.zeros(count, bool), numpy.zeros(count, bool)
        self.lower, self.upper = numpy.zeros(count), numpy.zeros(count)
        self.gamma, self.bound = numpy.zeros(count), numpy.full(count, numpy.inf)
        # the multiplier acts on the velocity alone: theta h of it moves the pose
        self.velocity_only = numpy.zeros(count, bool)

    def part(self, index):
        part = object.__new__(Laws)
        part.__dict__ = {name: value[index] for name, value in self.__dict__.items()}
        return part

    def set_equality(self, row, target):
        self.has_lower[row] = self.has_upper[row] = True
        self.lower[row] = self.upper[row] = target

    def is_active(self):
        return self.has_lower | self.has_upper

    def is_rigid(self):
        equal = self.has_lower & self.has_upper & (self.lower == self.upper)
        return equal & (self.gamma == 0) & numpy.isinf(self.bound)

    def violation(self, value):
        below = numpy.where(self.has_lower, self.lower - value, 0.0)
        above = numpy.where(self.has_upper, value - self.upper, 0.0)
        return numpy.maximum(0.0, numpy.maximum(below, above))


class Contact:
    """Rows first, first + 1, first + 2 (normal, tangents), and, where it resists turning, first + 3 … first + 5."""

    def __init__(self, first, target, static, dynamic, rolling, spinning):
        self.first, self.target = first, target
        self.static, self.dynamic, self.rolling, self.spinning = static, dynamic, rolling, spinning
        self.slides = False

    def turns(self):
        return self.rolling > 0 or self.spinning > 0


class Outcome:
    def __init__(self, multipliers, sweeps, residual, converged):
        self.multipliers, self.sweeps, self.residual, self.converged = multipliers, sweeps, residual, converged


def solve(rows, laws, contacts, x, warm, iterations, tolerance, host):
    """Multipliers of an island's rows. Rows of contacts have no law. `tolerance` is the change, in the rows' unit, that
    counts as none."""
    response = rows.response()
    value = rows.along(x)
    if not (numpy.isfinite(response).all() and numpy.isfinite(value).all()):
        raise OverflowError
    rigid = numpy.flatnonzero(laws.is_rigid())
    kept = rigid[independent_rows(response[numpy.ix_(rigid, rigid)])]
    is_other = ~laws.is_rigid() & laws.is_active()
    for contact in contacts:
        is_other[contact.first : contact.first + (6 if contact.turns() else 3)] = True
    others = numpy.flatnonzero(is_other)

    # what is left of the others once the locked rows hold
    inverse = numpy.linalg.inv(response[numpy.ix_(kept, kept)])
    share = response[numpy.ix_(others, kept)] @ inverse
    left = response[numpy.ix_(others, others)] - share @ response[numpy.ix_(kept, others)]
    offset = value[others] + share @ (laws.lower[kept] - value[kept])

    full = numpy.diag(response)[others]
    sweeps = Sweeps(left, offset, full, laws.part(others), rows.length[others], contacts, others)
    multipliers = numpy.zeros(len(rows))
    multipliers[others] = sweeps.run(warm[others], iterations, tolerance, host)
    # twice: the second takes the rounding of the first away
    for _ in range(2):
        missing = laws.lower[kept] - value[kept] - response[kept] @ multipliers
        multipliers[kept] += inverse @ missing
    return Outcome(multipliers, sweeps.done, sweeps.residual, sweeps.converged)


def independent_rows(response):
    """Rows of a positive semi-definite matrix that span the others: pivoted Cholesky, scaled to 1 on the diagonal."""
    diagonal = numpy.diag(response)
    scale = numpy.where(diagonal > 0, 1 / numpy.sqrt(numpy.where(diagonal > 0, diagonal, 1.0)), 0.0)
    matrix = response * scale[:, None] * scale
    try:
        # the common case: all are independent, clearly
        if (numpy.diag(numpy.linalg.cholesky(matrix)) > 1e-3).all():
            return numpy.arange(len(matrix))
    except numpy.linalg.LinAlgError:
        pass
    pivots = numpy.where(diagonal > 0, 1.0, 0.0)
    factor = numpy.zeros((len(matrix), 0))
    kept = []
    while len(pivots) and pivots.max() > INDEPENDENCE:
        chosen = int(pivots.argmax())
        column = (matrix[:, chosen] - factor @ factor[chosen]) / numpy.sqrt(pivots[chosen])
        factor = numpy.column_stack([factor, column])
        pivots = numpy.maximum(0.0, pivots - column * column)
        pivots[chosen] = 0.0
        pivots[kept] = 0.0
        kept.append(chosen)
    return numpy.array(sorted(kept), int)


class Sweeps:
    """Projected Gauss-Seidel on y = K lambda + q."""

    def __init__(self, matrix, offset, full, laws, length, contacts, numbers):
        self._matrix, self._offset, self._length = matrix, offset, length
        self._diagonal = numpy.diag(matrix).copy()
        self._laws = laws
        self._is_free = self._diagonal > INDEPENDENCE * full
        place = {int(number): i for i, number in enumerate(numbers)}
        self._contacts = [(contact, place[contact.first]) for contact in contacts]
        self._law_rows = [int(i) for i in numpy.flatnonzero(laws.is_active() & self._is_free)]
        self._blocks = {at: self._block(at) for _, at in self._contacts}
        self.done, self.residual, self.converged = 0, 0.0, True

    def _block(self, at):
        """The inverse of a contact's own response if it has one, and the largest of its tangents."""
        own = self._matrix[at : at + 3, at : at + 3]
        determinant = numpy.linalg.det(own)
        inverse = numpy.linalg.inv(own) if determinant > 1e-12 * numpy.trace(own) ** 3 else None
        return inverse, largest_of(own[1:, 1:])

    def run(self, warm, iterations, tolerance, host):
        multipliers = self._allowed(warm)
        if not self._law_rows and not self._contacts:
            return multipliers
        self.converged = False
        for self.done in range(1, iterations + 1):
            host.mark_progress()
            residual = self._sweep(multipliers)
            # at sweeps 2, 4, 8, …: the guess as equations, from which a sweep must find less to do
            is_time = self.done & (self.done - 1) == 0 and self.done > 1
            if is_time and residual > tolerance and (guess := self._guessed(multipliers)) is not None:
                left = self._sweep(guess)
                if left < residual:
                    multipliers, residual = guess, left
            self.residual = residual
            self.converged = residual <= tolerance
            is_late = self.done in (iterations // 2, iterations // 4 * 3)
            # those that slip, and by much more than a sweep still changes, slide from now on
            if (self.converged or is_late) and self._let_slide(multipliers, 1e4 * max(residual, tolerance)):
                self.converged = False
            if self.converged:
                break
        return multipliers

    def _sweep(self, multipliers):
        """Visits every row once; the largest change of a velocity."""
        before = multipliers.copy()
        for row in self._law_rows:
            self._visit_law(row, multipliers)
        for contact, at in self._contacts:
            self._visit_contact(contact, at, multipliers)
        change = numpy.abs((multipliers - before) * self._diagonal) * self._length
        return float(change.max(initial=0.0))

    def _guessed(self, multipliers):
        """Multipliers that make what acts now right as equations, or None. What slides keeps its direction."""
        laws, columns, rows, targets = self._laws, [], [], []
        value = self._matrix @ multipliers + self._offset
        unit = numpy.eye(len(multipliers))
        for row in self._law_rows:
            now = multipliers[row]
            if now != 0 and abs(now) < laws.bound[row]:
                columns.append(unit[row])
                rows.append(row)
                targets.append((laws.lower if now > 0 else laws.upper)[row])
        for contact, at in self._contacts:
            normal, tangent = multipliers[at], multipliers[at + 1 : at + 3]
            if contact.turns():
                return None
            if not normal > 0:
                continue
            mu = contact.dynamic if contact.slides else contact.static
            rows.append(at)
            targets.append(contact.target)
            if self._blocks[at][0] is not None and norm(tangent) < mu * normal:
                columns += [unit[at], unit[at + 1], unit[at + 2]]
                rows += [at + 1, at + 2]
                targets += [0.0, 0.0]
            else:
                slip = value[at + 1 : at + 3]
                along = -slip if norm(slip) > 0 else tangent
                size = norm(along)
                ratio = mu / size if size > 0 else 0.0
                columns.append(unit[at] + ratio * (along[0] * unit[at + 1] + along[1] * unit[at + 2]))
        if not rows or len(rows) > MOST_EQUATIONS:
            return None
        columns = numpy.array(columns).T
        # a contact that slides pushes along its column alone
        start = columns @ numpy.linalg.lstsq(columns, multipliers, rcond=None)[0]
        missing = numpy.array(targets) - (self._matrix @ start + self._offset + laws.gamma * start)[rows]
        matrix = (self._matrix @ columns + laws.gamma[:, None] * columns)[rows]
        return start + columns @ numpy.linalg.lstsq(matrix, missing, rcond=1e-11)[0]

    def _allowed(self, warm):
        """The nearest multipliers that the laws allow."""
        laws = self._laws
        out = numpy.where(laws.has_lower, warm, numpy.minimum(warm, 0.0))
        out = numpy.where(laws.has_upper, out, numpy.maximum(out, 0.0))
        out = numpy.clip(out, -laws.bound, laws.bound)
        out[~laws.is_active() | ~self._is_free] = 0.0
        for contact, at in self._contacts:
            normal = max(0.0, float(warm[at])) if self._diagonal[at] > 0 else 0.0
            out[at] = normal
            out[at + 1 : at + 3] = within(warm[at + 1 : at + 3], contact.static * normal)
        return out

    def _value(self, row, multipliers):
        return float(self._matrix[row] @ multipliers + self._offset[row])

    def _visit_law(self, row, multipliers):
        laws = self._laws
        now, response = float(multipliers[row]), self._diagonal[row] + laws.gamma[row]
        value = self._value(row, multipliers) + laws.gamma[row] * now
        to_lower = now + (laws.lower[row] - value) / response
        to_upper = now + (laws.upper[row] - value) / response
        relaxed = 0.0
        if laws.has_lower[row] and to_lower > 0:
            relaxed = to_lower
        elif laws.has_upper[row] and to_upper < 0:
            relaxed = to_upper
        multipliers[row] = min(max(relaxed, -laws.bound[row]), laws.bound[row])

    def _visit_contact(self, contact, at, multipliers):
        if not self._diagonal[at] > 0:
            return
        block = slice(at, at + 3)
        now = multipliers[block].copy()
        value = self._matrix[block] @ multipliers + self._offset[block]
        if value[0] >= contact.target and not now.any():
            return
        mu = contact.dynamic if contact.slides else contact.static
        multipliers[block] = self._relaxed(contact, at, now, value, mu)
        if contact.turns():
            self._visit_turning(contact, at + 3, float(multipliers[at]), multipliers)

    def _relaxed(self, contact, at, now, value, mu):
        """The contact's impulse with all others as they are: sticking if that lies in the cone, else one projected
        step, normal first."""
        inverse, tangents = self._blocks[at]
        if inverse is not None and mu > 0:
            sticking = now - inverse @ (value - numpy.array([contact.target, 0.0, 0.0]))
            if sticking[0] >= 0 and norm(sticking[1:]) <= mu * sticking[0]:
                return sticking
        normal = max(0.0, now[0] + (contact.target - value[0]) / self._diagonal[at])
        if not tangents > 0:
            return numpy.array([normal, 0.0, 0.0])
        slip = value[1:] + self._matrix[at + 1 : at + 3, at] * (normal - now[0])
        return numpy.concatenate([[normal], within(now[1:] - slip / tangents, mu * normal)])

    def _visit_turning(self, contact, at, normal, multipliers):
        if self._diagonal[at] > 0:
            spin = multipliers[at] - self._value(at, multipliers) / self._diagonal[at]
            bound = contact.spinning * normal
            multipliers[at] = min(max(spin, -bound), bound)
        largest = largest_of(self._matrix[at + 1 : at + 3, at + 1 : at + 3])
        if largest > 0:
            value = self._matrix[at + 1 : at + 3] @ multipliers + self._offset[at + 1 : at + 3]
            roll = multipliers[at + 1 : at + 3] - value / largest
            multipliers[at + 1 : at + 3] = within(roll, contact.rolling * normal)

    def _let_slide(self, multipliers, slip):
        any_new = False
        for contact, at in self._contacts:
            if contact.slides or not contact.dynamic < contact.static or multipliers[at] == 0:
                continue
            value = self._matrix[at + 1 : at + 3] @ multipliers + self._offset[at + 1 : at + 3]
            if norm(value) > slip:
                contact.slides = any_new = True
        return any_new


# ---- small vectors; sums are written out so that numpy chooses no order


def cross(a, b):
    return numpy.stack([
        a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1], a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2],
        a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]], axis=-1)


def dot(a, b):
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]


def apply(matrices, vectors):
    return numpy.stack([dot(matrices[..., i, :], vectors) for i in range(3)], axis=-1)


def norm(pair):
    return float(numpy.hypot(pair[0], pair[1]))


def within(pair, radius):
    """The nearest vector of a disc."""
    length = norm(pair)
    return pair if length <= radius else pair * (radius / length)


def largest_of(matrix):
    """The larger eigenvalue of a symmetric matrix of two rows."""
    mean, half = 0.5 * (matrix[0, 0] + matrix[1, 1]), 0.5 * (matrix[0, 0] - matrix[1, 1])
    return float(mean + numpy.hypot(half, matrix[0, 1]))
