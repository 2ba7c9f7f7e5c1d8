"""The Python SDK: its columns against protobuf and the golden messages, declared properties, and a worker that is
asked over a socket."""

import contextlib
import os
import pathlib
import queue
import random
import sys
import tempfile
import unittest
from concurrent import futures

import grpc
import numpy
from google.protobuf import text_format
from gravitas.control.v1 import control_pb2
from gravitas.stage.v1 import (
    call_pb2, collision_pb2, constraint_pb2, force_pb2, integrator_pb2, solver_pb2, space_pb2)
from gravitas_worker import Force, Integrator, Property, Refusal, Type, forces_of, type_id
from gravitas_worker.columns import Layout, WireError, stage_methods
from gravitas_worker.declaration import Values
from gravitas_worker.server import MAGIC, SCHEMA_HASH, Worker
from surface import philox4x32

GOLDEN = pathlib.Path(__file__).parents[2] / "schemas" / "golden"
MODULES = (collision_pb2, constraint_pb2, force_pb2, integrator_pb2, solver_pb2, space_pb2)
TYPES = {"gravitas.stage.v1." + name: getattr(module, name)
         for module in MODULES for name in module.DESCRIPTOR.message_types_by_name}


def golden_messages():
    """(name, class of the generated message, text, bytes)"""
    for path in sorted(GOLDEN.glob("*.txt")):
        text = path.read_text()
        name = text.partition("proto-message: ")[2].split()[0]
        kind = TYPES.get(name) or getattr(control_pb2, name.rpartition(".")[2])
        yield path.stem, kind, text, bytes.fromhex(path.with_suffix(".hex").read_text())


def random_message(kind, draw):
    message = kind()
    for field in kind.DESCRIPTOR.fields:
        if field.message_type is not None:
            continue
        if field.type == field.TYPE_DOUBLE:
            one = lambda: draw.choice([0.0, -0.0, 1.5, 1e300, float("inf"), draw.random()])
        else:
            bits = 32 if field.type == field.TYPE_UINT32 else 64
            one = lambda: draw.getrandbits(bits) >> draw.randrange(bits)
        if field.label == field.LABEL_REPEATED:
            components = max(1, Layout(kind.DESCRIPTOR)[field.name].components)
            getattr(message, field.name).extend(one() for _ in range(draw.randrange(4) * components))
        else:
            setattr(message, field.name, one())
    return message


@contextlib.contextmanager
def no_stacks():
    """What a plugin's failure writes goes nowhere."""
    with open(os.devnull, "w") as nowhere, contextlib.redirect_stderr(nowhere):
        yield


