// How reactions change with the states of bodies, against differences of the reactions themselves.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/joint_rows.h"
#include "plugin_sdk/math/rotation.h"
#include "tests/plugin_sdk/solver/reaction_problem.h"
#include "tests/sanitized.h"

namespace gravitas {
namespace {

using conformance::Draw;
using harness::ReactionProblem;

// A joint whose frames are fixed in its bodies.
struct Joint {
  std::uint32_t one, two;  // kNone: the world
  Pose frame1, frame2;     // in the bodies
  std::function<void(const Pose&, const Pose&, const std::function<void(const Discrepancy&)>&)> describe;
};

struct Mechanism {
  std::vector<Pose> poses;
  std::vector<Twist> twists;
  std::vector<double> masses;  // 0: kinematic
  std::vector<Wrench> wrenches;
  std::vector<Joint> joints;
  // what forces make of the state: wrench of `body` by the state of `by`
  std::uint32_t body = 0, by = 0;
  JacobianBlock slope = JacobianBlock::Zero();

  // With a number of a body's state changed.
  ReactionProblem problem(std::uint32_t changed = 0, int number = 0, double amount = 0.0) const {
    std::vector<Pose> at = poses;
    std::vector<Twist> moving = twists;
    std::vector<Wrench> acting = wrenches;
    move_state(number, amount, &at[changed], &moving[changed]);
    if (changed == by) {
      acting[body].force += amount * slope.col(number).head<3>();
      acting[body].torque += amount * slope.col(number).tail<3>();
    }
    ReactionProblem request;
    for (std::size_t i = 0; i < at.size(); ++i) {
      request.add_body(masses[i], at[i].position, moving[i].linear, acting[i].force);
      set_quaternion(request.orientation, i, at[i].orientation);
      set_vector(request.angular_velocity, i, moving[i].angular);
      set_vector(request.wrench, 2 * i + 1, acting[i].torque);
      request.drag[i] = 0.1 * static_cast<double>(i);
      if (masses[i] == 0.0) set_vector(request.acceleration, 2 * i, Vector3(1, 2, 3));
    }
    const auto placed = [&](std::uint32_t of, const Pose& frame) {
      if (of == kNone) return frame;
      return Pose{at[of].position + at[of].orientation * frame.position, at[of].orientation * frame.orientation};
    };
    for (const Joint& joint : joints)
      joint.describe(placed(joint.one, joint.frame1), placed(joint.two, joint.frame2),
                     [&](const Discrepancy& d) { request.add_joint(joint.one, joint.two, d); });
    if (!slope.isZero(0.0)) {
      request.block_body = {body, by};
      request.block.assign(slope.data(), slope.data() + slope.size());
    }
    return request;
  }

