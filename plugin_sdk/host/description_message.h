// A plugin's declaration as a message and back.
#pragma once

#include "gravitas/plugin/v1/description.pb.h"
#include "plugin_sdk/plugin.h"

namespace gravitas::host {

plugin::v1::Description to_message(const PluginDeclaration& declaration);

// A message from another process: unknown slots and property kinds give a declaration that serves nothing.
PluginDeclaration from_message(const plugin::v1::Description& message);

}  // namespace gravitas::host
