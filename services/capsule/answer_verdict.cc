#include "services/capsule/answer_verdict.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "plugin_sdk/answer_checks.h"
#include "plugin_sdk/body.h"
#include "plugin_sdk/checks.h"
#include "plugin_sdk/wrench_jacobian.h"

namespace gravitas::capsule {
namespace {

// The two messages of a call.
struct Messages {
  const MessageColumns& request;
  const MessageColumns& reply;
};

std::string not_finite(const stage::MethodInfo& method, const MessageColumns& reply) {
  for (const stage::ColumnInfo& info : method.reply) {
    if (info.type != stage::ElementType::kF64) continue;
    if (const std::size_t index = first_not_finite(reply.f64(info.name)); index != kNoRow)
      return fmt::format("{} of row {} is not finite", info.name, index / info.components);
  }
  return {};
}

std::string wrong_trial_state(const Messages& of) {
  if (const std::size_t row = first_not_unit(of.reply.f64("orientation"), 4); row != kNoRow)
    return fmt::format("orientation of row {} is not of unit length", row);
  const std::size_t moved = first_changed_body(of.request.u32("flags"), kMovable | kKinematic, [&] {
    const auto pair = [&](const char* name) { return ColumnPair{of.reply.f64(name), of.request.f64(name)}; };
    return std::array{pair("position"), pair("orientation"), pair("linear_velocity"), pair("angular_velocity")};
  });
  return moved == kNoRow ? std::string() : fmt::format("it moved the immovable body of row {}", moved);
}

SolutionColumns solution_of(const MessageColumns& reply) {
  return {reply.f64("linear_velocity"),     reply.f64("angular_velocity"),       reply.f64("pose_change"),
          reply.f64("discrepancy_impulse"), reply.f64("discrepancy_correction"), reply.f64("contact_impulse"),
          reply.f64("contact_correction"),  reply.f64("contact_direction"),      reply.f64("contact_turning"),
          reply.u32("stop_reason")[0]};
}

std::string wrong_solution(const Messages& of) {
  const std::span<const std::uint32_t> flags = of.request.u32("flags");
  const std::size_t pushed = first_changed_body(flags, kMovable, [&] {
    return std::array{ColumnPair{of.reply.f64("linear_velocity"), of.request.f64("trial_linear_velocity")},
                      ColumnPair{of.reply.f64("angular_velocity"), of.request.f64("trial_angular_velocity")}};
  });
  const std::span<const double> change = of.reply.f64("pose_change");
  for (std::size_t i = 0; i < flags.size(); ++i)
    if (i == pushed || ((flags[i] & kMovable) == 0 && std::ranges::count(change.subspan(6 * i, 6), 0.0) != 6))
      return fmt::format("it pushed the body of row {}, which nothing can push", i);
  return check_multipliers(solution_of(of.reply), of.request.f64("contact_material"), of.request.u32("mode")).text;
}

// Joints connect all movable bodies, at most.
std::uint64_t most_reaction_blocks(const MessageColumns& request) {
  const auto movable = static_cast<std::uint64_t>(
      std::ranges::count_if(request.u32("flags"), [](std::uint32_t flags) { return (flags & kMovable) != 0; }));
  return movable <= kMostJoinedBodies ? movable * movable : 0;
}

// Structure and numbers, beyond rows and what is not finite.
std::string wrong_rows(stage::Method method, const Messages& of) {
  const MessageColumns &request = of.request, &reply = of.reply;
  switch (method) {
    case stage::Method::kSpacePairs:
      return check_pairs(reply.u32("pair"), request.u32("flags")).text;
    case stage::Method::kCollisionManifolds:
      return check_contact_rows(reply.u32("contact_pair"), reply.u32("feature"), reply.f64("normal"),
                                request.u32("pair").size() / 2)
          .text;
    case stage::Method::kCollisionTimesOfImpact:
      return check_impact_rows(reply.u32("impact_pair"), reply.f64("fraction"), reply.f64("normal"),
                               request.u32("pair").size() / 2)
          .text;
    case stage::Method::kConstraintBind:
      return check_bound_begin(reply.u32("bound_begin"), reply.f64("bound").size()).text;
    case stage::Method::kConstraintDiscrepancies:
      return check_discrepancy_rows(reply.u32("constraint"), request.u32("intact"), discrepancy_columns(reply)).text;
    case stage::Method::kForceWrenches:
      return check_wrench_flags(reply.u32("flags")).text;
    case stage::Method::kForceJacobians:
      return check_block_rows("block_body", reply.u32("block_body"), request.f64("position").size() / 3,
                              kMostBlocksOfApplication * request.u32("application").size() / 2)
          .text;
    case stage::Method::kIntegratorIntegrate:
      return wrong_trial_state(of);
    case stage::Method::kSolverSolve:
      return wrong_solution(of);
    case stage::Method::kSolverReactionJacobians:
      return check_block_rows("reaction_body", reply.u32("reaction_body"), request.u32("flags").size(),
                              most_reaction_blocks(request))
          .text;
    default:
      return {};
  }
}

std::string broken_law(stage::Method method, const Messages& of, const WrenchRange& told) {
  const std::vector<gravitas_column> asked = of.request.plain();
  const MessageColumns& reply = of.reply;
  switch (method) {
    case stage::Method::kSpacePairs:
      return PairCheck().check(stage::SpacePairsRequest(asked.data()), reply.u32("pair"));
    case stage::Method::kCollisionManifolds:
      return check_contacts(stage::CollisionManifoldsRequest(asked.data()),
                            {reply.u32("contact_pair"), reply.f64("normal"), reply.f64("point"), reply.f64("depth"),
                             reply.f64("relative_velocity")});
    case stage::Method::kIntegratorIntegrate:
      return check_integration(stage::IntegratorIntegrateRequest(asked.data()),
                               {reply.f64("position"), reply.f64("orientation"), reply.f64("linear_velocity"),
                                reply.f64("angular_velocity")},
                               told);
    case stage::Method::kSolverSolve:
      return SolutionCheck().check(stage::SolverSolveRequest(asked.data()), solution_of(reply));
    default:
      return {};
  }
}

}  // namespace

std::string verdict_on(stage::Method method, const MessageColumns& request, const conformance::Answer& answer,
                       const WrenchRange& told, bool with_physics) {
  const stage::MethodInfo& info = stage::method_info(method);
  const Messages of{request, answer.columns};
  std::string wrong = check_rows(info, request.counts(), answer.columns.counts());
  if (wrong.empty()) wrong = not_finite(info, answer.columns);
  if (wrong.empty()) wrong = wrong_rows(method, of);
  if (!wrong.empty()) return "its answer is wrong: " + wrong;
  const std::string broken = with_physics ? broken_law(method, of, told) : std::string();
  return broken.empty() ? broken : "its answer breaks a law: " + broken;
}

}  // namespace gravitas::capsule
