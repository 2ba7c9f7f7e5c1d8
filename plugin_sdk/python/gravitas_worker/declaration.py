"""What a plugin says about itself, as in plugin_sdk/property.h: typed properties, declared once.

The kernel hands over the values of properties as plain numbers, flattened in the order of declaration: a number,
integer, flag (1 or 0) or choice (its position) takes one, a vector three, a quaternion four (w, x, y, z), a table its
row count followed by its rows. A property that may be absent and is, is NaN (a table: zero rows).
"""

import math

import numpy

from gravitas.plugin.v1 import description_pb2

_KINDS = description_pb2.Property

# Largest deviation of a quaternion's squared norm from 1.
UNIT_TOLERANCE = 1e-9
NONE = 0xFFFFFFFF  # a body that is not one: the world in a joint, no shape of a body


class Refusal(Exception):
    """The request, or a setting, is impossible, and why."""


def type_id(name):
    """Identity of a type's name: FNV-1a, 64 bits."""
    value = 0xCBF29CE484222325
    for byte in name.encode():
        value = (value ^ byte) * 0x100000001B3 & 0xFFFFFFFFFFFFFFFF
    return value


class Property:
    """A property of a type or of the plugin. Make it with the function of its kind:

    Property.number("Radius", "m", above=0.0, required=True, meaning="Radius of the sphere.")
    Property.choice("Frame", ["World", "Body"], default="World", meaning="Axes of the vector.")
    """

    def __init__(self, name, kind, size, *, unit="1", frame="", at_least=-math.inf, above=None, at_most=math.inf,
                 required=False, default=None, live=False, meaning="", choices=(), columns=0):
        self.name, self.size, self.columns = name, size, columns
        if isinstance(default, str):
            if default not in choices:
                allowed = ", ".join(f'"{choice}"' for choice in choices) or "numbers"
                raise ValueError(f'{name}: the default is "{default}"; allowed: {allowed}')
            default = choices.index(default)
        numbers = [] if default is None else [float(x) for x in numpy.atleast_1d(default)]
        self.message = description_pb2.Property(
            name=name, kind=kind, unit=unit, frame=frame, minimum=at_least if above is None else above,
            maximum=at_most, exclusive_minimum=above is not None, required=required, default_numbers=numbers,
            choices=choices, columns=columns, live=live, meaning=meaning)

    @staticmethod
    def number(name, unit, **more):
        return Property(name, _KINDS.KIND_NUMBER, 1, unit=unit, **more)

    @staticmethod
    def integer(name, **more):
        return Property(name, _KINDS.KIND_INTEGER, 1, **more)

    @staticmethod
    def flag(name, **more):
        return Property(name, _KINDS.KIND_FLAG, 1, **more)

    @staticmethod
    def choice(name, choices, **more):
        return Property(name, _KINDS.KIND_CHOICE, 1, choices=choices, **more)

    @staticmethod
    def vector(name, unit, frame, **more):
        return Property(name, _KINDS.KIND_VECTOR, 3, unit=unit, frame=frame, **more)

    @staticmethod
    def quaternion(name, frame, **more):
        return Property(name, _KINDS.KIND_QUATERNION, 4, frame=frame, **more)

    @staticmethod
    def table(name, columns, unit, frame, **more):
        return Property(name, _KINDS.KIND_TABLE, 1, columns=columns, unit=unit, frame=frame, **more)

    @staticmethod
    def body(name, **more):
        return Property(name, _KINDS.KIND_BODY, 1, **more)

    def read(self, numbers):
        """The value at the front of flattened numbers, and how many it takes. Raises Refusal."""
        if len(numbers) < self.size:
            raise Refusal(f"{self.name}: {len(numbers)} numbers are left where {self.size} belong")
        kind = self.message.kind
        if kind == _KINDS.KIND_TABLE:
            return self._read_table(numbers)
        value = numpy.array(numbers[: self.size], float)
        if numpy.isnan(value).any():
            may_be_absent = not self.message.required and not self.message.default_numbers
            if may_be_absent and numpy.isnan(value).all():
                return None, self.size
            raise Refusal(f"{self.name} is not a number")
        self._check_bounds(value)
        if kind == _KINDS.KIND_QUATERNION and not abs(sum(x * x for x in value.tolist()) - 1.0) <= UNIT_TOLERANCE:
            raise Refusal(f"{self.name} is no unit quaternion")
        if kind in (_KINDS.KIND_VECTOR, _KINDS.KIND_QUATERNION):
            return value, self.size
        number = float(value[0])
        if kind == _KINDS.KIND_NUMBER:
            return number, 1
        largest = {_KINDS.KIND_FLAG: 1, _KINDS.KIND_CHOICE: len(self.message.choices) - 1,
                   _KINDS.KIND_BODY: NONE - 1}.get(kind)
        if not number.is_integer() or (largest is not None and not 0 <= number <= largest):
            allowed = "a whole number" if largest is None else f"a whole number from 0 to {largest}"
            raise Refusal(f"{self.name} is {number:g}; allowed: {allowed}")
        return (bool(number) if kind == _KINDS.KIND_FLAG else int(number)), 1

    def _read_table(self, numbers):
        count = float(numbers[0])
        if not (count.is_integer() and count >= 0) or len(numbers) - 1 < count * self.columns:
            raise Refusal(f"{self.name} has {count:g} rows; {len(numbers) - 1} numbers are left for them")
        size = int(count) * self.columns
        rows = numpy.array(numbers[1 : 1 + size], float).reshape(-1, self.columns)
        if not numpy.isfinite(rows).all():
            raise Refusal(f"{self.name} has a number that is not finite")
        self._check_bounds(rows)
        return rows, 1 + size

    def _check_bounds(self, value):
        low, high = self.message.minimum, self.message.maximum
        below = value <= low if self.message.exclusive_minimum else value < low
        if not numpy.isfinite(value).all() or below.any() or (value > high).any():
            sign = "above" if self.message.exclusive_minimum else "at least"
            raise Refusal(f"{self.name} is out of range; allowed: finite, {sign} {low:g}, at most {high:g}")


class Type:
    """A name of the scene language that the plugin serves, such as a force type.

    `coordinates` of a joint type: (name, unit, meaning) of each, as Constraint.Coordinates counts them.
    """

    def __init__(self, name, meaning, properties, coordinates=()):
        self.name, self.meaning, self.properties = name, meaning, list(properties)
        self.coordinates = list(coordinates)
        self.id = type_id(name)


class Values:
    """Values of properties by name: `values.Iterations`, or None where it is absent."""

    def __init__(self, properties, numbers):
        at = 0
        for item in properties:
            value, taken = item.read(numbers[at:])
            setattr(self, item.name, value)
            at += taken
        if at != len(numbers):
            raise Refusal(f"{len(numbers)} numbers where {at} belong")


def description_of(plugin, build_id):
    """The message that describes a plugin's class."""
    message = description_pb2.Description(
        name=plugin.name, version=plugin.version, slot=plugin.slot_number(), meaning=plugin.meaning,
        capabilities=plugin.capabilities, theta=plugin.theta, build_id=build_id)
    message.properties.extend(item.message for item in plugin.properties)
    for served in plugin.types:
        written = message.types.add(name=served.name, meaning=served.meaning)
        written.properties.extend(item.message for item in served.properties)
        for coordinate in served.coordinates:
            written.coordinates.add(**dict(zip(("name", "unit", "meaning"), coordinate)))
    return message
