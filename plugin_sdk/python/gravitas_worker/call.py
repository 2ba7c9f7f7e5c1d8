"""One call to a plugin, from the request to the reply, and the session that it belongs to.

The thread of a stream and the thread of the plugin meet in a Call: what goes out passes through `outgoing`, the
kernel's answers to derivatives come in through `incoming`.
"""

import enum
import os
import queue
import sysconfig
import threading
import time
import traceback

import numpy
from google.protobuf.message import DecodeError

from gravitas.stage.v1 import call_pb2

from .columns import WireError, check_rows
from .declaration import Refusal, Values
from .plugin import Host

Outcome = call_pb2.Outcome

_PACKAGE = os.path.dirname(os.path.abspath(__file__)) + os.sep
_INSTALLED = ("/usr/lib/python3", "<", *map(sysconfig.get_path, ("stdlib", "platstdlib", "purelib", "platlib")))

# Marks of progress closer together than this go out as one.
MARK_SECONDS = 0.02
# An asset beyond this many bytes is refused.
LARGEST_ASSET = 1 << 31


def words_of(failure):
    """What failed, and the plugin's own line that raised or led to it: 'KIND: WHAT (FILE:LINE)'."""
    frames = traceback.extract_tb(failure.__traceback__)
    own = [frame for frame in frames if not frame.filename.startswith((_PACKAGE, *_INSTALLED))]
    place = f" ({own[-1].filename}:{own[-1].lineno})" if own else ""
    return f"{type(failure).__name__}: {failure}{place}"


def encodable(text):
    """The same with a '?' for what no message takes, as of a file's name that is no UTF-8."""
    return text.encode(errors="replace").decode()


class CallFailed(Exception):
    """A call that cannot be made or ended, with the status of its outcome."""

    def __init__(self, text, status=Outcome.STATUS_FAILED):
        super().__init__(text)
        self.status = status


class Sent(enum.Enum):
    MARK, QUESTION, REPLY = range(3)


class Columns:
    """A request's columns, as attributes."""

    def __init__(self, columns):
        self.__dict__.update(columns)


class Reply:
    """Its columns, as attributes: no others, so that one that is misspelt is not lost in silence."""

    __slots__ = ("_layout", "__dict__")

    def __init__(self, layout):
        object.__setattr__(self, "_layout", layout)

    def __setattr__(self, name, value):
        names = [column.name for column in self._layout.columns]
        if name not in names:
            raise AttributeError(f"the reply has no column {name!r}; allowed: {', '.join(names)}")
        super().__setattr__(name, value)


class Call(Host):
    """A call that is open."""

    def __init__(self, method, head, derivative):
        self.method, self.head, self._derivative = method, head, derivative
        self.outgoing = queue.SimpleQueue()
        self.incoming = queue.SimpleQueue()  # None: the kernel is gone
        self.written = threading.Event()  # the first message that went out, or the kernel is gone
        self.rows = {}  # by their word, as the request has them
        self._marks, self._last_mark = 0, time.monotonic()

    def reply(self, columns, **outcome):
        self._send(Sent.REPLY, columns, outcome)

    def say_taken(self):
        """Others failed at this request: whoever dies of it from here on has read it, and the kernel can know."""
        if self.head.attempt > 0:
            self._marks += 1
            self._send(Sent.MARK, None, {"marks": self._marks})
            self.written.wait()

    def mark_progress(self):
        self._marks += 1
        now = time.monotonic()
        if now - self._last_mark >= MARK_SECONDS:
            self._last_mark = now
            self._send(Sent.MARK, None, {"marks": self._marks})

    def derivative(self, time, position, orientation, linear_velocity, angular_velocity):
        if self._derivative is None:
            raise RuntimeError("a derivative is asked for by integrators only")
        asked = {"time": time, "position": position, "orientation": orientation, "linear_velocity": linear_velocity,
                 "angular_velocity": angular_velocity, "question": 0}
        asked = self.checked(self._derivative.request, asked, "the state of a derivative")
        self._send(Sent.QUESTION, None, {}, self._derivative.request.serialize(asked))
        answer = self.incoming.get()
        try:
            if answer is None:
                raise WireError("it did not come")
            message = self.method.request.parse(answer)
            if message.derivative is None:
                raise WireError("it has none")
            wrench = self._derivative.reply.parse(message.derivative).columns["wrench"]
        except WireError as error:
            raise CallFailed(f"the derivative's answer cannot be read: {error}", Outcome.STATUS_CALLBACK_FAILED)
        if wrench.shape != (self.rows["body"], 6):
            raise CallFailed("the derivative's answer is not six numbers a body", Outcome.STATUS_CALLBACK_FAILED)
        return wrench

    def checked(self, layout, values, what):
        """The columns of a message out of the plugin's hands."""
        try:
            columns = {column.name: column.taken(values.get(column.name, ())) for column in layout.columns}
        except ValueError as error:
            raise CallFailed(f"{what} is wrong: {error}") from None
        problem = check_rows(layout, columns, self.rows)
        if problem:
            raise CallFailed(f"{what} is wrong: {problem}")
        return columns

    def _send(self, kind, columns, outcome, derivative=None):
        outcome["text"] = encodable(outcome.get("text", ""))
        head = Outcome(epoch=self.head.epoch, sequence=self.head.sequence, **outcome).SerializeToString()
        self.outgoing.put((kind, self.method.reply.serialize(columns, head, derivative)))


