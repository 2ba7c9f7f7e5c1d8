#!/usr/bin/python3
"""A solver in Python: joints by factorisation, contacts by projected Gauss-Seidel, island by island.

    S_n, S*, discrepancies, contacts
      -> pose change       delta = M^-1 J^T mu      no joint open, no gap negative
      -> closed contacts   gaps and limits that S* (+) delta leaves at zero
      -> velocity          v_{n+1} = v* + M^-1 J^T lambda, joints where the pose change leaves the bodies
      -> pose change again, with theta h M^-1 J^T lambda of friction, drives and springs

The laws are those of schemas/gravitas/stage/v1/solver.proto. Bodies that no joint or contact joins are solved apart,
and do not know of each other. Restitution, of contacts and of stops, that would make an island gain energy is dropped
for that island. Every island is a dense problem: a pile of hundreds of bodies is not what this is for.
"""

import numpy

from complementarity import EPSILON, STILLNESS, Contact, Laws, Rows, apply, cross, dot, solve
from gravitas_worker import KINEMATIC, MOVABLE, NONE, Property, Refusal, Solver, main
from request_check import ANGULAR, DRIVEN, FRICTION, LIMITED, LOCKED, SWING, TWIST, UNILATERAL, check_request
from rotations import (conjugate, product, rotation, rotation_vector, sum_along, tangent_of, turn_by, turned_by, unit)
from surface import perturbed_normal

NOTHING_TO_DO, CONVERGED, ITERATIONS = 0, 1, 2
UNLIMITED = numpy.finfo(float).max


class Islands(Solver):
    name = "PythonIslands"
    version = "1.0"
    meaning = "Joints by factorisation, contacts by projected Gauss-Seidel, island by island."
    properties = [
        Property.integer("Iterations", at_least=1, at_most=100000, default=500, live=True,
                         meaning="Largest number of sweeps of one problem; fewer where it converges."),
        Property.number("CorrectionFactor", "1", at_least=0.0, at_most=1.0, default=1.0, live=True,
                        meaning="Share of the joint error and overlap of the step before that a step removes."),
    ]

    def __init__(self, settings):
        self._settings = settings

    def solve(self, request, reply, host):
        check_request(request)
        scene = Scene(request, self._settings.CorrectionFactor)
        islands = [Island(scene, *parts, self._settings.Iterations, host) for parts in scene.islands()]
        try:
            for island in islands:
                island.solve()
        except (OverflowError, numpy.linalg.LinAlgError):
            raise Refusal("masses, velocities, errors or arms so large that their products are not finite")
        scene.write(reply)
        if not (numpy.isfinite(scene.velocity).all() and numpy.isfinite(scene.displacement).all()):
            raise Refusal("the answer is not finite: masses, velocities or errors overflow")
        reply.iterations = sum(island.sweeps for island in islands)
        reply.residual = max((island.residual for island in islands), default=0.0)
        converged = all(island.converged for island in islands)
        reply.stop_reason = NOTHING_TO_DO if not islands else CONVERGED if converged else ITERATIONS


