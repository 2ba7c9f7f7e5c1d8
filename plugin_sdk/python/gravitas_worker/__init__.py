"""Gravitas plugins in Python: a worker process of its own that speaks the wire of schemas/WIRE.md.

    from gravitas_worker import Force, Property, Type, forces_of, main

    class Drag(Force):
        name, version, meaning = "Drag", "1.0", "..."
        types = [Type("Drag", "...", [Property.number("LinearCoefficient", "N*s/m", at_least=0.0, required=True)])]

        def wrenches(self, request, reply, host):
            ...

    if __name__ == "__main__":
        main(Drag)
"""

from .declaration import Property, Refusal, Type, Values, type_id
from .plugin import (
    CAN_SLEEP, CONSTANT_WRENCH, HAS_POTENTIAL, HAS_SHAPE, KINEMATIC, MOVABLE, NONE, UNBOUNDED, Collision, Constraint,
    Force, Host, Integrator, Solver, Space, check_finite, check_indices, forces_of)
from .server import main

__all__ = [
    "CAN_SLEEP", "CONSTANT_WRENCH", "HAS_POTENTIAL", "HAS_SHAPE", "KINEMATIC", "MOVABLE", "NONE", "UNBOUNDED",
    "Collision", "Constraint", "Force", "Host", "Integrator", "Property", "Refusal", "Solver", "Space", "Type",
    "Values", "check_finite", "check_indices", "forces_of", "main", "type_id"]
