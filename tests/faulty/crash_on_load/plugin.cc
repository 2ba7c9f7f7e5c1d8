// Crashes while it is loaded: its constructor raises SIGSEGV.
#include <signal.h>

#include "tests/faulty/spoiled_table.h"

namespace {

__attribute__((constructor)) void crash() {
  // the default action, whatever handler the process has
  signal(SIGSEGV, SIG_DFL);
  raise(SIGSEGV);
}

}  // namespace

GRAVITAS_PLUGIN(gravitas::faulty::Harmless)
