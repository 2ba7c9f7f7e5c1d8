// Slot constraint: a joint is right where it was bound, its errors are how far bodies are moved, its rows are the rate
// of its errors, and it knows no frame but those of its bodies. Modes and axes along which nothing is held are free to
// choose, so that errors are compared by their size.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>

#include "plugin_sdk/conformance/hostile_numbers.h"
#include "plugin_sdk/conformance/joints.h"
#include "plugin_sdk/conformance/sample_values.h"
#include "plugin_sdk/conformance/slot_cases.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas::conformance {
namespace {

// Rounding of points within ten metres, carried through some rotations.
constexpr double kJointRounding = 1e-13;
constexpr const char* kPointJoints[] = {"Spherical",    "Revolute",  "Rigid",
                                        "AngularMotor", "Universal", "ConstantVelocity"};

using Ends = std::pair<std::uint32_t, std::uint32_t>;

std::string shown_ends(const Ends& ends) {
  const auto name = [](std::uint32_t body) { return body == kNone ? "the world" : "body " + std::to_string(body); };
  return name(ends.first) + " and " + name(ends.second);
}

double largest_error(const std::vector<DescribedJoint>& described) {
  double largest = 0.0;
  for (const DescribedJoint& d : described)
    if (!d.discrepancy.is_angular()) largest = std::max(largest, error_of(d.discrepancy));
  return largest;
}

// ---- every type

// Calls judge(name, world) with a joint of each type between these, by its defaults and with values of every property.
template <typename Judge>
void for_each_joint(Subject& subject, const Ends& ends, Draw* draw, Judge&& judge) {
  for (const TypeDeclaration& type : joint_types_of(subject)) {
    for (const bool varies : {false, true}) {
      Joints world = joined(type, draw);
      world.joints[0].body1 = ends.first, world.joints[0].body2 = ends.second;
      if (varies) vary_joint(subject, type, 0, draw, &world);
      try {
        judge(varies ? shown(type, world.joints[0].properties) : type.name, world);
      } catch (const Refused&) {
        // drawn values may be, in any state
        if (!varies) throw;
      }
    }
  }
}

void judge_bind(Subject& subject) {
  Draw draw(41);
  for (const TypeDeclaration& type : joint_types_of(subject)) {
    for (const Ends& ends : {Ends{0, 1}, Ends{1, 0}, Ends{kNone, 1}, Ends{0, kNone}}) {
      for (int repeat = 0; repeat < 5; ++repeat) {
        Joints world = joined(type, &draw);
        world.joints[0].body1 = ends.first, world.joints[0].body2 = ends.second;
        Inquiry inquiry(subject, type.name + " between " + shown_ends(ends) + ", where it was bound");
        world.bind(&inquiry);
        const std::vector<DescribedJoint> described = world.describe(&inquiry);
        inquiry.expect(!described.empty(), "has no discrepancy");
        for (std::size_t i = 0; i < described.size(); ++i)
          inquiry.expect_near("joint error of discrepancy " + std::to_string(i), error_of(described[i].discrepancy),
                              0.0, kJointRounding);
      }
    }
  }
}

// True if any move along the axis is an error: what gives way is none.
bool is_held(const Discrepancy& d, int axis) {
  const AxisMode mode = axis_mode(d.modes, axis);
  if (d.compliance[axis] > 0.0) return false;
  return mode == AxisMode::kLocked || (mode == AxisMode::kLimited && d.lower[axis] == d.upper[axis]);
}

// True if what the error does along the axis is known to first order by what it does there: any held axis, and one that
// limits or gives way where there is no error, but for the lengths and angles that have no direction there.
bool is_measured(const Discrepancy& d, int axis) {
  const AxisMode mode = axis_mode(d.modes, axis);
  const double error = (d.point2 - d.point1).norm();
  if (is_held(d, axis)) return true;
  if (mode != AxisMode::kLocked && mode != AxisMode::kLimited && mode != AxisMode::kUnilateral) return false;
  return d.is_radial() || d.is_swing() ? axis == 0 && error > 1e-3 : error < kJointRounding;
}

// Along an axis, from its limit where there is one, which may move as the error does.
double off(const Discrepancy& d, const Matrix3& axes, int axis) {
  const double error = axes.col(axis).dot(d.point2 - d.point1);
  if (axis_mode(d.modes, axis) != AxisMode::kLimited) return error;
  if (d.upper[axis] < kUnlimited) return error - d.upper[axis];
  return d.lower[axis] > -kUnlimited ? error - d.lower[axis] : error;
}

// For small moves from where joints hold the error a.(x2 - x1) grows along each axis as its row says, J v t: a wrong sign
// is no small thing, as solvers then drive the joint open. Summed up over the axes, since a joint may choose others the next time.
void compare_growth(Joints world, const std::vector<DescribedJoint>& before, Inquiry* inquiry) {
  constexpr double kTime = 1e-6;
  std::vector<Vector3> rates;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const Discrepancy& d = before[i].discrepancy;
    const Matrix3 axes = to_rotation_matrix(d.axes);
    Vector3 rate = Vector3::Zero();
    for (int k = 0; k < 3; ++k) {
      inquiry->expect(!is_held(d, k) || d.maximum_force[k] > 0.0,
                      "locks axis " + std::to_string(k) + " of discrepancy " + std::to_string(i) +
                          " with a maximum_force of 0, which holds nothing");
      if (is_measured(d, k)) rate += world.row_velocity(before[i], axes.col(k)) * axes.col(k);
    }
    rates.push_back(rate);
  }
  for (JointedBody& body : world.bodies)
    body.pose = displaced(body.pose, kTime * body.twist.linear, kTime * body.twist.angular);
  const std::vector<DescribedJoint> after = world.describe(inquiry);
  inquiry->expect(after.size() == before.size(),
                  "has " + std::to_string(after.size()) + " discrepancies instead of " + std::to_string(before.size()));
  for (std::size_t i = 0; i < after.size(); ++i) {
    const Discrepancy &was = before[i].discrepancy, &is = after[i].discrepancy;
    const Matrix3 axes_before = to_rotation_matrix(was.axes), axes_after = to_rotation_matrix(is.axes);
    Vector3 growth = Vector3::Zero();
    for (int k = 0; k < 3; ++k) {
      if (!is_measured(was, k)) continue;
      growth += (off(is, axes_after, k) - off(was, axes_before, k)) / kTime * axes_after.col(k);
    }
    // the next order, and rounding of points over the time
    inquiry->expect_near("growth (m/s) of the joint error of discrepancy " + std::to_string(i), growth, rates[i],
                         1e-4 * (1.0 + rates[i].norm()));
  }
}

