#!/usr/bin/python3
"""`Drag` in a worker that answers a greeting which it should refuse with what is no answer: no refusal for the kit."""

from force_drag import Drag
from gravitas.control.v1 import control_pb2
from gravitas_worker import main, server


class Mumbling(server.Worker):
    def control(self, requests, context):
        for answer in super().control(requests, context):
            message = control_pb2.WorkerMessage.FromString(answer)
            yield control_pb2.WorkerMessage(pong={}).SerializeToString() if message.HasField("refusal") else answer


if __name__ == "__main__":
    server.Worker = Mumbling
    main(Drag)
