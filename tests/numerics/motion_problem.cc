#include "tests/numerics/motion_problem.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "plugin_sdk/body.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas::harness {
namespace {

constexpr double kAbsent = std::numeric_limits<double>::quiet_NaN();

double angle_between(const Quaternion& a, const Quaternion& b) {
  return log_rotation(shorter_arc(a * b.conjugate())).norm();
}

WorldBuilder jointed_world() {
  WorldBuilder world;
  world.plugin(Slot::kSolver, plugin_path("solver_direct"), {0.0, 1000.0});
  return world;
}

void hinge(WorldBuilder* world, std::uint32_t one, std::uint32_t two, const Vector3& at) {
  world->joint("Revolute", "constraint_revolute", one, two,
               {at.x(), at.y(), at.z(), at.x(), at.y(), at.z() + 1.0, kAbsent, kAbsent});
}

Vector3 position_of(const kernel::StateView& state, std::size_t body) { return vector_at(state.position, body); }

}  // namespace

std::vector<MotionMethod> fixed_step_methods() {
  return {{"Euler", "integrator_euler", {}, 1},
          {"SemiImplicitEuler", "integrator_semi_implicit_euler", {}, 1},
          {"Verlet", "integrator_verlet", {}, 2},
          {"BasicVerlet", "integrator_basic_verlet", {}, 2},
          {"ImplicitMidpoint", "integrator_implicit_midpoint", {}, 2},
          {"RK4", "integrator_rk4", {}, 4},
          {"RKMK4", "integrator_rkmk4", {}, 4},
          {"SymplecticSplitting 2", "integrator_symplectic_splitting", {2}, 2},
          {"SymplecticSplitting 4", "integrator_symplectic_splitting", {4}, 4},
          {"SymplecticSplitting 6", "integrator_symplectic_splitting", {6}, 6}};
}

// At an accuracy of 1, which any step meets, inner steps are those asked for.
std::vector<MotionMethod> adaptive_methods(double accuracy) {
  return {{"DormandPrince54", "integrator_dormand_prince54", {accuracy, accuracy < 1.0 ? 1.0 : 0.0}, 5},
          {"DormandPrince853", "integrator_dormand_prince853", {accuracy}, 8},
          {"Rosenbrock", "integrator_rosenbrock", {accuracy}, 4},
          {"Radau", "integrator_radau", {accuracy}, 5}};
}

MotionProblem tumbling_box() {
  WorldBuilder world;
  world.point(10.0, {0.80833333333333333, 0.68333333333333333, 0.14166666666666667}, {0, 0, 0});
  world.body().twist = {{-2, 2, 8}, {0.1, 5, 0.1}};
  world.gravity({0, 0, -9.8});
  return {"tumbling box", 10.0, false, world, [](const kernel::StateView& state) {
            const Quaternion exact(0.2251645634139581639, -0.6199275624994524883, -0.2770291506871945918,
                                   0.6987457236403101107);
            return angle_between(quaternion_at(state.orientation, 0), exact);
          }};
}

// k/m = 36; the spring holds the centre of mass, so that the rotor is free: I = (2, 2, 1), axis along z at the start.
MotionProblem spring_and_spin() {
  WorldBuilder world;
  world.point(1.0, {2.0, 2.0, 1.0}, {1, 0, 0});
  world.body().twist = {{0, 2, 0}, {1, 0, 3}};
  world.force("Spring", "force_spring", {36.0, 0.0, 0.0, 0.0, 0.0, 0.0, kAbsent, 0.0, 0.0, 0.0});
  return {"spring and spin", 2.0, false, world, [](const kernel::StateView& state) {
            const double w = 6.0, t = 2.0;
            const Vector3 exact(std::cos(w * t), 2.0 / w * std::sin(w * t), 0.0);
            // L = (2, 0, 3): turns about L at |L|/I, after a turn about the body's axis at w3 (1 - I3/I1)
            const Vector3 momentum(2.0, 0.0, 3.0);
            const Quaternion turned =
                exp_rotation(t * momentum / 2.0) * exp_rotation(Vector3(0.0, 0.0, t * 3.0 * (1.0 - 0.5)));
            return std::max((position_of(state, 0) - exact).norm(),
                            angle_between(quaternion_at(state.orientation, 0), turned));
          }};
}

