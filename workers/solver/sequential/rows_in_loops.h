// Rows of joints that may share a load: those of bodies that are held in loops, or by several joints, and by more rows than they
// have freedoms.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "plugin_sdk/solver/elimination_order.h"

namespace gravitas {

// Keeps the memory of what it finds.
class RowsInLoops {
 public:
  // Places of those rows, rising; none where no body is held so. Bodies that hang on one joint are left out, one after the
  // other: it bears one load only. Valid until the next find().
  const std::vector<std::uint32_t>& find(std::span<const RowEnds> rows);

 private:
  // All rows of two bodies, or of a body and what nothing pushes.
  struct Link {
    RowEnds ends;
    std::uint32_t rows = 0;
    bool is_left = true;
  };

  void find_links(std::span<const RowEnds> rows);
  void leave_out_ends();

  std::vector<std::uint32_t> order_;  // of rows, link by link
  std::vector<Link> links_;
  // by body: how many links are left, those of more rows than a body has freedoms twice; and their places, combined by xor, which of
  // one link is its place
  std::vector<int> held_;
  std::vector<std::uint32_t> places_;
  std::vector<std::uint32_t> ends_, found_;
};

}  // namespace gravitas