void judge_rows(Subject& subject) {
  Draw draw(42);
  for_each_joint(subject, {0, 1}, &draw, [&](const std::string& name, Joints& world) {
    Inquiry inquiry(subject, name + " where it was bound, and 1e-6 s later");
    world.bind(&inquiry);
    compare_growth(world, world.describe(&inquiry), &inquiry);
  });
}

// Where a joint lets a body go its points must not be told apart: the rows would push with an arm as long as half the way
// (held_point() of joint_rows.h).
void judge_ways(Subject& subject) {
  constexpr double kWay = 0.7;
  Draw draw(49);
  for (const TypeDeclaration& type : joint_types_of(subject)) {
    Joints bound = joined(type, &draw);
    Inquiry inquiry(subject, type.name + " where its body has gone 0.7 m along a free axis, and 1e-6 s later");
    bound.bind(&inquiry);
    for (const DescribedJoint& d : bound.describe(&inquiry)) {
      if (d.discrepancy.is_angular() || d.discrepancy.is_radial()) continue;
      const Matrix3 axes = to_rotation_matrix(d.discrepancy.axes);
      for (int k = 0; k < 3; ++k) {
        if (axis_mode(d.discrepancy.modes, k) != AxisMode::kFree) continue;
        Joints gone = bound;
        gone.bodies[1].pose.position += kWay * axes.col(k);
        const std::vector<DescribedJoint> described = gone.describe(&inquiry);
        const bool is_free = std::ranges::all_of(
            described, [](const DescribedJoint& one) { return error_of(one.discrepancy) < kJointRounding; });
        if (is_free) compare_growth(gone, described, &inquiry);
      }
    }
  }
}

