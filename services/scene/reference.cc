#include "services/scene/reference.h"

#include <fmt/format.h>

#include <set>

#include "plugin_sdk/property_value.h"
#include "plugin_sdk/slots.h"
#include "services/scene/grammar.h"

namespace gravitas::scene {
namespace {

constexpr const char* kTableHead =
    "| name | value | unit | frame | default | meaning |\n| --- | --- | --- | --- | --- | --- |\n";

// Text inside a cell of a table.
std::string cell(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '|' ? std::string("\\|") : std::string(1, c);
  return out;
}

std::string row(const std::string& name, const std::string& value, const std::string& unit, const std::string& frame,
                const std::string& fallback, const std::string& meaning) {
  const std::string shown_unit = unit == "1" || unit == "count" || unit == "index" ? "" : unit;
  const std::string shown_frame = frame == "scene" ? "" : frame;
  return fmt::format("| `{}` | {} | {} | {} | {} | {} |\n", name, cell(value), shown_unit, shown_frame, cell(fallback),
                     cell(meaning));
}

std::string value_of(const Entry& entry) {
  switch (entry.form) {
    case Form::kNumbers:
      return allowed_values(entry.declared);
    case Form::kText:
      return entry.choices.empty() ? "a text" : fmt::format("one of \"{}\"", fmt::join(entry.choices, "\", \""));
    case Form::kTexts:
      return "a list of texts";
    case Form::kValue:
      return "a value";
    case Form::kProperties:
      return "a block: see the plugin";
    case Form::kBlock:
      return entry.field->is_repeated()   ? "blocks, any number"
             : entry.shorthand != nullptr ? "a text or a block"
                                          : "a block";
  }
  return "";
}

std::string text_of(const PropertyValue& value) {
  if (value.kind != PropertyValue::Kind::kList) return shown(value);
  std::string text;
  for (const PropertyValue& element : value.list) text += (text.empty() ? "{" : ", ") + text_of(element);
  return text.empty() ? "{}" : text + "}";
}

std::string default_of(const Entry& entry) {
  if (entry.is_required) return "required";
  return entry.default_value ? text_of(*entry.default_value) : "";
}

void write_block(const BlockRule& block, std::set<std::string>* written, std::string* page) {
  if (!written->insert(block.name).second) return;
  *page += fmt::format("\n### {}\n\n{}", block.name, kTableHead);
  for (const std::string& name : block.names) {
    const Entry& entry = *block.find(name);
    *page += row(name, value_of(entry), entry.declared.unit, entry.declared.frame, default_of(entry),
                 entry.declared.meaning);
  }
  for (const std::string& name : block.names)
    if (const Entry& entry = *block.find(name); entry.form == Form::kBlock) write_block(*entry.block, written, page);
}

std::string default_of(const Property& p) {
  if (p.is_required) return "required";
  if (p.default_numbers.empty()) return "";
  if (p.kind == PropertyKind::kFlag) return p.default_numbers[0] != 0.0 ? "true" : "false";
  if (p.kind == PropertyKind::kChoice) return '"' + p.choices[static_cast<std::size_t>(p.default_numbers[0])] + '"';
  std::string text;
  for (const double number : p.default_numbers) text += (text.empty() ? "" : ", ") + number_text(number);
  return p.default_numbers.size() == 1 ? text : "{" + text + "}";
}

void write_properties(const std::string& title, const std::string& meaning, const std::vector<Property>& properties,
                      std::string* page) {
  *page += fmt::format("\n**`{}`**: {}\n", title, meaning);
  if (properties.empty()) return;
  *page += '\n';
  *page += kTableHead;
  for (const Property& p : properties) {
    const std::string live = p.is_live ? " May change while the simulation runs." : "";
    *page += row(p.name, allowed_values(p), p.unit, p.frame, default_of(p), p.meaning + live);
  }
}

void write_coordinates(const std::vector<CoordinateDeclaration>& coordinates, std::string* page) {
  if (coordinates.empty()) return;
  *page += "\n| coordinate (`--joints`) | unit | meaning |\n| --- | --- | --- |\n";
  for (const CoordinateDeclaration& c : coordinates)
    *page += fmt::format("| `{}` | {} | {} |\n", c.name, c.unit, cell(c.meaning));
}

}  // namespace

std::string reference_page(const Catalog& catalog) {
  std::string page =
      "# Reference of the scene language\n\nWritten by `gravitas describe --reference` from the grammar and the "
      "plugins' "
      "declarations; not edited by hand.\nSI units; quaternions are {w, x, y, z}, unit, body to world.\n\n## Blocks\n";
  std::set<std::string> written;
  write_block(scene_grammar(), &written, &page);
  page += "\n## Plugins\n";
  for (const Slot slot : kSlots) {
    page += fmt::format("\n### Slot {}\n", slot_name(slot));
    for (const InstalledPlugin& plugin : catalog.plugins()) {
      const PluginDeclaration& d = plugin.declaration;
      if (d.slot != slot) continue;
      if (d.types.empty() || !d.properties.empty()) write_properties(d.name, d.meaning, d.properties, &page);
      for (const TypeDeclaration& type : d.types) {
        write_properties(type.name, type.meaning, type.properties, &page);
        write_coordinates(type.coordinates, &page);
      }
    }
  }
  return page;
}

}  // namespace gravitas::scene
