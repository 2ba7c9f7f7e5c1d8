"""The process around a plugin: a gRPC server as schemas/WIRE.md describes it.

    kernel --- control stream ---> Worker.control    handshake, heartbeat, drain
           --- a stream a method -> Worker.stream    one request at a time  --->  the session's plugin thread

Messages are handled as raw bytes: what cannot be read is answered as a failure, and the stream lives on.
"""

import os
import pathlib
import re
import sys
import threading
import traceback
from concurrent import futures

import grpc
import numpy
from google.protobuf.message import DecodeError

from gravitas.control.v1 import control_pb2
from gravitas.plugin.v1 import description_pb2

from .call import CallFailed, Outcome, Sent, Session, encodable, unread_call, words_of
from .columns import WireError, stage_methods
from .declaration import Refusal, description_of

MAGIC = 0x4752415649544153  # "GRAVITAS"
PROTOCOL = 2
# Of the schemas that the messages here were generated from; the build writes it beside them.
SCHEMA_HASH = int(pathlib.Path(__file__).with_name("schema_hash").read_text(), 16)
BUILD_ID = f"python-{sys.version_info.major}.{sys.version_info.minor}-numpy-{numpy.__version__}"

CONTROL_PATH = "/gravitas.control.v1.WorkerControl/Session"
# Streams that can be open at once, the control stream among them.
MOST_STREAMS = 16
# How often the worker looks whether anybody can still reach it.
LOOK_SECONDS = 1.0
# The connection is not encrypted.
LOCAL_ADDRESS = re.compile(r"unix:.+|(127(\.\d{1,3}){3}|\[::1\]|localhost):\d{1,5}")

_Reason = control_pb2.Refusal

# With --describe standard output is the declaration's alone: what a plugin prints, from here on or before and not yet
# written, goes to standard error. It comes last, behind arguments of the plugin's own.
_DESCRIBES = sys.argv[-1:] == ["--describe"]
if _DESCRIBES:
    _declaration_file = os.dup(1)
    os.dup2(2, 1)

    def _tell_failure(kind, failure, trace):
        """Whoever asked shows the last line alone: it names the plugin's, where the stack may end in the SDK."""
        sys.__excepthook__(kind, failure, trace)
        print(words_of(failure), file=sys.stderr)

    sys.excepthook = _tell_failure


class Worker(grpc.GenericRpcHandler):
    """Serves one kernel after the other."""

    def __init__(self, plugin):
        self._plugin = plugin
        self._description = description_of(plugin, BUILD_ID)
        methods = stage_methods(plugin.slot)
        self._derivative = methods.pop("Derivative", None)
        self._methods = {method.path: method for method in methods.values()}
        self._session = None
        self._taken = threading.Lock()
        self.ended = threading.Event()  # a session has ended

    def service(self, details):
        method = self._methods.get(details.method)
        if method is not None:
            return grpc.stream_stream_rpc_method_handler(lambda requests, context: self.stream(method, requests))
        if details.method == CONTROL_PATH:
            return grpc.stream_stream_rpc_method_handler(self.control)
        return None  # UNIMPLEMENTED

    # ---- the control stream

    def control(self, requests, context):
        greeting = _kernel_message(next(requests, b""))
        hello = greeting.hello
        if not greeting.HasField("hello"):
            context.abort(grpc.StatusCode.INVALID_ARGUMENT, "the first message must be Hello")
        refusal = self._judge(hello)
        if refusal is None and not self._taken.acquire(blocking=False):
            context.abort(grpc.StatusCode.ALREADY_EXISTS, "this worker has its kernel")
        if refusal is None:
            try:
                self._session = Session(self._plugin, hello)
            except Refusal as why:
                self._taken.release()
                refusal = (_Reason.REASON_SETTINGS, f"{self._plugin.name}: {why}")
            except BaseException as failure:
                self._taken.release()
                traceback.print_exc()
                refusal = (_Reason.REASON_SETTINGS,
                           f"{self._plugin.name}: it cannot be made: {words_of(failure)}")
        if refusal is not None:
            yield _worker_message(refusal=_Reason(reason=refusal[0], text=encodable(refusal[1])))
            return
        try:
            yield from self._serve_kernel(hello, requests)
        except grpc.RpcError:
            pass  # the kernel is gone
        finally:
            session, self._session = self._session, None
            session.end()
            self._taken.release()
            self.ended.set()

    def _serve_kernel(self, hello, requests):
        # without floating_point: numpy does not know the control register
        yield _worker_message(welcome=control_pb2.Welcome(
            magic=MAGIC, protocol=PROTOCOL, schema_hash=SCHEMA_HASH, epoch=hello.epoch, nonce=hello.nonce,
            build_id=BUILD_ID, process_id=os.getpid(), plugins=[self._description]))
        yield _worker_message(ready=control_pb2.Ready())
        for data in requests:
            message = _kernel_message(data)
            if message.HasField("drain"):
                return
            if message.HasField("ping"):
                yield _worker_message(pong=control_pb2.Pong(
                    sequence=message.ping.sequence, calls=self._session.calls))

    def _judge(self, hello):
        """Why not, or nothing."""
        if hello.magic != MAGIC:
            return _Reason.REASON_MAGIC, "the other side is no Gravitas kernel"
        if not hello.protocol_minimum <= PROTOCOL <= hello.protocol_maximum:
            return _Reason.REASON_PROTOCOL, (f"the kernel speaks control protocol {hello.protocol_minimum} to "
                                             f"{hello.protocol_maximum}, this worker {PROTOCOL}")
        if hello.schema_hash != SCHEMA_HASH:
            return _Reason.REASON_SCHEMA, "the kernel was built for another schema of the stage contracts"
        if len(hello.plugins) != 1:
            return _Reason.REASON_SETTINGS, f"this worker serves one plugin, the kernel expects {len(hello.plugins)}"
        if hello.plugins[0].plugin != self._plugin.name:
            return _Reason.REASON_LIBRARY, (f"this worker serves plugin '{self._plugin.name}', not "
                                            f"'{hello.plugins[0].plugin}'")
        return None

    # ---- the streams of the stage's methods

    def stream(self, method, requests):
        try:
            for data in requests:
                yield from self._answer(method, data, requests)
        except grpc.RpcError:
            pass  # the kernel is gone

    def _answer(self, method, data, requests):
        call = unread_call(method)
        try:
            session = self._session
            if session is None:
                raise CallFailed("no kernel has introduced itself")
            message = method.request.parse(data)
            if message.asset is not None:
                session.take_asset(message.asset)
                return
            call = session.start(method, self._derivative, message)
        except (WireError, CallFailed) as problem:
            call.reply(None, status=Outcome.STATUS_FAILED, text=str(problem))
        try:
            kind = None
            while kind is not Sent.REPLY:
                kind, reply = call.outgoing.get()
                yield reply
                # gRPC comes back when that has gone out
                call.written.set()
                if kind is Sent.QUESTION:
                    call.incoming.put(next(requests, None))
        finally:
            # the plugin may wait for a kernel that is gone
            call.written.set()
            call.incoming.put(None)


