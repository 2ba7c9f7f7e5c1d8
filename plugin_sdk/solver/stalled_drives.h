// Drives that have run against a stop.
//
// A drive without a bound on its force asks for its velocity whatever stands against it; a limit that it has reached forbids
// it, and no motion meets both. The limit holds: the drive then keeps its bodies from going back from there, J v >= v_limit
// with lambda >= 0, and no more. It leaves as soon as its own target points away. What it drives along the limit's axis does not
// bounce there.
//
// A drive has reached a limit of the same two bodies if its row is a multiple of the limit's and what else holds between
// them (driving points about the axis of a hinge with limits: J_d = s J_l + sum c_k J_k, with J_k v = 0), to 1e-3, where turns
// count by way of the longest arm of those rows. A
// drive that is held up in any other way yields (end_of_step.h), which has to be found; what is told here is exact.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "plugin_sdk/solver/bodies.h"
#include "plugin_sdk/solver/joint_laws.h"

namespace gravitas {

class StalledDrives {
 public:
  // Changes the laws of drives among the rows, which for_each_row(visit) shows to visit(body1, body2, direction, law).
  template <class ForEachRow>
  void stall(ForEachRow&& for_each_row) {
    bool has_drive = false, has_limit = false;
    for_each_row([&](std::uint32_t, std::uint32_t, const ConstraintDirection&, JointLaw* law) {
      has_drive = has_drive || kind_of(*law) == Kind::kDrive;
      has_limit = has_limit || kind_of(*law) == Kind::kLimit;
    });
    if (!has_drive || !has_limit) return;
    rows_.clear();
    for_each_row([&](std::uint32_t body1, std::uint32_t body2, const ConstraintDirection& direction, JointLaw* law) {
      if (kind_of(*law) != Kind::kOther) rows_.push_back({kind_of(*law), body1, body2, &direction, law});
    });
    stall_rows();
  }

 private:
  enum class Kind : std::uint8_t { kOther, kHeld, kLimit, kDrive };
  struct Row {
    Kind kind;
    std::uint32_t body1, body2;
    const ConstraintDirection* direction;
    JointLaw* law;
  };
  using Numbers = Eigen::Matrix<double, 9, 1>;  // linear, angular1, angular2

  static Kind kind_of(const JointLaw& law) {
    if (!law.is_active() || law.gamma > 0.0 || law.bound < std::numeric_limits<double>::infinity()) return Kind::kOther;
    if (law.is_velocity_only) return Kind::kDrive;
    return law.is_equality() ? Kind::kHeld : Kind::kLimit;
  }
  static bool is_of(const Row& row, const Row& pair);
  // As a row of the pair of bodies in its order, turns times an arm.
  static Numbers numbers_of(const Row& row, const Row& pair, double arm);
  // Of the pair's rows, m; 1 if none has any.
  double longest_arm(const Row& pair) const;
  void stall_rows();

  std::vector<Row> rows_;
};

}  // namespace gravitas