// Both bodies moved as one: nothing that a solver sees changes but its direction.
void judge_constraint_frames(Subject& subject) {
  Draw draw(43);
  for_each_joint(subject, {0, 1}, &draw, [&](const std::string& name, Joints& world) {
    Inquiry inquiry(subject, name + " out of place, and the same in a world that is shifted and turned");
    world.bind(&inquiry);
    world.bodies[1].pose = displaced(world.bodies[1].pose, draw.vector(0.1), draw.vector(0.1));
    const std::vector<DescribedJoint> plain = world.describe(&inquiry);
    const Pose moved = draw.pose(3.0);
    for (JointedBody& body : world.bodies) {
      body.pose = compose(moved, body.pose);
      body.pose.orientation = normalized(body.pose.orientation);
      body.twist = {moved.orientation * body.twist.linear, moved.orientation * body.twist.angular};
    }
    Inquiry same = inquiry.demanding_answers();
    const std::vector<DescribedJoint> other = world.describe(&same);
    inquiry.expect(other.size() == plain.size(),
                   "has " + std::to_string(other.size()) + " discrepancies instead of " + std::to_string(plain.size()));
    for (std::size_t i = 0; i < plain.size(); ++i) {
      const Discrepancy &a = plain[i].discrepancy, &b = other[i].discrepancy;
      const std::string of = " of discrepancy " + std::to_string(i);
      inquiry.expect_near("joint error" + of, error_of(b), error_of(a), 10 * kJointRounding);
      inquiry.expect_near("desired speed" + of, b.velocity.norm(), a.velocity.norm(), 10 * kJointRounding);
      inquiry.expect(a.modes == b.modes,
                     "modes" + of + " are " + std::to_string(b.modes) + " instead of " + std::to_string(a.modes));
      inquiry.expect_near("compliance" + of, b.compliance, a.compliance, kJointRounding);
      inquiry.expect_near("damping" + of, b.damping, a.damping, kJointRounding);
    }
  });
}

// The world is a body at the origin that does not move, and no other body.
void judge_world(Subject& subject) {
  Draw draw(44);
  for_each_joint(subject, {kNone, 1}, &draw, [&](const std::string& name, Joints& by_world) {
    Joints by_body = by_world;
    by_body.bodies.emplace_back();
    by_body.joints[0].body1 = 2;
    Inquiry inquiry(subject, name + " to the world, and to a body at rest at the origin");
    Inquiry same = inquiry.demanding_answers();
    by_world.bind(&inquiry), by_body.bind(&same);
    for (std::size_t i = 0; i < 2; ++i) {
      const Pose moved = displaced(by_world.bodies[i].pose, draw.vector(0.1), draw.vector(0.1));
      by_world.bodies[i].pose = by_body.bodies[i].pose = moved;
    }
    const std::vector<DescribedJoint> a = by_world.describe(&inquiry), b = by_body.describe(&same);
    inquiry.expect(a.size() == b.size(),
                   "has " + std::to_string(a.size()) + " discrepancies instead of " + std::to_string(b.size()));
    for (std::size_t i = 0; i < a.size(); ++i) {
      const std::string of = " of discrepancy " + std::to_string(i);
      inquiry.expect_near("point1" + of, a[i].discrepancy.point1, b[i].discrepancy.point1, kJointRounding);
      inquiry.expect_near("point2" + of, a[i].discrepancy.point2, b[i].discrepancy.point2, kJointRounding);
      inquiry.expect_near("velocity" + of, a[i].discrepancy.velocity, b[i].discrepancy.velocity, 10 * kJointRounding);
    }
  });
}