MotionProblem point_pendulum() {
  WorldBuilder world = jointed_world();
  world.point(1.0, {0.1, 0.1, 0.1}, {-1, 0, 0});
  world.gravity({0, -9.81, 0});
  world.joint("Distance", "constraint_distance", kNone, 0, {0, 0, 0, -1, 0, 0, kAbsent, kAbsent});
  return {"point pendulum", 10.0, true, world, [](const kernel::StateView& state) {
            return (position_of(state, 0) - Vector3(-0.275087462576116860, -0.961419205099125064, 0)).norm();
          }};
}

MotionProblem spherical_pendulum() {
  WorldBuilder world = jointed_world();
  const Vector3 start(std::sqrt(0.75), 0, -0.5);
  world.point(1.0, {0.1, 0.1, 0.1}, start);
  world.body().twist.linear = {0, 2, 0};
  world.gravity({0, 0, -9.81});
  world.joint("Distance", "constraint_distance", kNone, 0,
              {0, 0, 0, start.x(), start.y(), start.z(), kAbsent, kAbsent});
  return {
      "spherical pendulum", 10.0, true, world, [](const kernel::StateView& state) {
        return (position_of(state, 0) - Vector3(0.04578256339846101085, -0.7377486044706621106, -0.6735213088613132007))
            .norm();
      }};
}

MotionProblem double_pendulum() {
  WorldBuilder world = jointed_world();
  world.point(1.0, {0.5, 1.0, 1.0}, {0.5, 0, 0});
  world.point(1.0, {0.5, 1.0, 1.0}, {1.5, 0, 0});
  world.gravity({0, -10, 0});
  hinge(&world, kNone, 0, {0, 0, 0});
  hinge(&world, 0, 1, {1, 0, 0});
  return {"double pendulum", 5.0, true, world, [](const kernel::StateView& state) {
            const double one = -0.9145987843839328747, two = -7.577710906986686579;
            const Vector3 first(0.5 * std::cos(one), 0.5 * std::sin(one), 0.0);
            const Vector3 second(std::cos(one) + 0.5 * std::cos(two), std::sin(one) + 0.5 * std::sin(two), 0.0);
            return std::max((position_of(state, 0) - first).norm(), (position_of(state, 1) - second).norm());
          }};
}

MotionProblem heavy_top() {
  WorldBuilder world = jointed_world();
  world.point(15.0, {0.234375, 0.46875, 0.234375}, {0, 1, 0});
  const Vector3 w(0, 150, -4.61538);
  world.body().twist = {w.cross(Vector3(0, 1, 0)), w};
  world.gravity({0, 0, -9.81});
  world.joint("Spherical", "constraint_spherical", kNone, 0,
              {0, 0, 0, kAbsent, 0, kAbsent, kAbsent, kAbsent, kAbsent, kAbsent});
  return {
      "heavy top", 2.0, true, world, [](const kernel::StateView& state) {
        const Quaternion exact(0.1229471350415334671, -0.4910798925500270147, 0.3504300303436209618,
                               -0.7879868875504856693);
        return std::max(
            angle_between(quaternion_at(state.orientation, 0), exact),
            (position_of(state, 0) - Vector3(-0.15041682274564176, -0.72416559163689565, -0.67302226956044410)).norm());
      }};
}

// Rods of 1 m and 1 kg: cranks from (i, 0) up to (i, 1), couplers between, i = 0, 1, 2.
MotionProblem four_bar(double duration) {
  WorldBuilder world = jointed_world();
  const double across = 1.0 / 12.0;
  for (int i = 0; i < 3; ++i) {
    world.point(1.0, {across, 1e-3, across}, {i + 0.0, 0.5, 0});
    world.body().twist = {{0.5, 0, 0}, {0, 0, -1}};
  }
  for (int i = 0; i < 2; ++i) {
    world.point(1.0, {1e-3, across, across}, {i + 0.5, 1, 0});
    world.body().twist = {{1, 0, 0}, {0, 0, 0}};
  }
  world.gravity({0, -9.81, 0});
  for (std::uint32_t i = 0; i < 3; ++i) hinge(&world, kNone, i, {i + 0.0, 0, 0});
  for (std::uint32_t i = 0; i < 2; ++i) {
    hinge(&world, i, 3 + i, {i + 0.0, 1, 0});
    hinge(&world, 3 + i, i + 1, {i + 1.0, 1, 0});
  }
  const Vector3 after_ten(0.328458111540815379, 0.944518538178600962, 0);
  const Vector3 after_twenty(0.839746574306843547, 0.542978536352884662, 0);
  return {"four-bar", duration, true, world, [=](const kernel::StateView& state) {
            return (2.0 * position_of(state, 0) - (duration == 10.0 ? after_ten : after_twenty)).norm();
          }};
}

