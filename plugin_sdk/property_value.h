// Values as an author writes them, checked against declared properties and flattened to the numbers
// that a plugin receives (plugin_sdk/property.h). The scene reader checks its own properties
// through the same functions, so that a bound, a list length or a quaternion is refused in the same
// words wherever it stands.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "plugin_sdk/property.h"

namespace gravitas {

// Where something stands in a text: row of a list of files that the caller keeps, line and column
// from 1. Line 0 means nowhere.
struct TextPosition {
  std::uint32_t file = 0;
  std::uint32_t line = 0;
  std::uint32_t column = 0;

  bool known() const { return line != 0; }
  friend bool operator==(const TextPosition&, const TextPosition&) = default;
};

struct PropertyValue {
  enum class Kind : std::uint32_t { kNumber, kText, kFlag, kList };

  Kind kind = Kind::kNumber;
  double number = 0.0;
  bool flag = false;
  std::string text;
  std::vector<PropertyValue> list;
  TextPosition position;

  static PropertyValue of(double number);
  static PropertyValue of(bool flag);
  static PropertyValue of(std::string text);
  static PropertyValue of(const char* text) { return of(std::string(text)); }
  static PropertyValue of(std::vector<PropertyValue> list);
  // A list of numbers.
  static PropertyValue numbers(std::span<const double> numbers);
};

// `Name = value`; `position` is that of the name.
struct NamedValue {
  std::string name;
  PropertyValue value;
  TextPosition position;
};

struct PropertyProblem {
  // Of the value or name that is wrong; nowhere if something is missing: then it is about the whole
  // block.
  TextPosition position;
  // What is wrong; what is allowed.
  std::string text;
  bool is_warning = false;
};

// Checks one value and appends its numbers to *out. Returns false, having appended nothing, if it
// is wrong. Checked: the kind of value, list lengths, that every number is finite and within the
// declared bounds, that an integer is whole, that a choice is one of those declared, and that a
// quaternion is unit: a norm within 1e-3 of 1 is repaired with a warning, an error of rounding's
// size (1e-15 in the squared norm) is left as it is. Rows of a table may nest: {t, {x, y, z}} is a
// row of four.
bool flatten_value(const Property& declared, const PropertyValue& given, std::vector<double>* out,
                   std::vector<PropertyProblem>* problems);

// Checks the values given against all declared properties and appends the numbers of every declared
// property, in the order of declaration, to *out. Besides the checks above: unknown names (with a
// suggestion), names given twice, required properties that are missing. Absent properties take
// their default, else NaN (a table: no rows). Returns false if there was an error; then *out must
// not be used.
bool flatten(const std::vector<Property>& declared, const std::vector<NamedValue>& given, std::vector<double>* out,
             std::vector<PropertyProblem>* problems);

// How many of the flattened numbers that begin with this property's are its: a table says so itself. 0 if they end before.
std::size_t flat_size_of(const Property& declared, std::span<const double> numbers);

// Times at which tables over time (Property::table) jump or bend, s, as they come; they are constant before and after.
std::vector<double> bends_of(const std::vector<Property>& declared, std::span<const double> numbers);

// The times of all rows of such tables, as they come.
std::vector<double> times_of(const std::vector<Property>& declared, std::span<const double> numbers);

// Checks flattened values, which may come from anywhere: their number, and that each is one that its
// property takes. Empty, or what is wrong; what is allowed.
std::string check_flattened(const std::vector<Property>& declared, std::span<const double> numbers);

// What a property takes: "a number > 0", "a list of 3 numbers", "one of "World", "Body"".
std::string allowed_values(const Property& declared);

// A value as an error message shows it: `0.5`, `"text"`, `true`, `a list of 3`.
std::string shown(const PropertyValue& value);

// The shortest text that reads back as the same number.
std::string number_text(double number);

}  // namespace gravitas
