#include "plugin_sdk/property_value.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <utility>

#include "plugin_sdk/checks.h"
#include "plugin_sdk/counted.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/near_miss.h"

namespace gravitas {
namespace {

// One number of a flattened value.
bool takes(const Property& p, double number) {
  if (!std::isfinite(number) || number > p.maximum || number < p.minimum) return false;
  if (p.exclusive_minimum && number == p.minimum) return false;
  if (p.kind == PropertyKind::kFlag) return number == 0.0 || number == 1.0;
  if (p.kind == PropertyKind::kChoice && (number < 0.0 || number >= static_cast<double>(p.choices.size())))
    return false;
  if (p.kind == PropertyKind::kBody && !(number >= 0.0 && number < GRAVITAS_NONE)) return false;
  const bool is_whole =
      p.kind == PropertyKind::kInteger || p.kind == PropertyKind::kChoice || p.kind == PropertyKind::kBody;
  return !is_whole || number == std::floor(number);
}

constexpr double kNormTolerance = 1e-3;
constexpr double kRoundingOfSquaredNorm = 1e-15;
constexpr double kLargestInteger = 9.0e15;
constexpr std::size_t kShownCharacters = 60;
// Unknown names beyond this number tell nothing new.
constexpr std::size_t kMostProblems = 20;

using Kind = PropertyValue::Kind;

bool wrong(const PropertyValue& value, std::string text, std::vector<PropertyProblem>* problems) {
  problems->push_back({value.position, std::move(text), false});
  return false;
}

bool refuse(const Property& declared, const PropertyValue& value, std::vector<PropertyProblem>* problems) {
  return wrong(value, declared.name + " is " + shown(value) + "; allowed: " + allowed_values(declared), problems);
}

std::string bounds_text(const Property& declared) {
  const bool below = std::isfinite(declared.minimum), above = std::isfinite(declared.maximum);
  if (!below && !above) return "";
  const std::string minimum = number_text(declared.minimum), maximum = number_text(declared.maximum);
  if (!above) return (declared.exclusive_minimum ? " > " : " >= ") + minimum;
  if (!below) return " <= " + maximum;
  return (declared.exclusive_minimum ? " in (" : " in [") + minimum + ", " + maximum + "]";
}

bool in_bounds(const Property& declared, double number) {
  if (!std::isfinite(number)) return false;
  const bool above = declared.exclusive_minimum ? number > declared.minimum : number >= declared.minimum;
  return above && number <= declared.maximum;
}

// One number of a list: an element that is none, or out of bounds, is named by its own position.
bool take_number(const Property& declared, const PropertyValue& element, std::vector<double>* out,
                 std::vector<PropertyProblem>* problems) {
  if (element.kind != Kind::kNumber || !in_bounds(declared, element.number)) {
    return wrong(element,
                 "an element of " + declared.name + " is " + shown(element) + "; allowed: " + allowed_values(declared),
                 problems);
  }
  out->push_back(element.number);
  return true;
}

bool take_list(const Property& declared, std::size_t length, const PropertyValue& given, std::vector<double>* out,
               std::vector<PropertyProblem>* problems) {
  if (given.kind != Kind::kList || given.list.size() != length) return refuse(declared, given, problems);
  for (const PropertyValue& element : given.list)
    if (!take_number(declared, element, out, problems)) return false;
  return true;
}

bool take_quaternion(const Property& declared, const PropertyValue& given, std::vector<double>* out,
                     std::vector<PropertyProblem>* problems) {
  const std::size_t start = out->size();
  if (!take_list(declared, 4, given, out, problems)) return false;
  double* q = out->data() + start;
  const double squared = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
  if (std::fabs(squared - 1.0) <= kRoundingOfSquaredNorm) return true;
  const double norm = std::sqrt(squared);
  if (!(std::fabs(norm - 1.0) <= kNormTolerance)) {
    return wrong(given,
                 declared.name + " has the norm " + number_text(norm) + "; allowed: " + allowed_values(declared) +
                     " with norm 1 (within 1e-3)",
                 problems);
  }
  const Quaternion unit = normalized(Quaternion(q[0], q[1], q[2], q[3]));
  q[0] = unit.w(), q[1] = unit.x(), q[2] = unit.y(), q[3] = unit.z();
  // numbers written with nine digits or more are meant to be unit
  if (std::fabs(norm - 1.0) > 1e-9) {
    problems->push_back(
        {given.position, declared.name + " has the norm " + number_text(norm) + " and was normalised", true});
  }
  return true;
}

// A table whose first column is a time.
bool is_over_time(const Property& table) { return table.unit.starts_with("s,"); }

// Numbers of one row of a table, whatever the nesting inside it.
bool take_row(const Property& declared, const PropertyValue& row, std::vector<double>* out,
              std::vector<PropertyProblem>* problems) {
  if (row.kind != Kind::kList) return take_number(declared, row, out, problems);
  for (const PropertyValue& element : row.list)
    if (!take_row(declared, element, out, problems)) return false;
  return true;
}

bool take_table(const Property& declared, const PropertyValue& given, std::vector<double>* out,
                std::vector<PropertyProblem>* problems) {
  if (given.kind != Kind::kList) return refuse(declared, given, problems);
  out->push_back(static_cast<double>(given.list.size()));
  for (const PropertyValue& row : given.list) {
    const std::size_t before = out->size();
    if (!take_row(declared, row, out, problems)) return false;
    if (out->size() - before != declared.columns) {
      return wrong(row,
                   "a row of " + declared.name + " has " + counted(out->size() - before, "number") +
                       "; allowed: " + allowed_values(declared),
                   problems);
    }
    if (!is_over_time(declared)) continue;
    // the times of this row, the one before, and the one before that
    const double* time = &(*out)[before];
    const auto columns = static_cast<std::ptrdiff_t>(declared.columns);
    const std::ptrdiff_t row_number = &row - given.list.data();
    if ((row_number > 0 && time[0] < time[-columns]) || (row_number > 1 && time[0] == time[-2 * columns]))
      return wrong(row,
                   declared.name + " has the time " + number_text(time[0]) + " after " + number_text(time[-columns]) +
                       "; allowed: times that ascend, two of a jump the same",
                   problems);
  }
  return true;
}

bool take_choice(const Property& declared, const PropertyValue& given, std::vector<double>* out,
                 std::vector<PropertyProblem>* problems) {
  if (given.kind != Kind::kText) return refuse(declared, given, problems);
  for (std::size_t i = 0; i < declared.choices.size(); ++i) {
    if (given.text != declared.choices[i]) continue;
    out->push_back(static_cast<double>(i));
    return true;
  }
  return wrong(given, declared.name + " is " + shown(given) + "; " + allowed_names(given.text, declared.choices),
               problems);
}

bool take(const Property& declared, const PropertyValue& given, std::vector<double>* out,
          std::vector<PropertyProblem>* problems) {
  switch (declared.kind) {
    case PropertyKind::kNumber:
      if (given.kind != Kind::kNumber || !in_bounds(declared, given.number)) return refuse(declared, given, problems);
      out->push_back(given.number);
      return true;
    case PropertyKind::kInteger:
      if (given.kind != Kind::kNumber || !in_bounds(declared, given.number) ||
          given.number != std::floor(given.number) || std::fabs(given.number) > kLargestInteger)
        return refuse(declared, given, problems);
      out->push_back(given.number);
      return true;
    case PropertyKind::kBody:  // whoever knows the bodies has put the row in the id's place
      if (given.kind != Kind::kNumber || !(given.number >= 0.0)) return refuse(declared, given, problems);
      out->push_back(given.number);
      return true;
    case PropertyKind::kFlag:
      if (given.kind != Kind::kFlag) return refuse(declared, given, problems);
      out->push_back(given.flag ? 1.0 : 0.0);
      return true;
    case PropertyKind::kChoice:
      return take_choice(declared, given, out, problems);
    case PropertyKind::kVector:
      return take_list(declared, 3, given, out, problems);
    case PropertyKind::kQuaternion:
      return take_quaternion(declared, given, out, problems);
    case PropertyKind::kTable:
      return take_table(declared, given, out, problems);
  }
  return wrong(given, declared.name + " has a kind that this version does not know; it cannot be given", problems);
}

void append_absent(const Property& property, std::vector<double>* out) {
  if (!property.default_numbers.empty()) {
    out->insert(out->end(), property.default_numbers.begin(), property.default_numbers.end());
  } else if (property.kind == PropertyKind::kTable) {
    out->push_back(0.0);
  } else {
    out->insert(out->end(), property.flat_size(), std::numeric_limits<double>::quiet_NaN());
  }
}

std::vector<std::string> names_of(const std::vector<Property>& declared) {
  std::vector<std::string> names;
  for (const Property& property : declared) names.push_back(property.name);
  return names;
}

// For each declared property the value given, or none.
bool match_names(const std::vector<Property>& declared, const std::vector<NamedValue>& given,
                 std::vector<const NamedValue*>* found, std::vector<PropertyProblem>* problems) {
  bool good = true;
  found->assign(declared.size(), nullptr);
  for (const NamedValue& value : given) {
    if (problems->size() >= kMostProblems) return false;
    std::size_t i = 0;
    while (i < declared.size() && declared[i].name != value.name) ++i;
    if (i == declared.size()) {
      problems->push_back({value.position,
                           "unknown property \"" + value.name + "\"; " + allowed_names(value.name, names_of(declared)),
                           false});
      good = false;
    } else if ((*found)[i] != nullptr) {
      problems->push_back({value.position, value.name + " is given twice; allowed: once", false});
      good = false;
    } else {
      (*found)[i] = &value;
    }
  }
  return good;
}

}  // namespace

PropertyValue PropertyValue::of(double number) {
  PropertyValue value;
  value.kind = Kind::kNumber;
  value.number = number;
  return value;
}

PropertyValue PropertyValue::of(bool flag) {
  PropertyValue value;
  value.kind = Kind::kFlag;
  value.flag = flag;
  return value;
}

PropertyValue PropertyValue::of(std::string text) {
  PropertyValue value;
  value.kind = Kind::kText;
  value.text = std::move(text);
  return value;
}

PropertyValue PropertyValue::of(std::vector<PropertyValue> list) {
  PropertyValue value;
  value.kind = Kind::kList;
  value.list = std::move(list);
  return value;
}

PropertyValue PropertyValue::numbers(std::span<const double> numbers) {
  PropertyValue value;
  value.kind = Kind::kList;
  for (const double number : numbers) value.list.push_back(of(number));
  return value;
}

bool flatten_value(const Property& declared, const PropertyValue& given, std::vector<double>* out,
                   std::vector<PropertyProblem>* problems) {
  const std::size_t start = out->size();
  if (take(declared, given, out, problems)) return true;
  out->resize(start);
  return false;
}

bool flatten(const std::vector<Property>& declared, const std::vector<NamedValue>& given, std::vector<double>* out,
             std::vector<PropertyProblem>* problems) {
  std::vector<const NamedValue*> found;
  bool good = match_names(declared, given, &found, problems);
  for (std::size_t i = 0; i < declared.size(); ++i) {
    const Property& property = declared[i];
    if (found[i] != nullptr) {
      good = flatten_value(property, found[i]->value, out, problems) && good;
    } else if (property.is_required) {
      problems->push_back({{}, property.name + " is missing; required: " + allowed_values(property), false});
      good = false;
    } else {
      append_absent(property, out);
    }
  }
  return good;
}

std::size_t flat_size_of(const Property& declared, std::span<const double> numbers) {
  std::size_t size = declared.flat_size();
  if (size > numbers.size()) return 0;
  if (declared.kind == PropertyKind::kTable) size += static_cast<std::size_t>(numbers[0]) * declared.columns;
  return size <= numbers.size() ? size : 0;
}

namespace {

// Does a table bend at a row, by more than its numbers are written to?
bool bends_at(std::span<const double> rows, std::size_t columns, std::size_t row) {
  constexpr double kWritten = 1e-9;
  const std::size_t count = rows.size() / columns;
  const auto slope = [&](std::size_t from, std::size_t column) {
    const double* at = &rows[from * columns];
    return (at[columns + column] - at[column]) / (at[columns] - at[0]);
  };
  for (std::size_t column = 1; column < columns; ++column) {
    const double before = row > 0 ? slope(row - 1, column) : 0.0, after = row + 1 < count ? slope(row, column) : 0.0;
    // where a time comes twice, a slope is not finite
    if (!std::isfinite(before) || !std::isfinite(after)) return true;
    if (std::fabs(after - before) > kWritten * std::max(std::fabs(before), std::fabs(after))) return true;
  }
  return false;
}

// Calls visit(rows, columns) for each table over time.
template <typename Visit>
void for_each_table_over_time(const std::vector<Property>& declared, std::span<const double> numbers, Visit&& visit) {
  for (const Property& p : declared) {
    const std::size_t size = flat_size_of(p, numbers);
    if (size > 0 && p.kind == PropertyKind::kTable && is_over_time(p)) visit(numbers.subspan(1, size - 1), p.columns);
    numbers = numbers.subspan(size);
  }
}

}  // namespace

std::vector<double> bends_of(const std::vector<Property>& declared, std::span<const double> numbers) {
  std::vector<double> times;
  for_each_table_over_time(declared, numbers, [&](std::span<const double> rows, std::size_t columns) {
    for (std::size_t row = 0; row * columns < rows.size(); ++row)
      if (const double time = rows[row * columns]; bends_at(rows, columns, row))
        if (times.empty() || times.back() != time) times.push_back(time);
  });
  return times;
}

std::vector<double> times_of(const std::vector<Property>& declared, std::span<const double> numbers) {
  std::vector<double> times;
  for_each_table_over_time(declared, numbers, [&](std::span<const double> rows, std::size_t columns) {
    for (std::size_t at = 0; at < rows.size(); at += columns) times.push_back(rows[at]);
  });
  return times;
}

std::string check_flattened(const std::vector<Property>& declared, std::span<const double> numbers) {
  for (const Property& p : declared) {
    std::size_t size = p.flat_size(), first = 0;
    if (size > numbers.size()) return "fewer numbers than the properties take";
    if (p.kind == PropertyKind::kTable) {
      const double rows = numbers[0];
      if (!(rows >= 0.0) || rows != std::floor(rows)) return p.name + " has " + number_text(rows) + " rows";
      if (rows * p.columns > static_cast<double>(numbers.size() - 1)) return "fewer numbers than the properties take";
      first = 1;
      size = 1 + static_cast<std::size_t>(rows) * p.columns;
    }
    const std::span<const double> values = numbers.subspan(first, size - first);
    numbers = numbers.subspan(size);
    // a table that is absent has no rows
    const bool may_be_absent = p.kind != PropertyKind::kTable && !p.is_required && p.default_numbers.empty();
    if (may_be_absent && std::ranges::all_of(values, [](double number) { return std::isnan(number); })) continue;
    for (const double number : values)
      if (!takes(p, number)) return p.name + " = " + number_text(number) + "; allowed: " + allowed_values(p);
    if (p.kind == PropertyKind::kQuaternion && first_not_unit(values, 4) != kNoRow)
      return p.name + " is no unit quaternion";
  }
  return numbers.empty() ? "" : "more numbers than the properties take";
}

std::string allowed_values(const Property& declared) {
  const std::string bounds = bounds_text(declared);
  const std::string each = bounds.empty() ? "" : ", each" + bounds;
  switch (declared.kind) {
    case PropertyKind::kNumber:
      return "a number" + bounds;
    case PropertyKind::kInteger:
      return "a whole number" + bounds;
    case PropertyKind::kFlag:
      return "true or false";
    case PropertyKind::kChoice:
      return "one of " + quoted_names(declared.choices);
    case PropertyKind::kVector:
      return "a list of 3 numbers" + each;
    case PropertyKind::kQuaternion:
      return "a list of 4 numbers (w, x, y, z)" + each;
    case PropertyKind::kTable:
      return "a list of rows of " + std::to_string(declared.columns) + " numbers" + each;
    case PropertyKind::kBody:
      return "the id of a body";
  }
  return "nothing";
}

std::string shown(const PropertyValue& value) {
  switch (value.kind) {
    case Kind::kNumber:
      return number_text(value.number);
    case Kind::kFlag:
      return value.flag ? "true" : "false";
    case Kind::kList:
      return "a list of " + std::to_string(value.list.size());
    case Kind::kText:
      break;
  }
  if (value.text.size() <= kShownCharacters) return '"' + value.text + '"';
  // cut before a whole character: bytes 10xxxxxx continue one
  std::size_t cut = kShownCharacters;
  while (cut > 0 && (static_cast<unsigned char>(value.text[cut]) & 0xC0U) == 0x80U) --cut;
  return '"' + value.text.substr(0, cut) + "…\"";
}

std::string number_text(double number) {
  std::array<char, 32> buffer;
  const std::to_chars_result end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), number);
  return {buffer.data(), end.ptr};
}

}  // namespace gravitas
