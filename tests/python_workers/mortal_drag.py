#!/usr/bin/python3
"""`Drag` that dies of every request after 0.045 s: `exit` as a program that ends, `segv` by a signal."""

import os
import signal
import sys

from force_drag import Drag
from gravitas_worker import main

DEATHS = {"exit": lambda: os._exit(3), "segv": lambda: signal.raise_signal(signal.SIGSEGV)}


class Mortal(Drag):
    def wrenches(self, request, reply, host):
        if request.time > 0.045:
            DEATHS[death]()
        super().wrenches(request, reply, host)


if __name__ == "__main__":
    death = sys.argv.pop(1)
    main(Mortal)