class Columns(unittest.TestCase):
    def test_golden_messages_are_the_bytes_of_their_texts(self):
        names = []
        for name, kind, text, data in golden_messages():
            self.assertEqual(text_format.Parse(text, kind()).SerializeToString(), data, name)
            names.append(name)
        self.assertIn("force_wrenches_request", names)

    def test_golden_messages_are_read_and_written_byte_for_byte(self):
        for name, kind, _, data in golden_messages():
            if kind.DESCRIPTOR.full_name not in TYPES or name.startswith("asset_"):
                continue
            layout = Layout(kind.DESCRIPTOR)
            message = layout.parse(data)
            self.assertEqual(layout.serialize(message.columns, message.header, message.derivative), data, name)

    def test_the_columns_of_a_golden_message(self):
        (data,) = [data for name, _, _, data in golden_messages() if name == "force_wrenches_request"]
        columns = stage_methods("force")["Wrenches"].request.parse(data).columns
        self.assertEqual(columns["time"], 0.25)
        self.assertEqual(columns["force_type"].tolist(), [type_id("Drag")])
        self.assertEqual(columns["application"].tolist(), [[0, 1]])
        self.assertEqual(columns["linear_velocity"].tolist(), [[0, 0, 0], [3, 4, 0]])

    def test_every_message_is_read_and_written_as_protobuf_does(self):
        draw = random.Random(1)
        for kind in TYPES.values():
            layout = Layout(kind.DESCRIPTOR)
            for _ in range(20):
                data = random_message(kind, draw).SerializeToString()
                self.assertEqual(layout.serialize(layout.parse(data).columns), data, kind.DESCRIPTOR.name)

    def test_columns_in_parts_unpacked_and_among_unknown_fields(self):
        # field 4 packed, then unpacked, then packed; field 77 a varint; field 81 a group; field 5 unpacked
        one, two = numpy.array([1.0]).tobytes(), numpy.array([2.0]).tobytes()
        data = (b"\x22\x08" + one + b"\xe8\x04\x96\x01" + b"\x21" + two + b"\x8b\x05\x08\x01\x8c\x05" + b"\x22\x08"
                + one + b"\x28\xac\x02\x28\x05")
        columns = stage_methods("force")["Wrenches"].request.parse(data).columns
        self.assertEqual(columns["force_parameter"].tolist(), [1, 2, 1])
        self.assertEqual(columns["application"].tolist(), [[300, 5]])

    def test_what_a_plugin_gives_is_taken_as_it_is_or_not_at_all(self):
        flags, wrench = (stage_methods("force")["Wrenches"].reply[name] for name in ("flags", "wrench"))
        most = 2**32 - 1
        for given in ([0, most], [1.0, 2.0], numpy.array([3], numpy.int64), (), numpy.zeros((0, 1)), [[1], [2]]):
            self.assertEqual(flags.taken(given).tolist(), numpy.array(given, numpy.uint64).tolist())
        for given, told in ((numpy.array([0, -1]), "-1"), ([1.9], "1.9"), ([numpy.nan], "nan"), ([most + 1], most + 1),
                            ([numpy.inf], "inf"), ([2.0**64], "1.8446744073709552e\\+19"), (-3, "-3")):
            with self.assertRaisesRegex(ValueError, f"column flags has {told}, not a whole number of 32 bits"):
                flags.taken(given)
        key = stage_methods("collision")["Manifolds"].request["shape_hash"]
        self.assertEqual(key.taken(numpy.array([2**64 - 1], numpy.uint64)).tolist(), [2**64 - 1])
        for given in ([-1], [2.0**64]):
            with self.assertRaisesRegex(ValueError, "not a whole number of 64 bits"):
                key.taken(given)
        for given in ([2**64], [None], [1j], ["5"]):
            for column in (flags, wrench):
                with self.assertRaisesRegex(ValueError, f"column {column.name} has values of type .*, not real numbers"):
                    column.taken(given)
        rows = numpy.arange(18.0).reshape(3, 6)
        for given in (rows, rows.reshape(-1), rows.reshape(3, 2, 3), rows.tolist()):
            self.assertEqual(wrench.taken(given).reshape(-1).tolist(), rows.reshape(-1).tolist())
        for given in (rows.T, rows.reshape(1, 18), rows.reshape(9, 2)):
            with self.assertRaisesRegex(ValueError, "column wrench has the shape .*, not 6 numbers a row"):
                wrench.taken(given)

    def test_what_is_no_message_is_refused_with_the_reason(self):
        layout = stage_methods("force")["Wrenches"].request
        for data, reason in (
                (b"\xff", "broken off"), (b"\x22\x04\0\0\0\0", "force_parameter ends within an element"),
                (b"\x22\x7f", "field 4 is broken off"), (b"\x1a\x05\xff\xff\xff\xff\x1f", "more than 32 bits"),
                (b"\x12\x0a" + 9 * b"\xff" + b"\x02", "more than 64 bits"), (b"\x12\x02\x80\x80", "ends within"),
                (b"\x20\x01", "force_parameter has another type"), (b"\xa8\x06\x01", "field 101 has another type")):
            with self.assertRaisesRegex(WireError, reason):
                layout.parse(data)

    def test_changed_golden_messages_are_read_or_refused(self):
        layouts = [Layout(kind.DESCRIPTOR) for kind in TYPES.values()]
        outcomes = {True: 0, False: 0}
        for _, _, _, data in golden_messages():
            changed = [data[:size] for size in range(0, len(data), 3)]
            for at in range(0, len(data), 5):
                changed += [data[:at] + bytes([value]) + data[at + 1 :] for value in (0, 0x7F, 0xFF)]
            for number, text in enumerate(changed):
                layout = layouts[number % len(layouts)]
                try:
                    layout.parse(text)
                    outcomes[True] += 1
                except WireError:
                    outcomes[False] += 1
        self.assertTrue(outcomes[True] and outcomes[False], outcomes)


