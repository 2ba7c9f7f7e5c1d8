// Newton and Direct: laws over random problems, and problems that are degenerate.
#include "plugin_sdk/solver/end_of_step.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/math/rotation.h"
#include "tests/sanitized.h"
#include "tests/workers/solver/end_of_step_problem.h"
#include "tests/workers/solver/solver_problem.h"

namespace gravitas {
namespace {

using conformance::Draw;

// Bodies in a row that are pressed together, with contacts between neighbours and the ground, theta 0 and no overlap: what
// the answer's velocities are is what its impulses make of the trial's.
struct Heap {
  SolverProblem problem;
  double friction;
};
struct HeapMaterial {
  double restitution = 0.0;
  double dynamic_share = 1.0;  // of the static friction
  double rolling = 0.0, spinning = 0.0;
  double friction_share = 1.0;  // of 0.1 to 0.9
};

Heap random_heap(std::uint64_t seed, double heaviest = 1.0, const HeapMaterial& material = {}) {
  Draw draw(seed);
  Heap heap;
  heap.friction = material.friction_share * draw.uniform(0.1, 0.9);
  SolverProblem& p = heap.problem;
  p.theta = 0.0;
  const std::uint32_t ground = p.add_immovable();
  const std::uint32_t count = 2 + draw.below(4);
  std::uint64_t key = 1;
  for (std::uint32_t i = 0; i < count; ++i) {
    const double mass = i + 1 == count ? heaviest : draw.uniform(0.5, 2.0);
    const std::uint32_t body =
        p.add_body({.mass = mass,
                    .moments = mass * Vector3{draw.uniform(0.1, 0.2), draw.uniform(0.1, 0.2), draw.uniform(0.1, 0.2)},
                    .pose = {Vector3(0, 0.5 + i, 0), draw.rotation()},
                    .linear = draw.vector(1.0) + Vector3(0, -2, 0),
                    .angular = draw.vector(2.0)});
    // the four corners of a face, so that rows depend on each other
    for (const double x : {-0.5, 0.5})
      for (const double z : {-0.5, 0.5})
        p.add_contact({.body1 = i == 0 ? ground : body - 1,
                       .body2 = body,
                       .point = {x, static_cast<double>(i), z},
                       .restitution = material.restitution,
                       .static_friction = heap.friction,
                       .dynamic_friction = material.dynamic_share * heap.friction,
                       .rolling = material.rolling,
                       .spinning = material.spinning,
                       .key = key++});
  }
  return heap;
}

Vector3 relative_velocity(const SolverProblem& p, std::span<const double> linear, std::span<const double> angular,
                          std::size_t contact) {
  Vector3 sum = Vector3::Zero();
  for (std::size_t end = 0; end < 2; ++end) {
    const std::uint32_t body = p.contact_body[2 * contact + end];
    const Vector3 arm = vector_at(p.contact_point, contact) - vector_at(p.trial_position, body);
    sum += (end == 0 ? -1.0 : 1.0) * (vector_at(linear, body) + vector_at(angular, body).cross(arm));
  }
  return sum;
}

// |r - P_K(r - u^)| / max(|q|, |r|, |u|), u^ = u + mu |u_T| n, K the friction cones (PROBLEMS: FCLIB).
double contact_residual(const Heap& heap, const SolverAnswer& answer) {
  const SolverProblem& p = heap.problem;
  double missing = 0.0, free = 0.0, impulses = 0.0, velocities = 0.0;
  for (std::size_t i = 0; i < p.contact_key.size(); ++i) {
    const Vector3 n = vector_at(p.contact_normal, i), r = answer.impulse(i);
    const Vector3 u = relative_velocity(p, answer.linear_velocity, answer.angular_velocity, i);
    const Vector3 q = relative_velocity(p, p.trial_linear_velocity, p.trial_angular_velocity, i);
    const Vector3 slip = u - u.dot(n) * n;
    const Vector3 z = r - (u + heap.friction * slip.norm() * n);
    // projection to the cone
    const double normal = z.dot(n);
    const Vector3 across = z - normal * n;
    const double length = across.norm(), mu = heap.friction;
    Vector3 projected = z;
    if (mu * length <= -normal) {
      projected = Vector3::Zero();
    } else if (length > mu * normal) {
      const double along = (normal + mu * length) / (1.0 + mu * mu);
      projected = along * (n + mu * across / length);
    }
    missing += (r - projected).squaredNorm();
    free += q.squaredNorm(), impulses += r.squaredNorm(), velocities += u.squaredNorm();
  }
  return std::sqrt(missing / std::max({free, impulses, velocities}));
}

TEST(EndOfStep, ContactResidualIsBelow1em10) {
  double worst = 0.0;
  std::uint32_t most = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const Heap heap = random_heap(seed);
    const SolverAnswer answer = heap.problem.solve(newton());
    EXPECT_TRUE(answer.converged()) << seed;
    const double residual = contact_residual(heap, answer);
    EXPECT_LE(residual, 1e-10) << seed;
    worst = std::max(worst, residual);
    most = std::max(most, answer.iterations[0]);
  }
  RecordProperty("worst_residual", fmt::format("{:.3e}", worst));
  RecordProperty("most_iterations", std::to_string(most));
}

// Heaps that slide and turn under loads of 1e-3 to 1e4 times their mass, all solved. Ill-conditioned: at 1e4 rounding of
// the loads alone is 1e-12 of the largest.
TEST(EndOfStep, ContactResidualAtMassRatios) {
  for (const double heaviest : {1e-3, 1e2, 1e4}) {
    for (int seed = 1; seed <= harness::unless_sanitized(200); ++seed) {
      const Heap heap = random_heap(seed, heaviest);
      const SolverAnswer answer = heap.problem.solve(newton());
      EXPECT_TRUE(answer.converged()) << heaviest << ", " << seed;
      EXPECT_LE(contact_residual(heap, answer), 1e-10) << heaviest << ", " << seed;
    }
  }
}

// Bricks in rows of six, each on two with the four corners of what they share, thrown about.
Heap random_wall(std::uint64_t seed, std::uint32_t levels) {
  constexpr std::uint32_t kBricks = 6;
  Draw draw(seed);
  Heap wall;
  wall.friction = 0.5;
  SolverProblem& p = wall.problem;
  p.theta = 0.0;
  const std::uint32_t ground = p.add_immovable();
  std::vector<std::uint32_t> below, row;
  std::uint64_t key = 1;
  for (std::uint32_t level = 0; level < levels; ++level) {
    for (std::uint32_t i = 0; i < kBricks; ++i) {
      const double x = i + 0.5 * (level % 2);
      row.push_back(p.add_body({.mass = 2.0,
                                .moments = {0.1, 0.2, 0.15},
                                .pose = {Vector3(x, 0.25 + 0.5 * level, 0), Quaternion::Identity()},
                                .linear = draw.vector(1.0) + Vector3(0, -1, 0),
                                .angular = draw.vector(1.0)}));
      const auto add = [&](std::uint32_t on, double from, double to) {
        for (const double at : {from, to})
          for (const double z : {-0.25, 0.25})
            p.add_contact({.body1 = on,
                           .body2 = row.back(),
                           .point = {at, 0.5 * level, z},
                           .static_friction = wall.friction,
                           .dynamic_friction = wall.friction,
                           .key = key++});
      };
      for (std::uint32_t k = 0; k < below.size(); ++k) {
        const double centre = k + 0.5 * ((level + 1) % 2);
        if (std::fabs(centre - x) < 1.0) add(below[k], std::max(x, centre) - 0.5, std::min(x, centre) + 0.5);
      }
      if (level == 0) add(ground, x - 0.5, x + 0.5);
    }
    below = row;
    row.clear();
  }
  return wall;
}

// Rows depend on each other in many ways, and steps alone do not find who slides: accelerated sweeps come near, steps end
// there. Before, walls of 332 contacts were left at 5e-6 to 4e-5.
TEST(EndOfStep, WallsThatFallAreLeftNearlySolved) {
  for (const std::uint32_t levels : {5U, 8U}) {
    for (int seed = 1; seed <= harness::unless_sanitized(4); ++seed) {
      const Heap wall = random_wall(static_cast<std::uint64_t>(seed), levels);
      EXPECT_LE(contact_residual(wall, wall.problem.solve(newton())), 1e-6) << levels << ", " << seed;
    }
  }
}

// Friction at rest above that of motion, torques that contacts share in many ways, and a pose change that friction moves:
// positions and velocities agree in a few rounds, whatever the impulses do that move nothing.
TEST(EndOfStep, HeapsThatRollSettle) {
  for (const double heaviest : {1.0, 1e2}) {
    for (int seed = 1; seed <= harness::unless_sanitized(200); ++seed) {
      Heap heap = random_heap(seed, heaviest, {.dynamic_share = 0.8, .rolling = 0.02, .spinning = 0.01});
      SolverProblem& p = heap.problem;
      p.theta = 0.5;
      const SolverAnswer answer = p.solve(newton());
      EXPECT_TRUE(answer.converged()) << heaviest << ", " << seed;
      EXPECT_LE(p.energy(answer.linear_velocity, answer.angular_velocity),
                p.energy(p.trial_linear_velocity, p.trial_angular_velocity) * (1.0 + 1e-12))
          << heaviest << ", " << seed;
    }
  }
}

// Coulomb's law may have several solutions: sweeps need not find the one that steps find, but one.
TEST(EndOfStep, SweepsEndAtASolutionToo) {
  for (const double heaviest : {1.0, 1e5}) {
    for (int seed = 1; seed <= harness::unless_sanitized(40); ++seed) {
      const Heap heap = random_heap(seed, heaviest);
      const SolverAnswer answer = heap.problem.solve(direct());
      EXPECT_TRUE(answer.converged()) << heaviest << ", " << seed;
      EXPECT_LE(contact_residual(heap, answer), 1e-10) << heaviest << ", " << seed;
    }
  }
}

// Bodies that slide past each other with little friction, since what sticks is found without sweeps: what Newton solves is
// solved, however few the sweeps.
TEST(EndOfStep, WhereSweepsRunOutStepsTakeOver) {
  for (int seed = 1; seed <= 20; ++seed) {
    Heap heap = random_heap(seed, 1.0, {.friction_share = 0.1});
    SolverProblem& p = heap.problem;
    p.theta = 0.5;
    for (std::size_t body = 1; body < p.flags.size(); ++body)
      p.trial_linear_velocity[3 * body] += body % 2 == 0 ? 10.0 : -10.0;
    for (const std::uint32_t sweeps : {1U, 20U, 1000U})
      EXPECT_TRUE(p.solve(direct(sweeps)).converged()) << sweeps << ", " << seed;
  }
}

// Three bodies of one place, each to be pushed off the next in a circle, which no motion does: they part as far as they can, none
// sinks into the ground that they overlap by a millimetre, and nobody gains speed.
TEST(EndOfStep, BodiesOfOnePlacePartAndDoNotSink) {
  for (const EndOfStepSolver& solver : {newton(), direct()}) {
    for (const double heaviest : {1.0, 100.0}) {
      SolverProblem p;
      const std::uint32_t ground = p.add_immovable();
      for (const double mass : {1.0, heaviest, 1.0}) p.add_body({.mass = mass});
      p.make_trial(Vector3::Zero());
      std::uint64_t key = 1;
      for (std::uint32_t body = 1; body <= 3; ++body) {
        p.add_contact({.body1 = ground, .body2 = body, .depth = 1e-3, .key = key++});
        p.add_contact({.body1 = body, .body2 = body % 3 + 1, .normal = Vector3::UnitX(), .depth = 1.0, .key = key++});
      }
      const SolverAnswer answer = p.solve(solver);
      std::vector<double> places;
      for (std::uint32_t body = 1; body <= 3; ++body) {
        EXPECT_NEAR(answer.translation(body).y(), 1e-3, 1e-8) << heaviest;
        EXPECT_LE(answer.velocity(body).norm(), 1e-12) << heaviest;
        places.push_back(answer.translation(body).x());
        EXPECT_LE(std::fabs(places.back()), 1.0) << heaviest;
      }
      std::ranges::sort(places);
      EXPECT_GE(std::min(places[1] - places[0], places[2] - places[1]), 0.05) << heaviest;
    }
  }
}

TEST(EndOfStep, EnergyNeverRises) {
  for (const double restitution : {0.0, 0.5, 1.0}) {
    for (int seed = 1; seed <= harness::unless_sanitized(100); ++seed) {
      const Heap heap = random_heap(seed, 1.0, {.restitution = restitution});
      const SolverProblem& p = heap.problem;
      const SolverAnswer answer = p.solve(newton());
      const double before = p.energy(p.trial_linear_velocity, p.trial_angular_velocity);
      EXPECT_LE(p.energy(answer.linear_velocity, answer.angular_velocity), before * (1.0 + 1e-12)) << seed;
    }
  }
}

// In the mirror x -> -x the answer is the mirrored one: positions and velocities are vectors, turning is not.
TEST(EndOfStep, AMirroredHeapMovesMirrored) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    const Heap heap = random_heap(seed);
    Heap mirrored = heap;
    SolverProblem& p = mirrored.problem;
    const auto flip = [](std::vector<double>* column, std::size_t width, std::initializer_list<std::size_t> which) {
      for (std::size_t row = 0; row < column->size() / width; ++row)
        for (const std::size_t k : which) (*column)[width * row + k] *= -1.0;
    };
    for (auto* column : {&p.position, &p.linear_velocity, &p.trial_position, &p.trial_linear_velocity, &p.contact_point,
                         &p.contact_normal})
      flip(column, 3, {0});
    for (auto* column : {&p.angular_velocity, &p.trial_angular_velocity}) flip(column, 3, {1, 2});
    for (auto* column : {&p.orientation, &p.trial_orientation}) flip(column, 4, {2, 3});
    const SolverAnswer one = heap.problem.solve(newton()), other = p.solve(newton());
    for (std::size_t i = 0; i < p.flags.size(); ++i) {
      EXPECT_LE((other.velocity(i) - one.velocity(i).cwiseProduct(Vector3(-1, 1, 1))).norm(), 1e-9) << seed;
      EXPECT_LE((other.turning(i) - one.turning(i).cwiseProduct(Vector3(1, -1, -1))).norm(), 1e-9) << seed;
    }
  }
}

