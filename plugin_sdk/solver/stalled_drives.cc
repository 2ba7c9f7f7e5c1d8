#include "plugin_sdk/solver/stalled_drives.h"

#include <algorithm>

namespace gravitas {
namespace {

constexpr double kAgrees = 1e-3;  // of rows: joints may be open

}  // namespace

bool StalledDrives::is_of(const Row& row, const Row& pair) {
  return (row.body1 == pair.body1 && row.body2 == pair.body2) || (row.body1 == pair.body2 && row.body2 == pair.body1);
}

StalledDrives::Numbers StalledDrives::numbers_of(const Row& row, const Row& pair, double arm) {
  const ConstraintDirection& d = *row.direction;
  Numbers numbers;
  if (row.body1 == pair.body1)
    numbers << d.linear, d.angular1 / arm, d.angular2 / arm;
  else
    numbers << -d.linear, d.angular2 / arm, d.angular1 / arm;
  return numbers;
}

double StalledDrives::longest_arm(const Row& pair) const {
  double longest = 0.0;
  for (const Row& row : rows_) {
    if (!is_of(row, pair) || row.direction->linear.isZero(0.0)) continue;
    longest = std::max({longest, row.direction->angular1.norm(), row.direction->angular2.norm()});
  }
  return longest > 0.0 ? longest : 1.0;
}

void StalledDrives::stall_rows() {
  std::vector<Numbers> held;  // orthonormal
  // Takes the held rows out of one; what is left, unless that is nothing.
  const auto left_of = [&](Numbers numbers) {
    const double size = numbers.norm();
    for (int repeat = 0; repeat < 2; ++repeat)
      for (const Numbers& other : held) numbers -= other.dot(numbers) * other;
    return numbers.norm() > kAgrees * size ? numbers : Numbers(Numbers::Zero());
  };
  for (const Row& limit : rows_) {
    if (limit.kind != Kind::kLimit) continue;
    held.clear();
    const double arm = longest_arm(limit);
    for (const Row& row : rows_) {
      if (row.kind != Kind::kHeld || !is_of(row, limit)) continue;
      const Numbers numbers = left_of(numbers_of(row, limit, arm));
      if (!numbers.isZero(0.0)) held.push_back(numbers.normalized());
    }
    const Numbers axis = left_of(numbers_of(limit, limit, arm));
    if (axis.isZero(0.0)) continue;
    for (const Row& drive : rows_) {
      JointLaw& law = *drive.law;
      if (drive.kind != Kind::kDrive || !is_of(drive, limit)) continue;
      const Numbers numbers = left_of(numbers_of(drive, limit, arm));
      const double share = axis.dot(numbers) / axis.squaredNorm();
      if (numbers.isZero(0.0) || (numbers - share * axis).norm() > kAgrees * numbers.norm()) continue;
      limit.law->set_bounce(0.0);
      if (!law.is_equality()) continue;
      const double along = law.lower_target / share;
      const bool is_below = limit.law->has_lower && along < limit.law->lower_target;
      const bool is_above = limit.law->has_upper && along > limit.law->upper_target;
      if (is_below == is_above) continue;
      law.lower_target = law.upper_target = share * (is_below ? limit.law->lower_target : limit.law->upper_target);
      // towards the limit it pushes on
      (is_above == (share > 0.0) ? law.has_upper : law.has_lower) = false;
    }
  }
}

}  // namespace gravitas
