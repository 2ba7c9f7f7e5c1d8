// Puts values into the scene's messages, by the rules of the grammar. Reading a file and applying
// an override go through the same functions, so both refuse the same things in the same words.
#pragma once

#include <google/protobuf/message.h>

#include "services/scene/grammar.h"
#include "services/scene/problem.h"

namespace gravitas::scene {

// Checks the value of a property (no block) and sets the field of `block`, together with its place.
// Blanks around ids are trimmed with a warning. A value that breaks a rule is reported and sets
// nothing.
void assign(const BlockRule& rule, const Entry& entry, PropertyValue value, google::protobuf::Message* block,
            Diagnostics* diagnostics);

// Drops the blanks around a reference; returns a warning that says so of `what`, empty if there are none.
std::string trim_reference(const std::string& what, std::string* text);

// Sets `Name = value` among properties that a plugin declares; one of that name is replaced.
void assign_property(std::string_view name, const TextPosition& name_position, PropertyValue value,
                     v1::Properties* properties);

// Gives every property and block that has a default and is absent its default. `present` has the
// bit of Entry::index set for every name that is there.
void fill_defaults(const BlockRule& rule, std::uint64_t present, google::protobuf::Message* block,
                   Diagnostics* diagnostics);

void set_location(const TextPosition& position, v1::Location* location);

// Free values and back.
void to_message(PropertyValue value, v1::Value* message);
PropertyValue from_message(const v1::Value& message);

// All properties of a block of free properties.
std::vector<NamedValue> named_values(const v1::Properties& properties);

}  // namespace gravitas::scene
