// The Sequential solver's bound on energy, and that the order of bodies is no physics.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/sanitized.h"
#include "tests/workers/solver/solver_problem.h"
#include "workers/solver/sequential/sequential.h"

namespace gravitas {
namespace {

// Numbers that are the same in every standard library.
class EnergyDraw {
 public:
  explicit EnergyDraw(std::uint64_t seed) : engine_(seed) {}
  double between(double low, double high) {
    return low + (high - low) * (static_cast<double>(engine_() >> 11) * 0x1p-53);
  }
  Vector3 vector(double size) {
    const double x = between(-size, size);
    const double y = between(-size, size);
    return {x, y, between(-size, size)};
  }
  Vector3 unit() {
    for (;;) {
      const Vector3 v = vector(1.0);
      if (v.norm() > 0.1 && v.norm() < 1.0) return v.normalized();
    }
  }
  std::uint32_t below(std::uint32_t count) { return static_cast<std::uint32_t>(engine_() % count); }

 private:
  std::mt19937_64 engine_;
};

// Boxes and balls of mixed masses, flying into each other and the ground at several points at once.
SolverProblem random_impact(std::uint64_t seed, double friction, double restitution) {
  EnergyDraw draw(seed);
  SolverProblem problem;
  const auto ground = problem.add_immovable();
  const std::uint32_t count = 2 + draw.below(4);
  for (std::uint32_t i = 0; i < count; ++i) {
    const double mass = draw.between(0.2, 5.0);
    const double zz = draw.between(0.01, 0.3), yy = draw.between(0.01, 0.3), xx = draw.between(0.01, 0.3);
    const Vector3 moments = mass / 3.0 * Vector3(yy + zz, xx + zz, xx + yy);
    const Vector3 at = draw.vector(2.0);
    const Quaternion turned = exp_rotation(draw.vector(3.0));
    const Vector3 linear = draw.vector(4.0);
    problem.add_body(
        {.mass = mass, .moments = moments, .pose = {at, turned}, .linear = linear, .angular = draw.vector(6.0)});
  }
  const std::uint32_t contacts = 1 + draw.below(6);
  for (std::uint32_t i = 0; i < contacts; ++i) {
    const std::uint32_t b = 1 + draw.below(count);
    std::uint32_t a = draw.below(count + 1);
    if (a == b) a = ground;
    const Vector3 normal = draw.unit();
    // near a corner of b
    const Vector3 point = problem.bodies[b].pose.position + draw.vector(0.5);
    problem.add_contact({.body1 = a,
                         .body2 = b,
                         .normal = normal,
                         .point = point,
                         .depth = 0.0,
                         .restitution = restitution * draw.between(0.0, 1.0),
                         .static_friction = friction,
                         .dynamic_friction = friction,
                         .key = i});
  }
  return problem;
}

double gained(const SolverProblem& problem, const SolverAnswer& answer) {
  const double before = problem.energy(problem.trial_linear_velocity, problem.trial_angular_velocity);
  return problem.energy(answer.linear_velocity, answer.angular_velocity) / before - 1.0;
}

// Solves and keeps the summary.
struct Recorder {
  SequentialSolver solver;
  SequentialSummary summary = {};
  void solve(const stage::SolverSolveRequest& request, const stage::SolverSolveReply& reply) {
    summary = solver.solve(request, reply);
  }
};

// Energy, the friction cone and momentum, converged or not: with the normal law solved before
// friction one impact in seven gains energy, up to 2.6 times what it had.
void expect_lawful_impacts(const SequentialSettings& way, std::uint32_t expected_of_200,
                           std::uint32_t expected_of_2000) {
  const std::uint64_t seeds = harness::unless_sanitized(1000);
  for (const std::uint32_t iterations : {200U, 2000U}) {
    SequentialSettings settings = way;
    settings.iterations = iterations;
    Recorder recorder{SequentialSolver(settings)};
    std::uint32_t lowered = 0;
    std::uint32_t converged = 0;
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
      const double friction = 0.1 * static_cast<double>(seed % 13);
      const SolverProblem problem = random_impact(seed, friction, seed % 3 == 0 ? 1.0 : 0.9);
      const SolverAnswer answer = problem.solve(recorder);
      lowered += recorder.summary.restitutions_lowered + recorder.summary.restitutions_shared;
      converged += answer.converged() ? 1U : 0U;
      // sums of a few tens of terms
      EXPECT_LE(gained(problem, answer), 1e-12) << "seed " << seed;
      Vector3 from_ground = Vector3::Zero();
      double size = 1.0;
      for (std::size_t i = 0; i < problem.contact_key.size(); ++i) {
        const Vector3 n = vector_at(problem.contact_normal, i);
        const double normal = answer.impulse(i).dot(n);
        const double tangent = (answer.impulse(i) - normal * n).norm();
        EXPECT_GE(normal, -1e-12) << "seed " << seed;
        EXPECT_LE(tangent, friction * normal + 1e-12 * (1.0 + normal)) << "seed " << seed;
        if (problem.contact_body[2 * i] == 0) from_ground += answer.impulse(i);
        size += answer.impulse(i).norm();
      }
      const Vector3 change = problem.momentum(answer.linear_velocity) - problem.momentum(problem.trial_linear_velocity);
      EXPECT_LE((change - from_ground).norm(), 1e-13 * size) << "seed " << seed;
    }
    // the bound is at work, and all but the problems with much friction at long arms have a
    // solution
    EXPECT_GT(lowered, 0U);
    if (seeds == 1000) {
      EXPECT_GE(converged, iterations == 200U ? expected_of_200 : expected_of_2000);
    }
  }
}

TEST(SequentialEnergy, NeverRisesInRandomImpacts) { expect_lawful_impacts({}, 900, 940); }
TEST(SequentialEnergy, NeverRisesDeepestFirst) {
  expect_lawful_impacts({.order = RelaxationOrder::kDeepestFirst}, 900, 940);
}
TEST(SequentialEnergy, NeverRisesSimultaneously) {
  expect_lawful_impacts({.order = RelaxationOrder::kSimultaneous}, 700, 920);
}
TEST(SequentialEnergy, NeverRisesOverRelaxed) { expect_lawful_impacts({.relaxation_factor = 1.5}, 700, 900); }
TEST(SequentialEnergy, NeverRisesUnderRelaxed) { expect_lawful_impacts({.relaxation_factor = 0.5}, 800, 940); }
TEST(SequentialEnergy, NeverRisesWithShockPropagation) {
  expect_lawful_impacts({.shock_propagation = ShockPropagation::kAlways}, 900, 940);
}

TEST(SequentialEnergy, ConvergedImpactsObeyTheirLaws) {
  Recorder recorder{SequentialSolver(SequentialSettings{5000, 1.0})};
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    SolverProblem problem = random_impact(seed, 0.3, 0.9);
    problem.theta = 0.0;
    const SolverAnswer answer = problem.solve(recorder);
    const SequentialSummary& summary = recorder.summary;
    if (!answer.converged() || summary.restitutions_lowered + summary.restitutions_shared > 0) continue;
    for (std::size_t i = 0; i < problem.contact_key.size(); ++i) {
      const Vector3 n = vector_at(problem.contact_normal, i);
      const auto relative = [&](const auto& linear, const auto& angular) {
        Vector3 sum = Vector3::Zero();
        for (std::size_t side = 0; side < 2; ++side) {
          const std::uint32_t body = problem.contact_body[2 * i + side];
          const Vector3 arm = vector_at(problem.contact_point, i) - problem.bodies[body].pose.position;
          const Vector3 v = vector_at(linear, body) + vector_at(angular, body).cross(arm);
          sum += side == 0 ? Vector3(-v) : v;
        }
        return sum;
      };
      const double before = n.dot(relative(problem.trial_linear_velocity, problem.trial_angular_velocity));
      const Vector3 after = relative(answer.linear_velocity, answer.angular_velocity);
      const double e = problem.contact_material[kMaterialColumns * i + kRestitution];
      const double law = n.dot(after) - e * std::max(0.0, -before);
      const double normal = answer.impulse(i).dot(n);
      const Vector3 tangent = answer.impulse(i) - normal * n;
      const Vector3 slip = after - n.dot(after) * n;
      // 0 <= lambda_N _|_ n.v - e s >= 0, to what slow convergence leaves of speeds of order 10
      EXPECT_GE(law, -1e-9) << seed;
      EXPECT_LE(std::min(normal, law), 1e-9) << seed;
      // friction against the slip, on the rim of the cone where it slips
      if (slip.norm() > 1e-6 && normal > 1e-6) {
        EXPECT_LE((tangent + 0.3 * normal * slip.normalized()).norm(), 1e-6 * normal) << seed;
      }
    }
  }
}

