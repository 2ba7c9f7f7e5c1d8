#include "plugin_sdk/conformance/hostile_numbers.h"

#include <array>
#include <limits>
#include <string_view>
#include <vector>

#include "plugin_sdk/conformance/inquiry.h"

namespace gravitas::conformance {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::array<double, 8> kHostile = {
    std::numeric_limits<double>::quiet_NaN(), kInfinity, -kInfinity, 1e300, -1e300, 1e-300, 0.0, -1.0};
constexpr std::uint32_t kForeign = 1000000;
constexpr std::size_t kMostElements = 4;

std::string place(const stage::ColumnInfo& column, std::size_t element) {
  return std::string(column.name) + ", row " + std::to_string(element / column.components);
}

// Some elements of a column, spread over it, the first and the last among them.
std::vector<std::size_t> some_elements(std::size_t size) {
  if (size <= kMostElements) {
    std::vector<std::size_t> all;
    for (std::size_t i = 0; i < size; ++i) all.push_back(i);
    return all;
  }
  std::vector<std::size_t> some;
  for (std::size_t i = 0; i < kMostElements; ++i) some.push_back(i * (size - 1) / (kMostElements - 1));
  return some;
}

}  // namespace

void expect_hostile_numbers_survived(Subject& subject, const std::string& scene, stage::Method method,
                                     const MessageColumns& request, const DerivativeFunction& derivative,
                                     const std::function<void(MessageColumns*)>& finish) {
  Inquiry inquiry(subject, scene);
  MessageColumns spoiled = request;
  for (const stage::ColumnInfo& column : stage::method_info(method).request) {
    if (column.type != stage::ElementType::kF64) continue;
    std::vector<double>& numbers = spoiled.f64(column.name);
    for (const std::size_t element : some_elements(numbers.size())) {
      const double good = numbers[element];
      for (const double bad : kHostile) {
        inquiry.now_asked(scene + ", with " + number_text(bad) + " in " + place(column, element));
        numbers[element] = bad;
        if (finish) finish(&spoiled);
        inquiry.answer_or_refusal(method, spoiled, derivative);
      }
      numbers[element] = good;
    }
  }
}

void expect_foreign_indices_refused(Subject& subject, const std::string& scene, stage::Method method,
                                    const MessageColumns& request) {
  Inquiry inquiry(subject, scene);
  MessageColumns spoiled = request;
  for (const stage::ColumnInfo& column : stage::method_info(method).request) {
    if (column.type != stage::ElementType::kU32 || column.unit != std::string_view("index")) continue;
    std::vector<std::uint32_t>& indices = spoiled.u32(column.name);
    for (const std::size_t element : some_elements(indices.size())) {
      const std::uint32_t good = indices[element];
      inquiry.now_asked(scene + ", with " + std::to_string(kForeign) + " in " + place(column, element));
      indices[element] = kForeign;
      inquiry.demand_refusal(method, spoiled);
      indices[element] = good;
    }
  }
}

}  // namespace gravitas::conformance
