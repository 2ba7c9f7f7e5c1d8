#include "services/check/large_question.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "plugin_sdk/derivative_question.h"

namespace gravitas::check {

using conformance::Question;
using stage::ColumnInfo;

namespace {

// The copies of bounds stand this far apart, so that no pair is between two of them.
constexpr double kDistance = 1e6;

// Rows that all copies share.
bool is_shared(const ColumnInfo& info) {
  const std::string_view rows = info.rows;
  return info.rows_index == stage::kScalar || rows.starts_with("shape") || rows.starts_with("force") || rows == "ray";
}

std::uint64_t rows_of(const MessageColumns& request, std::span<const ColumnInfo> infos, std::string_view word) {
  const std::vector<std::uint64_t> counts = request.counts();
  for (std::size_t i = 0; i < infos.size(); ++i)
    if (infos[i].rows == word) return counts[i] / infos[i].components;
  return 0;
}

template <typename T>
void repeat(std::vector<T>* numbers, std::uint32_t copies) {
  const std::vector<T> one = *numbers;
  for (std::uint32_t copy = 1; copy < copies; ++copy) numbers->insert(numbers->end(), one.begin(), one.end());
}

// Where rows begin: one number more than there are rows.
void repeat_begins(std::vector<std::uint32_t>* begins, std::uint32_t copies) {
  const std::vector<std::uint32_t> one = *begins;
  for (std::uint32_t copy = 1; copy < copies; ++copy)
    for (std::size_t i = 1; i < one.size(); ++i) begins->push_back(copy * one.back() + one[i]);
}

// Indices of bodies; in `application` and `candidate` the second of two.
void repeat_indices(const ColumnInfo& info, std::uint32_t bodies, std::uint32_t copies,
                    std::vector<std::uint32_t>* indices) {
  const std::size_t size = indices->size();
  repeat(indices, copies);
  const bool is_second = std::string_view(info.name) == "application" || std::string_view(info.name) == "candidate";
  if (std::string_view(info.name) == "body_shape") return;
  for (std::size_t i = size; i < indices->size(); ++i)
    if ((*indices)[i] != GRAVITAS_NONE && (!is_second || i % 2 == 1))
      (*indices)[i] += static_cast<std::uint32_t>(i / size) * bodies;
}

// Asks the function of one copy for each in turn.
conformance::DerivativeFunction repeated_derivative(const conformance::DerivativeFunction& one, std::uint32_t bodies,
                                                    std::uint32_t copies) {
  return [one, bodies, copies](const stage::IntegratorDerivativeRequest& all) {
    const std::array<double, 1> time = {all.time()};
    const std::array<std::span<const double>, 4> states = {all.position(), all.orientation(), all.linear_velocity(),
                                                           all.angular_velocity()};
    // of bodies alone
    if (all.question() >= kFirstOfImpulses) return std::vector<double>();
    const std::uint32_t no_jacobian = 0;
    std::vector<double> wrenches;
    for (std::size_t copy = 0; copy < copies; ++copy) {
      std::array<gravitas_column, 6> columns = {gravitas_column{time.data(), 1}};
      columns[5] = {&no_jacobian, 1};
      for (std::size_t k = 0; k < states.size(); ++k) {
        const std::size_t size = states[k].size() / copies;
        columns[k + 1] = {states[k].data() + copy * size, size};
      }
      const std::vector<double> part = one(stage::IntegratorDerivativeRequest(columns.data())).wrench;
      wrenches.insert(wrenches.end(), part.begin(), part.end());
    }
    wrenches.resize(std::size_t{6} * bodies * copies);
    return wrenches;
  };
}

}  // namespace

Question repeated(const Question& question, std::uint32_t copies) {
  const std::span<const ColumnInfo> infos = stage::method_info(question.method).request;
  const auto bodies = static_cast<std::uint32_t>(rows_of(question.request, infos, "body"));
  Question large = question;
  large.name = fmt::format("{}, {} times side by side", question.name, copies);
  for (const ColumnInfo& info : infos) {
    if (is_shared(info)) continue;
    if (info.type == stage::ElementType::kF64) {
      std::vector<double>& numbers = large.request.f64(info.name);
      const std::size_t size = numbers.size();
      repeat(&numbers, copies);
      const std::string_view name = info.name;
      for (std::size_t i = size; (name == "lower" || name == "upper") && bodies > 0 &&
                                 info.rows == std::string_view("body") && i < numbers.size();
           i += 3)
        numbers[i] += static_cast<double>(i / size) * kDistance;
    } else if (info.type == stage::ElementType::kU64) {
      repeat(&large.request.u64(info.name), copies);
    } else if (info.extra != 0) {
      repeat_begins(&large.request.u32(info.name), copies);
    } else if (std::string_view(info.unit) == "index") {
      repeat_indices(info, bodies, copies, &large.request.u32(info.name));
    } else {
      repeat(&large.request.u32(info.name), copies);
    }
  }
  if (question.derivative) large.derivative = repeated_derivative(question.derivative, bodies, copies);
  return large;
}

}  // namespace gravitas::check
