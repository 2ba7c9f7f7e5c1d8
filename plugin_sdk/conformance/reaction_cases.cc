// The optional questions of slot solver, reactions and how they change with the state: that with them the points of ball-and-socket joints accelerate
// as one, or as desired, that they are the pushes of the multipliers reported, and what they do to bodies that nothing can push.
//
// Tolerance: kReactionRounding of the largest force, acceleration or torque of the question.
#include <algorithm>
#include <cmath>
#include <limits>

#include "plugin_sdk/conformance/constrained_bodies.h"
#include "plugin_sdk/conformance/hostile_numbers.h"
#include "plugin_sdk/conformance/sample_values.h"
#include "plugin_sdk/conformance/slot_cases.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/wrench_jacobian.h"

namespace gravitas::conformance {
namespace {

constexpr stage::Method kReactions = stage::Method::kSolverReactions,
                        kReactionJacobians = stage::Method::kSolverReactionJacobians;
constexpr double kReactionRounding = 1e-9, kWeight = 9.81;

class Reactions {
 public:
  explicit Reactions(MessageColumns reply) : reply_(std::move(reply)) {}
  Vector3 force(std::size_t body) const { return vector_at(reply_.f64("reaction"), 2 * body); }
  Vector3 torque(std::size_t body) const { return vector_at(reply_.f64("reaction"), 2 * body + 1); }
  Vector3 joint_force(std::size_t joint) const { return vector_at(reply_.f64("discrepancy_force"), joint); }
  double residual() const { return reply_.f64("residual")[0]; }

 private:
  MessageColumns reply_;
};

// Bodies, wrenches and joints in one state, and what is given beside them.
struct Mechanism {
  ConstrainedBodies world;
  std::vector<double> drag;          // 1/s; a body without: 0
  std::vector<Twist> accelerations;  // of kinematic bodies
  std::vector<Discrepancy> start;    // of its joints in S_n; none: not told

  Reactions ask(Inquiry* inquiry) const {
    Reactions came(inquiry->answer(kReactions, request()));
    for (std::size_t i = 0; i < world.bodies.size(); ++i) {
      if (world.is_pushed(i)) continue;
      const std::string of = " on body " + std::to_string(i) + ", which nothing can push";
      inquiry->expect_near("force" + of, came.force(i), Vector3::Zero(), 0.0);
      inquiry->expect_near("torque" + of, came.torque(i), Vector3::Zero(), 0.0);
    }
    return came;
  }

