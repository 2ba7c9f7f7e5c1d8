// Sequential solves islands by themselves: whatever is beside one, and on whatever thread, its answer has the same bits.
#include "workers/solver/sequential/sequential_islands.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "plugin_sdk/thread_pool.h"
#include "tests/workers/solver/solver_problem.h"

namespace gravitas {
namespace {

struct OnThreads {
  SequentialIslands islands;
  ThreadPool pool;

  explicit OnThreads(std::uint32_t threads, const SequentialSettings& settings = {})
      : islands(settings), pool(threads) {}
  void solve(const stage::SolverSolveRequest& request, const stage::SolverSolveReply& reply) {
    gravitas_host plain{};
    plain.context = &pool;
    plain.mark_progress = [](void*) {};
    plain.parallel_for = [](void* context, std::uint64_t count, void (*body)(void*, std::uint64_t, std::uint64_t),
                            void* argument) { static_cast<ThreadPool*>(context)->parallel_for(count, body, argument); };
    islands.solve(request, reply, Host(&plain));
  }
};

// Bodies and rows of an island among others.
struct Placed {
  std::vector<std::uint32_t> bodies;
  std::size_t first_joint = 0, first_contact = 0, joints = 0, contacts = 0;
};

// A chain of 1 + which % 4 bodies, the last of which hits the floor, turning.
struct Chains {
  SolverProblem problem;
  std::vector<Placed> chains;