MotionProblem mujoco_box() {
  WorldBuilder world;
  world.point(1.0, Vector3(0.13, 0.10, 0.05) / 3.0, {0, 0, 0});
  world.body().twist.angular = {1, 2, 3};
  return {"MuJoCo's box", 5.0, false, world, [](const kernel::StateView& state) {
            const Quaternion exact(-0.3648637429868626004, 0.02356335734258868336, 0.02126200105200739735,
                                   -0.9305198249127347748);
            return angle_between(quaternion_at(state.orientation, 0), exact);
          }};
}

// L = (2, 0, 6): turns about L at |L|/I, after a turn about the body's axis at w3 (1 - J/I).
MotionProblem symmetric_rotor() {
  WorldBuilder world;
  world.point(1.0, {1.0, 1.0, 0.2}, {0, 0, 0});
  world.body().twist.angular = {2, 0, 30};
  return {"symmetric rotor", 10.0, false, world, [](const kernel::StateView& state) {
            const double t = 10.0;
            const Quaternion exact = exp_rotation(t * Vector3(2, 0, 6)) * exp_rotation(t * Vector3(0, 0, 30 * 0.8));
            return angle_between(quaternion_at(state.orientation, 0), exact);
          }};
}

// About the pivot I1 = 0.012, I3 = 0.001: 1 kg at 0.1 m.
MotionProblem lagrange_top() {
  WorldBuilder world = jointed_world();
  const Quaternion tilt = exp_rotation(Vector3(std::numbers::pi / 6.0, 0, 0));
  const Vector3 axis = tilt * Vector3::UnitZ();
  world.point(1.0, {0.002, 0.002, 0.001}, 0.1 * axis);
  world.body().pose.orientation = tilt;
  world.body().twist.angular = 200.0 * axis;
  world.gravity({0, 0, -9.81});
  world.joint("Spherical", "constraint_spherical", kNone, 0,
              {0, 0, 0, kAbsent, 0, kAbsent, kAbsent, kAbsent, kAbsent, kAbsent});
  return {"Lagrange top", 2.0, true, world, [](const kernel::StateView& state) {
            const Vector3 exact(-0.920011678805164078, -0.0342355524846993032, 0.390392671304381693);
            return (quaternion_at(state.orientation, 0) * Vector3::UnitZ() - exact).norm();
          }};
}

double no_reference(const kernel::StateView&) { return 0.0; }

MotionProblem bricard() {
  WorldBuilder world = jointed_world();
  const Vector3 joints[] = {{0, 0, 0}, {1, 0, 0}, {1, -1, 0}, {1, -1, 1}, {0, -1, 1}, {0, 0, 1}};
  const Vector3 axes[] = {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 0}};
  for (int i = 0; i < 5; ++i) {
    const Vector3 along = (joints[i + 1] - joints[i]).cwiseAbs();
    world.point(1.0, (Vector3::Ones() - along) / 12.0 + 1e-3 * along, 0.5 * (joints[i] + joints[i + 1]));
  }
  world.gravity({0, -9.81, 0});
  for (std::uint32_t i = 0; i < 6; ++i) {
    const Vector3 end = joints[i] + axes[i];
    world.joint("Revolute", "constraint_revolute", i == 0 ? kNone : i - 1, i == 5 ? kNone : i,
                {joints[i].x(), joints[i].y(), joints[i].z(), end.x(), end.y(), end.z(), kAbsent, kAbsent});
  }
  return {"Bricard", 10.0, true, world, no_reference};
}

MotionProblem triple_pendulum() {
  WorldBuilder world = jointed_world();
  for (int i = 0; i < 3; ++i) world.point(1.0, {1e-4, 0.0075, 0.0075}, {0.3 * i + 0.15, 0, 0});
  world.gravity({0, -10, 0});
  for (std::uint32_t i = 0; i < 3; ++i) hinge(&world, i == 0 ? kNone : i - 1, i, {0.3 * i, 0, 0});
  return {"pendulum challenge", 10.0, true, world, no_reference};
}

