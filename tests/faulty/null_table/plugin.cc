// Exports the entry point, but returns no table.
#include "plugin_sdk/abi.h"

extern "C" __attribute__((visibility("default"))) const gravitas_plugin_table* gravitas_plugin() { return nullptr; }
