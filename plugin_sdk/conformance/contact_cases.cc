// Slot solver: closed forms of single contacts, with restitution and each kind of friction.
//
// Tolerance: kAccuracy.
#include <algorithm>
#include <cmath>

#include "plugin_sdk/conformance/constrained_bodies.h"
#include "plugin_sdk/conformance/sample_values.h"
#include "plugin_sdk/conformance/slot_cases.h"

namespace gravitas::conformance {
namespace {

// Spheres that touched at S_n and go on freely for a step.
ConstrainedBodies touching_spheres(double mass_a, double mass_b, const Vector3& va, const Vector3& vb,
                                   double restitution, double friction) {
  const double radius = 0.5;
  ConstrainedBodies world;
  world.add({.mass = mass_a, .moments = Vector3::Constant(0.4 * mass_a * radius * radius), .twist = {.linear = va}});
  world.add({.mass = mass_b,
             .moments = Vector3::Constant(0.4 * mass_b * radius * radius),
             .pose = {2.0 * radius * Vector3::UnitX(), Quaternion::Identity()},
             .twist = {.linear = vb}});
  world.make_trial(Vector3::Zero());
  const Vector3 between = world.trial_pose[1].position - world.trial_pose[0].position;
  world.contacts = {{.body1 = 0,
                     .body2 = 1,
                     .normal = between.normalized(),
                     .point = 0.5 * (world.trial_pose[0].position + world.trial_pose[1].position),
                     .depth = 2.0 * radius - between.norm(),
                     .restitution = restitution,
                     .friction = friction}};
  return world;
}

// v_b' - v_a' = e (v_a - v_b), momentum kept, and no overlap left.
void judge_head_on(Subject& subject) {
  const double ma = 2.0, mb = 0.5, ua = 3.0, ub = -1.0;
  for (const double e : {0.0, 0.3, 1.0}) {
    const ConstrainedBodies world = touching_spheres(ma, mb, {ua, 0, 0}, {ub, 0, 0}, e, 0.0);
    Inquiry inquiry(subject, "2 kg at 3 m/s against 0.5 kg at -1 m/s, head-on, e = " + number_text(e));
    const Solution came = world.ask(&inquiry);
    const double centre = (ma * ua + mb * ub) / (ma + mb);
    inquiry.expect_near("velocity of body 0", came.velocity(0), Vector3(centre - e * mb * (ua - ub) / (ma + mb), 0, 0),
                        4.0 * kAccuracy);
    inquiry.expect_near("velocity of body 1", came.velocity(1), Vector3(centre + e * ma * (ua - ub) / (ma + mb), 0, 0),
                        4.0 * kAccuracy);
    const double apart = (world.committed(came, 1).position - world.committed(came, 0).position).norm();
    inquiry.expect_near("distance of the centres at the end", apart, 1.0, kAccuracy);
  }
}

// (1 + e) along the normal; friction stops the slip or reaches mu of the normal impulse.
void judge_oblique(Subject& subject) {
  const double ma = 1.0, mb = 3.0, e = 0.6;
  const Vector3 va(2.0, 0.4, -0.3), vb(-1.0, -0.2, 0.5);
  for (const double mu : {0.0, 0.05, 5.0}) {
    const ConstrainedBodies world = touching_spheres(ma, mb, va, vb, e, mu);
    Inquiry inquiry(subject, "spheres of 1 and 3 kg, oblique, e = 0.6, friction " + number_text(mu));
    const Solution came = world.ask(&inquiry);
    const Vector3 n = world.contacts[0].normal, relative = vb - va;
    const double normal = -(1.0 + e) * relative.dot(n) / (1.0 / ma + 1.0 / mb);
    const Vector3 slip = relative - relative.dot(n) * n;
    // response of the slip: arms of half the distance of the centres, moments 0.4 m r^2
    const double arm = 0.5 * (world.trial_pose[1].position - world.trial_pose[0].position).norm();
    const double stop = slip.norm() / ((1.0 / ma + 1.0 / mb) * (1.0 + 2.5 * arm * arm / 0.25));
    const Vector3 right = normal * n - std::min(stop, mu * normal) * slip.normalized();
    // arms may be taken at the end of the step, an overlap of 0.03 m away
    const double tolerance = 4.0 * kAccuracy + (mu > 1.0 ? 0.1 * stop : 0.0);
    inquiry.expect_near("contact impulse", came.contact_impulse(0), right, tolerance);
    inquiry.expect_near("velocity of body 1", came.velocity(1), vb + right / mb, tolerance / mb);
  }
}

// A load on the ground: at rest it stays, overlap of the step removed; with a side push it sticks or slides.
void judge_friction(Subject& subject) {
  const double mu = 0.5, h = 0.01;
  struct Trial {
    const char* name;
    double speed, push;  // m/s at S_n, m/s^2
  };
  for (const Trial& t :
       {Trial{"at rest", 0.0, 0.0}, Trial{"pushed by 0.4 of its weight", 0.0, 0.4 * kGravity},
        Trial{"pushed by 0.9 of its weight", 0.0, 0.9 * kGravity}, Trial{"sliding at 2 m/s", 2.0, 0.0}}) {
    ConstrainedBodies world;
    world.time_step = h;
    const std::uint32_t ground = world.add_ground();
    // moments zero: it does not turn, whatever pushes it where
    const std::uint32_t load = world.add({.mass = 3.0,
                                          .moments = Vector3::Zero(),
                                          .pose = {Vector3(0, 0.5, 0), Quaternion::Identity()},
                                          .twist = {.linear = Vector3(t.speed, 0, 0)}});
    world.make_trial(kDown + Vector3(t.push, 0, 0));
    const Vector3 at = world.trial_pose[load].position;
    const double depth = 0.5 - at.y();
    world.contacts = {
        {.body1 = ground, .body2 = load, .point = {at.x(), -0.5 * depth, 0}, .depth = depth, .friction = mu}};
    Inquiry inquiry(subject, "3 kg on the ground with friction 0.5, " + std::string(t.name));
    const Solution came = world.ask(&inquiry);
    const double free = t.speed + h * t.push;
    const double right = std::max(0.0, free - mu * kGravity * h);
    inquiry.expect_near("velocity", came.velocity(load), Vector3(right, 0, 0), kAccuracy);
    inquiry.expect_near("normal impulse", came.contact_impulse(0).y(), 3.0 * kGravity * h, 3.0 * kAccuracy);
    inquiry.expect_near("friction impulse", came.contact_impulse(0).x(), 3.0 * (right - free), 3.0 * kAccuracy);
    inquiry.expect_near("height at the end", world.committed(came, load).position.y(), 0.5, kAccuracy * h);
  }
}

// A ball on the ground that rolls along x and spins about y: each kind of friction stops its turning, or reaches its
// coefficient times the load.
void judge_rolling(Subject& subject) {
  const double h = 0.01, mass = 3.0, radius = 0.5, moment = 0.4 * mass * radius * radius, load = mass * kGravity * h;
  struct Trial {
    const char* name;
    double speed, spin;                  // m/s, rad/s
    double friction, rolling, spinning;  // 1, m, m
    Vector3 right;
  };
  for (const Trial& t :
       {Trial{"without friction of turning", 2.0, 5.0, 0.5, 0.0, 0.0, Vector3::Zero()},
        Trial{"with rolling friction", 2.0, 0.0, 0.5, 0.02, 0.0, Vector3(0, 0, 0.02 * load)},
        Trial{"with spinning friction", 0.0, 5.0, 0.5, 0.0, 0.01, Vector3(0, -0.01 * load, 0)},
        Trial{"with both", 2.0, -5.0, 0.5, 0.02, 0.01, Vector3(0, 0.01 * load, 0.02 * load)},
        Trial{"so slowly that it stops", 0.002, 0.003, 0.0, 0.02, 0.01, Vector3(0, -0.003 * moment, 0.004 * moment)}}) {
    ConstrainedBodies world;
    world.time_step = h;
    const std::uint32_t ground = world.add_ground();
    const std::uint32_t ball = world.add({.mass = mass,
                                          .moments = Vector3::Constant(moment),
                                          .pose = {Vector3(0, radius, 0), Quaternion::Identity()},
                                          .twist = {Vector3(t.speed, 0, 0), Vector3(0, t.spin, -t.speed / radius)}});
    world.make_trial(kDown);
    const Vector3 at = world.trial_pose[ball].position;
    const double depth = radius - at.y();
    world.contacts = {{.body1 = ground,
                       .body2 = ball,
                       .point = {at.x(), -0.5 * depth, 0},
                       .depth = depth,
                       .friction = t.friction,
                       .rolling_friction = t.rolling,
                       .spinning_friction = t.spinning}};
    Inquiry inquiry(subject, "3 kg that roll and spin on the ground, " + std::string(t.name));
    const Solution came = world.ask(&inquiry);
    inquiry.expect_near("impulse of turning", came.contact_turning(0), t.right, mass * kAccuracy);
    inquiry.expect_near("normal impulse", came.contact_impulse(0).y(), load, mass * kAccuracy);
    const double spin = came.turning(ball).y();
    inquiry.expect_near("angular velocity about the normal", spin, t.spin + t.right.y() / moment, 10.0 * kAccuracy);
  }
}

// A contact that parts, or a gap that stays open, does nothing.
void judge_open(Subject& subject) {
  ConstrainedBodies world;
  const std::uint32_t ground = world.add_ground();
  world.add({.pose = {Vector3(0, 0.6, 0), Quaternion::Identity()}, .twist = {.linear = Vector3(1, 2, 0)}});
  world.make_trial(Vector3::Zero());
  world.contacts = {{.body1 = ground,
                     .body2 = 1,
                     .point = {0, 0.06, 0},
                     .depth = -0.12,
                     .restitution = 1.0,
                     .friction = 1.0,
                     .rolling_friction = 1.0,
                     .spinning_friction = 1.0}};
  Inquiry inquiry(subject, "a ball 0.12 m above the ground, rising at 2 m/s");
  const Solution came = world.ask(&inquiry);
  inquiry.expect_near("velocity", came.velocity(1), Vector3(1, 2, 0), 0.0);
  inquiry.expect_near("translation", came.translation(1), Vector3::Zero(), 0.0);
  inquiry.expect_near("contact impulse", came.contact_impulse(0), Vector3::Zero(), 0.0);
  inquiry.expect_near("impulse of turning", came.contact_turning(0), Vector3::Zero(), 0.0);
}

}  // namespace

std::vector<Case> contact_cases(const PluginDeclaration& declaration) {
  std::vector<Case> cases = {make_case("solver/open", "A contact that stays open does nothing.", judge_open)};
  if (has_capability(declaration, "soft")) return cases;
  const auto add = [&](const char* name, const char* claim, void (*judge)(Subject&)) {
    cases.push_back(make_case(name, claim, judge));
  };
  add("solver/head-on", "Spheres that meet head-on part as restitution says.", judge_head_on);
  add("solver/oblique", "Oblique impacts obey restitution and Coulomb friction at once.", judge_oblique);
  add("solver/friction", "A load on the ground rests, sticks and slides by its friction.", judge_friction);
  add("solver/rolling", "Rolling and spinning friction are torques up to a length times the load.", judge_rolling);
  return cases;
}

}  // namespace gravitas::conformance