// Each body joined to the one before it, or on either side to the world, by joints of all types in turn,
// the second ones with values of every property if they vary.
Joints chain_of(Subject& subject, std::uint32_t count, bool varies, Draw* draw) {
  const std::vector<TypeDeclaration> types = joint_types_of(subject);
  Joints chain;
  for (std::uint32_t i = 0; i < count && !types.empty(); ++i) {
    chain.bodies.push_back({draw->pose(3.0), {draw->vector(2.0), draw->vector(2.0)}});
    const TypeDeclaration& type = types[i % types.size()];
    const std::uint32_t other = i % 10 == 0 ? kNone : i - 1;
    const bool is_first = i % 20 == 10;
    chain.joints.push_back({.type = type_id(type.name),
                            .body1 = is_first ? i : other,
                            .body2 = is_first ? other : i,
                            .properties = sample_values(type.properties, draw)});
    if (varies && i / types.size() == 1) vary_joint(subject, type, i, draw, &chain);
  }
  return chain;
}

void expect_same(const Inquiry& inquiry, const Discrepancy& came, const Discrepancy& right) {
  inquiry.expect_near("point1", came.point1, right.point1, 0.0);
  inquiry.expect_near("point2", came.point2, right.point2, 0.0);
  inquiry.expect_near("velocity", came.velocity, right.velocity, 0.0);
  inquiry.expect(came.modes == right.modes && came.axes.coeffs() == right.axes.coeffs(), "has other modes or axes");
}

// Of hundreds of joints: the same ones in other rows, between the same bodies in other rows.
void judge_constraint_permutation(Subject& subject, bool varies) {
  Draw draw(50);
  Joints plain = chain_of(subject, 300, varies, &draw);
  const std::size_t count = plain.joints.size();
  const std::vector<std::uint32_t> place = draw.order(count), row = draw.order(count);
  const auto renamed = [&](std::uint32_t body) { return body == kNone ? kNone : place[body]; };
  Joints mixed = plain;
  for (std::size_t i = 0; i < count; ++i) {
    Joint& joint = mixed.joints[row[i]] = plain.joints[i];
    joint.body1 = renamed(joint.body1), joint.body2 = renamed(joint.body2);
    mixed.bodies[place[i]] = plain.bodies[i];
  }
  Inquiry inquiry(subject, std::to_string(count) + " joints, and the same in other rows");
  Inquiry same = inquiry.demanding_answers();
  plain.bind(&inquiry), mixed.bind(&same);
  for (std::size_t i = 0; i < count; ++i) {
    JointedBody& body = plain.bodies[i];
    body.pose = displaced(body.pose, draw.vector(0.1), draw.vector(0.1));
    mixed.bodies[place[i]] = body;
  }
  std::vector<std::vector<Discrepancy>> right(count);
  for (const DescribedJoint& one : plain.describe(&inquiry)) right[row[one.joint]].push_back(one.discrepancy);
  std::vector<std::size_t> described(count, 0);
  for (const DescribedJoint& one : mixed.describe(&same)) {
    const std::size_t next = described[one.joint]++;
    inquiry.now_asked("joint " + std::to_string(one.joint) + " of " + std::to_string(count) +
                      ", and the same in another row");
    inquiry.expect(next < right[one.joint].size(), "has more discrepancies");
    expect_same(inquiry, one.discrepancy, right[one.joint][next]);
  }
  for (std::size_t i = 0; i < count; ++i)
    inquiry.expect(described[i] == right[i].size(), "joint " + std::to_string(i) + " has fewer discrepancies");
}

