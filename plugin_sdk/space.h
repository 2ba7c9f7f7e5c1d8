// What spaces do alike, whatever their structure: sort the pairs they found, and test bodies that the structure does not
// hold.
//
//   const PairRule rule(request);
//   found.clear();
//   found.add(7, 3);                            in any order
//   test_against_all(outsiders, rule, &found);
//   found.sort(bodies);
//   found.write(reply.pair());
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "plugin_sdk/pair_rule.h"
#include "schemas/stage_frames.h"

namespace gravitas {

// Sorts by counting: rows of the smaller index, each put in order by itself. O(bodies + pairs) for rows that are short,
// whatever their number.
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

// Adds all pairs of the bodies in `outsiders`, which ascend.
inline void test_against_all(std::span<const std::uint32_t> outsiders, const PairRule& rule, PairList* found) {
  for (const std::uint32_t a : outsiders) {
    // two of them meet once
    std::size_t next = 0;
    for (std::uint32_t b = 0; b < rule.bodies(); ++b) {
      const bool is_outsider = next < outsiders.size() && outsiders[next] == b;
      next += is_outsider ? 1 : 0;
      if ((!is_outsider || b > a) && rule(a, b)) found->add(a, b);
    }
  }
}

}  // namespace gravitas
