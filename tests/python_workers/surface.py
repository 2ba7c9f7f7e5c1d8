"""Imperfect surfaces: the normal of an impact, tilted at random, the same way for the same contact wherever it is
asked. The generator is Philox4x32-10 (Salmon, Moraes, Dror and Shaw, SC11), a function of the contact's key alone.
"""

import numpy

_MULTIPLIERS = numpy.array([0xD2511F53, 0xCD9E8D57], numpy.uint64)
_WEYL = numpy.array([0x9E3779B9, 0xBB67AE85], numpy.uint64)
_STREAM = numpy.array([0x66727573, 0x20656361], numpy.uint64)  # "surface " in two words
_LOW = numpy.uint64(0xFFFFFFFF)
_HALF = numpy.uint64(32)


def philox4x32(counter, key=_STREAM):
    """Rows of four words from rows of four words."""
    counter, key = counter.astype(numpy.uint64), key.copy()
    for _ in range(10):
        product0, product1 = _MULTIPLIERS[0] * counter[:, 0], _MULTIPLIERS[1] * counter[:, 2]
        counter = numpy.stack([
            (product1 >> _HALF) ^ counter[:, 1] ^ key[0], product1 & _LOW,
            (product0 >> _HALF) ^ counter[:, 3] ^ key[1], product0 & _LOW], axis=1)
        key = (key + _WEYL) & _LOW
    return counter


def perturbed_normal(normal, spread, contact_key):
    """n + d, made unit, with the components of d uniform in (-spread, spread)."""
    zero = numpy.zeros_like(contact_key)
    words = philox4x32(numpy.stack([contact_key & _LOW, contact_key >> _HALF, zero, zero], axis=1))
    offset = (words[:, :3].astype(float) + 0.5) / 2147483648.0 - 1.0
    tilted = normal + spread[:, None] * offset
    length = numpy.sqrt((tilted * tilted).sum(axis=1))
    is_short = (length < 1e-3)[:, None]
    return numpy.where(is_short, normal, tilted / numpy.where(is_short[:, 0], 1.0, length)[:, None])