class Session:
    """One kernel: an instance of the plugin, made with the settings of its greeting. All calls run in one thread."""

    def __init__(self, plugin, hello):
        self.epoch = hello.epoch
        self.calls = 0
        self._plugin = plugin(Values(plugin.properties, numpy.array(hello.plugins[0].numbers, float)))
        self._assets = {}
        self._jobs = queue.SimpleQueue()
        threading.Thread(target=self._work, daemon=True).start()

    def end(self):
        self._jobs.put(None)

    def take_asset(self, data):
        """A part of a large column. Parts come in order, without gaps."""
        chunk = call_pb2.AssetChunk()
        try:
            chunk.ParseFromString(data)
        except DecodeError:
            raise CallFailed("an asset that cannot be read") from None
        size, asset = self._assets.setdefault(chunk.hash, (chunk.size, bytearray()))
        if size != chunk.size or size > LARGEST_ASSET or chunk.offset != len(asset) or (
                len(asset) + len(chunk.data) > size):
            raise CallFailed("a part of an asset that does not follow the part before it")
        asset += chunk.data

    def start(self, method, derivative, message):
        """The call that a message asks for, under way or refused already."""
        head = call_pb2.Call()
        if message.header is None:
            raise CallFailed("a request without a call")
        try:
            head.ParseFromString(message.header)
        except DecodeError:
            raise CallFailed("a call that cannot be read") from None
        call = Call(method, head, derivative)
        if head.epoch != self.epoch:
            call.reply(None, status=Outcome.STATUS_FAILED, text="a request of another incarnation")
        elif head.target != 0:
            call.reply(None, status=Outcome.STATUS_FAILED, text="no such plugin in this worker")
        else:
            self._jobs.put((call, message))
        return call

    # ---- the plugin's thread

    def _work(self):
        while (job := self._jobs.get()) is not None:
            call, message = job
            start = time.perf_counter_ns()
            call.say_taken()
            try:
                columns = self._answer(call, message)
                call.reply(columns, compute_nanoseconds=time.perf_counter_ns() - start)
            except Refusal as refusal:
                call.reply(None, status=Outcome.STATUS_REFUSED, text=str(refusal))
            except CallFailed as failure:
                call.reply(None, status=failure.status, text=str(failure))
            except BaseException as failure:  # sys.exit() would end this thread alone, and nobody would know
                traceback.print_exc()
                call.reply(None, status=Outcome.STATUS_FAILED, text=words_of(failure))
            self.calls += 1

    def _answer(self, call, message):
        """The columns of the reply."""
        layout = call.method.request
        answer = getattr(self._plugin, self._plugin.methods[call.method.name], None)
        if answer is None:
            raise CallFailed("the plugin does not answer this method", Outcome.STATUS_UNKNOWN_METHOD)
        self._put_assets(call.head, layout, message)
        problem = check_rows(layout, message.columns, call.rows)
        if problem:
            raise Refusal(problem)
        reply = Reply(call.method.reply)
        with numpy.errstate(all="ignore"):
            answer(Columns(message.columns), reply, call)
        return call.checked(call.method.reply, vars(reply), "the plugin's answer")

    def _put_assets(self, head, layout, message):
        """Columns that were sent before."""
        for use in head.assets:
            column = next((c for c in layout.columns if c.number == use.column and not c.is_value), None)
            size, asset = self._assets.get(use.hash, (-1, b""))
            if column is None or len(asset) != size or size % column.dtype.itemsize != 0:
                raise CallFailed("a column whose asset was not sent")
            numbers = numpy.frombuffer(bytes(asset), column.dtype)
            message.columns[column.name] = (
                column.shaped(numbers) if len(numbers) % column.components == 0 else numbers)


def unread_call(method):
    """For the answer to a message whose call is not known."""
    return Call(method, call_pb2.Call(), None)
