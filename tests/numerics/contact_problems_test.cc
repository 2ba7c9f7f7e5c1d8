// Reference problems of contact, with the simulator that stops at impacts and at the ends of slides.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "kernel/environment.h"
#include "plugin_sdk/body.h"
#include "plugin_sdk/math/rotation.h"
#include "services/events/event_source.h"
#include "tests/kernel/run_to_end.h"
#include "tests/kernel/world_builder.h"
#include "tests/numerics/motion_problem.h"
#include "tests/numerics/reached.h"

namespace gravitas {
namespace {

using harness::CpuClock;
using harness::expect_reached;
using harness::plugin_path;
using harness::WorldBuilder;
using kernel::Environment;
using kernel::Simulator;
using kernel::StepOutcome;

constexpr double kGravity = 9.81;

class Listener final : public EventListener {
 public:
  void on_event(const Event& event) override { events.push_back(event); }
  std::vector<Event> events;
};

// Exact in free flight, and a solver that closes contacts to rounding.
WorldBuilder contact_world(std::uint32_t steps, double time_step, const harness::Material& material) {
  WorldBuilder world;
  world.steps(steps, time_step).integrator("integrator_verlet").material(material);
  world.plugin(Slot::kSolver, plugin_path("solver_newton"), {1e-12, 500});
  world.description().simulator = Simulator::kContinuous;
  return world;
}

Vector3 position(const Environment& world, std::size_t body) { return vector_at(world.state().position, body); }
Vector3 velocity(const Environment& world, std::size_t body) { return vector_at(world.state().linear_velocity, body); }
Vector3 spin(const Environment& world, std::size_t body) { return vector_at(world.state().angular_velocity, body); }

// Of spheres on the ground, which is body 0.
double energy_of_spheres(const Environment& world, double mass) {
  double energy = 0.0;
  for (std::size_t i = 1; i < world.model().body_count; ++i)
    energy += mass * (0.5 * velocity(world, i).squaredNorm() + kGravity * position(world, i).y());
  return energy;
}

// ---- impacts

// SimBenchmark's bounce: 7 x 7 balls fall from a centre height of 5 m and keep their energy.
TEST(ContactProblems, BallsBounceForTwentySeconds) {
  WorldBuilder builder = contact_world(2000, 0.01, {1.0, 0.0, 0.0, 0.0});
  builder.ground();
  for (int i = 0; i < 49; ++i) builder.sphere(0.1, 10.0, Vector3(i % 7, 5.0, i / 7));
  builder.gravity({0, -kGravity, 0});
  const CpuClock clock;
  Environment world(builder.description());
  const double fall = std::sqrt(2.0 * 4.9 / kGravity);
  double squares = 0.0, apex = 0.0;
  while (world.step_count() < world.total_steps()) {
    ASSERT_NO_FATAL_FAILURE(step(&world));
    squares += std::pow(energy_of_spheres(world, 10.0) / 24034.5 - 1.0, 2);
    for (std::size_t i = 1; i <= 49; ++i) {
      const double apex_time = world.time() + velocity(world, i).y() / kGravity;
      apex = std::max(apex, std::fabs(std::remainder(apex_time, 2.0 * fall)));
    }
  }
  const char* method = "Continuous, Verlet, Newton, 10 ms";
  expect_reached(
      {"bounce of 49 balls", method, "energy, relative RMS", 1e-10, std::sqrt(squares / 2000), clock.seconds()});
  expect_reached({"bounce of 49 balls", method, "apex times, s", 1e-9, apex, clock.seconds()});
}

TEST(ContactProblems, OneBallKeepsItsEnergyAtSixtyHertz) {
  WorldBuilder builder = contact_world(600, 1.0 / 60.0, {1.0, 0.0, 0.0, 0.0});
  builder.ground().sphere(0.5, 1.0, Vector3(0, 1.5, 0)).gravity({0, -kGravity, 0});
  const CpuClock clock;
  Environment world(builder.description());
  double worst = 0.0;
  while (world.step_count() < world.total_steps()) {
    ASSERT_NO_FATAL_FAILURE(step(&world));
    worst = std::max(worst, std::fabs(energy_of_spheres(world, 1.0) / (1.5 * kGravity) - 1.0));
  }
  expect_reached({"bounce", "Continuous, Verlet, Newton, 1/60 s", "energy, relative", 1e-10, worst, clock.seconds()});
}

// A turned and spinning cube, 10 m a step: its lowest corner meets the plane.
TEST(ContactProblems, ACubeAtAThousandMetresPerSecondMeetsAPlane) {
  WorldBuilder builder = contact_world(6, 0.01, {0.5, 0.0, 0.0, 0.0});
  builder.ground().box({0.1, 0.1, 0.1}, 1.0, {0, 25.0, 0}, {0, -1000.0, 0});
  builder.body().pose.orientation = exp_rotation(Vector3(0.3, 0.2, 0.5));
  const CpuClock clock;
  Environment world(builder.description());
  Listener listener;
  EventSource listener_source(&listener);
  world.set_commit_listener(&listener_source);
  double deepest = 0.0;
  const auto lowest_corner = [](const Vector3& centre, const Quaternion& q) {
    double lowest = centre.y();
    for (int k = 0; k < 8; ++k)
      lowest =
          std::min(lowest, centre.y() + (q * Vector3(k & 1 ? 0.1 : -0.1, k & 2 ? 0.1 : -0.1, k & 4 ? 0.1 : -0.1)).y());
    return lowest;
  };
  const double height = lowest_corner({0, 25.0, 0}, builder.body().pose.orientation);
  while (world.step_count() < world.total_steps()) {
    ASSERT_NO_FATAL_FAILURE(step(&world));
    deepest = std::max(deepest, -lowest_corner(position(world, 1), quaternion_at(world.state().orientation, 1)));
  }
  ASSERT_FALSE(listener.events.empty());
  const char* method = "Continuous, Verlet, Newton, 10 ms";
  expect_reached({"cube at 1000 m/s", method, "time of impact, s", 1e-9,
                  std::fabs(listener.events[0].time - height / 1000.0), clock.seconds()});
  expect_reached({"cube at 1000 m/s", method, "overlap at a committed step, m", 1e-9, deepest, clock.seconds()});
}

TEST(ContactProblems, APlateAtAHundredMetresPerSecondMeetsAPlate) {
  WorldBuilder builder = contact_world(10, 0.01, {0.5, 0.0, 0.0, 0.0});
  builder.box({1.0, 0.015, 1.0}, 1.0, {0, 0, 0}).box({0.5, 0.015, 0.5}, 1.0, {0.1, 3.456, 0.2}, {0, -100.0, 0});
  const CpuClock clock;
  Environment world(builder.description());
  Listener listener;
  EventSource listener_source(&listener);
  world.set_commit_listener(&listener_source);
  double deepest = 0.0;
  while (world.step_count() < world.total_steps()) {
    ASSERT_NO_FATAL_FAILURE(step(&world));
    deepest = std::max(deepest, world.figures().penetration);
    ASSERT_GT(position(world, 1).y(), position(world, 0).y());
  }
  ASSERT_FALSE(listener.events.empty());
  const char* method = "Continuous, Verlet, Newton, 10 ms";
  expect_reached({"plate at 100 m/s", method, "time of impact, s", 1e-9,
                  std::fabs(listener.events[0].time - (3.456 - 0.03) / 100.0), clock.seconds()});
  expect_reached({"plate at 100 m/s", method, "overlap at a committed step, m", 1e-9, deepest, clock.seconds()});
}

// Of any size against what hits it.
TEST(ContactProblems, NothingPassesAPlateHoweverLargeItIs) {
  const CpuClock clock;
  double worst = 0.0;
  for (const double half : {0.5, 3.0, 6.0, 40.0, 1e3, 1e5}) {
    for (const double speed : {0.3, 100.0, 300.0, 1000.0}) {
      const double gap = 1.2, length = gap / speed / 2.7;
      WorldBuilder builder = contact_world(6, length, {0.6, 0.0, 0.0, 0.0});
      builder.box({half, 0.1, half}, 1.0, {0, 0, 0});
      builder.body().flags &= ~kMovable, builder.body().mass = 0.0, builder.body().inertia.setZero();
      builder.sphere(0.25, 1.0, {0.1, 0.35 + gap, 0.2}, {0, -speed, 0});
      Environment world(builder.description());
      while (world.step_count() < world.total_steps()) ASSERT_NO_FATAL_FAILURE(step(&world));
      const double back = 0.6 * speed * (6 * length - gap / speed);
      worst = std::max(worst, std::fabs(position(world, 1).y() - 0.35 - back) / gap);
    }
  }
  expect_reached(
      {"ball on plates of 1 m to 200 km", "Continuous, Verlet, Newton", "way, relative", 1e-9, worst, clock.seconds()});
}

// A single contact without friction loses nothing, however the bodies turn while they meet.
TEST(ContactProblems, ElasticBoxesKeepTheirEnergy) {
  const CpuClock clock;
  std::mt19937_64 numbers(8);
  const auto number = [&] { return 2.0 * static_cast<double>(numbers() >> 11) * 0x1p-53 - 1.0; };
  const auto vector = [&](double size) { return Vector3(size * number(), size * number(), size * number()); };
  double worst = 0.0;
  for (int i = 0; i < 30; ++i) {
    WorldBuilder builder = contact_world(200, 0.005, {1.0, 0.0, 0.0, 0.0});
    builder.box({0.2, 0.3, 0.4}, 1.0, {-1, 0, 0}, Vector3(1.5, 0, 0) + vector(0.3));
    builder.body().twist.angular = vector(3.0);
    builder.box({0.3, 0.2, 0.3}, 2.0, {1, 0.1, 0.1}, Vector3(-1.5, 0, 0) + vector(0.3));
    builder.body().twist.angular = vector(3.0);
    Environment world(builder.description());
    const auto energy = [&] {
      double sum = 0.0;
      for (std::size_t b = 0; b < 2; ++b) {
        const Vector3 moments = vector_at(world.model().inertia.span(), b);
        const Vector3 w = quaternion_at(world.state().orientation, b).conjugate() * spin(world, b);
        sum +=
            0.5 * (velocity(world, b).squaredNorm() / world.model().inverse_mass[b] + w.dot(moments.cwiseProduct(w)));
      }
      return sum;
    };
    const double before = energy();
    while (world.step_count() < world.total_steps()) ASSERT_NO_FATAL_FAILURE(step(&world));
    worst = std::max(worst, std::fabs(energy() / before - 1.0));
  }
  expect_reached({"elastic boxes, 30 pairs", "Continuous, Verlet, Newton, 5 ms", "energy, relative", 1e-3, worst,
                  clock.seconds()});
}

// Its points come down all the time, but it does not land.
TEST(ContactProblems, ARollingBallIsNotHalved) {
  WorldBuilder builder = contact_world(120, 1.0 / 60, {0.0, 0.5, 0.5, 0.0});
  builder.ground().sphere(0.2, 1.0, {0, 0.2, 0}, {1, 0, 0}).gravity({0, -kGravity, 0});
  builder.body().twist.angular = {0, 0, -5};
  builder.description().simulator = Simulator::kBisection;
  Environment world(builder.description());
  while (world.step_count() < world.total_steps()) ASSERT_NO_FATAL_FAILURE(step(&world));
  EXPECT_NEAR(position(world, 1).x(), 2.0, 1e-9);
  EXPECT_LE(world.stage_time(kernel::Stage::kIntegrate).count(), 4U * 120U);
}

TEST(ContactProblems, TwoCubesMeetHeadOnAtFiveHundredMetresPerSecond) {
  WorldBuilder builder = contact_world(3, 0.01, {1.0, 0.0, 0.0, 0.0});
  builder.box({0.05, 0.05, 0.05}, 1.0, {-4, 0, 0}, {500, 0, 0}).box({0.05, 0.05, 0.05}, 1.0, {3, 0, 0}, {-500, 0, 0});
  const CpuClock clock;
  Environment world(builder.description());
  Listener listener;
  EventSource listener_source(&listener);
  world.set_commit_listener(&listener_source);
  double deepest = 0.0;
  while (world.step_count() < world.total_steps()) {
    ASSERT_NO_FATAL_FAILURE(step(&world));
    deepest = std::max(deepest, 0.1 - (position(world, 1).x() - position(world, 0).x()));
  }
  ASSERT_FALSE(listener.events.empty());
  const char* method = "Continuous, Verlet, Newton, 10 ms";
  expect_reached({"head-on at 500 m/s", method, "time of impact, s", 1e-9, std::fabs(listener.events[0].time - 0.0069),
                  clock.seconds()});
  expect_reached({"head-on at 500 m/s", method, "overlap at a committed step, m", 1e-9, deepest, clock.seconds()});
}

// SimBenchmark's 666: 6^3 balls fall from `base` in columns that are not quite straight.
WorldBuilder box_of_balls(WorldBuilder world, double base) {
  world.ground();
  std::mt19937_64 numbers(6);
  const auto jitter = [&] { return 1e-3 * static_cast<double>(numbers() >> 11) * 0x1p-53; };
  for (int i = 0; i < 216; ++i) {
    const double x = 0.21 * (i % 6) + jitter(), y = base + 0.21 * (i / 36) + jitter(),
                 z = 0.21 * (i / 6 % 6) + jitter();
    world.sphere(0.1, 10.0, Vector3(x, y, z));
  }
  return world.gravity({0, -kGravity, 0}).space("space_dynamic_bvh");
}

double sum_of_squared_overlaps(const Environment& world) {
  double sum = 0.0;
  for (std::size_t i = 1; i < world.model().body_count; ++i) {
    sum += std::pow(std::max(0.0, 0.1 - position(world, i).y()), 2);
    for (std::size_t k = 1; k < i; ++k)
      sum += std::pow(std::max(0.0, 0.2 - (position(world, i) - position(world, k)).norm()), 2);
  }
  return sum;
}

// The mean over `steps` of 10 ms in which the balls fall and come to rest.
void expect_no_overlap(Simulator simulator, std::uint32_t substeps, std::uint32_t steps, const std::string& method) {
  WorldBuilder builder = box_of_balls(contact_world(steps, 0.01, {0.0, 0.0, 0.0, 0.0}), 0.101);
  builder.description().simulator = simulator;
  builder.description().substeps = substeps;
  const CpuClock clock;
  Environment world(builder.description());
  double sum = 0.0;
  while (world.step_count() < world.total_steps()) {
    ASSERT_NO_FATAL_FAILURE(step(&world));
    sum += sum_of_squared_overlaps(world);
  }
  expect_reached({fmt::format("666, {} s", steps / 100.0), method + ", Verlet, Newton, 10 ms",
                  "mean of sum of overlap^2, m^2", 1e-8, sum / steps, clock.seconds()});
}

TEST(ContactProblems, BallsOf666DoNotOverlap) {
  const bool is_long = harness::runs_long_problems();
  const std::uint32_t steps = is_long ? 1000 : 100;
  expect_no_overlap(Simulator::kSubstepping, 1, steps, "Substepping 1");
  expect_no_overlap(Simulator::kSubstepping, 10, is_long ? 1000 : 50, "Substepping 10");
  // it stops at each of the contacts that the pile makes while it spreads
  expect_no_overlap(Simulator::kContinuous, 1, is_long ? 100 : 20, "Continuous");
}

// All of the first impacts of 36 columns, and hundreds of those within them, fall into twelve steps.
TEST(ContactProblems, ElasticBallsOf666KeepTheirEnergy) {
  const std::uint32_t steps = harness::runs_long_problems() ? 10000 : 600;
  const WorldBuilder builder = box_of_balls(contact_world(steps, 0.001, {1.0, 0.0, 0.0, 0.0}), 1.101);
  const CpuClock clock;
  Environment world(builder.description());
  const double start = energy_of_spheres(world, 10.0);
  double squares = 0.0;
  while (world.step_count() < world.total_steps()) {
    ASSERT_NO_FATAL_FAILURE(step(&world));
    squares += std::pow(energy_of_spheres(world, 10.0) / start - 1.0, 2);
  }
  expect_reached({"elastic 666, " + std::to_string(steps) + " ms", "Continuous, Verlet, Newton, 1 ms",
                  "energy, relative RMS", 1e-10, std::sqrt(squares / steps), clock.seconds()});
}

// ---- ends of slides

// A ball that is set sliding rolls from 2 v / (7 mu g) on, at 5/7 v.
TEST(ContactProblems, ASlidingBallComesToRoll) {
  for (const double time_step : {0.01, 0.001}) {
    const auto steps = static_cast<std::uint32_t>(std::lround(0.6 / time_step));
    WorldBuilder builder = contact_world(steps, time_step, {0.0, 0.3, 0.3, 0.0});
    builder.ground().sphere(0.2, 1.5, {0, 0.2, 0}, {5.0, 0, 0}).gravity({0, -kGravity, 0});
    const CpuClock clock;
    Environment world(builder.description());
    ASSERT_NO_FATAL_FAILURE(run_to_end(&world));
    const double time = 0.485413329450026698, way = 2.08034284050011442, speed = 25.0 / 7.0;
    const double error = std::fabs(position(world, 1).x() - (way + speed * (world.time() - time)));
    const double turn = std::fabs(spin(world, 1).z() + speed / 0.2);
    const std::string method = "Continuous, Verlet, Newton, " + std::to_string(std::lround(1e3 * time_step)) + " ms";
    expect_reached({"slide to roll", method, "position, m", 1e-9, error, clock.seconds()});
    expect_reached(
        {"slide to roll", method, "speed, m/s", 1e-9, std::fabs(velocity(world, 1).x() - speed), clock.seconds()});
    expect_reached({"slide to roll", method, "spin, rad/s", 1e-9, turn, clock.seconds()});
  }
}

TEST(ContactProblems, ABoxStopsWhereItShouldInSixteenDirections) {
  double worst = 0.0, worst_time = 0.0, turned = 0.0;
  const CpuClock clock;
  for (int i = 0; i < 16; ++i) {
    const double angle = std::numbers::pi / 8.0 * i;
    const Vector3 direction(std::cos(angle), 0.0, std::sin(angle));
    WorldBuilder builder = contact_world(120, 1.0 / 60.0, {0.0, 0.3, 0.3, 0.0});
    builder.ground().box({0.3, 0.2, 0.25}, 2.0, {0, 0.2, 0}, 5.0 * direction).gravity({0, -kGravity, 0});
    Environment world(builder.description());
    double stop = 0.0;
    while (world.step_count() < world.total_steps()) {
      const double speed = velocity(world, 1).norm(), time = world.time();
      ASSERT_NO_FATAL_FAILURE(step(&world));
      if (velocity(world, 1).norm() < 1e-9 && speed > 1e-9) stop = time + speed / (0.3 * kGravity);
    }
    worst = std::max(worst, (position(world, 1) - Vector3(0, 0.2, 0) - 4.24736663268773 * direction).norm());
    worst_time = std::max(worst_time, std::fabs(stop - 1.69894665307509));
    turned = std::max(turned, log_rotation(shorter_arc(quaternion_at(world.state().orientation, 1))).norm());
  }
  const char* method = "Continuous, Verlet, Newton, 1/60 s";
  expect_reached({"stop in 16 directions", method, "place, m", 1e-8, worst, clock.seconds()});
  expect_reached({"stop in 16 directions", method, "time, s", 1e-8, worst_time, clock.seconds()});
  expect_reached({"stop in 16 directions", method, "turn, rad", 1e-8, turned, clock.seconds()});
}

TEST(ContactProblems, ACubeSlidesAtThirtyDegrees) {
  const double angle = std::numbers::pi / 6.0, way = 25.0 / (2.0 * 0.5 * kGravity);
  WorldBuilder builder = contact_world(120, 1.0 / 60.0, {0.0, 0.5, 0.5, 0.0});
  builder.ground().box({0.5, 0.5, 0.5}, 1.0, {0, 0.5, 0}, 5.0 * Vector3(std::cos(angle), 0.0, std::sin(angle)));
  builder.gravity({0, -kGravity, 0});
  const CpuClock clock;
  Environment world(builder.description());
  ASSERT_NO_FATAL_FAILURE(run_to_end(&world));
  const Vector3 end = position(world, 1);
  const double degrees = std::fabs(std::atan2(end.z(), end.x()) - angle) * 180.0 / std::numbers::pi;
  const char* method = "Continuous, Verlet, Newton, 1/60 s";
  expect_reached({"slide30", method, "distance, relative", 1e-6, std::fabs(std::hypot(end.x(), end.z()) / way - 1.0),
                  clock.seconds()});
  expect_reached({"slide30", method, "direction, degrees", 1e-6, degrees, clock.seconds()});
}

// Up an incline, to rest for an instant, and back: 2 v (sin - mu cos) ... the slide turns within a step.
TEST(ContactProblems, ABoxThatSlidesUpASlopeComesBack) {
  const double slope = 0.5, friction = 0.3, up = kGravity * (std::sin(slope) + friction * std::cos(slope)),
               down = kGravity * (std::sin(slope) - friction * std::cos(slope));
  WorldBuilder builder = contact_world(60, 1.0 / 60.0, {0.0, friction, friction, 0.0});
  builder.ground().box({0.3, 0.2, 0.25}, 2.0, {0, 0.2, 0}, {3.0, 0, 0});
  builder.gravity(kGravity * Vector3(-std::sin(slope), -std::cos(slope), 0));
  const CpuClock clock;
  Environment world(builder.description());
  ASSERT_NO_FATAL_FAILURE(run_to_end(&world));
  const double turn = 3.0 / up, back = world.time() - turn;
  expect_reached({"up a slope and back", "Continuous, Verlet, Newton, 1/60 s", "place, m", 1e-9,
                  std::fabs(position(world, 1).x() - (9.0 / (2.0 * up) - 0.5 * down * back * back)), clock.seconds()});
}

// ---- a contact that moves

// Without an Accuracy (0) inner steps stand as they are: of order 1 where the reaction turns with the body.
std::string method_with(double accuracy, double time_step) {
  return accuracy == 0.0 ? fmt::format("Continuous, Verlet, Newton, {:g} ms", 1e3 * time_step)
                         : fmt::format("Continuous {:g}, Verlet, Newton, {:g} ms", accuracy, 1e3 * time_step);
}

// A rod of 1 m, 0.1 rad from the vertical, its foot on a floor without friction. Its ends are the centres of a capsule's
// caps, which stay at the capsule's radius above the floor.
TEST(ContactProblems, ARodFallsOver) {
  const double radius = 0.02, tilt = 0.1;
  const auto run = [&](double accuracy, double time_step, double slack) {
    WorldBuilder builder =
        contact_world(static_cast<std::uint32_t>(std::lround(0.6 / time_step)), time_step, {0.0, 0.0, 0.0, 0.0});
    builder.description().accuracy = accuracy;
    builder.ground().sphere(radius, 1.0, {0, radius + 0.5 * std::cos(tilt), 0});
    builder.body().inertia = Vector3(1.0 / 12.0, 1e-4, 1.0 / 12.0);
    builder.body().pose.orientation = exp_rotation(Vector3(0, 0, -tilt));
    builder.body().bound = {BoundKind::kSphere, Vector3::Zero(), Quaternion::Identity(),
                            Vector3::Constant(0.5 + radius)};
    builder.description().shapes.back() = {"rod", "Capsule", {radius, 1.0}};
    builder.gravity({0, -kGravity, 0});
    const CpuClock clock;
    Environment world(builder.description());
    double time = 0.0, rate = 0.0, drift = 0.0;
    while (world.step_count() < world.total_steps() && time == 0.0) {
      const double before = world.time(),
                   angle = 2.0 * std::atan2(-world.state().orientation[7], world.state().orientation[4]);
      const double spin_before = -spin(world, 1).z();
      EXPECT_NO_FATAL_FAILURE(step(&world));
      if (world.fault()) break;
      drift = std::max(drift, std::fabs(position(world, 1).x()));
      if (std::fabs(spin(world, 1).z()) > 1e-3 || spin_before < 1.0) continue;
      // the rest of the fall, from what energy is left: d/dt of (1/12 + sin^2 / 4) rate^2 + g cos is 0
      const auto share = [](double at) { return 1.0 / 12.0 + 0.25 * std::sin(at) * std::sin(at); };
      const double energy = share(angle) * spin_before * spin_before + kGravity * std::cos(angle);
      const auto rate_at = [&](double at) { return std::sqrt((energy - kGravity * std::cos(at)) / share(at)); };
      const double end = std::numbers::pi / 2.0, middle = 0.5 * (angle + end);
      rate = rate_at(end);
      time = before + (end - angle) / 6.0 * (1.0 / spin_before + 4.0 / rate_at(middle) + 1.0 / rate);
    }
    const std::string method = method_with(accuracy, time_step);
    const double error = std::fabs(time - 0.585947472819335), rate_error = std::fabs(rate - 5.41137437109393665);
    expect_reached({"falling rod", method, "time of the strike, s", 1e-8, error, clock.seconds(), slack});
    expect_reached(
        {"falling rod", method, "rate at the strike, rad/s", 1e-8, rate_error, clock.seconds(), 3.0 * slack});
    expect_reached({"falling rod", method, "sideways drift, m", 1e-12, drift, clock.seconds()});
    return error;
  };
  EXPECT_NEAR(std::log10(run(0.0, 1e-3, 5e-4) / run(0.0, 1e-4, 5e-5)), 1.0, 0.1);
  run(1e-11, 1e-3, 0.0);
}

// Euler's disk in steady motion: it rolls on its rim, its centre at rest. With the angle A of its axis from the vertical, the
// radius a, half the height b, and moments I1 across and I3 along the axis: the turning w is along the way from the centre
// to the contact, so Omega^2 sin A (I1 cos A - I3 (b/a) sin A) = m g (a cos A - b sin A); 4 g/a for b = 0.
TEST(ContactProblems, EulersDiskRolls) {
  const double a = 0.0381, b = 0.001, tilt = 10.0 * std::numbers::pi / 180.0, mass = 0.1;
  const double across = mass * (0.25 * a * a + b * b / 3.0), along = 0.5 * mass * a * a;
  const double rate = std::sqrt(mass * kGravity * (a * std::cos(tilt) - b * std::sin(tilt)) /
                                (std::sin(tilt) * (across * std::cos(tilt) - along * b / a * std::sin(tilt))));
  const auto run = [&](double accuracy, double time_step, double duration, double slack) {
    WorldBuilder builder =
        contact_world(static_cast<std::uint32_t>(std::lround(duration / time_step)), time_step, {0.0, 1.0, 1.0, 0.0});
    builder.description().accuracy = accuracy;
    builder.ground().sphere(a, mass, {0, a * std::sin(tilt) + b * std::cos(tilt), 0});
    builder.body().inertia = Vector3(across, along, across);
    // its axis, y, leans towards -x: the contact is on that side
    builder.body().pose.orientation = exp_rotation(Vector3(0, 0, tilt));
    const Vector3 axis(-std::sin(tilt), std::cos(tilt), 0), down(-std::cos(tilt), -std::sin(tilt), 0);
    builder.body().twist.angular = -rate * std::sin(tilt) * (down - b / a * axis);
    builder.description().shapes.back() = {"disk", "Cylinder", {a, 2.0 * b}};
    builder.gravity({0, -kGravity, 0});
    const CpuClock clock;
    Environment world(builder.description());
    const double start = harness::energy_of(&world);
    double turned = 0.0, heading = std::numbers::pi;
    while (world.step_count() < world.total_steps()) {
      EXPECT_NO_FATAL_FAILURE(step(&world));
      if (world.fault()) break;
      const Vector3 now = quaternion_at(world.state().orientation, 1) * Vector3::UnitY();
      const double next = std::atan2(-now.z(), now.x());
      turned += std::remainder(next - heading, 2.0 * std::numbers::pi);
      heading = next;
    }
    const std::string method = method_with(accuracy, time_step),
                      problem = fmt::format("Euler's disk, {:g} s", duration);
    const double error = std::fabs(harness::energy_of(&world) / start - 1.0);
    expect_reached({problem, method, "energy, relative", 1e-9, error, clock.seconds(), slack});
    if (accuracy > 0.0)
      expect_reached({problem, method, "rate, relative", 1e-6, std::fabs(std::fabs(turned) / (rate * duration) - 1.0),
                      clock.seconds()});
    return error;
  };
  EXPECT_NEAR(std::log10(run(0.0, 1e-3, 0.2, 0.4) / run(0.0, 1e-4, 0.2, 0.04)), 1.0, 0.1);
  run(1e-11, 1e-3, harness::runs_long_problems() ? 10.0 : 1.0, 0.0);
}

}  // namespace
}  // namespace gravitas
