// The pairs that a space finds, in whatever order, brought into the order of the answer.
//
//   PairList found;
//   found.add(7, 3);
//   found.sort(bodies);
//   found.partners(3)      -> {7}
//   found.write(reply.pair());
//
// Sorted by counting: rows of the smaller index, each put in order by itself. O(bodies + pairs) for rows that are
// short, whatever their number.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "schemas/stage_frames.h"

namespace gravitas {

class PairList {
 public:
  void clear() { first_.clear(), second_.clear(); }

  // Each pair once, in either order, a != b.
  void add(std::uint32_t a, std::uint32_t b) {
    first_.push_back(std::min(a, b));
    second_.push_back(std::max(a, b));
  }

  std::uint64_t size() const { return first_.size(); }

  // Makes partners() those of the pairs added. All indices are below `bodies`.
  void sort(std::uint32_t bodies) {
    begin_.assign(bodies + std::size_t{1}, 0);
    for (const std::uint32_t a : first_) ++begin_[a];
    std::uint64_t end = 0;
    for (std::uint64_t& row : begin_) row = end += row;
    // from behind, so that every row ends up at its begin
    partner_.resize(first_.size());
    for (std::size_t i = first_.size(); i-- > 0;) partner_[--begin_[first_[i]]] = second_[i];
    for (std::uint32_t a = 0; a < bodies; ++a) {
      const std::span<std::uint32_t> row(partner_.data() + begin_[a], begin_[a + 1] - begin_[a]);
      if (row.size() > 1) std::sort(row.begin(), row.end());
    }
  }

  // The larger indices of the pairs whose smaller one is a, ascending.
  std::span<const std::uint32_t> partners(std::uint32_t a) const {
    return {partner_.data() + begin_[a], begin_[a + 1] - begin_[a]};
  }

  // All pairs, ascending.
  void write(const stage::ReplyColumn<std::uint32_t>& pair) const {
    const std::span<std::uint32_t> out = pair.resize(2 * size());
    if (out.empty()) return;
    std::size_t k = 0;
    for (std::uint32_t a = 0; a + 1 < begin_.size(); ++a)
      for (const std::uint32_t b : partners(a)) out[k++] = a, out[k++] = b;
  }

 private:
  std::vector<std::uint32_t> first_, second_;
  // written by sort(): row a is partner_[begin_[a] … begin_[a + 1])
  std::vector<std::uint64_t> begin_;
  std::vector<std::uint32_t> partner_;
};

}  // namespace gravitas
