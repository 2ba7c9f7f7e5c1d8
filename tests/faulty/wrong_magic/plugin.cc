// Exports the entry point, but its table is one of something else.
#include "tests/faulty/spoiled_table.h"

namespace {

void spoil(gravitas_plugin_table* table) { table->magic = 0; }

}  // namespace

GRAVITAS_SPOILED_PLUGIN(spoil)