// Many joints at once, one of them broken: each as if it were alone.
void judge_constraint_independence(Subject& subject, bool varies) {
  Draw draw(45);
  Joints all;
  for (int i = 0; i < 5; ++i) all.bodies.push_back({draw.pose(3.0), {draw.vector(2.0), draw.vector(2.0)}});
  const std::vector<TypeDeclaration> types = joint_types_of(subject);
  for (std::uint32_t copy = 0; copy < 3; ++copy)
    for (const TypeDeclaration& type : types)
      all.joints.push_back({.type = type_id(type.name),
                            .body1 = copy == 2 ? kNone : copy,
                            .body2 = copy + 2,
                            .properties = sample_values(type.properties, &draw)});
  if (all.joints.empty()) return;
  for (std::size_t i = 0; i < types.size() && varies; ++i) vary_joint(subject, types[i], types.size() + i, &draw, &all);
  const std::size_t broken = all.joints.size() / 2;
  const std::vector<JointedBody> start = all.bodies;
  std::vector<JointedBody> moved = start;
  for (JointedBody& body : moved) body.pose = displaced(body.pose, draw.vector(0.1), draw.vector(0.1));
  Inquiry inquiry(subject, "");
  inquiry.now_asked(std::to_string(all.joints.size()) + " joints, number " + std::to_string(broken) + " broken");
  all.bind(&inquiry);
  all.bodies = moved;
  all.joints[broken].intact = 0;
  const std::vector<DescribedJoint> together = all.describe(&inquiry);
  Inquiry same = inquiry.demanding_answers();
  std::size_t next = 0;
  for (std::uint32_t j = 0; j < all.joints.size(); ++j) {
    if (all.joints[j].intact == 0) continue;
    Joints alone;
    alone.bodies = start;
    alone.joints = {all.joints[j]};
    same.now_asked("joint " + std::to_string(j) + " of " + std::to_string(all.joints.size()) +
                   ", alone and among the others");
    alone.bind(&same);
    alone.bodies = moved;
    for (const DescribedJoint& one : alone.describe(&same)) {
      same.expect(next < together.size() && together[next].joint == j, "has fewer discrepancies among the others");
      expect_same(same, together[next++].discrepancy, one.discrepancy);
    }
  }
  inquiry.expect(next == together.size(),
                 "has " + std::to_string(together.size()) + " discrepancies, should have " + std::to_string(next));
}

void judge_constraint_nothing(Subject& subject) {
  Inquiry inquiry(subject, "no joints");
  Joints world;
  world.bodies = {JointedBody{}};
  world.bind(&inquiry);
  inquiry.expect(world.describe(&inquiry).empty(), "has a discrepancy");
}

void judge_constraint_refusals(Subject& subject) {
  Draw draw(46);
  for (const TypeDeclaration& type : joint_types_of(subject)) {
    Joints world = joined(type, &draw);
    Inquiry inquiry(subject, type.name);
    world.bind(&inquiry);
    expect_foreign_indices_refused(subject, type.name, stage::Method::kConstraintBind, world.bind_request());
    expect_foreign_indices_refused(subject, type.name, stage::Method::kConstraintDiscrepancies,
                                   world.describe_request());
    world.joints[0].type = type_id("NoSuchJoint");
    inquiry.now_asked("a joint of a type that the plugin did not declare, with the properties of " + type.name);
    inquiry.demand_refusal(stage::Method::kConstraintBind, world.bind_request());
  }
}

void judge_constraint_hostile(Subject& subject) {
  Draw draw(47);
  for (const TypeDeclaration& type : joint_types_of(subject)) {
    Joints world = joined(type, &draw);
    Inquiry inquiry(subject, type.name);
    world.bind(&inquiry);
    expect_hostile_numbers_survived(subject, "binding " + type.name, stage::Method::kConstraintBind,
                                    world.bind_request());
    expect_hostile_numbers_survived(subject, type.name, stage::Method::kConstraintDiscrepancies,
                                    world.describe_request());
    if (world.joints[0].properties.empty()) continue;
    world.joints[0].properties.pop_back();
    inquiry.now_asked("binding " + type.name + ", its last property missing");
    inquiry.answer_or_refusal(stage::Method::kConstraintBind, world.bind_request());
  }
}