// Andrews' squeezing mechanism: Hairer, Wanner, Solving ODEs II, VII.7, with their names of lengths and angles. Bodies are
// K1 ... K7 in order, turned by their angles about z; where one turns about a fixed point, the direction in which its
// centre of mass lies is free, since nothing weighs anything.
MotionProblem squeezer() {
  constexpr double kD = 28e-3, kDa = 115e-4, kE = 2e-2, kEa = 1421e-5, kRr = 7e-3, kRa = 92e-5, kSa = 1874e-5,
                   kSb = 1043e-5, kSc = 18e-3, kSd = 2e-2, kTa = 2308e-5, kTb = 916e-5, kU = 4e-2, kUa = 1228e-5,
                   kUb = 449e-5, kZf = 2e-2, kZt = 4e-2, kFa = 1421e-5;
  constexpr double kMass[] = {0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498};
  constexpr double kMoment[] = {2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5};
  constexpr double kDrive = 0.033, kStiffness = 4530.0, kRest = 7785e-5;
  const Vector3 a(-0.06934, -0.00227, 0), b(-0.03635, 0.03273, 0), c(0.014, 0.072, 0), origin = Vector3::Zero();
  // beta, Theta, gamma, Phi, delta, Omega, epsilon
  using Angles = std::array<double, 7>;
  const auto attitudes = [](const Angles& q) {
    return Angles{q[0], q[0] + q[1], q[2], q[3] + q[4], q[4], q[5] + q[6], q[6]};
  };
  const auto along = [](double angle) { return Vector3(std::cos(angle), std::sin(angle), 0); };
  const auto across = [](double angle) { return Vector3(std::sin(angle), -std::cos(angle), 0); };

  const Angles start = attitudes({-0.0617138900142764496, 0.0, 0.455279819163070380, 0.222668390165885885,
                                  0.487364979543842550, -0.222668390165885885, 1.23054744454982119});
  const Vector3 crank = kRr * along(start[0]), p = crank - kD * along(start[1]);
  const Vector3 q5 = a + kZt * along(start[4]), q7 = a + kU * across(start[6]);
  const std::array<Vector3, 7> centres = {kRa * along(start[0]),
                                          crank - kDa * along(start[1]),
                                          b + std::hypot(kSa, kSb) * along(start[2]),
                                          q5 + (kE - kEa) * across(start[3]),
                                          a + std::hypot(kTa, kTb) * along(start[4]),
                                          q7 + (kZf - kFa) * along(start[5]),
                                          a + std::hypot(kUa, kUb) * along(start[6])};
  WorldBuilder world = jointed_world();
  for (std::size_t i = 0; i < 7; ++i) {
    world.point(kMass[i], Vector3::Constant(kMoment[i]), centres[i]);
    world.body().pose.orientation = exp_rotation(Vector3(0, 0, start[i]));
    if (i == 0) world.force("Basic", "force_basic", {0, 0, 0, 0, 0, 0, 0, 0, kDrive, 0, 0, 0});
    if (i != 2) continue;
    const Vector3 pulled = b + kSd * along(start[2]) + kSc * across(start[2]);
    spring_between(&world, {kStiffness, 0.0, kRest},
                   exp_rotation(Vector3(0, 0, -start[2])) * Vector3(pulled - centres[2]), kNone, c);
  }
  hinge(&world, kNone, 0, origin);
  hinge(&world, 0, 1, crank);
  for (const std::uint32_t other : {2U, 3U, 5U}) hinge(&world, 1, other, p);
  hinge(&world, kNone, 2, b);
  hinge(&world, 3, 4, q5);
  hinge(&world, kNone, 4, a);
  hinge(&world, 5, 6, q7);
  hinge(&world, kNone, 6, a);
  const Angles end =
      attitudes({15.81077119515370710, -15.75637105841183947, 0.04082224011964580486, -0.5347301163420795938,
                 0.5244099658799540694, 0.5347301163420795938, 1.048080741041937873});
  return {"squeezer", 0.03, true, world, [end](const kernel::StateView& state) {
            double worst = 0.0;
            for (std::size_t i = 0; i < 7; ++i)
              worst = std::max(worst,
                               angle_between(quaternion_at(state.orientation, i), exp_rotation(Vector3(0, 0, end[i]))));
            return worst;
          }};
}

