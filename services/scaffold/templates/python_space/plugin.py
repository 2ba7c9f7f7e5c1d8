#!/usr/bin/python3
"""Space `MyName`: every pair of bodies is tested, a row at a time. O(n^2), and nothing to go wrong.

A plugin is a class derived from that of its slot, and its worker process is main(). It declares itself once, receives a
request as numpy arrays, and assigns the arrays of the reply. The answer depends on the request and the settings alone:
the same request gives the same bytes, so keep nothing between calls but caches that can be made again.
"""

import numpy

from gravitas_worker import HAS_SHAPE, MOVABLE, Space, main


def partners(lower, upper, a):
    """Bodies behind `a` whose closed bounds overlap with its own; what is no number overlaps with nothing."""
    is_near = ((lower[a + 1:] <= upper[a]) & (lower[a] <= upper[a + 1:])).all(axis=1)
    return a + 1 + numpy.flatnonzero(is_near)


class MyNamePlugin(Space):
    # Rays and outlines are capabilities, and methods, of their own; settings would be `properties`, which __init__ gets.
    name = "MyName"
    version = "1.0"
    meaning = "Tests every pair of bodies."

    # The question of the slot: all pairs whose bounds overlap and whose filters allow it, ascending and each once
    # (schemas/gravitas/stage/v1/space.proto). All spaces answer by one rule, so that all of them agree; a space is about which
    # pairs it need not test.
    def pairs(self, request, reply, host):
        flags, group, mask = request.flags, request.filter_group, request.filter_mask
        rows = [numpy.empty((0, 2), numpy.uint32)]
        for a in range(len(flags)):
            # prolongs the deadline of the call where there is much to do
            host.mark_progress()
            b = partners(request.lower, request.upper, a)
            may_touch = ((flags[a] & flags[b] & HAS_SHAPE) != 0) & (((flags[a] | flags[b]) & MOVABLE) != 0)
            may_touch &= ((group[a] & mask[b]) != 0) & ((group[b] & mask[a]) != 0)
            b = b[may_touch].astype(numpy.uint32)
            rows.append(numpy.stack([numpy.full(len(b), a, numpy.uint32), b], axis=1))
        reply.pair = numpy.concatenate(rows)


if __name__ == "__main__":
    main(MyNamePlugin)
