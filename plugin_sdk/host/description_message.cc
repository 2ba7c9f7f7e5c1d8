#include "plugin_sdk/host/description_message.h"

namespace gravitas::host {
namespace {

void write_property(const Property& property, plugin::v1::Property* message) {
  message->set_name(property.name);
  message->set_kind(static_cast<plugin::v1::Property::Kind>(property.kind));
  message->set_unit(property.unit);
  message->set_frame(property.frame);
  message->set_minimum(property.minimum);
  message->set_maximum(property.maximum);
  message->set_exclusive_minimum(property.exclusive_minimum);
  message->set_required(property.is_required);
  for (const double number : property.default_numbers) message->add_default_numbers(number);
  for (const std::string& choice : property.choices) message->add_choices(choice);
  message->set_columns(property.columns);
  message->set_live(property.is_live);
  message->set_meaning(property.meaning);
}

Property read_property(const plugin::v1::Property& message) {
  Property property;
  property.name = message.name();
  property.kind = static_cast<PropertyKind>(message.kind());
  property.unit = message.unit();
  property.frame = message.frame();
  property.minimum = message.minimum();
  property.maximum = message.maximum();
  property.exclusive_minimum = message.exclusive_minimum();
  property.is_required = message.required();
  property.default_numbers.assign(message.default_numbers().begin(), message.default_numbers().end());
  property.choices.assign(message.choices().begin(), message.choices().end());
  property.columns = message.columns();
  property.is_live = message.live();
  property.meaning = message.meaning();
  return property;
}

}  // namespace

plugin::v1::Description to_message(const PluginDeclaration& declaration) {
  plugin::v1::Description message;
  message.set_name(declaration.name);
  message.set_version(declaration.version);
  message.set_slot(static_cast<plugin::v1::Slot>(declaration.slot));
  message.set_meaning(declaration.meaning);
  for (const std::string& capability : declaration.capabilities) message.add_capabilities(capability);
  for (const TypeDeclaration& type : declaration.types) {
    plugin::v1::Type* typed = message.add_types();
    typed->set_name(type.name);
    typed->set_meaning(type.meaning);
    for (const Property& property : type.properties) write_property(property, typed->add_properties());
    for (const CoordinateDeclaration& coordinate : type.coordinates) {
      plugin::v1::Coordinate* one = typed->add_coordinates();
      one->set_name(coordinate.name);
      one->set_unit(coordinate.unit);
      one->set_meaning(coordinate.meaning);
    }
  }
  for (const Property& property : declaration.properties) write_property(property, message.add_properties());
  message.set_theta(declaration.theta);
  message.set_build_id(GRAVITAS_BUILD_ID);
  return message;
}

PluginDeclaration from_message(const plugin::v1::Description& message) {
  PluginDeclaration declaration;
  declaration.name = message.name();
  declaration.version = message.version();
  declaration.slot = static_cast<Slot>(message.slot());
  declaration.meaning = message.meaning();
  declaration.capabilities.assign(message.capabilities().begin(), message.capabilities().end());
  for (const plugin::v1::Type& typed : message.types()) {
    TypeDeclaration type{typed.name(), typed.meaning(), {}};
    for (const plugin::v1::Property& property : typed.properties()) type.properties.push_back(read_property(property));
    for (const plugin::v1::Coordinate& one : typed.coordinates())
      type.coordinates.push_back({one.name(), one.unit(), one.meaning()});
    declaration.types.push_back(std::move(type));
  }
  for (const plugin::v1::Property& property : message.properties())
    declaration.properties.push_back(read_property(property));
  declaration.theta = message.theta();
  return declaration;
}

}  // namespace gravitas::host
