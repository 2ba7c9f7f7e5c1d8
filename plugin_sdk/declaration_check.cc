#include "plugin_sdk/declaration_check.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string_view>
#include <vector>

#include "plugin_sdk/near_miss.h"
#include "plugin_sdk/property_value.h"

namespace gravitas {
namespace {

bool is_decimal(char c) { return c >= '0' && c <= '9'; }
bool begins_name(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }

// What stands between quotes in a scene and alone on a command line.
bool is_written_in_quotes(std::string_view text) {
  return !text.empty() && std::ranges::all_of(text, [](char c) { return c > ' ' && c < 0x7f; });
}

// What stands before a `=`.
bool is_scene_name(std::string_view text) {
  return !text.empty() && begins_name(text[0]) &&
         std::ranges::all_of(text, [](char c) { return begins_name(c) || is_decimal(c); });
}

// The first word that stood before, or null.
const std::string* first_repeated(const std::vector<std::string>& words) {
  std::set<std::string> seen;
  for (const std::string& word : words)
    if (!seen.insert(word).second) return &word;
  return nullptr;
}

// ---- properties

// What is wrong with the default of a property, or empty.
std::string check_default(const Property& p) {
  if (p.default_numbers.empty()) return {};
  if (p.is_required) return "is required and has a default";
  const std::string problem = check_flattened({p}, p.default_numbers);
  return problem.empty() ? "" : "has a default that it does not allow: " + problem;
}

bool has_number_between_bounds(const Property& p) {
  if (p.minimum == HUGE_VAL || p.maximum == -HUGE_VAL) return false;
  return p.exclusive_minimum ? p.minimum < p.maximum : p.minimum <= p.maximum;
}

std::string check_property(const Property& p) {
  if (p.kind < PropertyKind::kNumber || p.kind > PropertyKind::kBody) return "is of no kind that exists";
  if (p.meaning.empty()) return "has no meaning";
  if (!has_number_between_bounds(p)) return "has bounds between which there is no number";
  if (p.kind == PropertyKind::kChoice && p.choices.empty()) return "is a choice between nothing";
  if (const std::string* twice = first_repeated(p.choices)) return "has the choice '" + *twice + "' twice";
  if (p.kind == PropertyKind::kTable && p.columns == 0) return "is a table without columns";
  return check_default(p);
}

std::string check_properties(const std::string& owner, const std::vector<Property>& properties, bool may_name_bodies) {
  std::set<std::string> names;
  for (const Property& p : properties) {
    if (p.name.empty()) return owner + " has a property without a name";
    if (!is_scene_name(p.name))
      return owner + " has a property '" + p.name +
             "', which a scene cannot write; allowed: letters, digits and '_', and no digit first";
    if (!names.insert(p.name).second) return owner + " declares " + p.name + " twice";
    if (p.kind == PropertyKind::kBody && !may_name_bodies)
      return owner + "." + p.name + " names a body; allowed: of types of forces";
    const std::string problem = check_property(p);
    if (!problem.empty()) return std::string(owner).append(".").append(p.name).append(" ").append(problem);
  }
  return {};
}

// ---- types and capabilities

std::string check_coordinates(const TypeDeclaration& type) {
  std::set<std::string> names;
  for (const CoordinateDeclaration& c : type.coordinates) {
    if (!is_scene_name(c.name))
      return type.name + " has a coordinate '" + c.name +
             "'; allowed: a name of letters, digits and '_', and no digit first";
    if (!names.insert(c.name).second) return type.name + " declares the coordinate " + c.name + " twice";
    if (c.unit.empty()) return "coordinate " + c.name + " of " + type.name + " has no unit";
    if (c.meaning.empty()) return "coordinate " + c.name + " of " + type.name + " has no meaning";
  }
  return {};
}

std::string check_types(const PluginDeclaration& d) {
  const bool serves_types = d.slot == Slot::kCollision || d.slot == Slot::kConstraint || d.slot == Slot::kForce;
  if (serves_types && d.types.empty())
    return std::string("a plugin of slot ") + slot_name(d.slot) + " serves types; it declares none";
  std::set<std::string> names;
  for (const TypeDeclaration& type : d.types) {
    if (!is_written_in_quotes(type.name)) return "a type has no name, or one that a scene cannot write";
    if (!names.insert(type.name).second) return "type " + type.name + " is declared twice";
    if (type.meaning.empty()) return "type " + type.name + " has no meaning";
    std::string problem = check_properties(type.name, type.properties, d.slot == Slot::kForce);
    if (problem.empty()) problem = check_coordinates(type);
    if (!problem.empty()) return problem;
  }
  const bool has_some =
      std::ranges::any_of(d.types, [](const TypeDeclaration& type) { return !type.coordinates.empty(); });
  if (has_some && !has_capability(d, "coordinates"))
    return "a type has coordinates, but the plugin does not declare the capability 'coordinates'";
  if (!has_some && has_capability(d, "coordinates"))
    return "it declares the capability 'coordinates', but no type has any";
  return {};
}

std::vector<std::string> capabilities_of(Slot slot) {
  switch (slot) {
    case Slot::kSpace:
      return {"rays", "debug_geometry"};
    case Slot::kCollision:
      return {"times_of_impact", "rays", "debug_geometry"};
    case Slot::kConstraint:
      return {"coordinates"};
    case Slot::kForce:
      return {"potential", "jacobians"};
    case Slot::kSolver:
      return {"reactions", "reaction_jacobians", "owns_motion", "soft"};
    case Slot::kIntegrator:
      return {"plugin_state", "order=N"};
  }
  return {};
}

bool is_order(std::string_view word) {
  constexpr std::string_view kBegin = "order=";
  return word.starts_with(kBegin) && word.size() > kBegin.size() &&
         std::ranges::all_of(word.substr(kBegin.size()), is_decimal);
}

std::string check_capabilities(const PluginDeclaration& d) {
  const std::vector<std::string> known = capabilities_of(d.slot);
  for (const std::string& word : d.capabilities) {
    const bool is_known = d.slot == Slot::kIntegrator && word.starts_with("order")
                              ? is_order(word)
                              : std::ranges::find(known, word) != known.end();
    if (!is_known)
      return std::string("slot ") + slot_name(d.slot) + " knows no capability '" + word + "'; " +
             allowed_names(word, known);
  }
  const std::string* twice = first_repeated(d.capabilities);
  return twice == nullptr ? "" : "the capability '" + *twice + "' is declared twice";
}

}  // namespace

std::string check_declaration(const PluginDeclaration& d) {
  if (d.slot < Slot::kSpace || d.slot > Slot::kIntegrator) return "it declares a slot that this version does not have";
  if (!is_written_in_quotes(d.name)) return "it has no name, or one that a scene cannot write";
  if (d.version.empty()) return "it has no version";
  if (d.meaning.empty()) return "it has no meaning";
  if (!(d.theta >= 0.0 && d.theta <= 1.0)) return "theta is " + number_text(d.theta) + "; allowed: 0 to 1";
  std::string problem = check_capabilities(d);
  if (problem.empty()) problem = check_properties(d.name, d.properties, false);
  return problem.empty() ? check_types(d) : problem;
}

}  // namespace gravitas