TEST(EndOfStep, EveryContactThreeTimesIsThatContact) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Heap heap = random_heap(seed);
    Heap thrice = heap;
    SolverProblem& p = thrice.problem;
    const std::size_t count = p.contact_key.size();
    for (int repeat = 0; repeat < 2; ++repeat)
      for (std::size_t i = 0; i < count; ++i)
        p.add_contact({.body1 = p.contact_body[2 * i],
                       .body2 = p.contact_body[2 * i + 1],
                       .point = vector_at(p.contact_point, i),
                       .static_friction = heap.friction,
                       .dynamic_friction = heap.friction,
                       .key = 1000 + p.contact_key.size()});
    EXPECT_LE(contact_residual(thrice, p.solve(newton())), 1e-10) << seed;
  }
}

// Three bricks, one across two: rolling friction is no torque where nothing turns, so it changes neither the answer nor
// what it costs, and the next step's guess is right as it stands.
TEST(EndOfStep, RollingFrictionOfWhatRestsCostsNothing) {
  const auto bricks = [](double rolling) {
    SolverProblem p;
    const auto ground = p.add_immovable();
    const Vector3 at[] = {{-0.55, 0.25, 0}, {0.55, 0.25, 0}, {0, 0.75, 0}};
    std::uint32_t brick[3];
    for (int i = 0; i < 3; ++i)
      brick[i] = p.add_body({.mass = 3.0, .moments = {0.1, 0.3, 0.3}, .pose = {at[i], Quaternion::Identity()}});
    p.make_trial({0, -9.81, 0});
    const double fall = 9.81 * p.time_step * p.time_step;
    const auto lay = [&](std::uint32_t below, std::uint32_t above, double from, double to, double y, double depth) {
      for (const double x : {from, to})
        for (const double z : {-0.25, 0.25})
          p.add_contact({.body1 = below,
                         .body2 = above,
                         .point = {x, y, z},
                         .depth = depth,
                         .static_friction = 0.6,
                         .dynamic_friction = 0.5,
                         .rolling = rolling,
                         .spinning = rolling,
                         .key = p.contact_key.size() + 1});
    };
    for (int i = 0; i < 2; ++i) lay(ground, brick[i], at[i].x() - 0.5, at[i].x() + 0.5, -0.5 * fall, fall);
    lay(brick[0], brick[2], -0.5, -0.05, 0.5 - fall, 0.0);
    lay(brick[1], brick[2], 0.05, 0.5, 0.5 - fall, 0.0);
    return p;
  };
  for (const EndOfStepSolver& solver : {newton(), direct()}) {
    const SolverAnswer without = bricks(0.0).solve(solver);
    SolverProblem p = bricks(0.05);
    const SolverAnswer with = p.solve(solver);
    EXPECT_TRUE(with.converged());
    EXPECT_LE(with.iterations[0], without.iterations[0]);
    EXPECT_EQ(with.contact_impulse, without.contact_impulse);
    p.contact_warm_impulse = with.contact_impulse;
    p.contact_warm_correction = with.contact_correction;
    EXPECT_EQ(p.solve(solver).iterations[0], 0U);
  }
}