class Declarations(unittest.TestCase):
    PROPERTIES = [
        Property.number("Radius", "m", above=0.0, required=True), Property.integer("Count", at_most=9, default=3),
        Property.flag("On", default=0), Property.choice("Frame", ["World", "Body"], default="Body"),
        Property.vector("Axis", "1", "world"), Property.table("Table", 2, "s", "world")]

    def test_values_are_read_in_the_order_of_declaration(self):
        values = Values(self.PROPERTIES, numpy.array([0.5, 4, 1, 1, 0, 1, 0, 2, 1, 2, 3, 4.0]))
        self.assertEqual((values.Radius, values.Count, values.On, values.Frame), (0.5, 4, True, 1))
        self.assertEqual(values.Axis.tolist(), [0, 1, 0])
        self.assertEqual(values.Table.tolist(), [[1, 2], [3, 4]])
        nan = float("nan")
        absent = Values(self.PROPERTIES, numpy.array([0.5, 4, 1, 1, nan, nan, nan, 0.0]))
        self.assertIsNone(absent.Axis)
        self.assertEqual(absent.Table.shape, (0, 2))

    def test_impossible_values_are_refused_by_name(self):
        good = [0.5, 4, 1, 1, 0, 1, 0, 0]
        nan = float("nan")
        for place, value, name in ((0, 0.0, "Radius"), (0, nan, "Radius"), (0, float("inf"), "Radius"),
                                   (1, 4.5, "Count"), (1, 10, "Count"), (2, 2, "On"), (3, 2, "Frame"), (3, -1, "Frame"),
                                   (4, nan, "Axis"), (7, 1, "Table"), (7, -1, "Table"), (7, nan, "Table")):
            numbers = list(good)
            numbers[place] = value
            with self.assertRaisesRegex(Refusal, name):
                Values(self.PROPERTIES, numpy.array(numbers))
        for numbers in (good[:-1], good + [1.0], []):
            with self.assertRaises(Refusal):
                Values(self.PROPERTIES, numpy.array(numbers))

    def test_turns_are_unit_and_bodies_have_rows(self):
        properties = [Property.quaternion("Turn", "world"), Property.body("Carrier")]
        nan = float("nan")
        values = Values(properties, numpy.array([0.6, 0, 0.8, 0, 7]))
        self.assertEqual((values.Turn.tolist(), values.Carrier), ([0.6, 0, 0.8, 0], 7))
        absent = Values(properties, numpy.full(5, nan))
        self.assertEqual((absent.Turn, absent.Carrier), (None, None))
        for numbers, name in (([2, 0, 0, 0, 0], "Turn"), ([0, 0, 0, 0, 0], "Turn"), ([1e200, 0, 0, 0, 0], "Turn"),
                              ([1, 0, 0, 0, -1], "Carrier"), ([1, 0, 0, 0, 0.5], "Carrier"),
                              ([1, 0, 0, 0, 0xFFFFFFFF], "Carrier")):
            with self.assertRaisesRegex(Refusal, name):
                Values(properties, numpy.array(numbers, float))

    def test_the_default_of_a_choice_is_named_as_in_scenes(self):
        self.assertEqual(self.PROPERTIES[3].message.default_numbers, [1])
        with self.assertRaisesRegex(ValueError, 'Frame: the default is "Wall"; allowed: "World", "Body"'):
            Property.choice("Frame", ["World", "Body"], default="Wall")
        with self.assertRaisesRegex(ValueError, 'Count: the default is "many"; allowed: numbers'):
            Property.integer("Count", default="many")

    def test_type_ids_are_fnv_1a(self):
        self.assertEqual(type_id(""), 0xCBF29CE484222325)
        self.assertEqual(type_id("a"), 0xAF63DC4C8601EC8C)


class Surfaces(unittest.TestCase):
    def test_the_generator_gives_the_published_numbers(self):
        # known answers of the Random123 distribution
        zero = philox4x32(numpy.zeros((1, 4), numpy.uint64), numpy.zeros(2, numpy.uint64))
        self.assertEqual([hex(x) for x in zero[0]], ["0x6627e8d5", "0xe169c58d", "0xbc57ac4c", "0x9b00dbd8"])
        ones = numpy.full(4, 0xFFFFFFFF, numpy.uint64)
        full = philox4x32(ones[None], ones[:2])
        self.assertEqual([hex(x) for x in full[0]], ["0x408f276d", "0x41c83b0e", "0xa20bc7c6", "0x6d5451fd"])