class Bodies:
    """The bodies of a request, and the world as one more, which nothing moves."""

    def __init__(self, request):
        def with_world(column, world):
            return numpy.concatenate([column, [world]])

        self.count = len(request.flags)
        origin, identity = numpy.zeros(3), [1.0, 0.0, 0.0, 0.0]
        flags = with_world(request.flags, 0)
        self.is_pushed = ((flags & MOVABLE) != 0) & ((flags & KINEMATIC) == 0)
        self.position = with_world(request.position, origin)
        self.orientation = with_world(request.orientation, identity)
        self.trial_position = with_world(request.trial_position, origin)
        self.trial_orientation = with_world(request.trial_orientation, identity)
        self.velocity = with_world(numpy.hstack([request.linear_velocity, request.angular_velocity]), numpy.zeros(6))
        self.trial_velocity = with_world(
            numpy.hstack([request.trial_linear_velocity, request.trial_angular_velocity]), numpy.zeros(6))
        self.inverse_mass = numpy.where(self.is_pushed, with_world(request.inverse_mass, 0.0), 0.0)
        axes = rotation(self.trial_orientation)
        moments = numpy.where(self.is_pushed[:, None], with_world(request.inverse_inertia, origin), 0.0)
        scaled = axes * moments[:, None, :]
        self.inertia = numpy.stack([apply(scaled, axes[:, i]) for i in range(3)], axis=-1)  # inverse, world, at S*
        turning = (self.inertia[:, 0, 0] + self.inertia[:, 1, 1] + self.inertia[:, 2, 2]) / 3
        self.gyration = numpy.sqrt(numpy.divide(self.inverse_mass, turning, out=numpy.zeros_like(turning),
                                                where=turning > 0))

    def carried(self, point, body):
        """A point that was given in the world at S*, where it is at S_n."""
        inward = rotation(self.trial_orientation[body]).swapaxes(-1, -2)
        local = apply(inward, point - self.trial_position[body])
        return apply(rotation(self.orientation[body]), local) + self.position[body]

    def turned_back(self, direction, body):
        """A direction that a body has at S*, as it was at S_n."""
        inward = rotation(self.trial_orientation[body]).swapaxes(-1, -2)
        return apply(rotation(self.orientation[body]), apply(inward, direction))

    def turned(self, direction, body):
        """A direction that a body has at S_n, as it is at S*."""
        inward = rotation(self.orientation[body]).swapaxes(-1, -2)
        return apply(rotation(self.trial_orientation[body]), apply(inward, direction))

    def turn(self, body):
        """Rotation vector from S_n to S*."""
        return rotation_vector(product(self.trial_orientation[body], conjugate(self.orientation[body])))

    def moved(self):
        """Displacement from S_n to S*."""
        return numpy.hstack([self.trial_position - self.position, self.turn(slice(None))])

    def slop(self, point, body1, body2):
        """Gap up to which a contact or limit counts as closed: rounding's size."""
        arm, size = numpy.zeros(len(point)), numpy.abs(point).max(axis=1, initial=0.0)
        for body in (body1, body2):
            pushed = self.is_pushed[body]
            reach = numpy.sqrt(dot(point - self.trial_position[body], point - self.trial_position[body]))
            arm = numpy.maximum(arm, numpy.where(pushed, reach, 0.0))
            size = numpy.maximum(size, numpy.where(pushed, numpy.abs(self.trial_position[body]).max(axis=1), 0.0))
        return 1e-9 * arm + 8 * EPSILON * size


