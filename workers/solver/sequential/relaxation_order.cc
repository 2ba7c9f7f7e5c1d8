#include "workers/solver/sequential/relaxation_order.h"

#include <algorithm>

namespace gravitas {
namespace {

constexpr std::size_t kMostNeighbours = 64;

// Multipliers, then x.
class SweptBlocks final : public SweptState {
 public:
  SweptBlocks(const std::array<RelaxationBlocks*, 2>& parts, BodyMotion* x) : parts_(parts), x_(*x) {}

  void read(std::vector<double>* state) const override {
    state->clear();
    for (const RelaxationBlocks* part : parts_) part->append_multipliers(state);
    double* next = append(6 * x_.size(), state);
    for (const Twist& twist : x_) {
      Vector3::Map(next) = twist.linear, Vector3::Map(next + 3) = twist.angular;
      next += 6;
    }
  }
  void read_responses(std::vector<double>* responses) const override {
    responses->clear();
    for (const RelaxationBlocks* part : parts_) part->append_responses(responses);
  }
  void write(const std::vector<double>& state) override {
    const double* from = state.data();
    for (RelaxationBlocks* part : parts_) from = part->take_multipliers(from);
    for (Twist& twist : x_) {
      twist.linear = Vector3::Map(from), twist.angular = Vector3::Map(from + 3);
      from += 6;
    }
  }

 private:
  const std::array<RelaxationBlocks*, 2>& parts_;
  BodyMotion& x_;
};

}  // namespace

void RelaxationSweep::begin(const SolverBodies& bodies, std::array<RelaxationBlocks*, 2> parts) {
  parts_ = parts;
  acceleration_.forget();
  if (order_ == RelaxationOrder::kGiven) return;
  places_.clear();
  at_body_.resize(bodies.count() + 1);
  for (std::vector<std::uint32_t>& blocks : at_body_) blocks.clear();
  for (RelaxationBlocks* part : parts_) {
    for (std::size_t block = 0; block < part->block_count(); ++block) {
      for (const std::uint32_t body : part->bodies_of(block))
        if (bodies[body].is_pushed()) at_body_[body].push_back(static_cast<std::uint32_t>(places_.size()));
      places_.push_back({part, block});
    }
  }
}

double RelaxationSweep::sweep(const SolverBodies& bodies, BodyMotion& x) {
  if (!is_accelerated_ || factor_ != 1.0) return sweep_once(bodies, x);
  SweptBlocks swept(parts_, &x);
  acceleration_.go_ahead(&swept);
  const double change = sweep_once(bodies, x);
  acceleration_.note(swept, change);
  return change;
}

double RelaxationSweep::sweep_once(const SolverBodies& bodies, BodyMotion& x) {
  switch (order_) {
    case RelaxationOrder::kDeepestFirst:
      return sweep_deepest_first(bodies, x);
    case RelaxationOrder::kSimultaneous:
      return sweep_simultaneously(bodies, x);
    case RelaxationOrder::kGiven:
      break;
  }
  return sweep_given(bodies, x);
}

double RelaxationSweep::largest_error(const BodyMotion& x) const {
  double largest = 0.0;
  for (const RelaxationBlocks* part : parts_)
    for (std::size_t block = 0; block < part->block_count(); ++block)
      largest = std::max(largest, part->error_of(block, x));
  return largest;
}

double RelaxationSweep::sweep_given(const SolverBodies& bodies, BodyMotion& x) const {
  double change = 0.0;
  for (RelaxationBlocks* part : parts_)
    for (std::size_t block = 0; block < part->block_count(); ++block)
      change = std::max(change, part->relax(block, factor_, bodies, x));
  return change;
}

double RelaxationSweep::sweep_deepest_first(const SolverBodies& bodies, BodyMotion& x) {
  visited_.assign(places_.size(), 0);
  error_.clear();
  candidates_.clear();
  for (const Place& place : places_) {
    const double error = place.part->error_of(place.block, x);
    candidates_.push_back({error, static_cast<std::uint32_t>(error_.size())});
    error_.push_back(error);
  }
  std::make_heap(candidates_.begin(), candidates_.end());
  double change = 0.0;
  while (!candidates_.empty()) {
    std::pop_heap(candidates_.begin(), candidates_.end());
    const Candidate next = candidates_.back();
    candidates_.pop_back();
    // others of the same block have overtaken or replaced it
    if (visited_[next.block] != 0 || next.error != error_[next.block]) continue;
    visited_[next.block] = 1;
    const Place& place = places_[next.block];
    const double asked = place.part->relax(place.block, factor_, bodies, x);
    change = std::max(change, asked);
    if (asked == 0.0) continue;
    for (const std::uint32_t body : place.part->bodies_of(place.block)) {
      if (at_body_[body].size() > kMostNeighbours) continue;
      for (const std::uint32_t neighbour : at_body_[body]) {
        if (visited_[neighbour] != 0) continue;
        const double error = places_[neighbour].part->error_of(places_[neighbour].block, x);
        if (error == error_[neighbour]) continue;
        error_[neighbour] = error;
        candidates_.push_back({error, neighbour});
        std::push_heap(candidates_.begin(), candidates_.end());
      }
    }
  }
  return change;
}

double RelaxationSweep::sweep_simultaneously(const SolverBodies& bodies, BodyMotion& x) {
  start_ = x;
  double change = 0.0;
  for (const Place& place : places_) {
    const auto [body1, body2] = place.part->bodies_of(place.block);
    const std::size_t sharing = std::max(at_body_[body1].size(), at_body_[body2].size());
    const Twist sum1 = x[body1];
    const Twist sum2 = x[body2];
    x[body1] = start_[body1];
    x[body2] = start_[body2];
    const double share = factor_ / static_cast<double>(std::max<std::size_t>(1, sharing));
    change = std::max(change, place.part->relax(place.block, share, bodies, x));
    const auto add = [&](const Twist& sum, std::uint32_t body) {
      x[body].linear = sum.linear + (x[body].linear - start_[body].linear);
      x[body].angular = sum.angular + (x[body].angular - start_[body].angular);
    };
    add(sum1, body1);
    add(sum2, body2);
  }
  return change;
}

}  // namespace gravitas
