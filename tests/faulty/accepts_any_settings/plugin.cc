// Takes whatever settings it is given, also those that it does not declare.
#include "tests/faulty/spoiled_table.h"

namespace {

void spoil(gravitas_plugin_table* table) {
  table->create = [](const double*, std::uint64_t, void** instance, gravitas_error*) -> std::int32_t {
    *instance = new gravitas::faulty::Harmless(gravitas::PropertyCursor({}));
    return GRAVITAS_OK;
  };
}

}  // namespace

GRAVITAS_SPOILED_PLUGIN(spoil)
