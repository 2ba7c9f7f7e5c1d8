// Never finishes loading: its constructor waits for a signal that nobody sends.
#include <unistd.h>

#include "tests/faulty/spoiled_table.h"

namespace {

__attribute__((constructor)) void hang() {
  for (;;) pause();
}

}  // namespace

GRAVITAS_PLUGIN(gravitas::faulty::Harmless)
