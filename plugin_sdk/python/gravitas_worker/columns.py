"""Stage messages as numpy columns: read from and written to protobuf bytes directly.

A generated class would hold each number as a Python object; a message of 1000 bodies has 20,000 of them. What a
message consists of still comes from the generated descriptors, so the .proto files are the one place where a column
is declared.

    layout = stage_methods("force")["Wrenches"].request
    message = layout.parse(data)          # raises WireError
    message.columns["position"]           # array of shape (rows, 3), read-only, a view into `data`
    layout.serialize({"position": p})     # bytes
"""

import importlib

import numpy

from gravitas.options.v1 import options_pb2

# Fields beside the columns (call.proto).
HEADER, DERIVATIVE, ASSET = 101, 102, 103
# Numbers of a column beyond this are refused: no honest message is that long.
MOST_ELEMENTS = 1 << 28

_VARINT, _FIXED64, _LENGTH, _START_GROUP, _END_GROUP, _FIXED32 = 0, 1, 2, 3, 4, 5
_DTYPES = {1: numpy.dtype("<f8"), 13: numpy.dtype("<u4"), 4: numpy.dtype("<u8")}  # FieldDescriptor.TYPE_*


class WireError(ValueError):
    """Bytes that are no message."""


class Column:
    """What a message's declaration says about one of its columns."""

    def __init__(self, field):
        options = field.GetOptions()
        self.name = field.name
        self.number = field.number
        self.dtype = _DTYPES[field.type]
        self.is_value = field.label != field.LABEL_REPEATED
        self.components = max(1, options.Extensions[options_pb2.components])
        self.unit = options.Extensions[options_pb2.unit]
        # "force+1" has one row more than there are forces
        word, _, extra = options.Extensions[options_pb2.rows].partition("+")
        self.rows, self.extra_rows = word, int(extra or 0)
        self.is_asset = options.Extensions[options_pb2.asset]
        wire_type = _LENGTH if not self.is_value else _FIXED64 if self.dtype.kind == "f" else _VARINT
        self.tag = _varint(self.number << 3 | wire_type)

    def shaped(self, numbers):
        if self.is_value:
            return numbers[0].item()
        if self.components == 1:
            return numbers
        return numbers.reshape(-1, self.components)

    def taken(self, value):
        """A plugin's value as numbers of the column. Raises ValueError where that would make others of them, or other rows."""
        given = numpy.asarray(value)
        if given.dtype.kind not in "biuf":
            raise ValueError(f"column {self.name} has values of type {given.dtype}, not real numbers")
        with numpy.errstate(all="ignore"):
            numbers = given.astype(self.dtype, copy=False)
        if self.dtype.kind == "u":
            whole = (given >= 0) & (numbers == given)
            if given.dtype.kind == "f":
                whole &= given < 2.0 ** (8 * self.dtype.itemsize)  # beyond, machines differ
            if not whole.all():
                bad = given[~whole].flat[0]
                raise ValueError(f"column {self.name} has {bad}, not a whole number of {8 * self.dtype.itemsize} bits")
        if self.is_value and numbers.size != 1:
            raise ValueError(f"{self.name} was left without a value")
        if numbers.ndim > 1 and numbers.size != 0 and numbers.size != len(numbers) * self.components:
            raise ValueError(f"column {self.name} has the shape {numbers.shape}, not {self.components} numbers a row")
        return numbers


class Message:
    """What one message holds. `columns` has every column, the empty ones too."""

    def __init__(self):
        self.columns = {}
        self.header = self.derivative = self.asset = None  # bytes where the field was there


class Layout:
    """The columns of one message type."""

    def __init__(self, descriptor):
        self.name = descriptor.name
        self.columns = [Column(field) for field in descriptor.fields if field.message_type is None]
        self._by_number = {column.number: column for column in self.columns}
        self._by_name = {column.name: column for column in self.columns}

    def __getitem__(self, name):
        return self._by_name[name]

    def parse(self, data):
        """Whatever a protobuf parser accepts: fields in any order, packed or not, in several parts, unknown ones."""
        message = Message()
        parts = {}
        at = 0
        while at < len(data):
            tag, at = _read_varint(data, at)
            number, wire_type = tag >> 3, tag & 7
            if number == 0 or tag >= 1 << 32:
                raise WireError("a field without a number")
            start, at = _skip(data, at, number, wire_type)
            column = self._by_number.get(number)
            if column is not None:
                parts.setdefault(number, []).append(_elements(column, wire_type, data, start, at))
            elif number in (HEADER, DERIVATIVE, ASSET):
                if wire_type != _LENGTH:
                    raise WireError(f"field {number} has another type")
                name = {HEADER: "header", DERIVATIVE: "derivative", ASSET: "asset"}[number]
                setattr(message, name, data[start:at])
        for column in self.columns:
            message.columns[column.name] = self._joined(column, parts.get(column.number, ()))
        return message

    def serialize(self, columns=None, header=None, derivative=None):
        """Bytes of the columns that are given, of a header and of a derivative's message (bytes both)."""
        out = []
        for column in self.columns if columns else ():
            if column.name in columns:
                out += _written(column, columns[column.name])
        for number, part in ((HEADER, header), (DERIVATIVE, derivative)):
            if part is not None:
                out += (_varint(number << 3 | _LENGTH), _varint(len(part)), part)
        return b"".join(out)

    @staticmethod
    def _joined(column, parts):
        if column.is_value:
            # the last one counts
            return column.shaped(parts[-1][-1:]) if parts else column.dtype.type(0).item()
        numbers = parts[0] if len(parts) == 1 else numpy.concatenate(parts) if parts else numpy.empty(0, column.dtype)
        if len(numbers) > MOST_ELEMENTS:
            raise WireError(f"column {column.name} is longer than any message may be")
        # numbers that are no whole rows stay as they are: check_rows says so
        return column.shaped(numbers) if len(numbers) % column.components == 0 else numbers


