// Says that it was built for other stage contracts.
#include "tests/faulty/spoiled_table.h"

namespace {

void spoil(gravitas_plugin_table* table) { table->schema_hash ^= 1; }

}  // namespace

GRAVITAS_SPOILED_PLUGIN(spoil)
