"""What a plugin's author writes: a class derived from that of its slot.

A request has an attribute per column, named as in schemas/gravitas/stage/v1/: an array of shape (rows, components),
or (rows,) where a row is one number; read-only. A reply takes the same by assignment. Before a method is called, the
lengths of the request's columns have been checked against each other; indices have not: see check_indices().

The answer must depend on the request and the settings alone: same request, same bytes. Raise Refusal for an
impossible request; any other exception is reported as a failure of the plugin.
"""

import numpy

from gravitas.plugin.v1 import description_pb2

from .declaration import NONE, Refusal, Values

# Bits of the `flags` column of bodies.
MOVABLE, KINEMATIC, UNBOUNDED, HAS_SHAPE, CAN_SLEEP = 1, 2, 4, 8, 16
# Bits of the `flags` column of Force.Wrenches.
CONSTANT_WRENCH, HAS_POTENTIAL = 1, 2


class Host:
    """What the worker offers during a call."""

    def mark_progress(self):
        """Says that the plugin is alive and getting on with long work: prolongs the deadline."""
        raise NotImplementedError

    def derivative(self, time, position, orientation, linear_velocity, angular_velocity):
        """Integrators: wrenches of all bodies (rows of six) in a trial state. Let what it raises pass."""
        raise NotImplementedError


class Plugin:
    """The base of the slots' classes."""

    name = ""  # as in `Solver=Name`
    version = ""
    meaning = ""
    capabilities = ()
    types = ()  # forces, joints, shapes; empty where the plugin's name is the type
    properties = ()  # settings of the plugin itself
    theta = 0.0  # integrators: share of a velocity-only impulse's effect that moves the pose within the step
    slot = ""
    methods = {}  # of the slot's service: name of the method that answers

    def __init__(self, settings):
        """`settings` has the values of `properties`, checked. Raise Refusal for those that do not go together."""

    @classmethod
    def slot_number(cls):
        return description_pb2.Slot.Value("SLOT_" + cls.slot.upper())


class Space(Plugin):
    # rays and debug_geometry are asked only of plugins that declare the capability of that name
    slot = "space"
    methods = {"Pairs": "pairs", "Rays": "rays", "DebugGeometry": "debug_geometry"}


class Collision(Plugin):
    # the last three are asked only of plugins that declare the capability of that name
    slot = "collision"
    methods = {
        "Manifolds": "manifolds",
        "TimesOfImpact": "times_of_impact",
        "Rays": "rays",
        "DebugGeometry": "debug_geometry",
    }


class Constraint(Plugin):
    # the last one is asked only of plugins that declare the capability of that name, whose types have coordinates
    slot = "constraint"
    methods = {"Bind": "bind", "Discrepancies": "discrepancies", "Coordinates": "coordinates"}


class Force(Plugin):
    # the last one is asked only of plugins that declare the capability of that name
    slot, methods = "force", {"Wrenches": "wrenches", "Jacobians": "jacobians"}


class Solver(Plugin):
    # the last two are asked only of plugins that declare the capability of that name
    slot = "solver"
    methods = {"Solve": "solve", "Reactions": "reactions", "ReactionJacobians": "reaction_jacobians"}


class Integrator(Plugin):
    slot, methods = "integrator", {"Integrate": "integrate"}
    theta = 0.5


def check_indices(name, indices, count, none_allowed=False):
    """Raises Refusal where an index of a column does not exist."""
    bad = indices >= count
    if none_allowed:
        bad = bad & (indices != NONE)
    if bad.any():
        row = int(numpy.argwhere(bad)[0][0])
        raise Refusal(f"column {name}, row {row}: index {int(indices[bad][0])}, there are {count}")


def check_finite(name, numbers):
    """Raises Refusal where a column has a number that is not finite."""
    if not numpy.isfinite(numbers).all():
        row = int(numpy.argwhere(~numpy.isfinite(numbers))[0][0])
        raise Refusal(f"column {name}, row {row}: not finite")


def forces_of(plugin, request):
    """For authors of forces, force by force: (type, values of its properties, rows of its applications, their bodies)."""
    types = {served.id: served for served in plugin.types}
    begin = request.force_parameter_begin.astype(numpy.int64)
    check_indices("application", request.application[:, 0], len(request.force_type))
    check_indices("application", request.application[:, 1], len(request.mass))
    check_indices("body_shape", request.body_shape, len(request.shape_type), none_allowed=True)
    check_indices("shape_parameter_begin", request.shape_parameter_begin, len(request.shape_parameter) + 1)
    check_indices("force_parameter_begin", begin, len(request.force_parameter) + 1)
    # the rows of force i are order[ends[i] … ends[i + 1])
    order = numpy.argsort(request.application[:, 0], kind="stable")
    ends = numpy.searchsorted(request.application[order, 0], numpy.arange(len(begin)))
    for force, identity in enumerate(request.force_type):
        served = types.get(int(identity))
        if served is None:
            raise Refusal(f"column force_type, row {force}: no type of this plugin")
        if begin[force] > begin[force + 1]:
            raise Refusal(f"column force_parameter_begin, row {force + 1}: smaller than the row before")
        values = Values(served.properties, request.force_parameter[begin[force] : begin[force + 1]])
        rows = order[ends[force] : ends[force + 1]]
        yield served, values, rows, request.application[rows, 1]
