#include "plugin_sdk/solver/stalled_drives.h"

#include <algorithm>
#include <limits>

namespace gravitas {
namespace {

constexpr double kAgrees = 1e-6;

// J x of b as a multiple of that of a: 1 or -1; 0 where they are not the same row.
double same_axis(const ConstraintDirection& a, const ConstraintDirection& b, bool is_swapped) {
  const Vector3 linear = is_swapped ? Vector3(-b.linear) : b.linear;
  const Vector3 &angular1 = is_swapped ? b.angular2 : b.angular1, &angular2 = is_swapped ? b.angular1 : b.angular2;
  const double size = a.linear.squaredNorm() + a.angular1.squaredNorm() + a.angular2.squaredNorm();
  for (const double sign : {1.0, -1.0}) {
    const double apart = (a.linear - sign * linear).squaredNorm() + (a.angular1 - sign * angular1).squaredNorm() +
                         (a.angular2 - sign * angular2).squaredNorm();
    if (apart <= kAgrees * kAgrees * size) return sign;
  }
  return 0.0;
}

}  // namespace

void StalledDrives::add(std::uint32_t body1, std::uint32_t body2, const ConstraintDirection& direction, JointLaw* law) {
  if (!law->is_active() || law->gamma > 0.0 || law->bound < std::numeric_limits<double>::infinity()) return;
  if (law->is_velocity_only)
    drives_.push_back({body1, body2, &direction, law});
  else if (!law->is_equality())
    limits_.push_back({body1, body2, &direction, law});
}

void StalledDrives::stall() {
  for (const Row& drive : drives_) {
    for (const Row& limit : limits_) {
      const bool is_swapped = drive.body1 == limit.body2 && drive.body2 == limit.body1;
      if (!is_swapped && (drive.body1 != limit.body1 || drive.body2 != limit.body2)) continue;
      const double sign = same_axis(*limit.direction, *drive.direction, is_swapped);
      const double along = sign * drive.law->lower_target;
      const bool is_below = limit.law->has_lower && along < limit.law->lower_target;
      const bool is_above = limit.law->has_upper && along > limit.law->upper_target;
      if (sign == 0.0 || is_below == is_above) continue;
      JointLaw& law = *drive.law;
      law.lower_target = law.upper_target = sign * (is_below ? limit.law->lower_target : limit.law->upper_target);
      // towards the limit it pushes on
      (is_above == (sign > 0.0) ? law.has_upper : law.has_lower) = false;
      break;
    }
  }
  drives_.clear(), limits_.clear();
}

}  // namespace gravitas