// Rolling and spinning friction end in finite time: a ball's turning is stopped by at most mu_r N each.
TEST(EndOfStep, RollingAndSpinningFrictionAreBoundedTorques) {
  for (const double coefficient : {0.001, 10.0}) {
    SolverProblem p;
    const auto ground = p.add_immovable();
    const auto ball = p.add_body({.pose = {{0, 0.5, 0}, Quaternion::Identity()}, .angular = {0, 4, 0}});
    p.theta = 0.0;
    p.set_trial_velocity(ball, {0, -0.0981, 0}, {0, 4, 0});
    p.add_contact({.body1 = ground,
                   .body2 = ball,
                   .static_friction = 0.5,
                   .dynamic_friction = 0.5,
                   .rolling = 0.01,
                   .spinning = coefficient});
    const SolverAnswer answer = p.solve(newton());
    const double lost = std::min(4.0, coefficient * 0.0981 / 0.4);
    EXPECT_NEAR(answer.turning(ball).y(), 4.0 - lost, 1e-12);
    EXPECT_LE((answer.torque_impulse(0) - Vector3(0, -0.4 * lost, 0)).norm(), 1e-12);
  }
}

// A ball that rolls evenly at 2 m/s is held back by a torque of mu_r N and the friction F that keeps it rolling:
// m a = -F, I a/r = F r - mu_r N, so a = -mu_r N / (r (m + I/r^2)).
TEST(EndOfStep, RollingFrictionSlowsABallThatRolls) {
  SolverProblem p;
  const auto ground = p.add_immovable();
  const auto ball =
      p.add_body({.pose = {{0, 0.5, 0}, Quaternion::Identity()}, .linear = {2, 0, 0}, .angular = {0, 0, -4}});
  p.theta = 0.0;
  p.set_trial_velocity(ball, {2, -0.0981, 0}, {0, 0, -4});
  p.add_contact({.body1 = ground, .body2 = ball, .static_friction = 0.5, .dynamic_friction = 0.5, .rolling = 0.02});
  const SolverAnswer answer = p.solve(newton());
  const double lost = 0.02 * 0.0981 / (0.5 * (1.0 + 0.4 / 0.25));
  EXPECT_NEAR(answer.velocity(ball).x(), 2.0 - lost, 1e-12);
  EXPECT_NEAR(answer.turning(ball).z(), -(2.0 - lost) / 0.5, 1e-12);
  EXPECT_LE((answer.torque_impulse(0) - Vector3(0, 0, 0.02 * 0.0981)).norm(), 1e-12);
}

