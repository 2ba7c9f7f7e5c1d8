#include "plugin_sdk/conformance/sample_values.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <utility>

#include "plugin_sdk/body.h"
#include "plugin_sdk/conformance/inquiry.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas::conformance {
namespace {

constexpr int kTableRows = 8;

std::pair<double, double> sampled_range(const Property& p) {
  const double low = std::isfinite(p.minimum) ? p.minimum : std::min(-1.0, p.maximum - 2.0);
  return {low, std::isfinite(p.maximum) ? std::min(p.maximum, low + 2.0) : low + 2.0};
}

double number_within(const Property& p, Draw* draw) {
  const auto [low, high] = sampled_range(p);
  // inside, so that an exclusive bound is none
  return draw->uniform(low + 0.1 * (high - low), high);
}

// Of a table's rows, rising: within 0 ... 1 where bounds allow that.
double argument_within(const Property& p, int row) {
  if ((p.exclusive_minimum ? p.minimum < 0.0 : p.minimum <= 0.0) && p.maximum >= 1.0)
    return static_cast<double>(row) / kTableRows;
  const auto [low, high] = sampled_range(p);
  return low + (high - low) * (row + 1.0) / (kTableRows + 1.0);
}

// Flags and choices are the first of theirs, unless `varies`.
void append_drawn(const Property& p, bool varies, const Matrix3& axes, int* next_axis, Draw* draw,
                  std::vector<double>* out) {
  switch (p.kind) {
    case PropertyKind::kNumber:
      out->push_back(number_within(p, draw));
      break;
    case PropertyKind::kInteger:
      out->push_back(std::ceil(number_within(p, draw)));
      break;
    case PropertyKind::kFlag:
      out->push_back(varies ? draw->below(2) : 0.0);
      break;
    case PropertyKind::kChoice:
      out->push_back(varies ? draw->below(static_cast<std::uint32_t>(p.choices.size())) : 0.0);
      break;
    case PropertyKind::kBody:
      out->push_back(0.0);
      break;
    case PropertyKind::kVector:
      if (p.unit == "1" && !std::isfinite(p.minimum)) {
        append(out, Vector3(axes.col((*next_axis)++ % 3)));
      } else {
        for (int k = 0; k < 3; ++k) out->push_back(number_within(p, draw));
      }
      break;
    case PropertyKind::kQuaternion:
      append(out, draw->rotation());
      break;
    case PropertyKind::kTable:
      out->push_back(kTableRows);
      for (int row = 0; row < kTableRows; ++row) {
        out->push_back(argument_within(p, row));
        for (std::uint32_t k = 1; k < p.columns; ++k) out->push_back(number_within(p, draw));
      }
      break;
  }
}

// Of a property whose values begin there.
std::size_t size_at(const Property& p, const double* values) {
  return p.kind == PropertyKind::kTable ? 1 + static_cast<std::size_t>(*values) * p.columns : p.flat_size();
}

// True if sample_values() draws nothing for it.
bool has_choice(const Property& p) {
  return p.kind == PropertyKind::kFlag || p.kind == PropertyKind::kChoice ||
         (!p.is_required && p.kind != PropertyKind::kBody);
}

// Each property that need not be given is, with a probability of `share`.
std::vector<double> values_of(const std::vector<Property>& properties, double share, Draw* draw) {
  std::vector<double> numbers;
  const Matrix3 axes = to_rotation_matrix(draw->rotation());
  int next_axis = 0;
  for (const Property& p : properties) {
    if (p.is_required || (share > 0.0 && has_choice(p) && draw->uniform(0.0, 1.0) < share)) {
      append_drawn(p, share > 0.0, axes, &next_axis, draw, &numbers);
    } else if (!p.default_numbers.empty()) {
      numbers.insert(numbers.end(), p.default_numbers.begin(), p.default_numbers.end());
    } else if (p.kind == PropertyKind::kTable) {
      numbers.push_back(0.0);
    } else {
      numbers.insert(numbers.end(), p.flat_size(), std::numeric_limits<double>::quiet_NaN());
    }
  }
  return numbers;
}

}  // namespace

std::vector<double> sample_values(const std::vector<Property>& properties, Draw* draw) {
  return values_of(properties, 0.0, draw);
}

void vary(const std::vector<Property>& properties, Draw* draw, std::vector<double>* values,
          const std::function<Answer()>& asked) {
  if (!std::ranges::any_of(properties, has_choice)) return;
  const std::vector<double> plain = *values;
  // some exclude each other
  for (const double share : {1.0, 0.5, 0.5, 0.3, 0.3, 0.3}) {
    *values = values_of(properties, share, draw);
    if (!is_refusal(asked())) return;
  }
  *values = plain;
}

