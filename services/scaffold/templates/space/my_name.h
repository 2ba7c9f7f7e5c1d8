// A sweep along one axis, free of the plugin interface, so that my_name_test.cc can call it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace plain {

// What a body covers of the axis, m.
struct Interval {
  double lower, upper;
  std::uint32_t body;
};

// Calls meet(a, b) once for any two bodies whose closed intervals overlap: sorted by their lower ends, those that begin
// before an interval ends follow it in a row. O(n log n + overlaps). Bounds may be infinite, not NaN. The order of the
// calls is a function of the intervals alone, since no two have the same body.
template <typename Meet>
void sweep(std::vector<Interval>* intervals, Meet&& meet) {
  std::sort(intervals->begin(), intervals->end(), [](const Interval& a, const Interval& b) {
    return a.lower != b.lower ? a.lower < b.lower : a.body < b.body;
  });
  for (std::size_t i = 0; i < intervals->size(); ++i)
    for (std::size_t k = i + 1; k < intervals->size() && (*intervals)[k].lower <= (*intervals)[i].upper; ++k)
      meet((*intervals)[i].body, (*intervals)[k].body);
}

}  // namespace plain