  // A joint at a frame in the world.
  void join(std::uint32_t one, std::uint32_t two, const Pose& frame, decltype(Joint::describe) describe) {
    const auto inside = [&](std::uint32_t of) {
      if (of == kNone) return frame;
      const Quaternion back = poses[of].orientation.conjugate();
      return Pose{back * (frame.position - poses[of].position), back * frame.orientation};
    };
    joints.push_back({one, two, inside(one), inside(two), std::move(describe)});
  }
};

void expect_slopes(const Mechanism& mechanism, const std::string& what, double by = 1e-5) {
  ReactionProblem here = mechanism.problem();
  const Eigen::MatrixXd jacobian = here.differentiate();
  double largest = 0.0;
  Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(jacobian.rows(), jacobian.cols());
  for (std::uint32_t body = 0; body < mechanism.poses.size(); ++body) {
    if (mechanism.masses[body] == 0.0) continue;
    for (int number = 0; number < 12; ++number) {
      ReactionProblem more = mechanism.problem(body, number, by), less = mechanism.problem(body, number, -by);
      more.solve(), less.solve();
      for (std::size_t i = 0; i < more.reactions().size(); ++i) {
        const double slope = (more.reactions()[i] - less.reactions()[i]) / (2.0 * by);
        expected(static_cast<Eigen::Index>(i), 12 * Eigen::Index{body} + number) = slope;
        largest = std::max(largest, std::abs(slope));
      }
    }
  }
  EXPECT_GT(largest, 1.0) << what;
  // differences by 1e-7 of numbers with 1e-15
  EXPECT_LT((jacobian - expected).cwiseAbs().maxCoeff(), 1e-5 * largest) << what;
}

void ball(const Pose& one, const Pose& two, const std::function<void(const Discrepancy&)>& emit) {
  emit(held_point(one, two.position, {true, true, true}));
}
void hinge(const Pose& one, const Pose& two, const std::function<void(const Discrepancy&)>& emit) {
  hold_hinge(one, two, emit);
}
void even_shafts(const Pose& one, const Pose& two, const std::function<void(const Discrepancy&)>& emit) {
  double scale = 0.0;
  ball(one, two, emit);
  emit(twist_row(one.orientation, two.orientation, AxisMode::kLocked, &scale));
}
void spring(const Pose& one, const Pose& two, const std::function<void(const Discrepancy&)>& emit) {
  Discrepancy d = held_point(one, two.position, {true, true, true});
  d.compliance = Vector3(0.01, 0.02, 0.03), d.damping = Vector3(3, 2, 1);
  emit(d);
}
// Turned out of its rest about all axes, and driven.
void bushing(const Pose& one, const Pose& two, const std::function<void(const Discrepancy&)>& emit) {
  ball(one, two, emit);
  Discrepancy d;
  d.axes = one.orientation;
  d.modes = pack_modes(AxisMode::kLocked, AxisMode::kLocked, AxisMode::kDriven, true);
  // far, so that turns about several axes do not add up
  d.point2 = log_rotation(two.orientation * exp_rotation(Vector3(0.3, 0.6, 0.9)) * one.orientation.conjugate());
  d.velocity = one.orientation * Vector3(1, 2, 3);
  d.compliance = Vector3(0.01, 0.02, 0.0), d.damping = Vector3(3, 2, 1);
  emit(d);
}
// The same by the components of the turn.
void uneven_bushing(const Pose& one, const Pose& two, const std::function<void(const Discrepancy&)>& emit) {
  ball(one, two, emit);
  const Quaternion turned = two.orientation * exp_rotation(Vector3(0.3, 0.6, 0.9));
  emit(sprung_component(one.orientation, turned, 0, {100.0, 3.0}));
  emit(sprung_component(one.orientation, turned, 1, {20.0, 2.0}));
  emit(sprung_component(one.orientation, turned, 2, {0.0, 1.0}));
}
// Not at its speed, so that it pushes with its bound.
void slipping_drive(const Pose& one, const Pose& two, const std::function<void(const Discrepancy&)>& emit) {
  ball(one, two, emit);
  Discrepancy d;
  d.axes = one.orientation;
  d.modes = pack_modes(AxisMode::kDriven, AxisMode::kFree, AxisMode::kFree, true);
  d.velocity = one.orientation * Vector3(50, 0, 0);
  d.maximum_force.x() = 70.0;
  emit(d);
}
void rod(const Pose& one, const Pose& two, const std::function<void(const Discrepancy&)>& emit) {
  Discrepancy d;
  d.point1 = one.position + one.orientation * Vector3(0, 2, 0), d.point2 = two.position;
  d.modes = pack_modes(AxisMode::kLimited, AxisMode::kFree, AxisMode::kFree) | kRadialDiscrepancy;
  d.lower.x() = d.upper.x() = 2.0;
  emit(d);
}

// Three links that turn as one about the first joint, so that all joints agree with them.
Mechanism links(std::uint64_t seed) {
  Draw draw(seed);
  Mechanism made;
  const Vector3 turning = draw.vector(2.0);
  for (int i = 0; i < 3; ++i) {
    made.poses.push_back({Vector3(i + 0.5, 0, 0) + draw.vector(0.2), draw.rotation()});
    made.twists.push_back({turning.cross(made.poses.back().position), turning});
    made.masses.push_back(draw.uniform(0.5, 2.0));
    made.wrenches.push_back({draw.vector(20.0), draw.vector(5.0)});
  }
  return made;
}

TEST(ReactionJacobians, AreTheSlopesOfTheReactions) {
  const std::vector<std::pair<std::string, decltype(Joint::describe)>> kinds = {{"balls", ball},
                                                                                {"hinges", hinge},
                                                                                {"even shafts", even_shafts},
                                                                                {"rods", rod},
                                                                                {"springs", spring},
                                                                                {"bushings", bushing},
                                                                                {"uneven bushings", uneven_bushing},
                                                                                {"slipping drives", slipping_drive}};
  for (const auto& [name, describe] : kinds) {
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      Draw draw(100 + seed);
      Mechanism made = links(seed);
      made.join(kNone, 0, {Vector3::Zero(), draw.rotation()}, ball);
      made.join(0, 1, {Vector3(1, 0, 0), draw.rotation()}, describe);
      made.join(1, 2, {Vector3(2, 0, 0), draw.rotation()}, describe);
      expect_slopes(made, name);
      made.body = 2, made.by = 1;
      made.slope = JacobianBlock::NullaryExpr([&](Eigen::Index, Eigen::Index) { return draw.uniform(-30.0, 30.0); });
      expect_slopes(made, name + " and a force");
      made.masses[0] = 0.0;
      made.joints.erase(made.joints.begin());
      expect_slopes(made, name + " carried by a kinematic body");
      const std::vector<Joint> once = made.joints;
      made.joints.insert(made.joints.end(), once.begin(), once.end());
      if (name == "balls" || name == "hinges" || name == "even shafts") expect_slopes(made, name + " twice");
    }
  }
}

// Two bobs side by side on rods of 1 m, and a rod of 2 m between them, nearly in line with those: off the joints by e in
// place a state is answered as if it were the nearest one on them, else slopes would be of the size of e over the cube of the
// angle.
TEST(ReactionJacobians, NearASingularConfigurationAreThoseOnTheJoints) {
  const auto rod_of = [](double length) {
    return [length](const Pose& one, const Pose& two, const std::function<void(const Discrepancy&)>& emit) {
      Discrepancy d;
      d.point1 = one.position, d.point2 = two.position;
      d.modes = pack_modes(AxisMode::kLimited, AxisMode::kFree, AxisMode::kFree) | kRadialDiscrepancy;
      d.lower.x() = d.upper.x() = length;
      emit(d);
    };
  };
  constexpr double kAngle = 0.05;
  const Vector3 along(std::cos(kAngle), std::sin(kAngle), 0.0), across(-std::sin(kAngle), std::cos(kAngle), 0.0);
  Mechanism bobs;
  for (const double x : {0.0, 2.0}) {
    bobs.poses.push_back({Vector3(x, 0, 0) + along, Quaternion::Identity()});
    bobs.twists.push_back({2.0 * across, Vector3::Zero()});
    bobs.masses.push_back(1.0);
    bobs.wrenches.push_back({Vector3(1, -9.81, 0), Vector3::Zero()});
  }
  bobs.joints.push_back({kNone, 0, Pose{}, Pose{}, rod_of(1.0)});
  bobs.joints.push_back({kNone, 1, Pose{Vector3(2, 0, 0), Quaternion::Identity()}, Pose{}, rod_of(1.0)});
  bobs.joints.push_back({0, 1, Pose{}, Pose{}, rod_of(2.0)});
  expect_slopes(bobs, "bobs", 1e-6);
}

// Joints that are told from both ends of a chain in turn are taken in an order of their own (elimination_order.h), in which
// places among the multipliers rise and fall.
TEST(ReactionJacobians, AreThoseOfJointsInAnyOrder) {
  constexpr int kLinks = harness::unless_sanitized(45, 2);
  Draw draw(7);
  Mechanism chain;
  const Vector3 turning = draw.vector(1.0);
  for (int i = 0; i < kLinks; ++i) {
    chain.poses.push_back({Vector3(i + 0.5, 0, 0) + draw.vector(0.2), draw.rotation()});
    chain.twists.push_back({turning.cross(chain.poses.back().position), turning});
    chain.masses.push_back(draw.uniform(0.5, 2.0));
    chain.wrenches.push_back({draw.vector(20.0), draw.vector(5.0)});
  }
  for (const int first : {0, 1})
    for (int i = first; i < kLinks; i += 2)
      chain.join(i == 0 ? kNone : static_cast<std::uint32_t>(i - 1), static_cast<std::uint32_t>(i),
                 {Vector3(i, 0, 0), draw.rotation()}, hinge);
  expect_slopes(chain, "hinges");
}

// Blocks for all that joints and forces connect, and for nobody else.
TEST(ReactionJacobians, AreOfThoseWhomJointsAndForcesConnect) {
  Mechanism made = links(3);
  made.join(0, 1, {Vector3(1, 0, 0), Quaternion::Identity()}, ball);
  ReactionProblem pair = made.problem();
  pair.differentiate();
  EXPECT_EQ(pair.blocks(), 4U);
  made.body = 2, made.by = 0;
  made.slope.setOnes();
  ReactionProblem all = made.problem();
  all.differentiate();
  EXPECT_EQ(all.blocks(), 9U);
  Mechanism apart = links(3);
  ReactionProblem none = apart.problem();
  EXPECT_TRUE(none.differentiate().isZero(0.0));
  EXPECT_EQ(none.blocks(), 1U);
}

// Both, with the bodies of `second` after those of `first`.
Mechanism side_by_side(const Mechanism& first, const Mechanism& second) {
  Mechanism both = first;
  const auto behind = static_cast<std::uint32_t>(first.poses.size());
  both.poses.insert(both.poses.end(), second.poses.begin(), second.poses.end());
  both.twists.insert(both.twists.end(), second.twists.begin(), second.twists.end());
  both.masses.insert(both.masses.end(), second.masses.begin(), second.masses.end());
  both.wrenches.insert(both.wrenches.end(), second.wrenches.begin(), second.wrenches.end());
  for (Joint joint : second.joints) {
    if (joint.one != kNone) joint.one += behind;
    joint.two += behind;
    both.joints.push_back(joint);
  }
  return both;
}

// Two rods of `length` in a row from `place`, which turn as one.
Mechanism two_rods(double length, const Vector3& place) {
  const auto rod_of = [length](const Pose& one, const Pose& two, const std::function<void(const Discrepancy&)>& emit) {
    Discrepancy d;
    d.point1 = one.position, d.point2 = two.position;
    d.modes = pack_modes(AxisMode::kLimited, AxisMode::kFree, AxisMode::kFree) | kRadialDiscrepancy;
    d.lower.x() = d.upper.x() = length;
    emit(d);
  };
  Mechanism rods;
  for (const Vector3& at : {Vector3(0.6, 0.8, 0.0), Vector3(1.4, 1.4, 0.0)}) {
    rods.poses.push_back({place + length * at, Quaternion::Identity()});
    rods.twists.push_back({length * Vector3(-at.y(), at.x(), 0.0), Vector3::Zero()});
    rods.masses.push_back(1.0);
    rods.wrenches.push_back({Vector3(1, -9.81, 2), Vector3::Zero()});
  }
  rods.joints.push_back({kNone, 0, Pose{place, Quaternion::Identity()}, Pose{}, rod_of});
  rods.joints.push_back({0, 1, Pose{}, Pose{}, rod_of});
  return rods;
}

TEST(ReactionJacobians, OfEachMechanismAreThoseItHasAlone) {
  Draw draw(11);
  Mechanism chain = links(5);
  chain.join(kNone, 0, {Vector3::Zero(), draw.rotation()}, ball);
  chain.join(0, 1, {Vector3(1, 0, 0), draw.rotation()}, hinge);
  chain.join(1, 2, {Vector3(2, 0, 0), draw.rotation()}, bushing);
  const Eigen::MatrixXd alone = chain.problem().differentiate();
  for (const double length : {1e-3, 1.0, 1e3}) {
    const Mechanism rods = two_rods(length, Vector3(3, 0, 0));
    ReactionProblem after = side_by_side(chain, rods).problem(), before = side_by_side(rods, chain).problem();
    for (std::size_t i = 0; i < chain.poses.size(); ++i) before.drag[rods.poses.size() + i] = after.drag[i];
    const Eigen::MatrixXd first = after.differentiate(), last = before.differentiate();
    EXPECT_EQ(first.topLeftCorner(alone.rows(), alone.cols()), alone) << length;
    EXPECT_EQ(last.bottomRightCorner(alone.rows(), alone.cols()), alone) << length;
    EXPECT_EQ(after.blocks(), 9U + 4U);
  }
}

// A force on one mechanism by the state of another, and one on a body without joints by theirs.
TEST(ReactionJacobians, KnowForcesBetweenMechanisms) {
  Draw draw(12);
  Mechanism chain = links(6);
  chain.join(kNone, 0, {Vector3::Zero(), draw.rotation()}, ball);
  chain.join(0, 1, {Vector3(1, 0, 0), draw.rotation()}, hinge);
  Mechanism both = side_by_side(chain, two_rods(1.0, Vector3(5, 0, 0)));
  both.slope = JacobianBlock::NullaryExpr([&](Eigen::Index, Eigen::Index) { return draw.uniform(-30.0, 30.0); });
  for (const auto& [body, by] : std::vector<std::pair<std::uint32_t, std::uint32_t>>{{1, 4}, {3, 0}, {2, 1}, {4, 2}}) {
    both.body = body, both.by = by;
    expect_slopes(both, std::to_string(body) + " by " + std::to_string(by));
  }
}

// Differences of places are by 1e-7 of the mechanism's size, however far it is from the origin: a curvature adds as much.
TEST(ReactionJacobians, OfSmallMechanismsFarAwayAreThoseAtTheOrigin) {
  const Eigen::MatrixXd here = two_rods(1e-3, Vector3::Zero()).problem().differentiate();
  const Eigen::MatrixXd there = two_rods(1e-3, Vector3(64, -32, 16)).problem().differentiate();
  EXPECT_GT(here.cwiseAbs().maxCoeff(), 1.0);
  EXPECT_LT((there - here).cwiseAbs().maxCoeff(), 1e-6 * here.cwiseAbs().maxCoeff());
}

TEST(ReactionJacobians, RefuseBlocksOfNobody) {
  Mechanism made = links(4);
  made.join(0, 1, {Vector3(1, 0, 0), Quaternion::Identity()}, ball);
  ReactionProblem foreign = made.problem();
  foreign.block_body = {0, 3};
  foreign.block.assign(kBlockNumbers, 1.0);
  EXPECT_THROW(foreign.differentiate(), Refusal);
  foreign.block_body = {0, 2};
  foreign.block.pop_back();
  EXPECT_THROW(foreign.differentiate(), Refusal);
}

}  // namespace
}  // namespace gravitas