// ---- the order of bodies

// Bodies of a hanging chain that two balls hit, without friction: one solution. Body k is written
// at place place[k].
SolverProblem struck_chain(const std::vector<std::uint32_t>& place) {
  const std::size_t count = place.size();
  std::vector<TestBody> bodies(count);
  for (std::size_t i = 0; i + 2 < count; ++i)
    bodies[i] = {.mass = 1.0 + 0.3 * static_cast<double>(i),
                 .moments = {0.1, 0.05, 0.2},
                 .pose = {{0.3 * static_cast<double>(i), -0.5 - static_cast<double>(i), 0},
                          exp_rotation({0.1 * static_cast<double>(i), 0.2, 0})},
                 .angular = {0.1, 0, 0.3}};
  for (std::size_t i = count - 2; i < count; ++i)
    bodies[i] = {.mass = 0.5,
                 .pose = {{-1.0, -0.5 - static_cast<double>(i - count + 2), 0}, Quaternion::Identity()},
                 .linear = {3.0, 0.2, -0.1}};
  SolverProblem problem;
  std::vector<TestBody> placed(count);
  for (std::size_t i = 0; i < count; ++i) placed[place[i]] = bodies[i];
  for (const TestBody& body : placed) problem.add_body(body);
  problem.make_trial({0, -9.81, 0});
  for (std::uint32_t i = 0; i + 2 < count; ++i) {
    const std::uint32_t above = i == 0 ? kNone : place[i - 1];
    const Vector3 anchor(0.3 * static_cast<double>(i), -static_cast<double>(i), 0.1);
    problem.add_discrepancy(above, place[i], problem.joint_at(above, place[i], anchor));
  }
  for (std::uint32_t i = 0; i < 2; ++i)
    problem.add_contact({.body1 = place[count - 2 + i],
                         .body2 = place[i],
                         .normal = Vector3::UnitX(),
                         .point = {-0.5, -0.5 - static_cast<double>(i), 0.05},
                         .depth = 0.03,
                         .restitution = 0.5,
                         .key = i});
  return problem;
}

TEST(SequentialOrder, PermutingTheBodiesPermutesTheAnswer) {
  const std::vector<std::uint32_t> plain = {0, 1, 2, 3, 4};
  const std::vector<std::uint32_t> mixed = {3, 0, 4, 2, 1};
  const SolverAnswer a = struck_chain(plain).solve(SequentialSolver(SequentialSettings{100000, 1.0}));
  const SolverAnswer b = struck_chain(mixed).solve(SequentialSolver(SequentialSettings{100000, 1.0}));
  ASSERT_TRUE(a.converged());
  ASSERT_TRUE(b.converged());
  EXPECT_GT(a.impulse(0).norm(), 0.1);
  for (std::size_t i = 0; i < plain.size(); ++i) {
    // speeds of order 3, changes of 1e-13 a sweep at the end
    EXPECT_LE((a.velocity(i) - b.velocity(mixed[i])).norm(), 1e-11);
    EXPECT_LE((a.turning(i) - b.turning(mixed[i])).norm(), 1e-11);
    EXPECT_LE((a.translation(i) - b.translation(mixed[i])).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace gravitas
