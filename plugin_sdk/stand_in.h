// Whether one plugin can take the place of another while a simulation runs.
#pragma once

#include <span>
#include <string>

#include "plugin_sdk/plugin.h"

namespace gravitas {

// Empty, or why `next` cannot: for every type in use that `now` serves it must declare the same properties in the same
// order, and choices that begin with the same, since a scene's values lie flattened by them. Settings of the plugin itself may differ.
std::string why_no_stand_in(const PluginDeclaration& now, const PluginDeclaration& next,
                            std::span<const std::string> types_in_use);

}  // namespace gravitas