  explicit Chains(const std::vector<std::uint32_t>& which) {
    const std::uint32_t floor = problem.add_immovable();
    for (const std::uint32_t k : which) {
      Placed& chain = chains.emplace_back();
      for (std::uint32_t i = 0; i <= k % 4; ++i)
        chain.bodies.push_back(problem.add_body({.mass = 1.0 + 0.1 * k,
                                                 .moments = Vector3(0.1, 0.2, 0.15) * (1.0 + 0.1 * k),
                                                 .pose = {{10.0 * k + 0.9 * i, 0.5, 0}, Quaternion::Identity()},
                                                 .linear = {0.3, -1.0 - 0.01 * k, 0.1 * i},
                                                 .angular = Vector3(0.3, -0.2, 0.5) * (1.0 + i)}));
    }
    problem.make_trial({0, -9.81, 0});
    for (std::size_t c = 0; c < chains.size(); ++c) {
      Placed& chain = chains[c];
      chain.first_joint = problem.mode.size();
      chain.joints = chain.bodies.size() - 1;
      for (std::size_t i = 0; i + 1 < chain.bodies.size(); ++i) {
        const Vector3 middle =
            0.5 * (problem.bodies[chain.bodies[i]].pose.position + problem.bodies[chain.bodies[i + 1]].pose.position);
        problem.add_discrepancy(chain.bodies[i], chain.bodies[i + 1],
                                problem.joint_at(chain.bodies[i], chain.bodies[i + 1], middle));
      }
      chain.first_contact = problem.contact_key.size();
      chain.contacts = 2;
      const std::uint32_t last = chain.bodies.back();
      for (const double side : {-0.4, 0.3})
        problem.add_contact({.body1 = floor,
                             .body2 = last,
                             .point = problem.bodies[last].pose.position + Vector3(side, -0.5, 0.2),
                             .depth = 0.001,
                             .restitution = 0.3,
                             .static_friction = 0.5,
                             .dynamic_friction = 0.4,
                             .key = 100 * which[c] + (side > 0.0 ? 1U : 0U)});
    }
  }
};

std::vector<std::uint32_t> all_of(std::uint32_t count) {
  std::vector<std::uint32_t> which;
  for (std::uint32_t k = 0; k < count; ++k) which.push_back(k);
  return which;
}

void expect_same_bits(const Placed& a, const SolverAnswer& one, const Placed& b, const SolverAnswer& other) {
  const auto equal = [](const std::vector<double>& x, std::size_t from_x, const std::vector<double>& y,
                        std::size_t from_y, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) EXPECT_EQ(x[from_x + i], y[from_y + i]);
  };
  for (std::size_t i = 0; i < a.bodies.size(); ++i) {
    equal(one.linear_velocity, 3 * a.bodies[i], other.linear_velocity, 3 * b.bodies[i], 3);
    equal(one.angular_velocity, 3 * a.bodies[i], other.angular_velocity, 3 * b.bodies[i], 3);
    equal(one.pose_change, 6 * a.bodies[i], other.pose_change, 6 * b.bodies[i], 6);
  }
  equal(one.discrepancy_impulse, 3 * a.first_joint, other.discrepancy_impulse, 3 * b.first_joint, 3 * a.joints);
  equal(one.discrepancy_correction, 3 * a.first_joint, other.discrepancy_correction, 3 * b.first_joint, 3 * a.joints);
  equal(one.contact_impulse, 3 * a.first_contact, other.contact_impulse, 3 * b.first_contact, 3 * a.contacts);
  equal(one.contact_correction, a.first_contact, other.contact_correction, b.first_contact, a.contacts);
  equal(one.contact_direction, 3 * a.first_contact, other.contact_direction, 3 * b.first_contact, 3 * a.contacts);
}

const std::vector<SequentialSettings> kWays = {{},
                                               {.iterations = 3},
                                               {.order = RelaxationOrder::kDeepestFirst},
                                               {.relaxation_factor = 1.5},
                                               {.shock_propagation = ShockPropagation::kAlways}};

TEST(SequentialIslands, EachIsAnsweredAsIfItWereAlone) {
  constexpr std::uint32_t kIslands = 12;
  const Chains together(all_of(kIslands));
  for (const SequentialSettings& way : kWays) {
    const SolverAnswer answer = together.problem.solve(OnThreads(1, way));
    std::uint32_t most = 0;
    for (std::uint32_t k = 0; k < kIslands; ++k) {
      SCOPED_TRACE(k);
      const Chains alone({k});
      const SolverAnswer one = alone.problem.solve(OnThreads(1, way));
      expect_same_bits(together.chains[k], answer, alone.chains[0], one);
      most = std::max(most, one.iterations[0]);
    }
    EXPECT_EQ(answer.iterations[0], most);
  }
}

TEST(SequentialIslands, HaveTheSameBytesOnAnyNumberOfThreads) {
  const Chains many(all_of(300));
  for (const SequentialSettings& way : kWays) {
    const std::string bytes = many.problem.solve(OnThreads(1, way)).bytes();
    for (const std::uint32_t threads : {2U, 3U, 7U})
      EXPECT_EQ(many.problem.solve(OnThreads(threads, way)).bytes(), bytes) << threads;
  }
}

// What joints break by is told beside a chain whose sweeps are used up, too.
TEST(SequentialIslands, TellOfAContradictionBesideWhatIsUnfinished) {
  for (const bool has_chain : {false, true}) {
    SolverProblem problem;
    const auto left = problem.add_body({.linear = {-1, 0, 0}, .kinematic = true});
    const auto right = problem.add_body({.linear = {1, 0, 0}, .kinematic = true});
    const auto middle = problem.add_body({.mass = 2.0});
    std::vector<std::uint32_t> links;
    for (int i = 0; has_chain && i < 40; ++i)
      links.push_back(
          problem.add_body({.mass = i < 39 ? 1.0 : 1e4, .pose = {{9, -0.5 - i, 0}, Quaternion::Identity()}}));
    problem.make_trial({0, -9.81, 0});
    for (const auto end : {left, right})
      problem.add_discrepancy(end, middle, problem.joint_at(end, middle, Vector3::Zero()));
    std::uint32_t before = kNone;
    for (std::size_t i = 0; i < links.size(); before = links[i++])
      problem.add_discrepancy(before, links[i], problem.joint_at(before, links[i], {9, -static_cast<double>(i), 0}));
    const SolverAnswer answer = problem.solve(OnThreads(1, {.iterations = 20}));
    const auto reason = static_cast<StopReason>(answer.stop_reason[0]);
    EXPECT_TRUE(tells_contradiction(reason)) << stop_reason_name(reason);
    EXPECT_EQ(tells_unfinished(reason), has_chain) << stop_reason_name(reason);
  }
}

TEST(SequentialIslands, WithoutAnyBodiesKeepTheirVelocities) {
  SolverProblem problem;
  problem.add_immovable();
  const std::uint32_t free = problem.add_body({.linear = {1, 2, 3}, .angular = {0, 0, 4}});
  problem.make_trial({0, -9.81, 0});
  const SolverAnswer answer = problem.solve(OnThreads(1));
  EXPECT_EQ(answer.velocity(free), vector_at(problem.trial_linear_velocity, free));
  EXPECT_EQ(answer.stop_reason[0], static_cast<std::uint32_t>(StopReason::kNothingToDo));
}

}  // namespace
}  // namespace gravitas
