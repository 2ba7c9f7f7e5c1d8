// Says that it was built for a later version of the frame layout.
#include "tests/faulty/spoiled_table.h"

namespace {

void spoil(gravitas_plugin_table* table) { table->layout_version += 1; }

}  // namespace

GRAVITAS_SPOILED_PLUGIN(spoil)