// ---- types of the scene language

// Joints that share a point: body 2 moved by d is |d| wrong.
void judge_displacement(Subject& subject) {
  Draw draw(48);
  for (const TypeDeclaration& type : joint_types_of(subject)) {
    if (std::ranges::find(kPointJoints, type.name) == std::end(kPointJoints)) continue;
    Joints world = joined(type, &draw);
    const Vector3 shift(0.1, -0.2, 0.3);
    Inquiry inquiry(subject, type.name + " after body 2 was moved by (0.1, -0.2, 0.3)");
    world.bind(&inquiry);
    world.bodies[1].pose.position += shift;
    inquiry.expect_near("largest joint error", largest_error(world.describe(&inquiry)), shift.norm(), kJointRounding);
    world.bodies[0].pose.position += shift;
    inquiry.now_asked(type.name + " after both bodies were moved by (0.1, -0.2, 0.3)");
    inquiry.expect_near("largest joint error", largest_error(world.describe(&inquiry)), 0.0, kJointRounding);
  }
}

// Turns body 2 about a point.
void turn_about(const Vector3& point, const Vector3& rotation, JointedBody* body) {
  const Quaternion turn = exp_rotation(rotation);
  body->pose = {point + turn * (body->pose.position - point), normalized(turn * body->pose.orientation)};
}

void judge_spherical(Subject& subject) {
  Draw draw(49);
  const TypeDeclaration& type = *find_type(subject.declaration(), "Spherical");
  for (int i = 0; i < 5; ++i) {
    Joints world = joined(type, &draw);
    const Vector3 point = draw.vector(2.0), turn = draw.vector(2.0);
    world.joints[0].properties = flattened(type, {given("BindPoint", point)});
    Inquiry inquiry(subject, "Spherical at " + shown(point) + " after body 2 turned about it by " + shown(turn));
    world.bind(&inquiry);
    turn_about(point, turn, &world.bodies[1]);
    for (const DescribedJoint& d : world.describe(&inquiry)) {
      inquiry.expect_near("joint error", error_of(d.discrepancy), 0.0, kJointRounding);
      inquiry.expect_near("point1", d.discrepancy.point1, point, kJointRounding);
    }
  }
}

// Motors, and other hinges that may have a drive.
std::vector<TypeDeclaration> driven_hinges(const PluginDeclaration& declaration) {
  std::vector<TypeDeclaration> types;
  for (const TypeDeclaration& type : declaration.types) {
    const bool has_speed = std::ranges::find(type.properties, "AngularSpeed", &Property::name) != type.properties.end();
    if (type.name == "AngularMotor" || (type.name == "Revolute" && has_speed)) types.push_back(type);
  }
  return types;
}

// A hinge turns about its axis, and its drive wants the set speed: with it every row has the velocity it asks for.
void judge_motor_of(Subject& subject, const TypeDeclaration& type) {
  Draw draw(50);
  for (const double speed : {3.0, -0.5, 0.0}) {
    Joints world = joined(type, &draw);
    const Vector3 point1 = draw.vector(1.0), point2 = point1 + draw.direction();
    const Vector3 axis = (point2 - point1).normalized();
    world.joints[0].properties = flattened(
        type, {given("BindAxisPoint1", point1), given("BindAxisPoint2", point2), given("AngularSpeed", speed)});
    Inquiry inquiry(subject,
                    type.name + " of " + number_text(speed) + " rad/s, body 2 turned by 0.7 rad, at that speed");
    world.bind(&inquiry);
    turn_about(point1, 0.7 * axis, &world.bodies[1]);
    JointedBody &one = world.bodies[0], &other = world.bodies[1];
    other.twist.angular = one.twist.angular + speed * axis;
    // the point on the axis has one velocity
    const Vector3 at_point = one.twist.linear + one.twist.angular.cross(point1 - one.pose.position);
    other.twist.linear = at_point - other.twist.angular.cross(point1 - other.pose.position);
    bool driven = false;
    for (const DescribedJoint& d : world.describe(&inquiry)) {
      inquiry.expect_near("joint error", error_of(d.discrepancy), 0.0, kJointRounding);
      const Matrix3 axes = to_rotation_matrix(d.discrepancy.axes);
      for (int k = 0; k < 3; ++k) {
        const AxisMode mode = axis_mode(d.discrepancy.modes, k);
        driven = driven || mode == AxisMode::kDriven;
        if (mode == AxisMode::kFree) continue;
        inquiry.expect_near("velocity of a row along " + shown(axes.col(k)), world.row_velocity(d, axes.col(k)),
                            d.discrepancy.velocity.dot(axes.col(k)), 10 * kJointRounding);
      }
    }
    inquiry.expect(driven, "has no driven axis");
  }
}

