#include "services/scene/assign.h"

#include <algorithm>
#include <utility>

#include "plugin_sdk/near_miss.h"

namespace gravitas::scene {
namespace {

namespace pb = google::protobuf;

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

}  // namespace

std::string trim_reference(const std::string& what, std::string* text) {
  const auto first = std::find_if_not(text->begin(), text->end(), is_blank);
  const auto last = std::find_if_not(text->rbegin(), std::make_reverse_iterator(first), is_blank).base();
  if (first == text->begin() && last == text->end()) return {};
  std::string trimmed(first, last);
  std::string warning = what + " is \"" + *text + "\"; the blanks around \"" + trimmed + "\" are dropped";
  *text = std::move(trimmed);
  return warning;
}

namespace {

void trim(const Entry& entry, const TextPosition& position, std::string* text, Diagnostics* diagnostics) {
  if (const std::string warning = trim_reference(entry.name, text); !warning.empty())
    diagnostics->warning(position, warning);
}

// Checks one text of a property; trims ids.
bool check_text(const Entry& entry, PropertyValue* value, Diagnostics* diagnostics) {
  const bool is_list = entry.form == Form::kTexts;
  if (value->kind != PropertyValue::Kind::kText) {
    diagnostics->error(value->position, (is_list ? "an element of " : "") + entry.name + " is " + shown(*value) +
                                            "; allowed: " + (is_list ? "texts" : "a text") + " in double quotes");
    return false;
  }
  if (entry.is_identifier) {
    trim(entry, value->position, &value->text, diagnostics);
    const bool has_control = std::any_of(value->text.begin(), value->text.end(),
                                         [](char c) { return static_cast<unsigned char>(c) < 0x20U || c == 0x7F; });
    if (has_control) {
      diagnostics->error(value->position, entry.name +
                                              " holds a tab, a line end or the like; allowed: visible "
                                              "characters and blanks inside");
      return false;
    }
  }
  if (entry.is_required && value->text.empty()) {
    diagnostics->error(value->position, entry.name + " is empty; required: a text of at least one character");
    return false;
  }
  if (entry.choices.empty()) return true;
  if (std::find(entry.choices.begin(), entry.choices.end(), value->text) != entry.choices.end()) return true;
  diagnostics->error(value->position,
                     entry.name + " is " + shown(*value) + "; " + allowed_names(value->text, entry.choices));
  return false;
}

bool set_texts(const Entry& entry, PropertyValue* value, pb::Message* block, Diagnostics* diagnostics) {
  if (value->kind != PropertyValue::Kind::kList) {
    diagnostics->error(value->position, entry.name + " is " + shown(*value) + "; allowed: a list of texts, { \"…\" }");
    return false;
  }
  for (PropertyValue& element : value->list)
    if (!check_text(entry, &element, diagnostics)) return false;
  const pb::Reflection& reflection = *block->GetReflection();
  reflection.ClearField(block, entry.field);
  for (PropertyValue& element : value->list) reflection.AddString(block, entry.field, std::move(element.text));
  return true;
}

void set_numbers(const Entry& entry, const std::vector<double>& numbers, pb::Message* block) {
  const pb::Reflection& reflection = *block->GetReflection();
  if (entry.field->is_repeated()) {
    reflection.ClearField(block, entry.field);
    for (const double number : numbers) reflection.AddDouble(block, entry.field, number);
  } else if (entry.declared.kind == PropertyKind::kFlag) {
    reflection.SetBool(block, entry.field, numbers[0] != 0.0);
  } else if (entry.declared.kind == PropertyKind::kInteger) {
    reflection.SetUInt32(block, entry.field, static_cast<std::uint32_t>(numbers[0]));
  } else {
    reflection.SetDouble(block, entry.field, numbers[0]);
  }
}

bool check_and_set_numbers(const Entry& entry, const PropertyValue& value, pb::Message* block,
                           Diagnostics* diagnostics) {
  std::vector<double> numbers;
  std::vector<PropertyProblem> problems;
  const bool good = flatten_value(entry.declared, value, &numbers, &problems);
  diagnostics->add(problems, value.position, "");
  if (good) set_numbers(entry, numbers, block);
  return good;
}

bool set(const Entry& entry, PropertyValue value, pb::Message* block, Diagnostics* diagnostics) {
  const pb::Reflection& reflection = *block->GetReflection();
  switch (entry.form) {
    case Form::kNumbers:
      return check_and_set_numbers(entry, value, block, diagnostics);
    case Form::kText:
      if (!check_text(entry, &value, diagnostics)) return false;
      reflection.SetString(block, entry.field, std::move(value.text));
      return true;
    case Form::kTexts:
      return set_texts(entry, &value, block, diagnostics);
    case Form::kValue:
      to_message(std::move(value), static_cast<v1::Value*>(reflection.MutableMessage(block, entry.field)));
      return true;
    case Form::kBlock:
    case Form::kProperties:
      break;
  }
  return false;
}

}  // namespace

void assign(const BlockRule& rule, const Entry& entry, PropertyValue value, pb::Message* block,
            Diagnostics* diagnostics) {
  const TextPosition position = value.position;
  if (!set(entry, std::move(value), block, diagnostics) || rule.places == nullptr) return;
  if (!position.known()) return;
  const pb::Reflection& reflection = *block->GetReflection();
  for (const std::uint32_t number :
       {static_cast<std::uint32_t>(entry.field->number()), position.file, position.line, position.column})
    reflection.AddUInt32(block, rule.places, number);
}

void assign_property(std::string_view name, const TextPosition& name_position, PropertyValue value,
                     v1::Properties* properties) {
  v1::Property* property = nullptr;
  for (v1::Property& candidate : *properties->mutable_property())
    if (candidate.name() == name) property = &candidate;
  if (property == nullptr) property = properties->add_property();
  property->set_name(std::string(name));
  set_location(name_position, property->mutable_location());
  to_message(std::move(value), property->mutable_value());
}

void fill_defaults(const BlockRule& rule, std::uint64_t present, pb::Message* block, Diagnostics* diagnostics) {
  const pb::Reflection& reflection = *block->GetReflection();
  for (const Entry& entry : rule.entries) {
    if ((present >> entry.index & 1U) != 0) continue;
    if (entry.is_block() && (entry.has_default_block || entry.default_value.has_value())) {
      pb::Message* inner = reflection.MutableMessage(block, entry.field);
      std::uint64_t inner_present = 0;
      if (entry.default_value.has_value()) {
        assign(*entry.block, *entry.shorthand, *entry.default_value, inner, diagnostics);
        inner_present = std::uint64_t{1} << entry.shorthand->index;
      }
      fill_defaults(*entry.block, inner_present, inner, diagnostics);
    } else if (entry.default_value.has_value()) {
      assign(rule, entry, *entry.default_value, block, diagnostics);
    }
  }
}

void set_location(const TextPosition& position, v1::Location* location) {
  location->set_file(position.file);
  location->set_line(position.line);
  location->set_column(position.column);
}

void to_message(PropertyValue value, v1::Value* message) {
  message->set_file(value.position.file);
  message->set_line(value.position.line);
  message->set_column(value.position.column);
  switch (value.kind) {
    case PropertyValue::Kind::kNumber:
      message->set_number(value.number);
      break;
    case PropertyValue::Kind::kText:
      message->set_text(std::move(value.text));
      break;
    case PropertyValue::Kind::kFlag:
      message->set_flag(value.flag);
      break;
    case PropertyValue::Kind::kList:
      message->mutable_list()->clear_value();
      message->mutable_list()->mutable_value()->Reserve(static_cast<int>(value.list.size()));
      for (PropertyValue& element : value.list) to_message(std::move(element), message->mutable_list()->add_value());
      break;
  }
}

PropertyValue from_message(const v1::Value& message) {
  PropertyValue value;
  switch (message.kind_case()) {
    case v1::Value::kText:
      value = PropertyValue::of(message.text());
      break;
    case v1::Value::kFlag:
      value = PropertyValue::of(message.flag());
      break;
    case v1::Value::kList:
      value.kind = PropertyValue::Kind::kList;
      value.list.reserve(static_cast<std::size_t>(message.list().value_size()));
      for (const v1::Value& element : message.list().value()) value.list.push_back(from_message(element));
      break;
    case v1::Value::kNumber:
    case v1::Value::KIND_NOT_SET:
      value = PropertyValue::of(message.number());
      break;
  }
  value.position = {message.file(), message.line(), message.column()};
  return value;
}

std::vector<NamedValue> named_values(const v1::Properties& properties) {
  std::vector<NamedValue> values;
  values.reserve(static_cast<std::size_t>(properties.property_size()));
  for (const v1::Property& property : properties.property())
    values.push_back({property.name(), from_message(property.value()), place_of(property.location())});
  return values;
}

}  // namespace gravitas::scene