  MessageColumns request() const {
    MessageColumns columns = world.reactions_request();
    columns.f64("drag") = drag;
    columns.f64("drag").resize(world.bodies.size(), 0.0);
    for (std::size_t i = 0; i < world.bodies.size(); ++i) {
      const Twist given = i < accelerations.size() ? accelerations[i] : Twist{};
      append(&columns.f64("acceleration"), given.linear);
      append(&columns.f64("acceleration"), given.angular);
    }
    for (const Discrepancy& d : start) {
      append(&columns.f64("start_point1"), d.point1);
      append(&columns.f64("start_point2"), d.point2);
      append(&columns.f64("start_velocity"), d.velocity);
      append(&columns.f64("start_axes"), d.axes);
      columns.u32("start_mode").push_back(d.modes);
      append(&columns.f64("start_lower"), d.lower);
      append(&columns.f64("start_upper"), d.upper);
      append(&columns.f64("start_compliance"), d.compliance);
      append(&columns.f64("start_damping"), d.damping);
      append(&columns.f64("start_acceleration"), d.acceleration);
    }
    return columns;
  }
};

std::string joint_text(const char* what, std::size_t joint) {
  return std::string(what) + " of joint " + std::to_string(joint);
}

// Links that hang from the world, or from a kinematic body, and turn; all points of joints move as one.
Mechanism swinging_chain(Draw* draw, std::uint32_t links, bool is_carried) {
  Mechanism made;
  std::uint32_t above = kNone;
  Vector3 joint = draw->vector(1.0), joint_velocity = Vector3::Zero();
  if (is_carried) {
    const Pose pose{joint + draw->vector(0.5), draw->rotation()};
    const Twist twist{draw->vector(1.0), draw->vector(1.0)};
    above = made.world.add({.pose = pose, .twist = twist, .kinematic = true});
    made.accelerations = {{draw->vector(3.0), draw->vector(3.0)}};
    joint_velocity = twist.linear + twist.angular.cross(joint - pose.position);
  }
  for (std::uint32_t i = 0; i < links; ++i) {
    const Vector3 half = draw->vector(0.6), turning = draw->vector(4.0);
    const double mass = draw->uniform(0.5, 2.0);
    const std::uint32_t link = made.world.add(
        {.mass = mass,
         .moments = mass * Vector3{draw->uniform(0.1, 0.2), draw->uniform(0.1, 0.2), draw->uniform(0.1, 0.2)},
         .pose = {joint + half, draw->rotation()},
         .twist = {joint_velocity + turning.cross(half), turning}});
    made.world.wrench[link] = {draw->vector(20.0), draw->vector(2.0)};
    made.world.add_ball_joint(above, link, joint);
    above = link;
    joint += 2.0 * half;
    joint_velocity += turning.cross(2.0 * half);
  }
  for (std::size_t i = 0; i < made.world.bodies.size(); ++i) made.drag.push_back(draw->uniform(0.0, 0.5));
  return made;
}

// Newton and Euler with the reactions.
Twist acceleration_of(const Mechanism& mechanism, const Reactions& came, std::uint32_t body) {
  if (!mechanism.world.is_pushed(body)) return mechanism.accelerations[body];
  const ConstrainedBody& one = mechanism.world.bodies[body];
  const Wrench& wrench = mechanism.world.wrench[body];
  const double drag = mechanism.drag[body];
  return {(wrench.force + came.force(body)) / one.mass - drag * one.twist.linear,
          angular_acceleration(one.pose.orientation, one.twist.angular, one.moments, one.moments.cwiseInverse(),
                               wrench.torque + came.torque(body)) -
              drag * one.twist.angular};
}

Vector3 point_acceleration(const Mechanism& mechanism, const Reactions& came, std::uint32_t body,
                           const Vector3& point) {
  if (body == kNone) return Vector3::Zero();
  const ConstrainedBody& one = mechanism.world.bodies[body];
  const Twist change = acceleration_of(mechanism, came, body);
  const Vector3 arm = point - one.pose.position;
  return change.linear + change.angular.cross(arm) + one.twist.angular.cross(one.twist.angular.cross(arm));
}

// ---- cases

void judge_hanging(Subject& subject) {
  Mechanism still;
  const std::uint32_t load = still.world.add({.mass = 2.0, .pose = {Vector3(0, -1, 0), Quaternion::Identity()}});
  still.world.wrench[load].force = Vector3(0, -2.0 * kWeight, 0);
  Inquiry inquiry(subject, "2 kg that fall freely");
  const Reactions free = still.ask(&inquiry);
  inquiry.expect_near("force", free.force(load), Vector3::Zero(), 0.0);
  inquiry.expect_near("torque", free.torque(load), Vector3::Zero(), 0.0);

  still.world.add_ball_joint(kNone, load, Vector3::Zero());
  inquiry.now_asked("2 kg hanging still from the world, 1 m below their joint");
  const Vector3 weight(0, 2.0 * kWeight, 0);
  const Reactions came = still.ask(&inquiry);
  inquiry.expect_near("force", came.force(load), weight, 1e-8);
  inquiry.expect_near("torque", came.torque(load), Vector3::Zero(), 1e-8);
  inquiry.expect_near("force of the joint on body 2", came.joint_force(0), weight, 1e-8);
  inquiry.expect_near("residual", came.residual(), 0.0, 1e-8);

  // the tension of a pendulum that passes its lowest point: m (g + w^2 l)
  still.world.bodies[load].twist = {Vector3(3, 0, 0), Vector3(0, 0, 3)};
  inquiry.now_asked("a pendulum of 2 kg and 1 m that passes its lowest point at 3 rad/s");
  inquiry.expect_near("force", still.ask(&inquiry).force(load), Vector3(0, 2.0 * (kWeight + 9.0), 0), 1e-8);
}

void judge_accelerations(Subject& subject) {
  Draw draw(91), of_desired(92);
  for (int trial = 0; trial < 24; ++trial) {
    const std::uint32_t links = 1 + draw.below(4);
    const bool is_carried = trial % 3 == 2, is_guided = trial % 4 == 3;
    Mechanism chain = swinging_chain(&draw, links, is_carried);
    if (is_guided)
      for (BodyJoint& joint : chain.world.joints) joint.discrepancy.acceleration = of_desired.vector(3.0);
    Inquiry inquiry(subject, "random chain number " + std::to_string(trial) + " of " + std::to_string(links) +
                                 " links that swing" + (is_carried ? " from a kinematic body" : " from the world") +
                                 (is_guided ? ", with desired accelerations" : ""));
    const Reactions came = chain.ask(&inquiry);
    std::vector<Wrench> pushes(chain.world.bodies.size());
    double size = 1.0;
    for (std::size_t i = 0; i < chain.world.joints.size(); ++i) {
      const BodyJoint& joint = chain.world.joints[i];
      const Vector3 one = point_acceleration(chain, came, joint.body1, joint.discrepancy.point1),
                    two = point_acceleration(chain, came, joint.body2, joint.discrepancy.point2);
      inquiry.expect_near(joint_text("relative acceleration of the points", i), two - one,
                          joint.discrepancy.acceleration, kReactionRounding * std::max({1.0, one.norm(), two.norm()}));
      const Vector3 force = came.joint_force(i);  // axes are the world's
      size += force.norm();
      for (const auto& [body, sign] : {std::pair(joint.body1, -1.0), std::pair(joint.body2, 1.0)}) {
        if (body == kNone || !chain.world.is_pushed(body)) continue;
        pushes[body].force += sign * force;
        pushes[body].torque += sign * (joint.discrepancy.point2 - chain.world.bodies[body].pose.position).cross(force);
      }
    }
    for (std::size_t i = 0; i < pushes.size(); ++i) {
      const std::string of = " on body " + std::to_string(i) + " (against the forces of its joints)";
      inquiry.expect_near("force" + of, came.force(i), pushes[i].force, kReactionRounding * size);
      inquiry.expect_near("torque" + of, came.torque(i), pushes[i].torque, kReactionRounding * size);
    }
  }
}

void judge_springs(Subject& subject) {
  Mechanism sprung;
  const std::uint32_t load = sprung.world.add({.mass = 2.0, .twist = {Vector3(0.5, 0, 0), Vector3::Zero()}});
  BodyJoint spring{.body1 = kNone, .body2 = load, .discrepancy = {}};
  spring.discrepancy.point1 = Vector3(-0.3, 0, 0);
  spring.discrepancy.modes = pack_modes(AxisMode::kLocked, AxisMode::kFree, AxisMode::kFree);
  spring.discrepancy.compliance.x() = 0.01, spring.discrepancy.damping.x() = 4.0;
  sprung.world.joints.push_back(spring);
  Inquiry inquiry(subject, "2 kg at 0.5 m/s on a spring of 100 N/m and 4 N s/m, 0.3 m long");
  const Reactions came = sprung.ask(&inquiry);
  const Vector3 pull(-32, 0, 0);
  inquiry.expect_near("force", came.force(load), pull, 1e-10);
  inquiry.expect_near("torque", came.torque(load), Vector3::Zero(), 1e-10);
  inquiry.expect_near("force of the spring on body 2", came.joint_force(0), pull, 1e-10);

  sprung.world.joints[0].discrepancy.modes |= kForcesApplied;
  inquiry.now_asked("the same at the end of a step, where the spring acted already");
  const Solution solved = sprung.world.ask(&inquiry);
  inquiry.expect_near("impulse of the spring", solved.joint_impulse(0), Vector3::Zero(), 0.0);
  inquiry.expect_near("velocity", sprung.world.twists(solved)[load].linear, Vector3(0.5, 0, 0), 0.0);
}

// Limits that were closed in S_n hold, and drives that were at their speed, by what joints tell there. A load is pulled along x with
// 3 N, and its joint in the state that is asked about is the same each time.
void judge_start(Subject& subject) {
  Mechanism pulled;
  const std::uint32_t load = pulled.world.add({.mass = 2.0});
  pulled.world.wrench[load].force = Vector3(3, 0, 0);
  const auto expect = [&](const char* asked, const Discrepancy& joint, const Discrepancy& at_start, double force) {
    pulled.world.joints = {{.body1 = kNone, .body2 = load, .discrepancy = joint}};
    pulled.start = {at_start};
    Inquiry inquiry(subject, std::string("2 kg at rest that 3 N pull along x, at ") + asked);
    const Reactions came = pulled.ask(&inquiry);
    inquiry.expect_near("force", came.force(load), Vector3(force, 0, 0), 1e-8);
    inquiry.expect_near("torque", came.torque(load), Vector3::Zero(), 1e-8);
  };
  Discrepancy limit;
  limit.modes = pack_modes(AxisMode::kLimited, AxisMode::kFree, AxisMode::kFree);
  limit.lower.x() = -kUnlimited;
  expect("the end of a limit that was closed in S_n", limit, limit, -3.0);
  Discrepancy open = limit;
  open.upper.x() = 0.3;
  expect("the end of a limit that was 0.3 m further in S_n", limit, open, 0.0);
  open = limit;
  open.point1.x() = 0.3;
  expect("the end of a limit that was 0.3 m open in S_n", limit, open, 0.0);

  Discrepancy drive;
  drive.modes = pack_modes(AxisMode::kDriven, AxisMode::kFree, AxisMode::kFree);
  drive.maximum_force.x() = 5.0;
  expect("the speed of a drive of 5 N that was its speed in S_n", drive, drive, -3.0);
  Discrepancy faster = drive;
  faster.velocity.x() = 1.0;
  expect("the speed of a drive of 5 N that asked for 1 m/s in S_n", drive, faster, 5.0);
}

void judge_twice(Subject& subject) {
  Draw draw(92);
  Mechanism chain = swinging_chain(&draw, 3, false);
  Inquiry inquiry(subject, "a chain of three that swings, and every joint of it twice");
  const Reactions once = chain.ask(&inquiry);
  const std::vector<BodyJoint> joints = chain.world.joints;
  chain.world.joints.insert(chain.world.joints.end(), joints.begin(), joints.end());
  const Reactions twice = chain.ask(&inquiry);
  for (std::size_t i = 0; i < 3; ++i) {
    const std::string of = " on body " + std::to_string(i) + " with every joint twice";
    inquiry.expect_near("force" + of, twice.force(i), once.force(i), 1e-7 * (1.0 + once.force(i).norm()));
    inquiry.expect_near("torque" + of, twice.torque(i), once.torque(i), 1e-7 * (1.0 + once.torque(i).norm()));
  }
}

// With a number of a body's state changed: its joints' points go with it.
Mechanism moved(Mechanism made, std::uint32_t body, int number, double by) {
  ConstrainedBody& one = made.world.bodies[body];
  const Pose before = one.pose;
  move_state(number, by, &one.pose, &one.twist);
  if (number >= 6) return made;
  for (BodyJoint& joint : made.world.joints) {
    Discrepancy& d = joint.discrepancy;
    if (joint.body1 == body) d.point1 = carried(d.point1, before, one.pose);
    if (joint.body2 == body) d.point2 = carried(d.point2, before, one.pose);
    if (joint.body1 == body) d.axes = one.pose.orientation * (before.orientation.conjugate() * d.axes);
  }
  return made;
}

// A chain under forces that answer the state of the second link with a wrench on the last one.
void judge_reaction_jacobians(Subject& subject) {
  constexpr double kMoved = 1e-5, kTolerance = 1e-4;
  constexpr std::uint32_t kLinks = 3, kPushed = 2, kBy = 1;
  Draw draw(94);
  const Mechanism chain = swinging_chain(&draw, kLinks, false);
  const JacobianBlock slope =
      JacobianBlock::NullaryExpr([&](Eigen::Index, Eigen::Index) { return draw.uniform(-20.0, 20.0); });
  MessageColumns request = chain.request();
  request.u32("block_body") = {kPushed, kBy};
  request.f64("block").assign(slope.data(), slope.data() + slope.size());
  Inquiry inquiry(subject, "a chain of three that swings, under a force that answers its state");
  const MessageColumns came = inquiry.answer(kReactionJacobians, request);
  const std::vector<std::uint32_t>& bodies = came.u32("reaction_body");
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(6 * kLinks, 12 * kLinks);
  for (std::size_t i = 0; i < bodies.size() / 2; ++i) {
    inquiry.expect(bodies[2 * i] < kLinks && bodies[2 * i + 1] < kLinks,
                   "block " + std::to_string(i) + " names a body that does not exist");
    jacobian.block<6, 12>(6 * bodies[2 * i], 12 * bodies[2 * i + 1]) +=
        Eigen::Map<const JacobianBlock>(&came.f64("reaction_block")[kBlockNumbers * i]);
  }
  const double scale = std::max(1.0, jacobian.cwiseAbs().maxCoeff());
  const auto reactions = [&](std::uint32_t body, int number, double by) {
    Mechanism there = moved(chain, body, number, by);
    if (body == kBy) {
      there.world.wrench[kPushed].force += by * slope.col(number).head<3>();
      there.world.wrench[kPushed].torque += by * slope.col(number).tail<3>();
    }
    const Reactions asked = there.ask(&inquiry);
    Eigen::VectorXd all(6 * kLinks);
    for (std::uint32_t i = 0; i < kLinks; ++i) all.segment<6>(6 * i) << asked.force(i), asked.torque(i);
    return all;
  };
  for (std::uint32_t body = 0; body < kLinks; ++body) {
    for (int number = 0; number < 12; ++number) {
      const Eigen::VectorXd expected =
          (reactions(body, number, kMoved) - reactions(body, number, -kMoved)) / (2.0 * kMoved);
      const Eigen::Index column = 12 * Eigen::Index{body} + number;
      Eigen::Index row = 0;
      (expected - jacobian.col(column)).cwiseAbs().maxCoeff(&row);
      inquiry.expect_near("change of reaction number " + std::to_string(row % 6) + " on body " +
                              std::to_string(row / 6) + " with number " + std::to_string(number) +
                              " of the state of body " + std::to_string(body),
                          jacobian(row, column), expected[row], kTolerance * scale);
    }
  }
}

// What differences are taken of may be anything but finite.
void judge_reaction_jacobian_hostile(Subject& subject) {
  Draw draw(95);
  MessageColumns request = swinging_chain(&draw, 2, false).request();
  request.u32("block_body") = {0, 1};
  request.f64("block").assign(kBlockNumbers, 1.0);
  expect_foreign_indices_refused(subject, "a chain that swings", kReactionJacobians, request);
  expect_hostile_numbers_survived(subject, "a chain that swings", kReactionJacobians, request);
}

void judge_reaction_refusals(Subject& subject) {
  Draw draw(93);
  const MessageColumns request = swinging_chain(&draw, 3, true).request();
  expect_foreign_indices_refused(subject, "a chain that swings", kReactions, request);
  for (const char* column : {"position", "angular_velocity", "wrench", "point1"}) {
    MessageColumns spoiled = request;
    spoiled.f64(column)[1] = std::numeric_limits<double>::quiet_NaN();
    Inquiry inquiry(subject, std::string("a chain that swings, with a NaN in ") + column);
    inquiry.demand_refusal(kReactions, spoiled);
  }
  expect_hostile_numbers_survived(subject, "a chain that swings", kReactions, request);
}

}  // namespace

std::vector<Case> reaction_cases(const PluginDeclaration& declaration) {
  if (!has_capability(declaration, "reactions")) return {unknown_case("solver/reactions_unknown", kReactions)};
  std::vector<Case> cases = {
      make_case("solver/reactions_hanging", "A joint bears the weight and the centripetal force of what hangs on it.",
                judge_hanging),
      make_case("solver/reactions", "With the reactions the points of joints accelerate as one, or as desired.",
                judge_accelerations),
      make_case("solver/reactions_springs", "Springs of joints are among the reactions, and not applied again.",
                judge_springs),
      make_case("solver/reactions_start", "Limits and drives hold by what joints tell of the start.", judge_start),
      make_case("solver/reactions_twice", "Joints that hold what is held already change nothing.", judge_twice),
      make_case("solver/reactions_refusals", "Bodies that do not exist and numbers that are none are refused.",
                judge_reaction_refusals)};
  if (!has_capability(declaration, "reaction_jacobians")) {
    cases.push_back(unknown_case("solver/reaction_jacobians_unknown", kReactionJacobians));
    return cases;
  }
  cases.push_back(
      make_case("solver/reaction_jacobians", "Jacobians of reactions are their slopes.", judge_reaction_jacobians));
  cases.push_back(make_case("solver/reaction_jacobians_hostile",
                            "Jacobians of reactions in any state are finite or refused.",
                            judge_reaction_jacobian_hostile));
  return cases;
}

std::vector<Question> reaction_questions(const PluginDeclaration& declaration, Draw* draw) {
  if (!has_capability(declaration, "reactions")) return {};
  const MessageColumns request = swinging_chain(draw, 12, true).request();
  std::vector<Question> questions = {{"reactions of a chain of 12 links", kReactions, request, {}}};
  if (has_capability(declaration, "reaction_jacobians"))
    questions.push_back({"Jacobians of the reactions of a chain of 4 links",
                         kReactionJacobians,
                         swinging_chain(draw, 4, true).request(),
                         {}});
  return questions;
}

}  // namespace gravitas::conformance
