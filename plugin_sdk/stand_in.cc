#include "plugin_sdk/stand_in.h"

#include <algorithm>

namespace gravitas {

std::string why_no_stand_in(const PluginDeclaration& now, const PluginDeclaration& next,
                            std::span<const std::string> types_in_use) {
  if (next.slot != now.slot) return std::string("it is a plugin of slot ") + slot_name(next.slot);
  for (const TypeDeclaration& type : now.types) {
    if (std::ranges::find(types_in_use, type.name) == types_in_use.end()) continue;
    const auto other = std::ranges::find(next.types, type.name, &TypeDeclaration::name);
    if (other == next.types.end()) return "it does not serve the type '" + type.name + "'";
    const bool same = std::ranges::equal(type.properties, other->properties, [](const Property& a, const Property& b) {
      // a choice lies flattened as its position
      const bool has_choices = std::ranges::mismatch(a.choices, b.choices).in1 == a.choices.end();
      return a.name == b.name && a.kind == b.kind && a.columns == b.columns && has_choices;
    });
    if (!same) return "its type '" + type.name + "' has other properties than that of " + now.name;
  }
  return {};
}

}  // namespace gravitas