void judge_motor(Subject& subject) {
  for (const TypeDeclaration& type : driven_hinges(subject.declaration())) judge_motor_of(subject, type);
}

}  // namespace

std::vector<Case> constraint_cases(const PluginDeclaration& declaration) {
  std::vector<Case> cases = {
      make_types_case("constraint/types", joint_types_of),
      make_case("constraint/nothing", "Without joints there is no discrepancy.", judge_constraint_nothing),
      make_case("constraint/bind", "A joint has no error where it was bound, to a body or to the world.", judge_bind),
      make_case("constraint/rows", "The rows of an axis are the rate of the error along it.", judge_rows),
      make_case("constraint/ways", "The rows are that, too, wherever free axes let a body go.", judge_ways),
      make_case("constraint/frames", "A joint knows no frame but those of its bodies.", judge_constraint_frames),
      make_case("constraint/world", "The world is a body at the origin, at rest.", judge_world),
      make_varied_case("constraint/independence", "Each joint is described for itself; a broken one not at all.",
                       judge_constraint_independence),
      make_varied_case("constraint/permutation", "The order of bodies and joints changes no bit of a joint.",
                       judge_constraint_permutation),
      make_case("constraint/displacement", "A body moved from its joint is as wrong as it was moved.",
                judge_displacement),
      make_case("constraint/refusals", "Bodies that do not exist and types that were not declared are refused.",
                judge_constraint_refusals),
      make_case("constraint/hostile", "Hostile numbers are refused with a reason, or answered with finite ones.",
                judge_constraint_hostile)};
  if (find_type(declaration, "Spherical") != nullptr)
    cases.push_back(make_case("constraint/spherical", "Bodies turn freely about their shared point.", judge_spherical));
  if (!driven_hinges(declaration).empty())
    cases.push_back(make_case("constraint/motor", "A motor's rows want its speed about its axis, and no other motion.",
                              judge_motor));
  std::ranges::move(coordinate_cases(declaration), std::back_inserter(cases));
  return cases;
}

// The discrepancies of joints that the subject itself has bound.
std::vector<Question> constraint_questions(Subject& subject, Draw* draw) {
  std::vector<Question> questions;
  if (joint_types_of(subject).empty()) return questions;
  for (const std::uint32_t count : {1U, 12U, 100U}) {
    const std::string joints = std::to_string(count) + " joints";
    MessageColumns binding = empty_request(stage::Method::kConstraintBind);
    const std::optional<Joints> chain =
        bound_and_moved(subject, stage::Method::kConstraintDiscrepancies, 0.01, draw, [&](bool varies) {
          Joints one = chain_of(subject, count, varies, draw);
          binding = one.bind_request();
          return one;
        });
    questions.push_back({"binding " + joints, stage::Method::kConstraintBind, binding, {}});
    if (chain)
      questions.push_back(
          {"discrepancies of " + joints, stage::Method::kConstraintDiscrepancies, chain->describe_request(), {}});
  }
  std::ranges::move(coordinate_questions(subject, draw), std::back_inserter(questions));
  return questions;
}

}  // namespace gravitas::conformance