// On an arm that is turned at w: r'' = w^2 r - k (r - 1) - d r', r(0) = 1, r'(0) = 0.
MotionProblem sprung_wheel() {
  constexpr double kTurning = 2.0, kStiffness = 40.0, kDamping = 0.6;
  WorldBuilder world = jointed_world();
  world.point(1.0, {1.0, 1.0, 1.0}, {0, 0, 0});
  world.body().flags = kKinematic;
  world.body().twist.angular = {0, 0, kTurning};
  world.point(1.0, {0.1, 0.1, 0.2}, {1, 0, 0});
  world.body().twist.linear = {0, kTurning, 0};
  world.joint("Axle", "constraint_axle", 0, 1, {1, 0, 0, 1, 0, 0, 0, 0, 1, kStiffness, kDamping});
  return {"sprung wheel", 2.0, true, world, [](const kernel::StateView& state) {
            constexpr double kTime = 2.0, kDecay = 0.5 * kDamping;
            const double rest = kStiffness / (kStiffness - kTurning * kTurning);
            const double w = std::sqrt(kStiffness - kTurning * kTurning - kDecay * kDecay);
            const double r = rest + (1.0 - rest) * std::exp(-kDecay * kTime) *
                                        (std::cos(w * kTime) + kDecay / w * std::sin(w * kTime));
            const double angle = kTurning * kTime;
            return (position_of(state, 1) - r * Vector3(std::cos(angle), std::sin(angle), 0)).norm();
          }};
}

// Its axis of symmetry stays at right angles to the steering axis, so that both rates stay: the camber bears the gyroscopic
// couple.
MotionProblem steered_wheel() {
  constexpr double kSteering = 3.0, kRolling = 7.0, kTime = 2.0;
  WorldBuilder world = jointed_world();
  world.point(1.0, {0.1, 0.1, 0.2}, {0, 0, 0});
  world.body().twist.angular = {0, kSteering, kRolling};
  world.joint("Axle", "constraint_axle", kNone, 0, {0, 0, 0, 0, 1, 0, 0, 0, 1, kAbsent, kAbsent});
  return {"steered wheel", kTime, true, world, [](const kernel::StateView& state) {
            const Quaternion exact =
                exp_rotation(Vector3(0, kSteering * kTime, 0)) * exp_rotation(Vector3(0, 0, kRolling * kTime));
            return angle_between(quaternion_at(state.orientation, 0), exact);
          }};
}

// IFToMM A05: a shaft along z, a slider on it, two arms (a rod with a ball without moments at its end) hinged to the shaft
// at z = 1, springs from the slider to the rods' midpoints. Arms hang 30 degrees below the horizontal.
MotionProblem flyball_governor() {
  constexpr double kRod = 0.3, kBall = 5.0, kSlider = 3.0, kStiffness = 8e5, kDamping = 4e4,
                   kSpin = 2 * std::numbers::pi;
  constexpr double kAcross = kRod * 1.0001 / 12.0, kAlong = kRod * 2e-4 / 12.0, kAngle = std::numbers::pi / 6.0;
  const double centre = (0.5 * kRod + kBall) / (kRod + kBall);
  const double moment = kAcross + kRod * std::pow(centre - 0.5, 2) + kBall * std::pow(1.0 - centre, 2);
  WorldBuilder world = jointed_world();
  world.point(kRod, {kAcross, kAcross, kAlong}, {0, 0, 0.5});
  world.body().twist.angular = {0, 0, kSpin};
  world.point(kSlider, Vector3::Constant(kSlider * 0.02 / 12.0), {0, 0, 0.5});
  world.body().twist.angular = {0, 0, kSpin};
  for (const double side : {1.0, -1.0}) {
    const Vector3 along(side * std::cos(kAngle), 0, -std::sin(kAngle));
    world.point(kRod + kBall, {kAlong, moment, moment}, Vector3(0.05 * side, 0, 1) + centre * along);
    kernel::BodyDescription& arm = world.body();
    arm.pose.orientation = exp_rotation(Vector3(0, side > 0.0 ? kAngle : std::numbers::pi - kAngle, 0));
    arm.twist.angular = {0, 0, kSpin};
    arm.twist.linear = arm.twist.angular.cross(arm.pose.position);
    spring_between(&world, {kStiffness, kDamping, 0.5}, Vector3(0.5 - centre, 0, 0), 1, Vector3(0.05 * side, 0, 0));
  }
  world.gravity({0, 0, -9.81});
  world.joint("Revolute", "constraint_revolute", kNone, 0, {0, 0, 0, 0, 0, 1, kAbsent, kAbsent});
  world.joint("Slider", "constraint_slider", 0, 1, {0, 0, 0.5, 0, 0, 1, kAbsent, kAbsent, kAbsent, kAbsent});
  for (const std::uint32_t arm : {2U, 3U}) {
    const double x = arm == 2 ? 0.05 : -0.05;
    world.joint("Revolute", "constraint_revolute", 0, arm, {x, 0, 1, x, 1, 1, kAbsent, kAbsent});
  }
  return {"flyball governor", 10.0, true, world,
          [](const kernel::StateView& state) { return std::fabs(position_of(state, 1).z() - 0.619622917061365659); }};
}

