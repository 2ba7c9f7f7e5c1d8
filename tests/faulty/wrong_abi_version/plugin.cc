// Says that it was built for a later version of the plugin interface.
#include "tests/faulty/spoiled_table.h"

namespace {

void spoil(gravitas_plugin_table* table) { table->abi_version += 1; }

}  // namespace

GRAVITAS_SPOILED_PLUGIN(spoil)