def _kernel_message(data):
    try:
        return control_pb2.KernelMessage.FromString(data)
    except DecodeError:
        return control_pb2.KernelMessage()


def _worker_message(**kind):
    return control_pb2.WorkerMessage(**kind).SerializeToString()


# ---- the command line


def _describe(plugin):
    catalog = description_pb2.Catalog()
    catalog.entries.add(library=encodable(sys.argv[0]), description=description_of(plugin, BUILD_ID))
    with os.fdopen(_declaration_file, "wb") as file:
        file.write(catalog.SerializeToString())


def _listen(plugin, address):
    if not LOCAL_ADDRESS.fullmatch(address):
        sys.exit(f"{sys.argv[0]}: --listen {address}: the connection is not encrypted, so only this machine is "
                 "allowed: 127.0.0.1:PORT, [::1]:PORT or unix:PATH")
    worker = Worker(plugin)
    server = grpc.server(
        futures.ThreadPoolExecutor(MOST_STREAMS), handlers=[worker],
        options=[("grpc.max_receive_message_length", -1), ("grpc.max_send_message_length", -1),
                 ("grpc.so_reuseport", 0)])
    try:
        port = server.add_insecure_port(address)
    except RuntimeError:
        port = 0
    if port == 0:
        sys.exit(f"{sys.argv[0]}: cannot listen at {address}: is it a free address of this machine?")
    parent = os.getppid()
    server.start()
    path = address[len("unix:"):] if address.startswith("unix:") else None
    if path is None:
        # a caller that let the system choose the port
        print("listening at", f"{address.rpartition(':')[0]}:{port}", flush=True)

    # A kernel that starts a worker takes the socket's name away once it is connected. Then nobody else can come: the
    # worker ends with its session, or with the kernel's process if there was none.
    while True:
        worker.ended.wait(LOOK_SECONDS)
        if path is None or os.path.exists(path):
            worker.ended.clear()
        elif worker.ended.is_set() or os.getppid() != parent:
            break
    sys.stdout.flush()
    # threads that hang in a plugin must not keep the process
    os._exit(0)


def main(plugin):
    """The program of a worker with one plugin."""
    arguments = sys.argv[1:]
    if _DESCRIBES and len(arguments) == 1:
        _describe(plugin)
    elif len(arguments) == 2 and arguments[0] == "--listen":
        _listen(plugin, arguments[1])
    else:
        sys.exit(f"usage: {sys.argv[0]} --describe | --listen ADDRESS\n"
                 "ADDRESS: 127.0.0.1:PORT, [::1]:PORT or unix:PATH")