class Midpoint(Integrator):
    """Asks twice, marks its progress, and refuses or fails where the time says so."""

    name, version = "Midpoint", "1"
    properties = [Property.number("Share", "1", at_least=0.0, at_most=1.0, default=0.5)]

    def __init__(self, settings):
        self._share = settings.Share
        if settings.Share == 0.25:
            sys.exit("no quarters")

    def integrate(self, request, reply, host):
        if request.time == 1.0:
            raise Refusal("not at one")
        if request.time == 2.0:
            raise ValueError("broken at two")
        if request.time == 6.0:
            raise Refusal("no file pl\udcfcgin")  # as os.fsdecode() gives names that are no UTF-8
        if request.time == 5.0:
            sys.exit(6)
        if request.time == 9.0:
            reply.orientaton = request.orientation
        if request.time == 4.0:
            host._last_mark -= 1.0  # as if the last mark had been a second ago
            host.mark_progress()
        state = (request.position, request.orientation, request.linear_velocity, request.angular_velocity)
        first = host.derivative(request.time, *state)
        second = host.derivative(request.time + self._share * request.time_step, *state)
        reply.position, reply.orientation = request.position + first[:, :3], request.orientation
        reply.linear_velocity, reply.angular_velocity = second[:, :3], request.angular_velocity
        reply.error_estimate = 0.25
        reply.plugin_state = request.plugin_state
        if request.time == 3.0:
            reply.position = numpy.zeros((5, 3))
        if request.time == 7.0:
            reply.position = first[:, :3].T
        if request.time == 8.0:
            host.derivative(8.0, request.position.T, *state[1:])


class Stream:
    """A client's end of a stream."""

    def __init__(self, channel, path):
        self._requests = queue.SimpleQueue()
        self._replies = channel.stream_stream(path)(iter(self._requests.get, None))

    def send(self, data):
        self._requests.put(data if isinstance(data, bytes) else data.SerializeToString())
        return next(self._replies)

    def next(self):
        return next(self._replies)

    def close(self):
        self._requests.put(None)


