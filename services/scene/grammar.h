// The grammar of the scene language, read from the descriptors of
// schemas/gravitas/scene/v1/scene.proto: which names a block may hold, what their values are and
// which rules they obey. Reader, overrides and builder look everything up here; nothing about a
// name is written anywhere else.
#pragma once

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "plugin_sdk/property_value.h"

namespace gravitas::scene {

struct BlockRule;

enum class Form : std::uint32_t {
  kNumbers,     // a number, whole number, flag, vector or quaternion: `declared` says which
  kText,        // a text, one of `choices` if there are any
  kTexts,       // a list of texts
  kValue,       // any value
  kBlock,       // `Name { … }` with the names of `block`
  kProperties,  // `Name { … }` with names that a plugin declares
};

// A name inside a block.
struct Entry {
  std::string name;  // PascalCase, as in a scene
  const google::protobuf::FieldDescriptor* field = nullptr;
  Form form = Form::kNumbers;
  Property declared;                 // bounds and kind of kNumbers; name of all
  std::vector<std::string> choices;  // of kText
  bool is_required = false;
  bool is_identifier = false;
  bool is_joined = false;
  bool has_default_block = false;              // there with its own defaults, written or not
  std::optional<PropertyValue> default_value;  // of a property, or the shorthand of a block
  const Entry* shorthand = nullptr;            // of a block: the property that `Name = value` sets
  const BlockRule* block = nullptr;
  std::size_t index = 0;  // in BlockRule::entries

  bool is_block() const { return form == Form::kBlock || form == Form::kProperties; }
};

struct BlockRule {
  std::string name;
  std::vector<Entry> entries;      // sorted by name; at most 64
  std::vector<std::string> names;  // in the order of the schema
  const google::protobuf::FieldDescriptor* location = nullptr;
  const google::protobuf::FieldDescriptor* places = nullptr;  // null if the block has no properties

  const Entry* find(std::string_view wanted) const;
};

// The rule of the whole scene, made on the first call and kept.
const BlockRule& scene_grammar();

// The rule of a block's message type.
const BlockRule& grammar_of(const google::protobuf::Descriptor& message);

// "body1" -> "Body1", "mass_density" -> "MassDensity".
std::string pascal_case(std::string_view snake);

// The name under which a field stands in a scene.
std::string name_of(const google::protobuf::Descriptor& message, int field_number);

}  // namespace gravitas::scene
