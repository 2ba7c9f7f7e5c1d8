#include "services/scene/grammar.h"

#include <algorithm>
#include <map>
#include <memory>
#include <stdexcept>

#include "gravitas/options/v1/options.pb.h"
#include "gravitas/scene/v1/scene.pb.h"
#include "services/scene/parser.h"

namespace gravitas::scene {
namespace {

namespace pb = google::protobuf;
namespace options = gravitas::options::v1;

constexpr std::size_t kMaximumEntries = 64;

[[noreturn]] void malformed(const pb::FieldDescriptor& field, const std::string& why) {
  throw std::logic_error("scene.proto: " + field.full_name() + ' ' + why);
}

bool is_named(const pb::Descriptor* type, const char* name) {
  return type != nullptr && type->full_name() == std::string("gravitas.scene.v1.") + name;
}

PropertyKind list_kind(const pb::FieldDescriptor& field, const pb::FieldOptions& rules) {
  const std::uint32_t length = rules.GetExtension(options::length);
  if (rules.GetExtension(options::unit_quaternion) && length == 4) return PropertyKind::kQuaternion;
  if (length == 3) return PropertyKind::kVector;
  malformed(field, "is a list of numbers that is neither a vector nor a quaternion");
}

Property declare(const std::string& name, const pb::FieldDescriptor& field, const pb::FieldOptions& rules) {
  Property declared;
  declared.name = name;
  declared.unit = rules.GetExtension(options::unit);
  declared.frame = rules.GetExtension(options::frame);
  declared.meaning = rules.GetExtension(options::meaning);
  if (rules.HasExtension(options::minimum)) declared.minimum = rules.GetExtension(options::minimum);
  if (rules.HasExtension(options::maximum)) declared.maximum = rules.GetExtension(options::maximum);
  declared.exclusive_minimum = rules.GetExtension(options::exclusive_minimum);
  switch (field.type()) {
    case pb::FieldDescriptor::TYPE_DOUBLE:
      declared.kind = field.is_repeated() ? list_kind(field, rules) : PropertyKind::kNumber;
      break;
    case pb::FieldDescriptor::TYPE_BOOL:
      declared.kind = PropertyKind::kFlag;
      break;
    case pb::FieldDescriptor::TYPE_UINT32:
      declared.kind = PropertyKind::kInteger;
      declared.minimum = std::max(declared.minimum, 0.0);
      declared.maximum = std::min(declared.maximum, 4294967295.0);
      break;
    default:
      malformed(field, "has a type that the scene language does not have");
  }
  return declared;
}

Form form_of(const pb::FieldDescriptor& field) {
  if (field.type() == pb::FieldDescriptor::TYPE_STRING) return field.is_repeated() ? Form::kTexts : Form::kText;
  if (field.type() != pb::FieldDescriptor::TYPE_MESSAGE) return Form::kNumbers;
  if (is_named(field.message_type(), "Value")) return Form::kValue;
  return is_named(field.message_type(), "Properties") ? Form::kProperties : Form::kBlock;
}

void read_default(const std::string& text, Entry* entry) {
  if (text.empty()) return;
  if (entry->is_block() && text == "{}") {
    entry->has_default_block = true;
    return;
  }
  Parser parser(text, 0);
  entry->default_value = parser.value(0);
  // written nowhere
  entry->default_value->position = {};
}

class Grammar {
 public:
  const BlockRule& rule(const pb::Descriptor& message) {
    std::unique_ptr<BlockRule>& slot = rules_[message.full_name()];
    if (slot == nullptr) {
      slot = std::make_unique<BlockRule>();
      fill(message, slot.get());
    }
    return *slot;
  }

 private:
  void fill(const pb::Descriptor& message, BlockRule* rule) {
    rule->name = message.name();
    rule->location = message.FindFieldByName("location");
    rule->places = message.FindFieldByName("places");
    for (int i = 0; i < message.field_count(); ++i) {
      const pb::FieldDescriptor& field = *message.field(i);
      if (field.options().GetExtension(options::internal)) continue;
      rule->entries.push_back(entry(field));
      rule->names.push_back(rule->entries.back().name);
    }
    if (rule->entries.size() > kMaximumEntries) malformed(*message.field(0), "stands in a block of more than 64 names");
    std::sort(rule->entries.begin(), rule->entries.end(),
              [](const Entry& a, const Entry& b) { return a.name < b.name; });
    for (std::size_t i = 0; i < rule->entries.size(); ++i) rule->entries[i].index = i;
  }

  Entry entry(const pb::FieldDescriptor& field) {
    const pb::FieldOptions& rules = field.options();
    Entry entry;
    entry.name = pascal_case(field.name());
    entry.field = &field;
    entry.form = form_of(field);
    entry.declared.name = entry.name;
    entry.declared.meaning = rules.GetExtension(options::meaning);
    if (entry.form == Form::kNumbers) entry.declared = declare(entry.name, field, rules);
    for (int i = 0; i < rules.ExtensionSize(options::choices); ++i)
      entry.choices.push_back(rules.GetExtension(options::choices, i));
    entry.is_required = rules.GetExtension(options::required);
    entry.is_identifier = rules.GetExtension(options::identifier);
    entry.is_joined = rules.GetExtension(options::joined);
    if (entry.form == Form::kBlock) entry.block = &rule(*field.message_type());
    if (rules.HasExtension(options::shorthand)) {
      entry.shorthand =
          entry.block == nullptr ? nullptr : entry.block->find(pascal_case(rules.GetExtension(options::shorthand)));
      if (entry.shorthand == nullptr) malformed(field, "has a shorthand for no property of its block");
    }
    read_default(rules.GetExtension(options::default_value), &entry);
    return entry;
  }

  std::map<std::string, std::unique_ptr<BlockRule>> rules_;
};

}  // namespace

std::string pascal_case(std::string_view snake) {
  std::string name;
  bool is_start = true;
  for (const char c : snake) {
    if (c != '_') name += is_start && c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
    is_start = c == '_';
  }
  return name;
}

std::string name_of(const pb::Descriptor& message, int field_number) {
  return pascal_case(message.FindFieldByNumber(field_number)->name());
}

const Entry* BlockRule::find(std::string_view wanted) const {
  const auto found = std::lower_bound(entries.begin(), entries.end(), wanted,
                                      [](const Entry& entry, std::string_view text) { return entry.name < text; });
  return found != entries.end() && found->name == wanted ? &*found : nullptr;
}

const BlockRule& grammar_of(const pb::Descriptor& message) {
  // all rules are made with these, so later look-ups change nothing and may come from any thread
  static Grammar grammar;
  static const bool made = (grammar.rule(*v1::Scene::descriptor()), grammar.rule(*v1::Addition::descriptor()), true);
  static_cast<void>(made);
  return grammar.rule(message);
}

const BlockRule& scene_grammar() { return grammar_of(*v1::Scene::descriptor()); }

}  // namespace gravitas::scene
