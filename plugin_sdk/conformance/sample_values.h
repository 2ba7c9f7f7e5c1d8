// Values for declared properties: what a scene could give for types that the kit knows by their declaration only,
// and what it gives for those of the scene language.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "plugin_sdk/conformance/conformance.h"
#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/plugin.h"
#include "plugin_sdk/property_value.h"

namespace gravitas::conformance {

// Flattened values within the declared bounds: the default where there is one, nothing where the property may be
// absent, else drawn. Vectors without unit are directions and perpendicular to each other (the axes of a joint);
// tables have eight rows whose first column ascends.
std::vector<double> sample_values(const std::vector<Property>& properties, Draw* draw);

// Draws values of every property in place of such values, also of those that have a default or may be absent, unless what is
// asked with these is refused each time. In another state they may be refused still: make_varied_case(). Bodies that may be absent stay so: what a force says of two bodies depends on
// all that it is applied to.
void vary(const std::vector<Property>& properties, Draw* draw, std::vector<double>* values,
          const std::function<Answer()>& asked);

// "Spring (Stiffness 2, Frame Body)": a type with the values that are given, for findings.
std::string shown(const TypeDeclaration& type, const std::vector<double>& values);

// Such values with the directions that may be absent given, too: orthonormal ones.
std::vector<double> with_directions(const std::vector<Property>& properties, const std::vector<double>& values,
                                    Draw* draw);

// Numbers of properties that name bodies by their rows, after these have got new places.
void rename_bodies(const std::vector<Property>& properties, std::span<const std::uint32_t> place,
                   std::vector<double>* values);

// The settings of a plugin that a scene says nothing about.
std::vector<double> default_settings(const PluginDeclaration& declaration);

// `Name = value` in a scene.
NamedValue given(std::string name, double value);
NamedValue given(std::string name, const Vector3& value);
NamedValue given(std::string name, const char* choice);
NamedValue given(std::string name, bool flag);

// Flattened values of a type as a scene gives them; a Finding if the declaration does not take them.
std::vector<double> flattened(const TypeDeclaration& type, const std::vector<NamedValue>& values);

// The declaration of a type, or null.
const TypeDeclaration* find_type(const PluginDeclaration& declaration, std::string_view name);

// Those declared types for which questions can be made: the `known` ones of the scene language, and others unless they
// refuse drawn values (a list of faces, say, cannot be drawn). `probe` asks the subject with freshly drawn values. A refusal
// is told in `refusal`, if there is one and it is wanted.
std::vector<TypeDeclaration> askable_types(const PluginDeclaration& declaration, std::span<const char* const> known,
                                           std::string* refusal,
                                           const std::function<Answer(const TypeDeclaration&, Draw*)>& probe);
// A case by which there is at least one.
Case make_types_case(std::string name, std::function<std::vector<TypeDeclaration>(Subject&, std::string*)> askable);

// The number behind the capability `name=`, or `otherwise`.
double capability_number(const PluginDeclaration& declaration, std::string_view name, double otherwise);

}  // namespace gravitas::conformance
