#include "plugin_sdk/pair_rule.h"

#include <algorithm>
#include <tuple>

namespace gravitas {

bool can_any_touch(std::vector<TouchRights> bodies) {
  std::ranges::sort(bodies, {}, [](const TouchRights& one) { return std::tuple(one.flags, one.group, one.mask); });
  // of equal bodies two are enough: one touches others, the other its like
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (i > 0 && bodies[i] == bodies[i - 1]) continue;
    if (i + 1 < bodies.size() && bodies[i] == bodies[i + 1] && may_touch(bodies[i], bodies[i])) return true;
    for (std::size_t k = i + 1; k < bodies.size(); ++k)
      if (bodies[k] != bodies[k - 1] && may_touch(bodies[i], bodies[k])) return true;
  }
  return false;
}

}  // namespace gravitas
