#!/usr/bin/python3
"""`Drag` that takes 10 ms of CPU for every answer."""

import time

from force_drag import Drag
from gravitas_worker import main


class Busy(Drag):
    def wrenches(self, request, reply, host):
        begin = time.process_time()
        while time.process_time() - begin < 0.01:
            pass
        super().wrenches(request, reply, host)


if __name__ == "__main__":
    main(Busy)