def check_rows(layout, columns, rows):
    """What is wrong with the lengths of the columns, or nothing. `rows` collects the number of rows of each word."""
    for column in layout.columns:
        if column.is_value:
            continue
        numbers = columns[column.name]
        found = numbers.size // column.components - column.extra_rows
        if numbers.size % column.components != 0 or found < 0:
            return f"column {column.name} has {numbers.size} elements, not a whole number of rows"
        expected = rows.setdefault(column.rows, found)
        if found != expected:
            extra = column.extra_rows
            return f"column {column.name} has {found + extra} rows, expected {expected + extra} (one per {column.rows})"
    return ""


class StageMethod:
    """A question of a slot: its gRPC path and the layouts of its messages."""

    def __init__(self, service, method):
        self.path = f"/{service.full_name}/{method.name}"
        self.name = method.name
        self.request = Layout(method.input_type)
        self.reply = Layout(method.output_type)


def stage_methods(slot):
    """The methods of a slot's service, by their names."""
    module = importlib.import_module(f"gravitas.stage.v1.{slot}_pb2")
    (service,) = module.DESCRIPTOR.services_by_name.values()
    return {method.name: StageMethod(service, method) for method in service.methods}


# ---- the encoding


def _varint(value):
    out = bytearray()
    while value >= 0x80:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def _read_varint(data, at):
    value = shift = 0
    while at < len(data) and shift < 70:
        byte = data[at]
        at += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, at
        shift += 7
    raise WireError("the message is broken off")


def _skip(data, at, number, wire_type):
    """Where the content of a field starts and ends."""
    start = at
    if wire_type == _VARINT:
        _, at = _read_varint(data, at)
    elif wire_type == _FIXED64:
        at += 8
    elif wire_type == _FIXED32:
        at += 4
    elif wire_type == _LENGTH:
        size, start = _read_varint(data, at)
        at = start + size
    elif wire_type == _START_GROUP:
        at = _skip_group(data, at, number)
    else:
        raise WireError(f"field {number} has a wire type that does not exist")
    if at > len(data):
        raise WireError(f"field {number} is broken off")
    return start, at


def _skip_group(data, at, number):
    """Groups are unknown fields here; without recursion, so that no depth can hurt."""
    open_groups = [number]
    while open_groups:
        tag, at = _read_varint(data, at)
        inner, wire_type = tag >> 3, tag & 7
        if wire_type == _START_GROUP:
            open_groups.append(inner)
        elif wire_type == _END_GROUP:
            if open_groups.pop() != inner:
                raise WireError("a group ends that did not begin")
        else:
            _, at = _skip(data, at, inner, wire_type)
    return at


def _elements(column, wire_type, data, start, end):
    """A run of elements, packed, or one element on its own."""
    is_real = column.dtype.kind == "f"
    if wire_type not in (_FIXED64 if is_real else _VARINT, None if column.is_value else _LENGTH):
        raise WireError(f"column {column.name} has another type")
    if is_real:
        if (end - start) % 8 != 0:
            raise WireError(f"column {column.name} ends within an element")
        return numpy.frombuffer(data, column.dtype, (end - start) // 8, start)
    return _decoded_varints(column, numpy.frombuffer(data, numpy.uint8, end - start, start))


def _decoded_varints(column, data):
    last = numpy.flatnonzero(data < 0x80)
    if len(last) == len(data):
        return data.astype(column.dtype)
    if len(last) == 0 or last[-1] != len(data) - 1:
        raise WireError(f"column {column.name} ends within an element")
    first = numpy.concatenate(([0], last[:-1] + 1))
    length = last - first + 1
    # of a tenth byte one bit is left
    if length.max() > 10 or (data[last[length == 10]] > 1).any():
        raise WireError(f"column {column.name} has an element of more than 64 bits")
    shift = 7 * (numpy.arange(len(data)) - numpy.repeat(first, length))
    bits = (data & 0x7F).astype(numpy.uint64) << shift.astype(numpy.uint64)
    values = numpy.bitwise_or.reduceat(bits, first)
    if column.dtype.itemsize == 4 and (values >> numpy.uint64(32)).any():
        raise WireError(f"column {column.name} has an element of more than 32 bits")
    return values.astype(column.dtype)


def _encoded_varints(numbers):
    if len(numbers) == 0 or numbers.max() < 0x80:
        return numbers.astype(numpy.uint8).tobytes()
    numbers = numbers.astype(numpy.uint64)
    length = numpy.ones(len(numbers), numpy.intp)
    for byte in range(1, 10):
        length += numbers >= numpy.uint64(1 << 7 * byte)
    first = numpy.cumsum(length) - length
    place = numpy.arange(length.sum()) - numpy.repeat(first, length)
    out = (numpy.repeat(numbers, length) >> (7 * place).astype(numpy.uint64)).astype(numpy.uint8) & 0x7F
    out[place < numpy.repeat(length, length) - 1] |= 0x80
    return out.tobytes()


def _written(column, value):
    """As protobuf writes it: no field for a value of zero bits or an empty column."""
    numbers = numpy.ascontiguousarray(value, column.dtype).reshape(-1)
    if len(numbers) == 0:
        return ()
    payload = numbers.tobytes() if column.dtype.kind == "f" else _encoded_varints(numbers)
    if not column.is_value:
        return (column.tag, _varint(len(payload)), payload)
    return (column.tag, payload) if any(numbers.tobytes()) else ()
