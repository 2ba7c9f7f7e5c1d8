#include "services/check/abused_requests.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <string_view>

#include "plugin_sdk/counted.h"

namespace gravitas::check {

using conformance::Question;
using stage::ColumnInfo;

namespace {

// Beyond all rows, and not one of the numbers that mean "none".
constexpr std::uint32_t kFarAway = 0x7FFFFFF0;

bool shares_its_rows(std::span<const ColumnInfo> infos, std::size_t column) {
  return std::ranges::count(infos, infos[column].rows_index, &ColumnInfo::rows_index) > 1;
}

// The answer has the rows of columns of the request that have none.
bool asks_nothing(const Question& question) {
  const auto& method = stage::method_info(question.method);
  const std::vector<std::uint64_t> counts = question.request.counts();
  bool has_rows_of_request = false;
  for (const ColumnInfo& answered : method.reply) {
    if (answered.rows_index == stage::kScalar) continue;
    for (std::size_t i = 0; i < method.request.size(); ++i) {
      if (method.request[i].rows_index != answered.rows_index) continue;
      if (counts[i] > 0) return false;
      has_rows_of_request = true;
    }
  }
  return has_rows_of_request;
}

}  // namespace

void set_count(MessageColumns* columns, std::size_t column, std::uint64_t count) {
  std::vector<gravitas_reply_column> sizes = columns->rooms();
  for (gravitas_reply_column& size : sizes) size.count = size.capacity;
  sizes[column].count = count;
  columns->resize(sizes);
}

std::vector<AbusedRequest> with_uneven_rows(const Question& question) {
  const std::span<const ColumnInfo> infos = stage::method_info(question.method).request;
  const std::vector<std::uint64_t> counts = question.request.counts();
  std::vector<AbusedRequest> abused;
  const auto add = [&](std::size_t column, std::uint64_t count) {
    abused.push_back(
        {fmt::format("column {} with {} instead of {}", infos[column].name, counted(count, "number"), counts[column]),
         question.request});
    set_count(&abused.back().request, column, count);
  };
  for (std::size_t i = 0; i < infos.size(); ++i) {
    if (infos[i].rows_index == stage::kScalar || counts[i] == 0) continue;
    if (infos[i].components > 1) add(i, counts[i] - 1);
    if (!shares_its_rows(infos, i)) continue;
    add(i, counts[i] - infos[i].components);
    add(i, 0);
  }
  return abused;
}

std::vector<AbusedRequest> with_wild_indices(const Question& question) {
  if (asks_nothing(question)) return {};
  const std::span<const ColumnInfo> infos = stage::method_info(question.method).request;
  const std::vector<std::uint64_t> counts = question.request.counts();
  const auto beyond = static_cast<std::uint32_t>(*std::ranges::max_element(counts) + 1);
  std::vector<AbusedRequest> abused;
  for (std::size_t i = 0; i < infos.size(); ++i) {
    if (std::string_view(infos[i].unit) != "index" || counts[i] == 0) continue;
    for (const std::uint32_t index : {beyond, kFarAway}) {
      abused.push_back({fmt::format("column {} full of the index {}", infos[i].name, index), question.request});
      std::ranges::fill(abused.back().request.u32(infos[i].name), index);
    }
  }
  return abused;
}

AbusedRequest with_no_rows(const Question& question) {
  const std::span<const ColumnInfo> infos = stage::method_info(question.method).request;
  AbusedRequest abused{"no row of anything", question.request, true};
  for (std::size_t i = 0; i < infos.size(); ++i) {
    if (infos[i].rows_index == stage::kScalar) continue;
    set_count(&abused.request, i, 0);
    // where rows begin: one number more than there are rows
    set_count(&abused.request, i, std::uint64_t{infos[i].extra} * infos[i].components);
  }
  return abused;
}

}  // namespace gravitas::check
