#include "plugin_sdk/property.h"

#include <cmath>
#include <stdexcept>
#include <utility>

#include "schemas/frame/layout.h"

namespace gravitas {
namespace {

Property make(PropertyKind kind, std::string name, std::string unit, std::string frame) {
  Property property;
  property.kind = kind;
  property.name = std::move(name);
  property.unit = std::move(unit);
  property.frame = std::move(frame);
  return property;
}

}  // namespace

Property Property::number(std::string name, std::string unit) {
  return make(PropertyKind::kNumber, std::move(name), std::move(unit), "");
}

Property Property::integer(std::string name) { return make(PropertyKind::kInteger, std::move(name), "count", ""); }

Property Property::flag(std::string name) { return make(PropertyKind::kFlag, std::move(name), "", ""); }

Property Property::choice(std::string name, std::vector<std::string> choices) {
  Property property = make(PropertyKind::kChoice, std::move(name), "", "");
  property.choices = std::move(choices);
  return property;
}

Property Property::vector(std::string name, std::string unit, std::string frame) {
  return make(PropertyKind::kVector, std::move(name), std::move(unit), std::move(frame));
}

Property Property::quaternion(std::string name, std::string frame) {
  return make(PropertyKind::kQuaternion, std::move(name), "1", std::move(frame));
}

Property Property::table(std::string name, std::uint32_t columns, std::string unit, std::string frame) {
  Property property = make(PropertyKind::kTable, std::move(name), std::move(unit), std::move(frame));
  property.columns = columns;
  return property;
}

Property Property::body(std::string name) { return make(PropertyKind::kBody, std::move(name), "", ""); }

Property Property::at_least(double bound) && {
  minimum = bound;
  return std::move(*this);
}

Property Property::above(double bound) && {
  minimum = bound;
  exclusive_minimum = true;
  return std::move(*this);
}

Property Property::at_most(double bound) && {
  maximum = bound;
  return std::move(*this);
}

Property Property::required() && {
  is_required = true;
  return std::move(*this);
}

Property Property::defaults_to(std::vector<double> numbers) && {
  default_numbers = std::move(numbers);
  return std::move(*this);
}

Property Property::live() && {
  is_live = true;
  return std::move(*this);
}

Property Property::means(std::string sentence) && {
  meaning = std::move(sentence);
  return std::move(*this);
}

std::size_t Property::flat_size() const {
  if (kind == PropertyKind::kVector) return 3;
  if (kind == PropertyKind::kQuaternion) return 4;
  return 1;
}

std::span<const double> PropertyCursor::take(std::size_t count) {
  if (count > numbers_.size() - position_) throw std::out_of_range("fewer numbers than the declared properties take");
  const std::span<const double> taken = numbers_.subspan(position_, count);
  position_ += count;
  return taken;
}

double PropertyCursor::number() { return take(1)[0]; }

std::int64_t PropertyCursor::integer() {
  const double value = number();
  if (!(std::fabs(value) <= 9.0e15) || value != std::floor(value)) throw std::out_of_range("not a whole number");
  return static_cast<std::int64_t>(value);
}

bool PropertyCursor::flag() {
  const double value = number();
  if (value != 0.0 && value != 1.0) throw std::out_of_range("neither true nor false");
  return value != 0.0;
}

std::uint32_t PropertyCursor::choice() {
  const std::int64_t position = integer();
  if (position < 0 || position > std::numeric_limits<std::uint32_t>::max())
    throw std::out_of_range("not the position of a choice");
  return static_cast<std::uint32_t>(position);
}

std::uint32_t PropertyCursor::body() {
  const double value = number();
  if (std::isnan(value)) return GRAVITAS_NONE;
  if (!(value >= 0.0 && value < GRAVITAS_NONE) || value != std::floor(value))
    throw std::out_of_range("not the row of a body");
  return static_cast<std::uint32_t>(value);
}

Vector3 PropertyCursor::vector() {
  const std::span<const double> v = take(3);
  return {v[0], v[1], v[2]};
}

Quaternion PropertyCursor::quaternion() {
  const std::span<const double> q = take(4);
  return {q[0], q[1], q[2], q[3]};
}

std::span<const double> PropertyCursor::table(std::uint32_t columns) {
  const std::int64_t rows = integer();
  if (rows < 0) throw std::out_of_range("a table with a negative number of rows");
  return take(static_cast<std::size_t>(rows) * columns);
}

}  // namespace gravitas