void spring_between(WorldBuilder* world, const SpringValues& spring, const Vector3& attachment,
                    std::uint32_t anchor_body, const Vector3& anchor) {
  const auto row = static_cast<std::uint32_t>(world->description().forces.size());
  world->force("Spring", "force_spring",
               {spring.stiffness, spring.damping, spring.rest_length, attachment.x(), attachment.y(), attachment.z(),
                anchor_body == kNone ? kAbsent : anchor_body, anchor.x(), anchor.y(), anchor.z()});
  if (anchor_body != kNone) world->description().bodies[anchor_body].forces.push_back(row);
}

double energy_of(kernel::Environment* environment) {
  const kernel::Model& model = environment->model();
  const kernel::StateView state = environment->state();
  double energy = environment->potential_energy();
  for (std::uint32_t i = 0; i < model.body_count; ++i)
    if (model.inverse_mass[i] > 0.0)
      energy += kinetic_energy(1.0 / model.inverse_mass[i], vector_at(model.inertia.span(), i),
                               quaternion_at(state.orientation, i),
                               {vector_at(state.linear_velocity, i), vector_at(state.angular_velocity, i)});
  return energy;
}

Vector3 angular_momentum_of(const kernel::Environment& environment) {
  const kernel::Model& model = environment.model();
  const kernel::StateView state = environment.state();
  Vector3 sum = Vector3::Zero();
  for (std::uint32_t i = 0; i < model.body_count; ++i)
    if (model.inverse_mass[i] > 0.0)
      sum += angular_momentum(1.0 / model.inverse_mass[i], vector_at(model.inertia.span(), i),
                              {vector_at(state.position, i), quaternion_at(state.orientation, i)},
                              {vector_at(state.linear_velocity, i), vector_at(state.angular_velocity, i)});
  return sum;
}

MotionResult run_motion(const MotionProblem& problem, const MotionMethod& method, std::uint32_t steps,
                        kernel::Simulator simulator, double most_seconds) {
  WorldBuilder world = problem.world;
  world.steps(steps, problem.duration / steps);
  world.plugin(Slot::kIntegrator, plugin_path(method.library), method.settings);
  world.description().simulator = simulator;
  kernel::Environment environment(world.description());
  MotionResult result;
  const double energy = energy_of(&environment);
  const Vector3 momentum = angular_momentum_of(environment);
  std::clock_t start = std::clock();  // looking at invariants is not counted
  for (std::uint32_t i = 0; i < steps; ++i) {
    if (environment.step() != kernel::StepOutcome::kCommitted)
      throw std::runtime_error(problem.name + ", " + method.name + ": " + environment.fault()->fault.what());
    result.joint_error = std::max(result.joint_error, environment.figures().joint_error);
    const std::clock_t pause = std::clock();
    result.energy_error = std::max(result.energy_error, std::fabs(energy_of(&environment) - energy));
    result.momentum_error = std::max(result.momentum_error, (angular_momentum_of(environment) - momentum).norm());
    start += std::clock() - pause;
    if (static_cast<double>(std::clock() - start) > most_seconds * CLOCKS_PER_SEC)
      throw std::runtime_error("more than " + std::to_string(std::lround(most_seconds)) + " s");
  }
  result.seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  result.error = problem.error(environment.state());
  const auto stage = problem.is_jointed ? kernel::Stage::kConstrain : kernel::Stage::kForce;
  result.derivatives = environment.stage_time(stage).count();
  return result;
}

}  // namespace gravitas::harness