class Talk(unittest.TestCase):
    EPOCH = 7

    def setUp(self):
        self._folder = tempfile.TemporaryDirectory()
        address = f"unix:{self._folder.name}/worker"
        self._server = grpc.server(futures.ThreadPoolExecutor(8), handlers=[Worker(Midpoint)])
        self._server.add_insecure_port(address)
        self._server.start()
        self.channel = grpc.insecure_channel(address)

    def tearDown(self):
        self.channel.close()
        self._server.stop(None).wait()
        self._folder.cleanup()

    def hello(self, **changes):
        fields = dict(magic=MAGIC, protocol_minimum=2, protocol_maximum=2, schema_hash=SCHEMA_HASH, epoch=self.EPOCH,
                      nonce=5, plugins=[control_pb2.PluginSettings(plugin="Midpoint", numbers=[0.5])])
        fields.update(changes)
        stream = Stream(self.channel, "/gravitas.control.v1.WorkerControl/Session")
        answer = control_pb2.WorkerMessage.FromString(
            stream.send(control_pb2.KernelMessage(hello=control_pb2.Hello(**fields))))
        return stream, answer

    def ready(self):
        stream, answer = self.hello()
        self.assertTrue(answer.HasField("welcome"), answer)
        self.assertFalse(answer.welcome.HasField("floating_point"))
        self.assertEqual((answer.welcome.epoch, answer.welcome.nonce), (self.EPOCH, 5))
        self.assertTrue(control_pb2.WorkerMessage.FromString(stream.next()).HasField("ready"))
        return stream, Stream(self.channel, "/gravitas.stage.v1.Integrator/Integrate")

    def request(self, time=0.0, sequence=1, epoch=EPOCH, bodies=2):
        return integrator_pb2.IntegratorIntegrateRequest(
            time=time, time_step=0.5, flags=[9] * bodies, inverse_mass=[1.0] * bodies, inertia=[1.0] * 3 * bodies,
            inverse_inertia=[1.0] * 3 * bodies, damping=[0.0] * bodies, wrench=[0.0] * 6 * bodies,
            position=[0.0] * 3 * bodies, orientation=[1.0, 0, 0, 0] * bodies, linear_velocity=[0.0] * 3 * bodies,
            angular_velocity=[0.0] * 3 * bodies, state_changed=[0] * bodies,
            call=call_pb2.Call(epoch=epoch, sequence=sequence))

    def reply(self, data):
        return integrator_pb2.IntegratorIntegrateReply.FromString(data)

    def answer(self, numbers):
        derivative = integrator_pb2.IntegratorDerivativeReply(wrench=numbers)
        return integrator_pb2.IntegratorIntegrateRequest(call=call_pb2.Call(epoch=self.EPOCH), derivative=derivative)

    def test_greetings_that_are_not_for_this_worker_are_refused(self):
        other = [control_pb2.PluginSettings(plugin="Other")]
        wrong = [control_pb2.PluginSettings(plugin="Midpoint", numbers=[1.5])]
        for reason, changes in (("MAGIC", {"magic": 1}), ("PROTOCOL", {"protocol_minimum": 3, "protocol_maximum": 4}),
                                ("SCHEMA", {"schema_hash": 1}), ("LIBRARY", {"plugins": other}),
                                ("SETTINGS", {"plugins": []}), ("SETTINGS", {"plugins": wrong})):
            _, answer = self.hello(**changes)
            self.assertEqual(control_pb2.Refusal.Reason.Name(answer.refusal.reason), "REASON_" + reason)
            self.assertTrue(answer.refusal.text)
        self.ready()

    def test_a_plugin_that_cannot_be_made_says_why(self):
        with no_stacks():
            _, answer = self.hello(plugins=[control_pb2.PluginSettings(plugin="Midpoint", numbers=[0.25])])
        self.assertTrue(answer.HasField("refusal"), answer)
        self.assertRegex(answer.refusal.text, r"Midpoint: it cannot be made: SystemExit: no quarters \(.*sdk_test\.py:\d+\)")

    def test_a_second_kernel_is_turned_away_and_a_later_one_is_served(self):
        control, _ = self.ready()
        with self.assertRaises(grpc.RpcError) as refused:
            self.hello()
        self.assertEqual(refused.exception.code(), grpc.StatusCode.ALREADY_EXISTS)
        with self.assertRaises(StopIteration):
            control.send(control_pb2.KernelMessage(drain=control_pb2.Drain()))
        self.ready()

    def test_a_ping_is_answered(self):
        control, _ = self.ready()
        pong = control_pb2.WorkerMessage.FromString(
            control.send(control_pb2.KernelMessage(ping=control_pb2.Ping(sequence=4))))
        self.assertEqual(pong.pong.sequence, 4)

    def test_derivatives_are_asked_for_and_used(self):
        _, stream = self.ready()
        first = self.reply(stream.send(self.request(sequence=9)))
        self.assertEqual((first.outcome.epoch, first.outcome.sequence, first.derivative.time), (self.EPOCH, 9, 0.0))
        second = self.reply(stream.send(self.answer([1.0] * 12)))
        self.assertEqual(second.derivative.time, 0.25)
        end = self.reply(stream.send(self.answer([2.0] * 12)))
        self.assertEqual(end.outcome.status, call_pb2.Outcome.STATUS_OK, end.outcome)
        self.assertEqual(list(end.position), [1.0] * 6)
        self.assertEqual(list(end.linear_velocity), [2.0] * 6)
        self.assertEqual(end.error_estimate, 0.25)

    def test_a_reason_that_no_message_takes_is_told_with_question_marks(self):
        _, stream = self.ready()
        outcome = self.reply(stream.send(self.request(time=6.0))).outcome
        self.assertEqual((outcome.status, outcome.text), (call_pb2.Outcome.STATUS_REFUSED, "no file pl?gin"))

    def test_a_derivative_that_cannot_be_had_ends_the_call(self):
        _, stream = self.ready()
        for bad in (b"\xff", b"", self.answer([1.0])):
            stream.send(self.request())
            self.assertEqual(self.reply(stream.send(bad)).outcome.status, call_pb2.Outcome.STATUS_CALLBACK_FAILED)

    def test_progress_is_marked_before_the_reply(self):
        _, stream = self.ready()
        mark = self.reply(stream.send(self.request(time=4.0)))
        self.assertEqual((mark.outcome.marks, mark.outcome.sequence), (1, 1))
        self.assertTrue(self.reply(stream.next()).HasField("derivative"))

    def test_what_others_failed_at_is_said_to_be_taken(self):
        _, stream = self.ready()
        asked = self.request()
        asked.call.attempt = 1
        taken = self.reply(stream.send(asked))
        self.assertEqual((taken.outcome.marks, taken.outcome.sequence), (1, 1))
        self.assertTrue(self.reply(stream.next()).HasField("derivative"))

    def test_what_is_impossible_is_refused_and_what_is_broken_fails_and_the_worker_lives(self):
        _, stream = self.ready()
        uneven = self.request()
        uneven.damping.append(1.0)
        foreign = self.request(epoch=3)
        no_call = self.request()
        no_call.ClearField("call")
        target = self.request()
        target.call.target = 1
        for asked, status, text in (
                (self.request(time=1.0), "REFUSED", "not at one"), (uneven, "REFUSED", "column damping has 3 rows"),
                (foreign, "FAILED", "another incarnation"), (no_call, "FAILED", "without a call"),
                (target, "FAILED", "no such plugin"), (b"\xff\xff", "FAILED", "broken off"), (b"", "FAILED", "call")):
            outcome = self.reply(stream.send(asked)).outcome
            self.assertEqual(call_pb2.Outcome.Status.Name(outcome.status), "STATUS_" + status)
            self.assertIn(text, outcome.text)
        stream.send(self.request())
        stream.send(self.answer([1.0] * 12))
        self.assertEqual(self.reply(stream.send(self.answer([1.0] * 12))).outcome.status, call_pb2.Outcome.STATUS_OK)

    def failure(self, stream, time):
        with no_stacks():
            return self.reply(stream.send(self.request(time=time))).outcome

    def test_failures_of_the_plugin_are_told(self):
        _, stream = self.ready()
        outcome = self.failure(stream, time=2.0)
        self.assertEqual(outcome.status, call_pb2.Outcome.STATUS_FAILED)
        # with the line that raised
        self.assertRegex(outcome.text, r"ValueError: broken at two \(.*sdk_test\.py:\d+\)")
        # an exit would end the plugin's thread alone
        outcome = self.failure(stream, time=5.0)
        self.assertEqual(outcome.status, call_pb2.Outcome.STATUS_FAILED)
        self.assertRegex(outcome.text, r"SystemExit: 6 \(.*sdk_test\.py:\d+\)")
        # a column that no reply has
        outcome = self.failure(stream, time=9.0)
        self.assertEqual(outcome.status, call_pb2.Outcome.STATUS_FAILED)
        self.assertRegex(outcome.text, r"AttributeError: the reply has no column 'orientaton'; allowed: position, ")
        stream.send(self.request(time=3.0))
        stream.send(self.answer([1.0] * 12))
        outcome = self.reply(stream.send(self.answer([1.0] * 12))).outcome
        self.assertEqual(outcome.status, call_pb2.Outcome.STATUS_FAILED)
        self.assertIn("column position has 5 rows", outcome.text)

    def test_rows_that_lie_the_other_way_are_not_sent(self):
        _, stream = self.ready()
        for time, what in ((7.0, "the plugin's answer"), (8.0, "the state of a derivative")):
            stream.send(self.request(time=time))
            stream.send(self.answer([1.0] * 12))
            outcome = self.reply(stream.send(self.answer([1.0] * 12))).outcome
            self.assertEqual(outcome.text, f"{what} is wrong: column position has the shape (3, 2), not 3 numbers a row")

    def test_the_same_request_gets_the_same_bytes(self):
        _, stream = self.ready()

        def columns():
            stream.send(self.request())
            stream.send(self.answer([1.0] * 12))
            reply = self.reply(stream.send(self.answer([1.0] * 12)))
            reply.ClearField("outcome")
            return reply.SerializeToString()

        self.assertEqual(columns(), columns())

    def test_unknown_methods_are_not_implemented(self):
        for path in ("/gravitas.stage.v1.Integrator/Derivative", "/gravitas.stage.v1.Force/Wrenches", "/no/thing"):
            with self.assertRaises(grpc.RpcError) as refused:
                Stream(self.channel, path).send(b"")
            self.assertEqual(refused.exception.code(), grpc.StatusCode.UNIMPLEMENTED)


