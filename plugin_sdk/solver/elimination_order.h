// In which order a profile factorisation (profile_ldlt.h) had best take rows that meet in bodies.
//
// A row's profile reaches back to the first row that shares a body with it, so that the order decides what is stored and
// computed: a chain whose even links come before its odd ones costs the cube of its length, in a row the length. Two orders of
// the bodies are tried, and each row taken where the later of its bodies comes:
//   by level    from a body at the end of everything (Cuthill and McKee 1969): bands, as of chains and nets
//   by branch   what hangs on a body before the body, the largest branch first: trees, at n log n entries
// N rows that meet in one movable body depend on each other in any order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace gravitas {

// Bodies of a row; kNone for one that nothing pushes.
using RowEnds = std::pair<std::uint32_t, std::uint32_t>;

// Places of the rows in the order found; empty where the given one costs little, or less than twice as much. Rows between
// the same bodies that follow each other stay together.
std::vector<std::uint32_t> elimination_order(std::span<const RowEnds> rows);

// Puts rows in that order, which it remembers as long as the same bodies meet.
class EliminationOrder {
 public:
  // False if the rows meet as those before them did.
  template <typename Row, typename EndsOf>
  bool arrange(EndsOf&& ends_of, std::vector<Row>* rows) {
    ends_.clear();
    for (const Row& row : *rows) ends_.push_back(ends_of(row));
    const bool is_new = ends_ != known_;
    if (is_new) order_ = elimination_order(ends_), known_.swap(ends_);
    if (order_.empty()) return is_new;
    std::vector<Row> arranged;
    for (const std::uint32_t place : order_) arranged.push_back((*rows)[place]);
    *rows = std::move(arranged);
    return is_new;
  }
  // Bodies of a row that was arranged last, by its place.
  const RowEnds& ends(std::size_t place) const { return known_[order_.empty() ? place : order_[place]]; }

 private:
  std::vector<RowEnds> ends_, known_;
  std::vector<std::uint32_t> order_;  // of known_
};

}  // namespace gravitas
