// Drives that have run against a stop.
//
// A drive without a bound on its force asks for its velocity whatever stands against it; a limit of the same axis that it
// has reached forbids it, and no motion meets both. The limit holds: the drive then keeps its bodies from going back from
// there, J v >= v_limit with lambda >= 0, and no more. It leaves as soon as its own target points away. Of the same axis are
// rows of the same two bodies that agree, but for their sign, to 1e-6, as those of a slider's own drive and limits. A drive
// that reaches a limit by way of other rows (the four points of an AngularMotor on a hinge with limits) or other bodies is a
// contradiction still.
#pragma once

#include <cstdint>
#include <vector>

#include "plugin_sdk/solver/bodies.h"
#include "plugin_sdk/solver/joint_laws.h"

namespace gravitas {

class StalledDrives {
 public:
  // A row with its velocity law, which must live until stall(). Takes note of drives and closed limits alone.
  void add(std::uint32_t body1, std::uint32_t body2, const ConstraintDirection& direction, JointLaw* law);
  // Changes the laws of drives, and forgets the rows.
  void stall();

 private:
  struct Row {
    std::uint32_t body1, body2;
    const ConstraintDirection* direction;
    JointLaw* law;
  };
  std::vector<Row> drives_, limits_;
};

}  // namespace gravitas
