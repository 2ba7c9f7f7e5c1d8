// Jumps of reactions that an extrapolation does not see (extrapolated.cc): friction that turns back, a drive that reaches its
// speed, a rope that comes taut in the first inner step of every attempt. What acts where that step ends then acts all of it,
// in each of them alike, and the results agree on what is wrong by the jump times the time until it.
//
// Shorter inner steps, each an eighth of the one before, tell it: those that end before the jump miss of the change of
// velocities that the attempts foretell as much as the jump makes in their time, and the shorter the less. What a smooth motion
// misses, since its changes are no polynomial of the step, is prod(1 - s/h) of the attempts' steps h in a step s: the shorter
// the more; and so is what closes a gap of rounding. Trials so short that a gap within the accuracy stays open tell nothing.
//
// A jump in the last inner step of every attempt is in the first one of the coarsest, which is the whole part. What the attempts
// foretell of no time at all is then not nought, but would be without the coarsest; nor do trials find that much to put right.
#include <algorithm>
#include <cmath>

#include "kernel/environment.h"
#include "kernel/simulators/location.h"

namespace gravitas::kernel {
namespace {

constexpr double kShorterTrial = 8.0;
constexpr double kSeen = 0.1;     // of the accuracy: seven eighths of an eighth of the jump shows in a trial, at least
constexpr double kOfError = 2.0;  // that the extrapolation leaves
constexpr double kRounding = 1e-12;       // m/s or rad/s
constexpr double kShortestTrial = 1e-10;  // of the part
constexpr double kUncertain = 0.25;       // share of what a smooth motion, or the coarsest attempt, misses

// rad/m: by how much a turn puts a slip right. Points of a shape are within its reach; without one joints hold, at any arm: one
// where the push turns the body as much as it moves it takes most.
double turn_of_slip(const Model& model, std::uint32_t body) {
  if (model.bound[body].reach > 0.0) return 1.0 / model.bound[body].reach;
  const double mass = model.inverse_mass[body], most = vector_at(model.inverse_inertia.span(), body).maxCoeff();
  return mass > 0.0 ? 0.5 * std::sqrt(most / mass) : 0.0;
}

}  // namespace

// Of what is redundant solvers go on with the solution that they are given, and find another from one of a step of another length, by
// which friction that goes by it would seem to jump. So all that begins where a part does is given what an attempt before found there.
bool Environment::make_piece(double begin, double length, std::uint32_t i, std::uint32_t pieces) {
  const double from = i * length / pieces, to = (i + 1) * length / pieces;
  guess_.first.clear();  // of no contacts
  if (i == 0) guess_ = first_impulses_;
  begin_inner_step(begin + from, to - from);
  return make_next_state();
}

// Of what is awake, in the inner step that has been made; scales_, what an accuracy of 1 lets each of them be that puts right what
// the start misses: a slip is, by a turn that is its speed over an arm; and pressed_, the pairs that push each other, in rising order.
void Environment::find_changes(std::vector<double>* changes) {
  changes->clear(), scales_.clear();
  const auto add = [&](const Column<double>& from, const Column<double>& to, bool turns) {
    for (std::size_t k = 0; k < to.size(); ++k) {
      const auto body = static_cast<std::uint32_t>(k / 3);
      changes->push_back(is_awake(body) ? to[k] - from[k] : 0.0);
      scales_.push_back(std::max({1.0, vector_at(from.span(), body).norm(), turns ? turn_of_slip(model_, body) : 0.0}));
    }
  };
  add(start_linear_velocity(), states_[back_].linear_velocity, false);
  add(start_angular_velocity(), states_[back_].angular_velocity, true);
  pressed_.clear();
  for (std::size_t i = 0; i < data_.contact_key.size(); ++i)
    if (!vector_at(data_.contact_impulse.span(), i).isZero(0.0))
      pressed_.push_back({data_.contact_body[2 * i], data_.contact_body[2 * i + 1]});
  std::ranges::sort(pressed_);
}

// Has the inner step that has been made left a pair apart that the attempts press together, and that starts at rest on each other
// within the accuracy?
bool Environment::lets_go() const {
  for (std::size_t i = 0; i < data_.contact_key.size(); ++i) {
    const std::array pair = {data_.contact_body[2 * i], data_.contact_body[2 * i + 1]};
    if (std::ranges::binary_search(pressed_, pair) || !std::ranges::binary_search(pressed_by_attempts_, pair)) continue;
    const Vector3 start =
        contact_velocity(data_, i, data_.trial_position, start_linear_velocity(), start_angular_velocity());
    if (gap_at(i, states_[back_]) <= description_.accuracy &&
        std::fabs(vector_at(data_.contact_normal.span(), i).dot(start)) <= description_.accuracy)
      return true;
  }
  return false;
}

// After attempts in `first` to `pieces` inner steps, two at least, which left an error of the extrapolation. The state is where
// the trials end.
bool Environment::hides_jump(double begin, double length, std::uint32_t first, std::uint32_t pieces, double error) {
  const std::size_t front = front_, back = back_;
  const double fine_step = length / pieces;
  const auto foretold = [&](std::size_t k, double step, std::uint32_t from) {
    // Aitken and Neville's, of the attempts `from` on; what the start misses of its laws within the accuracy is put right in any step
    double changes[kMostPieces];
    for (std::uint32_t n = from; n <= pieces; ++n) {
      changes[n - 1] = first_changes_[n - 1][k];
      for (std::uint32_t m = n - 1; m >= from; --m)
        changes[m - 1] = changes[m] + (changes[m] - changes[m - 1]) * (step * n - length) / (length - length * n / m);
    }
    return changes[from - 1];
  };
  const auto of_smooth = [&](double step) {
    double product = 1.0;
    for (std::uint32_t n = first; n <= pieces; ++n) product *= 1.0 - step * n / length;
    return product;
  };
  const double allowed = std::max(kSeen * description_.accuracy + kOfError * error, kRounding);
  double step = fine_step / kShorterTrial;
  missed_.clear();
  for (double largest = 2.0 * allowed; largest > allowed && step > kShortestTrial * length; step /= kShorterTrial) {
    front_ = front, back_ = back;
    if (!make_piece(begin, step, 0, 1) || must_restart_) return true;
    find_changes(&trial_changes_);
    if (lets_go()) return false;
    const bool is_first = missed_.empty();
    missed_.resize(trial_changes_.size(), 0.0);
    const double kept = of_smooth(step * kShorterTrial) / of_smooth(step);
    largest = 0.0;
    for (std::size_t k = 0; k < trial_changes_.size(); ++k) {
      const double expected = foretold(k, step, first), missed = trial_changes_[k] - expected;
      largest = std::max({largest, std::fabs(trial_changes_[k]), std::fabs(expected - foretold(k, 0.0, first))});
      const double of_jump = missed_[k] - kept * missed;
      if (!is_first && std::fabs(of_jump) > std::max(allowed, kUncertain * std::fabs(missed)) &&
          std::fabs(missed_[k]) > std::fabs(missed))
        return true;
      missed_[k] = missed;
    }
  }
  if (pieces < first + 2) return false;
  for (std::size_t k = 0; k < trial_changes_.size(); ++k) {
    const double of_no_time = std::fabs(foretold(k, 0.0, first)), of_finer = std::fabs(foretold(k, 0.0, first + 1));
    if (of_no_time > allowed && std::max(of_finer, std::fabs(trial_changes_[k])) < kUncertain * of_no_time) return true;
  }
  return false;
}

}  // namespace gravitas::kernel