std::string shown(const TypeDeclaration& type, const std::vector<double>& values) {
  std::string given;
  const double* at = values.data();
  for (const Property& p : type.properties) {
    const std::size_t size = size_at(p, at);
    if (!std::isnan(*at) && !(p.kind == PropertyKind::kTable && *at == 0.0)) {
      given += (given.empty() ? "" : ", ") + p.name;
      for (std::size_t k = 0; k < size; ++k)
        given +=
            " " + (p.kind == PropertyKind::kChoice ? p.choices[static_cast<std::size_t>(*at)] : number_text(at[k]));
    }
    at += size;
  }
  return given.empty() ? type.name : type.name + " (" + given + ")";
}

std::vector<double> with_directions(const std::vector<Property>& properties, const std::vector<double>& values,
                                    Draw* draw) {
  std::vector<double> numbers = values;
  const Matrix3 axes = to_rotation_matrix(draw->rotation());
  int next_axis = 0;
  std::size_t at = 0;
  for (const Property& p : properties) {
    const bool is_direction = p.kind == PropertyKind::kVector && p.unit == "1" && !std::isfinite(p.minimum);
    if (is_direction && std::isnan(numbers[at]))
      for (int k = 0; k < 3; ++k) numbers[at + static_cast<std::size_t>(k)] = axes(k, next_axis % 3);
    if (is_direction) ++next_axis;
    at += size_at(p, &numbers[at]);
  }
  return numbers;
}

void rename_bodies(const std::vector<Property>& properties, std::span<const std::uint32_t> place,
                   std::vector<double>* values) {
  std::size_t at = 0;
  for (const Property& p : properties) {
    double& first = (*values)[at];
    at += size_at(p, &first);
    if (p.kind == PropertyKind::kBody && !std::isnan(first)) first = place[static_cast<std::size_t>(first)];
  }
}

std::vector<double> default_settings(const PluginDeclaration& declaration) {
  Draw draw(1);
  return sample_values(declaration.properties, &draw);
}

NamedValue given(std::string name, double value) { return {std::move(name), PropertyValue::of(value), {}}; }
NamedValue given(std::string name, const Vector3& value) {
  return {std::move(name), PropertyValue::numbers({value.data(), 3}), {}};
}
NamedValue given(std::string name, const char* choice) { return {std::move(name), PropertyValue::of(choice), {}}; }
NamedValue given(std::string name, bool flag) { return {std::move(name), PropertyValue::of(flag), {}}; }

std::vector<double> flattened(const TypeDeclaration& type, const std::vector<NamedValue>& values) {
  std::vector<double> numbers;
  std::vector<PropertyProblem> problems;
  if (flatten(type.properties, values, &numbers, &problems)) return numbers;
  std::string text = "type " + type.name + " does not take what the scene language gives it";
  for (const PropertyProblem& problem : problems) text += ": " + problem.text;
  throw Finding(text);
}

const TypeDeclaration* find_type(const PluginDeclaration& declaration, std::string_view name) {
  const auto found = std::ranges::find(declaration.types, name, &TypeDeclaration::name);
  return found == declaration.types.end() ? nullptr : &*found;
}

std::vector<TypeDeclaration> askable_types(const PluginDeclaration& declaration, std::span<const char* const> known,
                                           std::string* refusal,
                                           const std::function<Answer(const TypeDeclaration&, Draw*)>& probe) {
  constexpr int kProbes = 4;
  std::vector<TypeDeclaration> askable;
  for (const TypeDeclaration& type : declaration.types) {
    bool is_refused = false;
    if (std::ranges::find(known, type.name) == known.end()) {
      Draw draw(type_id(type.name));
      for (int i = 0; i < kProbes && !is_refused; ++i) {
        const Answer answer = probe(type, &draw);
        is_refused = is_refusal(answer);
        if (is_refused && refusal != nullptr) *refusal = type.name + ": " + answer.text;
      }
    }
    if (!is_refused) askable.push_back(type);
  }
  return askable;
}

Case make_types_case(std::string name, std::function<std::vector<TypeDeclaration>(Subject&, std::string*)> askable) {
  return make_case(std::move(name), "Types are declared, and values within their bounds are answered.",
                   [askable = std::move(askable)](Subject& subject) {
                     const std::size_t count = subject.declaration().types.size();
                     Inquiry inquiry(subject, std::to_string(count) + " declared types");
                     inquiry.expect(count > 0, "a plugin of this slot serves at least one type");
                     std::string refusal;
                     const bool any = !askable(subject, &refusal).empty();
                     inquiry.expect(any, "each refused values within its declared bounds; " + refusal);
                   });
}

double capability_number(const PluginDeclaration& declaration, std::string_view name, double otherwise) {
  for (const std::string& capability : declaration.capabilities) {
    if (!capability.starts_with(name) || capability.size() <= name.size() || capability[name.size()] != '=') continue;
    double number = otherwise;
    std::from_chars(capability.data() + name.size() + 1, capability.data() + capability.size(), number);
    return number;
  }
  return otherwise;
}

}  // namespace gravitas::conformance
