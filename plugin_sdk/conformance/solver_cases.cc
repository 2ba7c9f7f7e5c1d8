// Slot solver: closed forms of joints, balances of momentum and energy, complementarity, and that neither the order of the
// bodies nor the warm start is physics; single contacts are in contact_cases.cc.
//
// Tolerance: kAccuracy. A solver that holds its constraints by stiff springs declares the capability `soft` and is asked for
// the balances and bounds only; one that declares `owns_motion` answers S_{n+1} from S_n and is asked likewise.
#include <algorithm>
#include <cmath>
#include <limits>

#include "plugin_sdk/conformance/constrained_bodies.h"
#include "plugin_sdk/conformance/hostile_numbers.h"
#include "plugin_sdk/conformance/sample_values.h"
#include "plugin_sdk/conformance/slot_cases.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas::conformance {
namespace {

constexpr stage::Method kSolve = stage::Method::kSolverSolve;

std::string of_body(const char* what, std::size_t body) {
  return std::string(what) + " of body " + std::to_string(body);
}

// ---- nothing to do

void judge_free(Subject& subject) {
  Draw draw(81);
  Inquiry inquiry(subject, "no bodies");
  ConstrainedBodies{}.ask(&inquiry);
  ConstrainedBodies world;
  for (int i = 0; i < 6; ++i) world.add({.pose = draw.pose(3.0), .twist = {draw.vector(2.0), draw.vector(2.0)}});
  world.make_trial(kDown);
  inquiry.now_asked("6 bodies without joints and contacts");
  const Solution came = world.ask(&inquiry);
  for (std::size_t i = 0; i < 6; ++i) {
    inquiry.expect_near(of_body("velocity", i), came.velocity(i), world.trial_twist[i].linear, 0.0);
    inquiry.expect_near(of_body("angular velocity", i), came.turning(i), world.trial_twist[i].angular, 0.0);
    inquiry.expect_near(of_body("translation", i), came.translation(i), Vector3::Zero(), 0.0);
    inquiry.expect_near(of_body("rotation", i), came.rotation(i), Vector3::Zero(), 0.0);
  }
}

// Contacts and joints between bodies that nothing can push do nothing.
void judge_solver_immovable(Subject& subject) {
  ConstrainedBodies world;
  const std::uint32_t ground = world.add_ground(), wall = world.add_ground();
  const std::uint32_t lift = world.add({.twist = {Vector3(0, 2, 0), Vector3(0, 0, 1)}, .kinematic = true});
  const std::uint32_t far = world.add({.pose = {Vector3(9, 9, 9), exp_rotation(Vector3(1, 2, 0))}});
  world.make_trial(Vector3::Zero());
  world.contacts = {{.body1 = ground, .body2 = wall, .depth = 0.1, .friction = 0.5},
                    {.body1 = ground, .body2 = lift, .depth = 0.1, .restitution = 1.0, .friction = 0.5, .key = 2}};
  world.add_ball_joint(ground, wall, Vector3(1, 0, 0));
  world.add_ball_joint(kNone, lift, Vector3(1, 0, 0));
  Inquiry inquiry(subject, "contacts and joints between immovable and kinematic bodies, and a free body elsewhere");
  const Solution came = world.ask(&inquiry);
  inquiry.expect_near(of_body("velocity", far), came.velocity(far), world.trial_twist[far].linear, 0.0);
  inquiry.expect_near(of_body("translation", far), came.translation(far), Vector3::Zero(), 0.0);
}

// ---- balances

// Balls and boxes that fly into each other and the ground; theta 0 and no overlap, so that nothing is moved.
ConstrainedBodies random_impact(Draw* draw, std::uint32_t contacts, double friction) {
  ConstrainedBodies world;
  world.theta = 0.0;
  world.add_ground();
  const std::uint32_t count = 2 + draw->below(3);
  for (std::uint32_t i = 0; i < count; ++i) {
    const double mass = draw->uniform(0.5, 2.0);
    world.add({.mass = mass,
               .moments = mass * Vector3{draw->uniform(0.1, 0.2), draw->uniform(0.1, 0.2), draw->uniform(0.1, 0.2)},
               .pose = draw->pose(1.0),
               .twist = {draw->vector(3.0), draw->vector(3.0)}});
  }
  for (std::uint32_t i = 0; i < contacts; ++i) {
    const std::uint32_t body2 = 1 + draw->below(count);
    std::uint32_t body1 = draw->below(count + 1);
    if (body1 == body2) body1 = 0;
    const Vector3 normal = draw->direction(), point = world.bodies[body2].pose.position + draw->vector(0.3);
    world.contacts.push_back(
        {.body1 = body1, .body2 = body2, .normal = normal, .point = point, .friction = friction, .key = i + 1});
  }
  return world;
}

// M (v' - v*) = J^T lambda for every body, with the impulses that the answer reports.
void judge_momentum(Subject& subject) {
  Draw draw(82);
  for (int trial = 0; trial < 20; ++trial) {
    ConstrainedBodies world = random_impact(&draw, 3, trial % 2 == 0 ? 0.0 : 0.4);
    world.add_ball_joint(1, 2, draw.vector(1.0));
    if (trial % 4 == 1)
      for (BodyContact& contact : world.contacts) contact.rolling_friction = 0.05, contact.spinning_friction = 0.03;
    Inquiry inquiry(subject, "random impact number " + std::to_string(trial) + " of " +
                                 std::to_string(world.bodies.size() - 1) + " bodies, two of them joined");
    const Solution came = world.ask(&inquiry);
    std::vector<Vector3> push(world.bodies.size(), Vector3::Zero()), turn = push;
    double size = 1.0;
    const auto act = [&](std::uint32_t body1, std::uint32_t body2, const Vector3& point, const Vector3& impulse) {
      size += impulse.norm();
      for (const auto& [body, sign] : {std::pair(body1, -1.0), std::pair(body2, 1.0)}) {
        push[body] += sign * impulse;
        turn[body] += sign * (point - world.trial_pose[body].position).cross(impulse);
      }
    };
    for (std::size_t i = 0; i < world.contacts.size(); ++i) {
      const BodyContact& contact = world.contacts[i];
      act(contact.body1, contact.body2, contact.point, came.contact_impulse(i));
      turn[contact.body1] -= came.contact_turning(i);
      turn[contact.body2] += came.contact_turning(i);
    }
    const Discrepancy& d = world.joints[0].discrepancy;
    act(1, 2, 0.5 * (d.point1 + d.point2), to_rotation_matrix(d.axes) * came.joint_impulse(0));
    for (std::size_t i = 1; i < world.bodies.size(); ++i) {
      const ConstrainedBody& body = world.bodies[i];
      const Quaternion& q = world.trial_pose[i].orientation;
      const Vector3 change = body.mass * (came.velocity(i) - world.trial_twist[i].linear);
      const Vector3 spin = q.conjugate() * (came.turning(i) - world.trial_twist[i].angular);
      inquiry.expect_near(of_body("change of momentum", i) + " (against its impulses)", change, push[i], 1e-9 * size);
      inquiry.expect_near(of_body("change of angular momentum", i) + " (against its impulses)",
                          q * body.moments.cwiseProduct(spin), turn[i], 1e-9 * size);
    }
  }
}

// One contact with e <= 1, where no friction couples it to the spin: energy cannot grow.
void judge_energy(Subject& subject) {
  Draw draw(83);
  for (int trial = 0; trial < 60; ++trial) {
    ConstrainedBodies world = random_impact(&draw, 1, 0.0);
    world.contacts[0].restitution = draw.uniform(0.0, 1.0);
    if (trial % 3 == 0) world.contacts[0].restitution = 1.0;
    const std::uint32_t body = world.contacts[0].body2;
    if (trial % 2 == 0) {
      // under the centre of a ball: the normal goes through it, and friction may act
      world.contacts[0].point = world.bodies[body].pose.position - 0.5 * world.contacts[0].normal;
      world.contacts[0].body1 = 0;
      world.contacts[0].friction = draw.uniform(0.0, 2.0);
      world.bodies[body].moments = Vector3::Constant(0.1 * world.bodies[body].mass);
    }
    Inquiry inquiry(subject, "random bounce number " + std::to_string(trial) +
                                 ", e = " + number_text(world.contacts[0].restitution) + ", friction " +
                                 number_text(world.contacts[0].friction));
    const Solution came = world.ask(&inquiry);
    const double before = world.energy(world.trial_twist), after = world.energy(world.twists(came));
    inquiry.expect(after <= before * (1.0 + 1e-9),
                   "kinetic energy grew from " + number_text(before) + " J to " + number_text(after) + " J");
  }
}

// A row of balls of different masses that run into each other: 0 <= lambda _|_ n.v' >= 0.
void judge_complementarity(Subject& subject) {
  Draw draw(84);
  for (int trial = 0; trial < 10; ++trial) {
    ConstrainedBodies world;
    world.theta = 0.0;
    for (std::uint32_t i = 0; i < 5; ++i) {
      world.add({.mass = draw.uniform(0.5, 2.0),
                 .pose = {Vector3(i, 0, 0), draw.rotation()},
                 .twist = {.linear = Vector3{draw.uniform(-2, 2), draw.uniform(-2, 2), 0}}});
      if (i == 0) continue;
      world.contacts.push_back(
          {.body1 = i - 1, .body2 = i, .normal = Vector3::UnitX(), .point = Vector3(i - 0.5, 0, 0), .key = i});
    }
    Inquiry inquiry(subject, "row number " + std::to_string(trial) + " of five touching balls, e = 0, no friction");
    const Solution came = world.ask(&inquiry);
    const std::vector<Twist> after = world.twists(came);
    for (std::size_t i = 0; i < world.contacts.size(); ++i) {
      const std::string of = " of contact " + std::to_string(i);
      const double leaving = world.contacts[i].normal.dot(world.relative_velocity(world.contacts[i], after));
      const double impulse = world.contacts[i].normal.dot(came.contact_impulse(i));
      inquiry.expect(leaving >= -4.0 * kAccuracy, "bodies" + of + " approach at " + number_text(leaving) + " m/s");
      inquiry.expect_at_most("the smaller of impulse (" + number_text(impulse) + " N s) and separation (" +
                                 number_text(leaving) + " m/s)" + of,
                             std::min(impulse, leaving), 4.0 * kAccuracy);
    }
  }
}

// ---- joints

void judge_joint(Subject& subject) {
  // hangs still
  ConstrainedBodies still;
  still.add({.mass = 2.0, .pose = {Vector3(0, -1, 0), Quaternion::Identity()}});
  still.make_trial(kDown);
  still.add_ball_joint(kNone, 0, Vector3::Zero());
  Inquiry inquiry(subject, "2 kg hanging still from the world, 1 m below its joint, h = 0.01");
  const Solution rest = still.ask(&inquiry);
  inquiry.expect_near("velocity", rest.velocity(0), Vector3::Zero(), kAccuracy);
  inquiry.expect_near("angular velocity", rest.turning(0), Vector3::Zero(), kAccuracy);
  inquiry.expect_near("position at the end", still.committed(rest, 0).position, Vector3(0, -1, 0), 0.01 * kAccuracy);
  inquiry.expect_near("joint impulse", rest.joint_impulse(0), Vector3(0, 2.0 * kGravity * 0.01, 0), 2.0 * kAccuracy);

  // two links that swing: the points move as one, and stay together but for the turn within the step, squared
  ConstrainedBodies swing;
  swing.add({.pose = {Vector3(0.5, 0, 0), exp_rotation(Vector3(0, 0, 0.3))}, .twist = {.angular = Vector3(0, 0, 1)}});
  swing.bodies[0].twist.linear = Vector3(0, 0.5, 0);
  swing.add({.mass = 2.0, .pose = {Vector3(1.0, -0.5, 0.2), Quaternion::Identity()}});
  swing.bodies[1].twist.linear = Vector3(0, 1.0, 0);
  swing.make_trial(kDown);
  swing.add_ball_joint(kNone, 0, Vector3::Zero());
  swing.add_ball_joint(0, 1, Vector3(1, 0, 0));
  inquiry.now_asked("a double pendulum that swings at 1 rad/s, h = 0.01");
  const Solution came = swing.ask(&inquiry);
  const std::vector<Twist> after = swing.twists(came);
  for (std::size_t i = 0; i < swing.joints.size(); ++i) {
    const BodyJoint& joint = swing.joints[i];
    const auto point_velocity = [&](std::uint32_t body) {
      if (body == kNone) return Vector3(Vector3::Zero());
      const Vector3 arm = 0.5 * (joint.discrepancy.point1 + joint.discrepancy.point2) - swing.trial_pose[body].position;
      return Vector3(after[body].linear + after[body].angular.cross(arm));
    };
    const auto committed_point = [&](std::uint32_t body, const Vector3& point) {
      return body == kNone ? point : carried(point, swing.trial_pose[body], swing.committed(came, body));
    };
    const std::string of = " of joint " + std::to_string(i);
    // arms may be those at the end: a step's motion away
    inquiry.expect_near("relative velocity of the points" + of,
                        point_velocity(joint.body2) - point_velocity(joint.body1), Vector3::Zero(), 1e-2);
    inquiry.expect_near("distance of the points at the end" + of,
                        (committed_point(joint.body2, joint.discrepancy.point2) -
                         committed_point(joint.body1, joint.discrepancy.point1))
                            .norm(),
                        0.0, 1e-5);
  }
}

// One axis that is driven, limited or held, on a load that does not turn.
void judge_axes(Subject& subject) {
  const double h = 0.01;
  struct Trial {
    const char* name;
    AxisMode mode;
    double desired, lower, upper, most;
    double right;  // velocity along x
    double restitution = 0.0;
  };
  const double speed = 0.3;
  for (const Trial& t :
       {Trial{"held", AxisMode::kLocked, 0.0, 0.0, 0.0, kUnlimited, 0.0},
        Trial{"free", AxisMode::kFree, 0.0, 0.0, 0.0, kUnlimited, speed},
        Trial{"driven to 2 m/s", AxisMode::kDriven, 2.0, 0.0, 0.0, kUnlimited, 2.0},
        Trial{"driven to 2 m/s by at most 40 N", AxisMode::kDriven, 2.0, 0.0, 0.0, 40.0, speed + 40.0 * 0.01 / 4.0},
        Trial{"within its limits", AxisMode::kLimited, 0.0, -1.0, 1.0, kUnlimited, speed},
        Trial{"at its upper limit", AxisMode::kLimited, 0.0, -1.0, 0.0, kUnlimited, 0.0},
        Trial{"at its upper limit, of restitution 0.4", AxisMode::kLimited, 0.0, -1.0, 0.0, kUnlimited, -0.4 * speed,
              0.4},
        Trial{"at its lower limit, leaving it", AxisMode::kLimited, 0.0, 0.0, 1.0, kUnlimited, speed, 0.4}}) {
    ConstrainedBodies world;
    world.time_step = h;
    world.add({.mass = 4.0, .moments = Vector3::Zero(), .twist = {.linear = Vector3(speed, 0, 0)}});
    world.make_trial(Vector3::Zero());
    BodyJoint joint{.body1 = kNone, .body2 = 0, .discrepancy = {}};
    Discrepancy& d = joint.discrepancy;
    d.point2 = world.trial_pose[0].position;
    d.modes = pack_modes(t.mode, AxisMode::kLocked, AxisMode::kLocked);
    d.velocity = Vector3(t.desired, 0, 0);
    d.lower = Vector3(t.lower, 0, 0), d.upper = Vector3(t.upper, 0, 0);
    d.restitution = t.restitution;
    d.maximum_force = Vector3(t.most, kUnlimited, kUnlimited);
    world.joints = {joint};
    Inquiry inquiry(subject, "4 kg at 0.3 m/s on a joint whose axis x is " + std::string(t.name) + ", h = 0.01");
    const Solution came = world.ask(&inquiry);
    inquiry.expect_near("velocity", came.velocity(0), Vector3(t.right, 0, 0), 2.0 * kAccuracy);
    inquiry.expect_near("impulse", came.joint_impulse(0), Vector3(4.0 * (t.right - speed), 0, 0), 8.0 * kAccuracy);
  }
}

// ---- what is no physics

// A short chain that two balls hit, without friction: one solution. Body k is written at place[k].
ConstrainedBodies struck_chain(const std::vector<std::uint32_t>& place) {
  std::vector<ConstrainedBody> chain;
  for (int i = 0; i < 3; ++i)
    chain.push_back({.mass = 1.0 + 0.3 * i,
                     .moments = {0.1, 0.05, 0.2},
                     .pose = {Vector3(0.3 * i, -0.5 - i, 0), exp_rotation(Vector3(0.1 * i, 0.2, 0))},
                     .twist = {.angular = Vector3(0.1, 0, 0.3)}});
  for (int i = 0; i < 2; ++i)
    chain.push_back({.mass = 0.5,
                     .pose = {Vector3(-1.0, -0.5 - i, 0), Quaternion::Identity()},
                     .twist = {.linear = Vector3(3.0, 0.2, -0.1)}});
  std::vector<ConstrainedBody> placed(chain.size());
  for (std::size_t i = 0; i < chain.size(); ++i) placed[place[i]] = chain[i];
  ConstrainedBodies world;
  for (const ConstrainedBody& body : placed) world.add(body);
  world.make_trial(kDown);
  for (std::uint32_t i = 0; i < 3; ++i)
    world.add_ball_joint(i == 0 ? kNone : place[i - 1], place[i], Vector3(0.3 * i, -1.0 * i, 0.1));
  for (std::uint32_t i = 0; i < 2; ++i)
    world.contacts.push_back({.body1 = place[3 + i],
                              .body2 = place[i],
                              .normal = Vector3::UnitX(),
                              .point = {-0.5, -0.5 - i, 0.05},
                              .depth = 0.03,
                              .restitution = 0.5,
                              .key = i + 1});
  return world;
}

void expect_same(const Inquiry& inquiry, const std::string& how, const Solution& came,
                 const std::vector<std::uint32_t>& place, const Solution& right) {
  for (std::size_t i = 0; i < place.size(); ++i) {
    // iterations that stop at 1e-6 may do so on either side
    inquiry.expect_near(of_body("velocity", i) + how, came.velocity(place[i]), right.velocity(i), 10.0 * kAccuracy);
    inquiry.expect_near(of_body("angular velocity", i) + how, came.turning(place[i]), right.turning(i),
                        10.0 * kAccuracy);
    inquiry.expect_near(of_body("translation", i) + how, came.translation(place[i]), right.translation(i), kAccuracy);
  }
}

void judge_solver_permutation(Subject& subject) {
  const std::vector<std::uint32_t> plain = {0, 1, 2, 3, 4}, mixed = {3, 0, 4, 2, 1};
  Inquiry inquiry(subject, "a chain of three that two balls hit, written in two orders");
  const Solution one = struck_chain(plain).ask(&inquiry), other = struck_chain(mixed).ask(&inquiry);
  expect_same(inquiry, " in another order", other, mixed, one);
}

void judge_warm_start(Subject& subject) {
  const std::vector<std::uint32_t> plain = {0, 1, 2, 3, 4};
  ConstrainedBodies world = struck_chain(plain);
  Inquiry inquiry(subject, "a chain of three that two balls hit, from no warm start and from its own answer");
  const Solution cold = world.ask(&inquiry);
  for (std::size_t i = 0; i < world.joints.size(); ++i) {
    world.joints[i].warm_impulse = cold.joint_impulse(i);
    world.joints[i].warm_correction = cold.joint_correction(i);
  }
  for (std::size_t i = 0; i < world.contacts.size(); ++i) {
    world.contacts[i].warm_impulse = cold.contact_impulse(i);
    world.contacts[i].warm_correction = cold.contact_correction(i);
  }
  expect_same(inquiry, " from its own answer", world.ask(&inquiry), plain, cold);
}

// ---- hostile

ConstrainedBodies small_scene() {
  ConstrainedBodies world = struck_chain({0, 1, 2, 3, 4});
  const std::uint32_t ground = world.add_ground();
  world.contacts.push_back({.body1 = ground,
                            .body2 = 2,
                            .point = {0.6, -3.0, 0},
                            .depth = 0.01,
                            .restitution = 0.2,
                            .friction = 0.5,
                            .key = 9});
  BodyJoint spring{.body1 = kNone, .body2 = 3, .discrepancy = {}};
  spring.discrepancy.point2 = Vector3(0.05, 0, 0);
  spring.discrepancy.modes = pack_modes(AxisMode::kLocked, AxisMode::kLimited, AxisMode::kDriven);
  spring.discrepancy.compliance = Vector3(1e-4, 0, 0);
  spring.discrepancy.damping = Vector3(2.0, 0, 0);
  spring.discrepancy.lower = Vector3(0, -0.1, 0), spring.discrepancy.upper = Vector3(0, 0.1, 0);
  spring.discrepancy.maximum_force = Vector3(kUnlimited, 10.0, 5.0);
  world.joints.push_back(spring);
  return world;
}

void judge_solver_refusals(Subject& subject) {
  const ConstrainedBodies world = small_scene();
  expect_foreign_indices_refused(subject, "joints and contacts", kSolve, world.request());
  struct Trial {
    const char* what;
    std::function<void(MessageColumns*)> spoil;
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Trial trials[] = {
      {"a NaN among the trial velocities", [&](MessageColumns* r) { r->f64("trial_linear_velocity")[4] = nan; }},
      {"an infinite position",
       [](MessageColumns* r) { r->f64("trial_position")[3] = std::numeric_limits<double>::infinity(); }},
      {"a contact with the world as a body", [](MessageColumns* r) { r->u32("contact_body")[0] = kNone; }},
      {"a contact normal of NaN", [&](MessageColumns* r) { r->f64("contact_normal")[0] = nan; }},
  };
  for (const Trial& trial : trials) {
    MessageColumns request = world.request();
    trial.spoil(&request);
    Inquiry inquiry(subject, std::string("joints and contacts, with ") + trial.what);
    inquiry.demand_refusal(kSolve, request);
  }
}

void judge_solver_hostile(Subject& subject) {
  const ConstrainedBodies world = small_scene();
  expect_hostile_numbers_survived(subject, "joints and contacts", kSolve, world.request());
  struct Trial {
    const char* what;
    std::function<void(ConstrainedBodies*)> spoil;
  };
  const Trial trials[] = {
      {"stiffness 1e300 N/m", [](ConstrainedBodies* w) { w->joints[3].discrepancy.compliance.setConstant(1e-300); }},
      {"damping 1e300 N s/m", [](ConstrainedBodies* w) { w->joints[3].discrepancy.damping.setConstant(1e300); }},
      {"every joint twice",
       [](ConstrainedBodies* w) { w->joints.insert(w->joints.end(), w->joints.begin(), w->joints.begin() + 3); }},
      {"every contact twice",
       [](ConstrainedBodies* w) {
         w->contacts.insert(w->contacts.end(), w->contacts.begin(), w->contacts.begin() + 2);
       }},
      {"a body paired with itself", [](ConstrainedBodies* w) { w->contacts[0].body1 = w->contacts[0].body2; }},
      {"modes that do not exist", [](ConstrainedBodies* w) { w->joints[0].discrepancy.modes = 0xFFFFFFFFU; }},
      {"masses of 1e-300 and 1e300 kg that touch",
       [](ConstrainedBodies* w) { w->bodies[3].mass = 1e-300, w->bodies[0].mass = 1e300; }},
      {"a contact 1e300 m deep", [](ConstrainedBodies* w) { w->contacts[0].depth = 1e300; }},
      {"restitution 1e300", [](ConstrainedBodies* w) { w->contacts[0].restitution = 1e300; }},
      {"negative friction", [](ConstrainedBodies* w) { w->contacts[0].friction = -0.5; }},
  };
  for (const Trial& trial : trials) {
    ConstrainedBodies spoiled = world;
    trial.spoil(&spoiled);
    Inquiry inquiry(subject, std::string("joints and contacts, with ") + trial.what);
    inquiry.answer_or_refusal(kSolve, spoiled.request());
  }
}

// A ball of radius 0.5 on another, or on the ground y = 0, at S*.
BodyContact ball_contact(const ConstrainedBodies& world, std::uint32_t lower, std::uint32_t upper) {
  const Vector3 at = world.trial_pose[upper].position;
  const Vector3 below = world.is_pushed(lower) ? world.trial_pose[lower].position : Vector3(at.x(), -0.5, at.z());
  const Vector3 normal = (at - below).normalized();
  const double depth = 1.0 - (at - below).norm();
  return {.body1 = lower,
          .body2 = upper,
          .normal = normal,
          .point = at - (0.5 - 0.5 * depth) * normal,
          .depth = depth,
          .restitution = 0.3,
          .friction = 0.5,
          .key = upper};
}

}  // namespace

std::vector<Case> solver_cases(const PluginDeclaration& declaration) {
  std::vector<Case> cases = {
      make_case("solver/free", "Without joints and contacts the trial state stands, bit for bit.", judge_free),
      make_case("solver/immovable", "What nothing can push stays, and pushes nothing elsewhere.",
                judge_solver_immovable),
      make_case("solver/refusals", "Bodies that do not exist and numbers that are none are refused.",
                judge_solver_refusals),
      make_case("solver/hostile", "Hostile numbers are refused with a reason, or answered with finite ones.",
                judge_solver_hostile)};
  std::ranges::move(reaction_cases(declaration), std::back_inserter(cases));
  const auto add = [&](const char* name, const char* claim, void (*judge)(Subject&)) {
    cases.push_back(make_case(name, claim, judge));
  };
  if (has_capability(declaration, "owns_motion")) return cases;
  std::ranges::move(contact_cases(declaration), std::back_inserter(cases));
  add("solver/momentum", "The reported impulses are what changes the momenta.", judge_momentum);
  add("solver/energy", "No bounce with e <= 1 gains energy.", judge_energy);
  if (has_capability(declaration, "soft")) return cases;
  add("solver/complementarity", "Contacts push or part, never both, and never approach.", judge_complementarity);
  add("solver/joint", "Joints hold: their points move as one and stay together.", judge_joint);
  add("solver/axes", "Axes are held, free, driven and limited as their modes say.", judge_axes);
  add("solver/permutation", "The order of the bodies is no physics.", judge_solver_permutation);
  add("solver/warm-start", "The warm start is no physics.", judge_warm_start);
  return cases;
}

// Columns of balls that stand on the ground, and beside each a chain of two that hangs from the world.
std::vector<Question> solver_questions(const PluginDeclaration& declaration, Draw* draw) {
  std::vector<Question> questions = reaction_questions(declaration, draw);
  for (const std::uint32_t columns : {1U, 4U, 40U}) {
    constexpr std::uint32_t kHeight = 3;
    ConstrainedBodies world;
    const std::uint32_t ground = world.add_ground();
    for (std::uint32_t i = 0; i < columns; ++i) {
      const double x = 2.0 * i;
      for (std::uint32_t k = 0; k < kHeight; ++k)
        world.add({.mass = draw->uniform(0.5, 2.0),
                   .pose = {Vector3(x, 0.5 + k, 0), draw->rotation()},
                   .twist = {.linear = draw->vector(0.1)}});
      for (std::uint32_t k = 1; k <= 2; ++k)
        world.add({.mass = draw->uniform(0.5, 2.0),
                   .pose = {Vector3(x, -1.0 * k, 9), draw->rotation()},
                   .twist = {.angular = draw->vector(0.5)}});
    }
    world.make_trial(kDown);
    for (std::uint32_t i = 0; i < columns; ++i) {
      const std::uint32_t first = 1 + (kHeight + 2) * i;
      for (std::uint32_t body = first; body < first + kHeight; ++body)
        world.contacts.push_back(ball_contact(world, body == first ? ground : body - 1, body));
      world.add_ball_joint(kNone, first + kHeight, Vector3(2.0 * i, -0.5, 9));
      world.add_ball_joint(first + kHeight, first + kHeight + 1, Vector3(2.0 * i, -1.5, 9));
    }
    questions.push_back({std::to_string(columns) + " columns of balls and chains", kSolve, world.request(), {}});
  }
  return questions;
}

}  // namespace gravitas::conformance