// Ten cubes of 1 kg at rest under 1 to 10,000 kg: contact k bears the weight above it, to 1e-8, and nothing sinks.
TEST(EndOfStep, AStackCarriesItsWeightAtEveryRatio) {
  for (const double load : {1.0, 1e2, 1e4}) {
    SolverProblem p;
    p.time_step = 1.0 / 60;
    const auto ground = p.add_immovable();
    for (int i = 0; i <= 10; ++i) {
      const double mass = i == 10 ? load : 1.0;
      p.add_body(
          {.mass = mass, .moments = Vector3::Constant(mass / 6.0), .pose = {{0, 0.5 + i, 0}, Quaternion::Identity()}});
    }
    p.make_trial({0, -9.81, 0});
    const double fallen = 9.81 / 3600.0;
    for (int i = 0; i <= 10; ++i)
      for (int corner = 0; corner < 4; ++corner)
        p.add_contact({.body1 = i == 0 ? ground : static_cast<std::uint32_t>(i),
                       .body2 = static_cast<std::uint32_t>(i + 1),
                       .point = {corner % 2 - 0.5, i - (i == 0 ? 0.5 : 1.0) * fallen, corner / 2 - 0.5},
                       .depth = i == 0 ? fallen : 0.0,
                       .static_friction = 0.5,
                       .dynamic_friction = 0.5,
                       .key = static_cast<std::uint64_t>(4 * i + corner + 1)});
    const SolverAnswer answer = p.solve(newton());
    EXPECT_TRUE(answer.converged()) << load;
    for (std::size_t i = 0; i <= 10; ++i) {
      double force = 0.0;
      for (std::size_t corner = 0; corner < 4; ++corner) force += 60.0 * answer.impulse(4 * i + corner).y();
      const double weight = 9.81 * (static_cast<double>(10 - i) + load);
      EXPECT_NEAR(force, weight, 1e-8 * weight) << load << ", " << i;
      EXPECT_NEAR(p.committed(answer, static_cast<std::uint32_t>(i + 1)).position.y(), 0.5 + static_cast<double>(i),
                  1e-12)
          << load << ", " << i;
    }
  }
}

}  // namespace
}  // namespace gravitas