class Scene:
    """Rows and laws of the whole request, and what is answered."""

    def __init__(self, request, correction_factor):
        self.step, self.theta = request.time_step, request.theta
        self.bodies = Bodies(request)
        self.velocity = self.bodies.trial_velocity.copy()
        self.displacement = numpy.zeros_like(self.velocity)
        self._set_joints(request, correction_factor)
        self._set_contacts(request, correction_factor)
        self._set_bounces(request)

    # ---- joints: three rows a discrepancy

    def _set_joints(self, r, correction_factor):
        bodies, world = self.bodies, self.bodies.count
        self.joint_body = numpy.where(r.discrepancy_body == NONE, world, r.discrepancy_body).astype(numpy.intp)
        body1, body2 = self.joint_body[:, 0], self.joint_body[:, 1]
        middle = 0.5 * (r.point1 + r.point2)
        axes = rotation(r.axes).swapaxes(-1, -2)  # [row, axis]
        self.joint_axes, self.joint_point = axes, (r.point1, r.point2)
        self.is_swing, self.is_twist = (r.mode & SWING) != 0, (r.mode & TWIST) != 0
        angular = (r.mode & ANGULAR) != 0
        error = r.point2 - r.point1
        turned = error + bodies.turn(body1) - bodies.turn(body2)
        # axes turn with body 1
        carried = bodies.turned(bodies.carried(r.point2, body2) - bodies.carried(r.point1, body1), body1)
        start = numpy.where(angular[:, None], turned, carried)
        start = numpy.where(self.is_swing[:, None], self._swing_at_start(r, axes, body1, body2), start)

        def along(vectors):
            return numpy.stack([dot(axes[:, i], vectors) for i in range(3)], axis=-1).reshape(-1)

        self.error_start, self.error_trial, self.desired = along(start), along(error), along(r.velocity)
        self.mode = numpy.stack([r.mode >> 4 * i & 0xF for i in range(3)], axis=-1).reshape(-1)
        self.lower, self.upper = r.lower.reshape(-1), r.upper.reshape(-1)
        self.compliance, self.damping = r.compliance.reshape(-1), r.damping.reshape(-1)
        self.maximum_force = r.maximum_force.reshape(-1)
        self.beta = numpy.repeat(correction_factor * r.correction, 3)
        self.slop = numpy.repeat(numpy.where(angular, 1e-9, bodies.slop(middle, body1, body2)), 3)
        self.joint_size = numpy.abs(r.point2).max(axis=1, initial=0.0)
        self.joint_warm = r.discrepancy_warm_impulse.reshape(-1), r.discrepancy_warm_correction.reshape(-1)
        self.joint_impulse, self.joint_correction = numpy.zeros_like(self.lower), numpy.zeros_like(self.lower)

        # where a point is all that holds two bodies, each is pushed at its own
        same = (self.joint_body[1:] == self.joint_body[:-1]).all(axis=1)
        is_alone = ~angular & ~numpy.append(same, False) & ~numpy.insert(same, 0, False)
        self.is_own = is_alone[:, None] & (self.mode.reshape(-1, 3) == LOCKED) & (r.compliance == 0)
        self.is_angular = angular
        apart = sum_along(axes, 0.5 * numpy.where(self.is_own, self.error_trial.reshape(-1, 3), 0.0))
        self.joint_rows = self._rows_of_joints(axes, middle - apart, middle + apart)

    def _rows_of_joints(self, axes, point1, point2):
        """Three a discrepancy, along axes at a point of each body, or about them."""
        bodies, flat = self.bodies, axes.reshape(-1, 3)
        one, two = (numpy.repeat(self.joint_body[:, i], 3) for i in range(2))
        angular = numpy.repeat(self.is_angular, 3)
        linear, turning = numpy.flatnonzero(~angular), numpy.flatnonzero(angular)
        rows = Rows.joined(
            Rows(bodies, one[linear], two[linear], flat[linear], numpy.repeat(point1, 3, axis=0)[linear],
                 numpy.repeat(point2, 3, axis=0)[linear]),
            Rows(bodies, one[turning], two[turning], flat[turning]))
        return rows.part(numpy.argsort(numpy.concatenate([linear, turning])))

    def joint_rows_at(self, displacement):
        """The rows where a displacement leaves the bodies; of two that do not turn, or touch each other, those of S*. Linear
        axes turn with body 1, a swing's with its two directions, a twist's with its two shafts."""
        axes, (point1, point2) = self.joint_axes, self.joint_point
        body1, body2 = self.joint_body[:, 0], self.joint_body[:, 1]
        if not displacement[:, 3:].any() or not len(axes):
            return self.joint_rows
        turn1, turn2 = (rotation(turn_by(displacement[body, 3:])) for body in (body1, body2))

        def moved(point, body, turn):
            centre = self.bodies.trial_position[body]
            return centre + displacement[body, :3] + apply(turn, point - centre)

        def turned(vectors):
            return numpy.stack([apply(turn1, vectors[:, i]) for i in range(3)], axis=1)

        end1, end2, at_end = moved(point1, body1, turn1), moved(point2, body2, turn2), turned(axes)
        errors = numpy.stack([dot(at_end[:, i], end2 - end1) for i in range(3)], axis=-1)
        modes = self.mode.reshape(-1, 3)
        is_held = (modes == LOCKED) | (modes == LIMITED) | (modes == UNILATERAL)
        place = numpy.where(is_held.any(axis=1)[:, None], end2, end1)
        place = place - sum_along(at_end, 0.5 * numpy.where(is_held, errors, 0.0))
        apart = sum_along(at_end, 0.5 * numpy.where(self.is_own, errors, 0.0))

        first = apply(turn1, axes[:, 1])
        angle = dot(axes[:, 0], point2)[:, None]
        second = apply(turn2, numpy.cos(angle) * axes[:, 1] + numpy.sin(angle) * axes[:, 2])
        swing = axes.copy()
        swing[:, 0] = unit(cross(first, second), axes[:, 0])
        swing[:, 1], swing[:, 2] = first, cross(swing[:, 0], first)
        cosine = numpy.sqrt(numpy.maximum(0.0, 1 - dot(point1, point1)))[:, None]
        twist = axes.copy()
        twist[:, 0] = unit(apply(turn1, cosine * axes[:, 0] + point1) + apply(turn2, cosine * axes[:, 0] - point1),
                           axes[:, 0])
        about = numpy.where(self.is_twist[:, None, None], twist, axes)
        about = numpy.where(self.is_swing[:, None, None], swing, about)
        rows = self._rows_of_joints(numpy.where(self.is_angular[:, None, None], about, at_end),
                                    place - apart - displacement[body1, :3], place + apart - displacement[body2, :3])
        still = ~(displacement[body1, 3:].any(axis=1) | displacement[body2, 3:].any(axis=1)) | self.touches
        still, count = numpy.repeat(still, 3), len(rows)
        return Rows.joined(rows, self.joint_rows).part(numpy.where(still, count, 0) + numpy.arange(count))

    def _set_bounces(self, r):
        """What stops give back of the speed at which they are arrived at, away from them: above 0 from the lower. One that
        pushed in the step before is not arrived at."""
        bodies = self.bodies
        restitution = numpy.repeat(r.restitution, 3)
        self.stop_bounce = numpy.zeros_like(restitution)
        if not restitution.any():
            return
        rows = self.joint_rows_at(-bodies.moved())
        rate = rows.along(bodies.velocity) - self.desired
        sign = numpy.where(rate < 0, 1.0, -1.0)
        limit = numpy.where(rate < 0, self.lower, self.upper)
        has_stop = (self.mode == LIMITED) & (self.lower < self.upper) & (numpy.abs(limit) < UNLIMITED)
        limit = numpy.where(has_stop, limit, 0.0)
        has_stop |= (self.mode == UNILATERAL) & (rate < 0)
        has_stop &= (self.compliance == 0) & ~(sign * self.joint_warm[0] > 0)
        has_stop &= numpy.abs(rate) > 1e-12 * rows.motions(bodies.velocity)
        self.stop_rate, self.stop_gap = rate, numpy.maximum(0.0, sign * (self.error_start - limit))
        self.stop_restitution = numpy.where(has_stop, restitution, 0.0)
        self.stop_bounce = -self.stop_restitution * rate  # until Island._find_bounces()

    def _swing_at_start(self, r, axes, body1, body2):
        """Of the angle between a direction of body 1, the second axis, and one of body 2, that turned by point2."""
        angle = dot(axes[:, 0], r.point2)[:, None]
        first = self.bodies.turned_back(axes[:, 1], body1)
        second = self.bodies.turned_back(numpy.cos(angle) * axes[:, 1] + numpy.sin(angle) * axes[:, 2], body2)
        across = cross(first, second)
        at_start = numpy.arctan2(numpy.sqrt(dot(across, across)), dot(first, second))
        return (at_start - dot(axes[:, 0], r.point1))[:, None] * axes[:, 0]

    def joint_law(self, laws, row, i, after):
        """Sets the law of joint row i as row `row`: of the pose change, or of the velocity where the pose change
        leaves the error `after`."""
        mode, start, trial = self.mode[i], self.error_start[i], self.error_trial[i]
        lower, upper, h = self.lower[i], self.upper[i], self.step
        is_held = mode == LOCKED or (mode == LIMITED and lower == upper)
        is_limit = mode in (LIMITED, UNILATERAL) and not is_held
        rest = 0.0 if mode in (LOCKED, UNILATERAL) else lower
        has_lower = mode == UNILATERAL or (mode == LIMITED and lower > -UNLIMITED)
        has_upper = mode == LIMITED and upper < UNLIMITED
        is_soft = self.compliance[i] > 0 and (is_held or is_limit)
        is_pose = after is None
        if self.maximum_force[i] < UNLIMITED:
            laws.bound[row] = self.maximum_force[i] * (h * h if is_pose else h)
        if is_soft and not is_pose:
            self._set_spring(laws, row, i, is_held, has_lower, has_upper, rest)
        elif is_pose and is_held and not is_soft:
            laws.set_equality(row, rest + (1 - self.beta[i]) * (start - rest) - trial)
        elif is_pose and is_limit and not is_soft:
            laws.has_lower[row], laws.has_upper[row] = has_lower, has_upper
            if has_lower:
                laws.lower[row] = rest + min(0.0, (1 - self.beta[i]) * (start - rest)) - trial
            if has_upper:
                laws.upper[row] = upper + max(0.0, (1 - self.beta[i]) * (start - upper)) - trial
        elif not is_pose and mode in (DRIVEN, FRICTION):
            laws.set_equality(row, self.desired[i])
            laws.velocity_only[row] = True
            if self.damping[i] > 0:
                laws.gamma[row] = 1 / (h * self.damping[i])
        elif not is_pose and is_held:
            laws.set_equality(row, self.desired[i])
        elif not is_pose and is_limit:
            laws.has_lower[row] = has_lower and after <= rest + self.slop[i]
            laws.has_upper[row] = has_upper and after >= upper - self.slop[i]
            laws.lower[row] = laws.upper[row] = self.desired[i]
            laws.lower[row] += max(0.0, self.stop_bounce[i])
            laws.upper[row] += min(0.0, self.stop_bounce[i])

    def _set_spring(self, laws, row, i, is_held, has_lower, has_upper, rest):
        """Spring and damper at the end of the step: implicit Euler."""
        start, trial = self.error_start[i], self.error_trial[i]
        softness = self.compliance[i] * self.damping[i] + self.step
        laws.gamma[row] = self.compliance[i] / (self.step * softness)
        laws.velocity_only[row] = True
        if is_held or (has_lower and min(start, trial) < rest):
            laws.has_lower[row] = True
            laws.lower[row] = self.desired[i] - (start - rest) / softness
        if is_held or (has_upper and max(start, trial) > self.upper[i]):
            limit = rest if is_held else self.upper[i]
            laws.has_upper[row] = True
            laws.upper[row] = self.desired[i] - (start - limit) / softness

    # ---- contacts: a gap row, and six rows for velocities

    def _set_contacts(self, r, correction_factor):
        bodies = self.bodies
        self.contact_body = r.contact_body.astype(numpy.intp)
        touching = {tuple(sorted(pair)) for pair in self.contact_body.tolist()}
        self.touches = numpy.array([tuple(sorted(pair)) in touching for pair in self.joint_body.tolist()], bool)
        body1, body2 = self.contact_body[:, 0], self.contact_body[:, 1]
        normal, point, self.gap = r.contact_normal, r.contact_point, -r.contact_depth
        self.gap_rows = Rows(bodies, body1, body2, normal, point)
        to_surface = -0.5 * self.gap[:, None] * normal
        carried = bodies.carried(point - to_surface, body2) - bodies.carried(point + to_surface, body1)
        self.gap_law = numpy.minimum(0.0, (1 - correction_factor) * dot(normal, carried)) - self.gap
        self.gap_slop = bodies.slop(point, body1, body2)
        self.contact_size = numpy.abs(point).max(axis=1, initial=0.0)

        before = self.gap - self.gap_rows.along(bodies.moved())
        self.direction, speed = self._impact(r, normal, before)
        tangent1 = tangent_of(self.direction)
        self.frame = numpy.stack([self.direction, tangent1, cross(self.direction, tangent1)], axis=1)
        self.bounce = r.contact_material[:, 0] * speed
        self.friction = r.contact_material[:, 1:5].copy()  # static, dynamic, rolling, spinning
        self.friction[:, 0] = numpy.maximum(self.friction[:, 0], self.friction[:, 1])
        along = [Rows(bodies, body1, body2, self.frame[:, i], point) for i in range(3)]
        about = [Rows(bodies, body1, body2, self.frame[:, i]) for i in range(3)]
        order = numpy.arange(6 * len(normal)).reshape(6, -1).T.reshape(-1)
        self.contact_rows = Rows.joined(*along, *about).part(order)  # row 6 i + k
        warm = numpy.zeros((len(normal), 6))
        warm[:, :3] = apply(self.frame, r.contact_warm_impulse)
        self.contact_warm = warm.reshape(-1), r.contact_warm_correction
        self.contact_impulse, self.contact_turning = numpy.zeros((len(normal), 3)), numpy.zeros((len(normal), 3))
        self.contact_correction = numpy.zeros(len(normal))

    def _impact(self, r, normal, gap):
        """Direction of the normal law, and the speed of arrival along it."""
        bodies = self.bodies

        def arrival(rows):
            start, trial = rows.along(bodies.velocity), rows.along(bodies.trial_velocity)
            return start, trial, arrival_speed(start, trial, gap, self.step)

        start, _, speed = arrival(self.gap_rows)
        spread = r.contact_material[:, 5]
        if not ((spread > 0) & (speed > 0)).any():
            return normal.copy(), speed
        tilted = perturbed_normal(normal, spread, r.contact_key)
        rows = Rows(bodies, self.gap_rows.body1, self.gap_rows.body2, tilted, r.contact_point)
        start_across, trial_across, speed_across = arrival(rows)
        keeps = (trial_across < 0) & ((start_across < 0) == (start < 0))
        keeps &= (speed_across > 0) & (dot(tilted, normal) > 0)
        is_tilted = (spread > 0) & (speed > 0) & keeps
        return numpy.where(is_tilted[:, None], tilted, normal), numpy.where(is_tilted, speed_across, speed)

    # ---- islands

    def islands(self):
        """(discrepancies, contacts) of each set of bodies that hang together, in the order of its first body."""
        parent = list(range(self.bodies.count + 1))

        def root(body):
            while parent[body] != body:
                parent[body] = parent[parent[body]]
                body = parent[body]
            return body

        pairs = [*self.joint_body.tolist(), *self.contact_body.tolist()]
        pushed = self.bodies.is_pushed
        for one, two in pairs:
            if pushed[one] and pushed[two]:
                first, second = sorted((root(one), root(two)))
                parent[second] = first
        found = {}
        for i, (one, two) in enumerate(pairs):
            if pushed[one] or pushed[two]:
                parts = found.setdefault(root(two if pushed[two] else one), ([], []))
                joints = len(self.joint_body)
                parts[i >= joints].append(i if i < joints else i - joints)
        return [found[body] for body in sorted(found)]

    def write(self, reply):
        count = self.bodies.count
        reply.linear_velocity, reply.angular_velocity = self.velocity[:count, :3], self.velocity[:count, 3:]
        reply.pose_change = self.displacement[:count]
        reply.discrepancy_impulse, reply.discrepancy_correction = self.joint_impulse, self.joint_correction
        reply.contact_impulse, reply.contact_correction = self.contact_impulse, self.contact_correction
        reply.contact_direction, reply.contact_turning = self.direction, self.contact_turning


