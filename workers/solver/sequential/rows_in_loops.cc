#include "workers/solver/sequential/rows_in_loops.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "plugin_sdk/solver/bodies.h"

namespace gravitas {
namespace {

constexpr std::uint32_t kFreedoms = 6;

template <typename Use>
void for_bodies(const RowEnds& ends, Use&& use) {
  for (const std::uint32_t body : {ends.first, ends.second})
    if (body != kNone) use(body);
}

int weight(std::uint32_t rows) { return rows > kFreedoms ? 2 : 1; }

}  // namespace

void RowsInLoops::find_links(std::span<const RowEnds> rows) {
  const auto of_pair = [&](std::uint32_t row) {
    return std::pair(RowEnds(std::minmax(rows[row].first, rows[row].second)), row);
  };
  order_.resize(rows.size());
  std::iota(order_.begin(), order_.end(), 0);
  std::ranges::sort(order_, {}, of_pair);
  links_.clear();
  std::uint32_t count = 0;
  for (const std::uint32_t row : order_) {
    const RowEnds ends = of_pair(row).first;
    if (links_.empty() || links_.back().ends != ends) links_.push_back({ends});
    ++links_.back().rows;
    for_bodies(ends, [&](std::uint32_t body) { count = std::max(count, body + 1); });
  }
  held_.assign(count, 0);
  places_.assign(count, 0);
  for (std::uint32_t i = 0; i < links_.size(); ++i)
    for_bodies(links_[i].ends, [&](std::uint32_t body) { held_[body] += weight(links_[i].rows), places_[body] ^= i; });
}

void RowsInLoops::leave_out_ends() {
  ends_.clear();
  for (std::uint32_t body = 0; body < held_.size(); ++body)
    if (held_[body] == 1) ends_.push_back(body);
  while (!ends_.empty()) {
    const std::uint32_t end = ends_.back();
    ends_.pop_back();
    if (held_[end] != 1) continue;  // both ends of a link came up
    const std::uint32_t place = places_[end];
    links_[place].is_left = false;
    for_bodies(links_[place].ends, [&](std::uint32_t body) {
      places_[body] ^= place;
      if (--held_[body] == 1) ends_.push_back(body);
    });
  }
}

const std::vector<std::uint32_t>& RowsInLoops::find(std::span<const RowEnds> rows) {
  find_links(rows);
  leave_out_ends();
  found_.clear();
  std::uint32_t begin = 0;
  for (const Link& link : links_) {
    if (link.is_left) found_.insert(found_.end(), order_.begin() + begin, order_.begin() + begin + link.rows);
    begin += link.rows;
  }
  const auto bodies = static_cast<std::size_t>(std::ranges::count_if(held_, [](int held) { return held > 0; }));
  if (found_.size() <= kFreedoms * bodies) found_.clear();
  std::ranges::sort(found_);
  return found_;
}

}  // namespace gravitas