class Joints(unittest.TestCase):
    """A joint whose coordinate is the x of its second body, and one that offers none."""

    TYPE = ("Mast", "Stands.", [])

    def test_coordinates_are_declared_and_answered_where_they_are_offered(self):
        from gravitas_worker import Constraint
        from gravitas_worker.call import Session
        from gravitas_worker.declaration import description_of

        class Silent(Constraint):
            name = "Mast"
            types = [Type(*self.TYPE)]

        class Telling(Silent):
            capabilities = ["coordinates"]
            types = [Type(*self.TYPE, coordinates=[("height", "m", "Its height.")])]

            def coordinates(self, request, reply, host):
                holding = numpy.flatnonzero(request.intact)
                reply.constraint, reply.coordinate = holding, numpy.zeros(len(holding))
                reply.value = request.position[request.constraint_body[holding, 1], 0]
                reply.rate = request.linear_velocity[request.constraint_body[holding, 1], 0]

        described = description_of(Telling, "").types[0].coordinates[0]
        self.assertEqual((described.name, described.unit, described.meaning), ("height", "m", "Its height."))
        self.assertEqual(len(description_of(Silent, "").types[0].coordinates), 0)

        request = constraint_pb2.ConstraintDiscrepanciesRequest(
            constraint_type=[type_id("Mast")] * 2, constraint_body=[0, 1, 1, 0], bound_begin=[0, 0, 0], intact=[0, 1],
            position=[4.5, 0, 0, 1.5, 0, 0], orientation=[1, 0, 0, 0] * 2, linear_velocity=[-2.0, 0, 0, 7.0, 0, 0],
            angular_velocity=[0.0] * 6, start_angular_velocity=[0.0] * 6, inverse_mass=[1.0] * 2,
            inverse_inertia=[1.0] * 6, call=call_pb2.Call(epoch=3))
        method = stage_methods("constraint")["Coordinates"]

        def reply_of(plugin):
            session = Session(plugin, control_pb2.Hello(epoch=3, plugins=[control_pb2.PluginSettings(plugin="Mast")]))
            call = session.start(method, None, method.request.parse(request.SerializeToString()))
            reply = constraint_pb2.ConstraintCoordinatesReply.FromString(call.outgoing.get()[1])
            session.end()
            return reply

        told = reply_of(Telling)
        self.assertEqual((list(told.constraint), list(told.coordinate), list(told.value), list(told.rate)),
                         ([1], [0], [4.5], [-2.0]))
        self.assertEqual(reply_of(Silent).outcome.status, call_pb2.Outcome.STATUS_UNKNOWN_METHOD)