class Island:
    """The two problems of bodies that hang together."""

    def __init__(self, scene, joints, contacts, iterations, host):
        self._scene, self._iterations, self._host = scene, iterations, host
        self._joints = (3 * numpy.array(joints, int)[:, None] + numpy.arange(3)).reshape(-1)
        self._contacts = numpy.array(contacts, int)
        self._size = max(scene.joint_size[joints].max(initial=0.0), scene.contact_size[contacts].max(initial=0.0))
        self._pose_rows = Rows.joined(scene.joint_rows.part(self._joints), scene.gap_rows.part(self._contacts))
        self._pose_laws = Laws(len(self._pose_rows))
        for row, i in enumerate(self._joints):
            scene.joint_law(self._pose_laws, row, i, None)
        gaps = slice(len(self._joints), None)
        self._pose_laws.has_lower[gaps] = True
        self._pose_laws.lower[gaps] = scene.gap_law[self._contacts]
        self._pose_warm = numpy.concatenate(
            [scene.joint_warm[1][self._joints], scene.contact_warm[1][self._contacts]])
        self._closed = numpy.zeros(len(self._contacts), bool)
        self._sides = numpy.zeros((len(self._joints), 2), bool)
        self.sweeps, self.residual, self.converged = 0, 0.0, True

    def solve(self):
        scene = self._scene
        offset = numpy.zeros_like(scene.displacement)
        self._solve_pose(offset)
        self._find_closed(offset)
        self._solve_velocity()
        factor = scene.theta * scene.step
        pushes = self._velocity_only * self._multipliers
        if factor > 0 and pushes.any():
            self._velocity_rows.push(factor * pushes, offset)
            self._solve_pose(offset)
            if self._find_closed(offset):
                self._solve_velocity()
                offset[:] = 0.0
                self._velocity_rows.push(factor * self._velocity_only * self._multipliers, offset)
                self._solve_pose(offset)
        scene.displacement += self._displacement
        scene.velocity += self._start - scene.bodies.trial_velocity
        self._velocity_rows.push(self._multipliers, scene.velocity)
        self._store()

    def _solve_pose(self, offset):
        rows, laws = self._pose_rows, self._pose_laws
        violation = float((laws.violation(rows.along(offset)) * rows.length).max(initial=0.0))
        motion, representable = rows.motion(offset), 0.25 * EPSILON * self._size
        self._corrections = numpy.zeros(len(rows))
        if not violation <= max(representable, EPSILON * motion):
            tolerance = max(representable, STILLNESS * max(violation, motion))
            self._corrections = self._take(solve(rows, laws, (), offset, self._pose_warm, self._iterations, tolerance,
                                                 self._host))
        self._displacement = offset.copy()
        rows.push(self._corrections, self._displacement)

    def _take(self, outcome):
        self.sweeps += outcome.sweeps
        self.residual = outcome.residual
        self.converged = self.converged and outcome.converged
        return outcome.multipliers

    def _find_closed(self, offset):
        """Which contacts and limits the pose change closes, beside those that are closed already; whether any."""
        scene, count = self._scene, len(self._joints)
        moved = self._pose_rows.along(self._displacement)
        closed = scene.gap[self._contacts] + moved[count:] <= scene.gap_slop[self._contacts]
        laws = Laws(count)
        for row, i in enumerate(self._joints):
            scene.joint_law(laws, row, i, scene.error_trial[i] + moved[row])
        sides = numpy.stack([laws.has_lower, laws.has_upper], axis=1)
        is_new = bool((closed & ~self._closed).any() or (sides & ~self._sides).any())
        self._closed |= closed
        self._sides |= sides
        laws.has_lower, laws.has_upper = self._sides[:, 0].copy(), self._sides[:, 1].copy()
        self._joint_laws = laws
        # between two stops that are closed there is no room to leave either
        self._drop_bounces(laws, laws.has_lower & laws.has_upper)
        return is_new

    def _drop_bounces(self, laws, where):
        count = len(self._joints)
        where = where[:count] & (self._scene.stop_bounce[self._joints] != 0)
        for side in (laws.lower, laws.upper):
            side[:count] = numpy.where(where, self._scene.desired[self._joints], side[:count])

    def _solve_velocity(self):
        scene, count = self._scene, len(self._joints)
        contacts, numbers = [], []
        for contact in self._contacts[self._closed]:
            static, dynamic, rolling, spinning = scene.friction[contact]
            contacts.append(Contact(count + len(numbers), scene.bounce[contact], static, dynamic, rolling, spinning))
            numbers += range(6 * contact, 6 * contact + (6 if contacts[-1].turns() else 3))
        joint_rows = scene.joint_rows_at(self._displacement)
        self._velocity_rows = Rows.joined(joint_rows.part(self._joints), scene.contact_rows.part(numbers))
        self._velocity_laws = Laws(len(self._velocity_rows))
        for name, values in self._joint_laws.__dict__.items():
            self._velocity_laws.__dict__[name][:count] = values
        self._velocity_contacts = contacts
        self._velocity_only = self._velocity_laws.velocity_only.copy()
        for contact in contacts:
            self._velocity_only[contact.first + 1 : contact.first + (6 if contact.turns() else 3)] = True
        self._warm = numpy.concatenate([scene.joint_warm[0][self._joints], scene.contact_warm[0][numbers]])
        self._start = self._turned_by_joints()
        self._find_bounces()
        self._relax()
        self._bound_energy()

    def _find_bounces(self):
        """What stops that are closed give back of the speed at which the other joints let the bodies arrive."""
        scene, joints, laws = self._scene, self._joints, self._velocity_laws
        bounce, own = scene.stop_bounce[joints], numpy.arange(len(joints))
        closed = numpy.where(bounce > 0, laws.has_lower[own], laws.has_upper[own]) & (bounce != 0)
        closed &= ~(laws.has_lower[own] & laws.has_upper[own])
        if not closed.any():
            return
        others, rows, velocity = laws.part(own), self._velocity_rows.part(own), self._start.copy()
        others.has_lower[closed] = others.has_upper[closed] = False
        tolerance = STILLNESS * rows.motion(velocity)
        rows.push(solve(rows, others, (), velocity, self._warm[own], self._iterations, tolerance, self._host).multipliers,
                  velocity)
        sign, desired = numpy.sign(bounce), scene.desired[joints]
        speed = arrival_speed(sign * scene.stop_rate[joints], sign * (rows.along(velocity) - desired),
                              scene.stop_gap[joints], scene.step)
        target = desired + sign * scene.stop_restitution[joints] * speed
        laws.lower[own] = numpy.where(closed & (bounce > 0), target, laws.lower[own])
        laws.upper[own] = numpy.where(closed & (bounce < 0), target, laws.upper[own])

    def _turned_by_joints(self):
        """v*, of which spins go along with what joints turn the bodies by, along what these turn by, and no further."""
        velocity = self._scene.bodies.trial_velocity.copy()
        by_joints = numpy.zeros_like(velocity)
        multipliers = self._corrections.copy()
        multipliers[len(self._joints) :] = 0.0
        self._pose_rows.push(multipliers, by_joints)
        turn, whole = by_joints[:, 3:], self._displacement[:, 3:]
        square = dot(whole, whole)
        share = numpy.clip(dot(turn, whole) / numpy.where(square > 0, square, 1.0), 0.0, 1.0)
        turn = share[:, None] * whole
        acting = numpy.flatnonzero(turn.any(axis=1))
        velocity[acting, 3:] = turned_by(velocity[acting, 3:], turn[acting])
        return velocity

    def _relax(self):
        rows, laws, velocity = self._velocity_rows, self._velocity_laws, self._start
        value = rows.along(velocity)
        missing = [contact.target - value[contact.first] for contact in self._velocity_contacts]
        violation = max(float((laws.violation(value) * rows.length).max(initial=0.0)), max(missing, default=0.0))
        motion = rows.motion(velocity)
        self._multipliers = numpy.zeros(len(rows))
        if not violation <= EPSILON * motion:
            self._multipliers = self._take(solve(rows, laws, self._velocity_contacts, velocity, self._warm,
                                                 self._iterations, STILLNESS * max(violation, motion), self._host))

    def _bound_energy(self):
        """What joints and contacts do to the island's energy must not be positive; drives and springs may be."""
        bounces = any(contact.target > 0 for contact in self._velocity_contacts)
        if (bounces or self._scene.stop_bounce[self._joints].any()) and self._gain()[0] > 0:
            for contact in self._velocity_contacts:
                contact.target, contact.slides = 0.0, False
            self._drop_bounces(self._velocity_laws, self._velocity_laws.has_lower | self._velocity_laws.has_upper)
            self._relax()
        gain, along = self._gain()
        is_driven = (self._velocity_laws.velocity_only & (self._multipliers != 0)).any()
        if gain > 0 and not self.converged and not is_driven:
            # a share f of all impulses gains f L + f^2 (W - L)
            self._multipliers *= max(0.0, -along / (gain - along))

    def _gain(self):
        """Work of the impulses, zero where it is rounding, and what it would be at the velocities before."""
        velocity = self._start.copy()
        before = self._velocity_rows.along(velocity)
        self._velocity_rows.push(self._multipliers, velocity)
        after = self._velocity_rows.along(velocity)
        acting = numpy.where(self._velocity_laws.velocity_only, 0.0, self._multipliers)
        work = float((0.5 * acting * (before + after)).sum())
        size = float((0.5 * numpy.abs(acting) * (numpy.abs(before) + numpy.abs(after))).sum())
        return (work if work > 1e-13 * size else 0.0), float((acting * before).sum())

    def _store(self):
        scene, count = self._scene, len(self._joints)
        scene.joint_correction[self._joints] = self._corrections[:count]
        scene.contact_correction[self._contacts] = self._corrections[count:]
        scene.joint_impulse[self._joints] = self._multipliers[:count]
        for contact, number in zip(self._velocity_contacts, self._contacts[self._closed]):
            scene.contact_impulse[number] = self._in_world(contact.first, number)
            if contact.turns():
                scene.contact_turning[number] = self._in_world(contact.first + 3, number)

    def _in_world(self, row, contact):
        """Three multipliers from a row on, which are along a contact's normal and tangents."""
        part, frame = self._multipliers[row : row + 3, None], self._scene.frame[contact]
        return (part[0] * frame[0] + part[1] * frame[1]) + part[2] * frame[2]


def arrival_speed(start, trial, way, step):
    """That of two surfaces, or of a stop, after a way at constant acceleration; none where nothing arrives, or rests."""
    gained = trial - start
    square = start * start - 2 * (gained / step) * numpy.maximum(0.0, way)
    speed = numpy.sqrt(numpy.maximum(0.0, square))
    rests = ~(trial < 0) | (speed < 2 * numpy.abs(gained))
    return numpy.where(rests, 0.0, speed)


if __name__ == "__main__":
    main(Islands)
