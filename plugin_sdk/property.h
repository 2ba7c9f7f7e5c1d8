// Typed properties: declared once by a plugin, used to parse and check a scene, by `gravitas describe`, and in
// the documentation.
//
//   Property::number("Radius", "m").above(0.0).required().means("Radius of the sphere.")
//
// A plugin receives the values of its properties as plain numbers, flattened in the order of declaration:
// a number, integer, flag (1 or 0) or choice (its position) takes one, a vector three, a quaternion four
// (w, x, y, z), a table its row count followed by its rows, a body its row in the columns of bodies. A property that may be absent and is, is NaN
// (a table: zero rows). PropertyCursor reads them back in the same order.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "plugin_sdk/math/types.h"

namespace gravitas {

enum class PropertyKind : std::uint32_t {
  kNumber = 1,
  kInteger = 2,
  kFlag = 3,
  kChoice = 4,
  kVector = 5,
  kQuaternion = 6,
  kTable = 7,
  kBody = 8  // named by its id in a scene
};

struct Property {
  std::string name;
  PropertyKind kind = PropertyKind::kNumber;
  std::string unit;
  std::string frame;
  // Bounds of each number, inclusive unless exclusive_minimum says otherwise.
  double minimum = -std::numeric_limits<double>::infinity();
  double maximum = std::numeric_limits<double>::infinity();
  bool exclusive_minimum = false;
  bool is_required = false;
  // Empty where the property must be given or may be absent.
  std::vector<double> default_numbers;
  std::vector<std::string> choices;
  std::uint32_t columns = 0;  // of a table
  // May be changed while the simulation runs, by `gravitas ctl set`. Of a plugin's own properties only: those of types are
  // part of the scene, of which `gravitas ctl edit` changes any.
  bool is_live = false;
  std::string meaning;

  static Property number(std::string name, std::string unit);
  static Property integer(std::string name);
  static Property flag(std::string name);
  static Property choice(std::string name, std::vector<std::string> choices);
  static Property vector(std::string name, std::string unit, std::string frame);
  static Property quaternion(std::string name, std::string frame);
  // With a unit that begins with "s," the first column is a time, which ascends from row to row; twice the same is a
  // jump. At jumps of forces steps end, and what is asked before is asked on that side.
  static Property table(std::string name, std::uint32_t columns, std::string unit, std::string frame);
  // May be absent. Of forces only.
  static Property body(std::string name);

  Property at_least(double bound) &&;
  Property above(double bound) &&;
  Property at_most(double bound) &&;
  Property required() &&;
  Property defaults_to(std::vector<double> numbers) &&;
  Property live() &&;
  Property means(std::string sentence) &&;

  // Numbers the value takes when flattened; for a table that of its smallest form (the row count).
  std::size_t flat_size() const;
};

// Reads flattened values in the order of declaration. Reading past the end, or a number that is none of the
// kind (also the NaN of an absent value, unless read as a number, vector or quaternion), throws
// std::out_of_range: the host turns it into a refusal.
class PropertyCursor {
 public:
  explicit PropertyCursor(std::span<const double> numbers) : numbers_(numbers) {}

  double number();
  std::int64_t integer();
  bool flag();
  std::uint32_t choice();
  Vector3 vector();
  Quaternion quaternion();
  // Rows of `columns` numbers each.
  std::span<const double> table(std::uint32_t columns);
  // Row of a body, or GRAVITAS_NONE where none is named.
  std::uint32_t body();
  // True when every number has been read.
  bool at_end() const { return position_ == numbers_.size(); }

 private:
  std::span<const double> take(std::size_t count);

  std::span<const double> numbers_;
  std::size_t position_ = 0;
};

}  // namespace gravitas
