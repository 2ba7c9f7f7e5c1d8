// Mechanisms, each by itself: what one does shows nothing of what else there is in the scene.
#include "plugin_sdk/solver/reactions.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/plugin.h"
#include "plugin_sdk/solver/islands.h"
#include "plugin_sdk/solver/reaction_solver.h"
#include "plugin_sdk/solver/request_check.h"
#include "plugin_sdk/wrench_jacobian.h"

namespace gravitas {
namespace {

void require_finite(double reaction) {
  if (!std::isfinite(reaction)) throw Refusal("a reaction is not finite: masses, velocities or forces overflow");
}

// Memory is all that stays of it.
class Mechanisms {
 public:
  // Returns the worst residual. The request must live until write() or differentiate().
  double solve(const stage::SolverReactionsRequest& request);
  void write(double residual, const stage::SolverReactionsReply& reply);
  void differentiate(const stage::SolverReactionJacobiansReply& reply);

 private:
  // Remembered as long as the same bodies meet.
  void find_islands();
  // Bodies that joints, or joints and forces, connect: by the first of them, and which have a joint.
  void connect_by_forces();

  const stage::SolverReactionsRequest* request_ = nullptr;
  std::vector<std::uint8_t> is_pushed_;  // by body
  std::vector<std::uint32_t> joined_;    // by joints, two a row
  IslandFinder finder_;
  std::span<const Island> islands_;
  std::vector<ReactionSolver> solvers_;  // those of the islands, and memory of others
  std::vector<std::uint32_t> places_;    // by body, among those of its island
  std::vector<Wrench> reactions_;
  std::vector<double> forces_;
  // of the Jacobian
  BodyUnion connected_{0};
  std::vector<std::uint32_t> mechanism_of_;  // by body; kNone: of none
  std::vector<std::vector<std::uint32_t>> members_, blocks_by_;
  std::vector<std::uint8_t> is_jointed_;
  std::vector<JacobianBlock> blocks_;
  std::vector<std::uint32_t> touched_;
};

double Mechanisms::solve(const stage::SolverReactionsRequest& request) {
  request_ = &request;
  find_islands();
  double residual = 0.0;
  for (std::size_t k = 0; k < islands_.size(); ++k) {
    const double missed = solvers_[k].solve(request);
    require_finite(missed);
    residual = std::max(residual, missed);
  }
  return residual;
}

void Mechanisms::find_islands() {
  const std::size_t count = request_->flags().size();
  bool is_known = is_pushed_.size() == count && std::ranges::equal(joined_, request_->discrepancy_body());
  is_pushed_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint8_t now = is_pushed(*request_, i) ? 1 : 0;
    is_known = is_known && is_pushed_[i] == now;
    is_pushed_[i] = now;
  }
  if (is_known) return;
  joined_.clear(), islands_ = {};
  islands_ = finder_.find(*request_);
  if (solvers_.size() < islands_.size()) solvers_.resize(islands_.size());
  places_.resize(count);
  for (const Island& island : islands_)
    for (std::uint32_t i = 0; i < island.bodies.size(); ++i) places_[island.bodies[i]] = i;
  for (std::size_t k = 0; k < islands_.size(); ++k) solvers_[k].set_mechanism(*request_, islands_[k], places_);
  joined_.assign(request_->discrepancy_body().begin(), request_->discrepancy_body().end());
}

void Mechanisms::write(double residual, const stage::SolverReactionsReply& reply) {
  reactions_.assign(request_->flags().size(), {});
  forces_.assign(3 * request_->mode().size(), 0.0);
  for (std::size_t k = 0; k < islands_.size(); ++k) solvers_[k].write(&reactions_, &forces_);
  for (const Wrench& reaction : reactions_)
    reply.reaction().push(reaction.force.x(), reaction.force.y(), reaction.force.z(), reaction.torque.x(),
                          reaction.torque.y(), reaction.torque.z());
  for (const double force : forces_) {
    require_finite(force);
    reply.discrepancy_force().push(force);
  }
  reply.residual().set(residual);
}

void Mechanisms::connect_by_forces() {
  const auto count = static_cast<std::uint32_t>(request_->flags().size());
  connected_.reset(count);
  mechanism_of_.assign(count, kNone);
  for (std::uint32_t k = 0; k < islands_.size(); ++k) {
    for (const std::uint32_t i : islands_[k].bodies) {
      mechanism_of_[i] = k;
      connected_.join(islands_[k].bodies.front(), i);
    }
  }
  blocks_by_.assign(count, {});
  for (std::uint32_t b = 0; b < request_->block_body().size() / 2; ++b) {
    const std::uint32_t body = request_->block_body()[2 * b], by = request_->block_body()[2 * b + 1];
    if (is_pushed_[body] == 0 || is_pushed_[by] == 0) continue;
    connected_.join(body, by);
    blocks_by_[by].push_back(b);
  }
  members_.assign(count, {}), is_jointed_.assign(count, 0);
  for (std::uint32_t i = 0; i < count; ++i) {
    if (is_pushed_[i] == 0) continue;
    members_[connected_.root(i)].push_back(i);
    if (mechanism_of_[i] != kNone) is_jointed_[connected_.root(i)] = 1;
  }
}

void Mechanisms::differentiate(const stage::SolverReactionJacobiansReply& reply) {
  connect_by_forces();
  const auto count = static_cast<std::uint32_t>(request_->flags().size());
  for (std::size_t k = 0; k < islands_.size(); ++k) solvers_[k].start_differentiating();
  blocks_.resize(count);
  bool is_empty = true;
  for (std::uint32_t by = 0; by < count; ++by) {
    if (is_pushed_[by] == 0 || is_jointed_[connected_.root(by)] == 0) continue;
    const std::vector<std::uint32_t>& felt = members_[connected_.root(by)];
    for (const std::uint32_t i : felt) blocks_[i].setZero();
    touched_ = {mechanism_of_[by]};
    for (const std::uint32_t b : blocks_by_[by]) touched_.push_back(mechanism_of_[request_->block_body()[2 * b]]);
    std::ranges::sort(touched_);
    touched_.erase(std::unique(touched_.begin(), touched_.end()), touched_.end());
    for (const std::uint32_t k : touched_)
      if (k != kNone) solvers_[k].differentiate(by, blocks_by_[by], &blocks_);
    for (const std::uint32_t i : felt) {
      if (!blocks_[i].allFinite()) throw Refusal("the Jacobian of a reaction is not finite: masses or forces overflow");
      reply.reaction_body().push(i, by);
      for (Eigen::Index n = 0; n < blocks_[i].size(); ++n) reply.reaction_block().push(blocks_[i].data()[n]);
      is_empty = false;
    }
  }
  // no block at all would be no answer
  if (!is_empty || count == 0) return;
  reply.reaction_body().push(0, 0);
  for (std::size_t n = 0; n < kBlockNumbers; ++n) reply.reaction_block().push(0.0);
}

Mechanisms& mechanisms() {
  thread_local Mechanisms all;
  return all;
}

}  // namespace

void solve_reactions(const stage::SolverReactionsRequest& request, const stage::SolverReactionsReply& reply) {
  check_reactions_request(request);
  const double residual = mechanisms().solve(request);
  mechanisms().write(residual, reply);
}

void differentiate_reactions(const stage::SolverReactionsRequest& request,
                             const stage::SolverReactionJacobiansReply& reply) {
  check_reactions_request(request);
  mechanisms().solve(request);
  mechanisms().differentiate(reply);
}

}  // namespace gravitas
