// Switches the processor to flush-to-zero while it is loaded, as libraries that are linked with -ffast-math do.
#include <immintrin.h>

#include "tests/faulty/spoiled_table.h"

namespace {

__attribute__((constructor)) void flush_to_zero() { _mm_setcsr(_mm_getcsr() | 0x8040); }

}  // namespace

GRAVITAS_PLUGIN(gravitas::faulty::Harmless)