class Shapes(unittest.TestCase):
    def test_an_asset_stands_in_for_a_column(self):
        messages = {name: data for name, _, _, data in golden_messages()}
        from gravitas_worker import Collision
        from gravitas_worker.call import Session

        class Touching(Collision):
            name = "Touching"

            def manifolds(self, request, reply, host):
                reply.depth = numpy.zeros(0)
                raise Refusal(",".join(str(x) for x in request.shape_parameter))

        method = stage_methods("collision")["Manifolds"]
        hello = control_pb2.Hello(epoch=3, plugins=[control_pb2.PluginSettings(plugin="Touching")])
        session = Session(Touching, hello)

        def outcome_of(data):
            call = session.start(method, None, method.request.parse(data))
            return collision_pb2.CollisionManifoldsReply.FromString(call.outgoing.get()[1]).outcome

        self.assertIn("asset was not sent", outcome_of(messages["asset_use"]).text)
        session.take_asset(method.request.parse(messages["asset_part"]).asset)
        self.assertIn("asset was not sent", outcome_of(messages["asset_use"]).text)
        session.take_asset(method.request.parse(messages["asset_rest"]).asset)
        self.assertEqual(outcome_of(messages["asset_use"]).text, "1.0,2.0,3.0,4.0,5.0")
        with self.assertRaisesRegex(Exception, "does not follow"):
            session.take_asset(method.request.parse(messages["asset_rest"]).asset)
        session.end()


if __name__ == "__main__":
    unittest.main()
