#include "plugin_sdk/ray_rule.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "plugin_sdk/checks.h"

namespace gravitas {
namespace {

// Times along the ray are right within two roundings, so their quotient within four.
constexpr double kRayRounding = 1.0 + 4.0 * std::numeric_limits<double>::epsilon();

}  // namespace

RayRule::RayRule(const stage::SpaceRaysRequest& request)
    : lower_(request.lower()),
      upper_(request.upper()),
      origin_(request.origin()),
      direction_(request.direction()),
      length_(request.length()),
      flags_(request.flags()) {
  if (const std::size_t i = first_not_finite(origin_); i != kNoRow)
    throw Refusal("ray " + std::to_string(i / 3) + " has an origin that is not finite");
  if (const std::size_t i = first_not_unit(direction_, 3); i != kNoRow)
    throw Refusal("ray " + std::to_string(i) + " has a direction that is no unit vector");
  for (std::size_t i = 0; i < length_.size(); ++i)
    if (!(length_[i] >= 0.0 && std::isfinite(length_[i])))
      throw Refusal("ray " + std::to_string(i) + " has a length that is negative or not finite");
}

bool RayRule::meets(std::uint32_t ray, const double* lower, const double* upper) const {
  double begin = 0.0, end = length_[ray];
  for (std::size_t k = 0; k < 3; ++k) {
    const double from = origin_[3 * std::size_t{ray} + k], along = direction_[3 * std::size_t{ray} + k];
    if (!(lower[k] <= upper[k])) return false;
    if (along == 0.0) {
      if (!(lower[k] <= from && from <= upper[k])) return false;
      continue;
    }
    double enters = (lower[k] - from) / along, leaves = (upper[k] - from) / along;
    if (along < 0.0) std::swap(enters, leaves);
    begin = std::max(begin, enters);
    end = std::min(end, leaves);
  }
  return begin <= end * kRayRounding;
}

void test_rays_against_all(const stage::SpaceRaysRequest& request, const stage::SpaceRaysReply& reply, Host& host) {
  const RayRule meets(request);
  const stage::ReplyColumn<std::uint32_t> candidate = reply.candidate();
  for (std::uint32_t ray = 0; ray < meets.rays(); ++ray) {
    host.mark_progress();
    for (std::uint32_t body = 0; body < meets.bodies(); ++body)
      if (meets(ray, body)) candidate.push(ray, body);
  }
}

}  // namespace gravitas
