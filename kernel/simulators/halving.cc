// Where `Bisection` ends an inner step (§ 1.4): trials are halved until one ends just after a contact closes. It sees contacts at
// S* alone: what passes through within a trial is missed. Pairs that touch and do not fly up are the solver's.
//
// What closes on the way has a gap where the trial begins. The contact's own points tell it, carried back there along its normal;
// but where the normal turns on the way, as that of two balls that graze each other, they may tell of none though the pair was
// apart. So where a contact of a pair that did not touch has none, the pair is looked for at the beginning itself.
#include <vector>

#include "kernel/environment.h"
#include "kernel/simulators/location.h"

namespace gravitas::kernel {
namespace {

constexpr double kLead = 0.9999;  // of the way to an impact is one step, the rest another

}  // namespace

double Environment::bisect(const Trusted<TrialState>& trial, double begin, double length, bool is_near) {
  const double nothing = kTargetShare * margin_;
  const auto start_speed = [&](std::size_t contact) {
    return vector_at(data_.contact_normal.span(), contact)
        .dot(contact_velocity(data_, contact, data_.trial_position, start_linear_velocity(), start_angular_velocity()));
  };
  const auto find_contacts_at = [&](const Trusted<TrialState>& at) {
    look_up_contacts(find_contacts(bound_and_pair(at)));
  };
  const auto try_step = [&](double end) {
    begin_inner_step(begin, end);
    return integrate();
  };
  const auto contact_pair = [&](std::size_t contact) { return data_.contact_body.span().subspan(2 * contact, 2); };
  // pairs that overlap at the beginning, once one of them is asked for
  std::vector<std::uint32_t> overlapping, doubtful;
  bool knows_overlapping = false;
  const auto closes = [&](const Trusted<TrialState>& at) {
    find_contacts_at(at);
    doubtful.clear();
    std::span<const std::uint32_t> touching = front().touching.span();
    for (std::size_t i = 0; i < data_.contact_key.size(); ++i) {
      const bool touches = starts_with(contact_pair(i), &touching);
      // what rolls or slides on is the solver's, what flies up is not
      const bool goes_on = touches && start_speed(i) * data_.time_step[0] <= nothing;
      if (goes_on || data_.contact_depth[i] <= nothing) continue;
      if (gap_at(i, front()) > nothing) return true;
      if (!touches) doubtful.insert(doubtful.end(), contact_pair(i).begin(), contact_pair(i).end());
    }
    if (doubtful.empty()) return false;
    if (!knows_overlapping) {
      find_contacts_at(try_step(kFinest * length));
      for (std::size_t i = 0; i < data_.contact_key.size(); ++i)
        if (data_.contact_depth[i] > nothing)
          overlapping.insert(overlapping.end(), contact_pair(i).begin(), contact_pair(i).end());
      knows_overlapping = true;
    }
    std::span<const std::uint32_t> known = overlapping;
    for (std::size_t k = 0; k < doubtful.size(); k += 2)
      if (!starts_with(std::span(doubtful).subspan(k, 2), &known)) return true;
    return false;
  };
  if (!closes(trial)) return length;
  double clear = 0.0, closed = length;
  while (closed - clear > kFinest * length) {
    const double middle = 0.5 * (clear + closed);
    (closes(try_step(middle)) ? closed : clear) = middle;
  }
  return is_near || clear == 0.0 ? closed : kLead * clear;
}

}  // namespace gravitas::kernel
