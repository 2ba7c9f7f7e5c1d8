// How far apart two surfaces that meet in a trial are in another state, and which pairs touch where an inner step ends.
#include <algorithm>
#include <array>

#include "kernel/environment.h"
#include "kernel/simulators/location.h"
#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/merged_rows.h"

namespace gravitas::kernel {
namespace {

// A pair touches if a contact of it carries an impulse, or its gap is below this share of the margin; where impacts are
// located, a step that ends just before one touches nothing.
constexpr double kTouchingShare = 1e-3, kLocatedShare = 1e-7;

}  // namespace

double Environment::gap_at(std::size_t contact, const State& state) const {
  const Vector3 point = vector_at(data_.contact_point.span(), contact);
  const Vector3 normal = vector_at(data_.contact_normal.span(), contact);
  const Vector3 half = 0.5 * data_.contact_depth[contact] * normal;
  const auto carry = [&](const Vector3& from, std::uint32_t body) {
    return carried(from, pose_of(data_.trial_position, data_.trial_orientation, body),
                   pose_of(state.position, state.orientation, body));
  };
  return normal.dot(carry(point - half, data_.contact_body[2 * contact + 1]) -
                    carry(point + half, data_.contact_body[2 * contact]));
}

// Overlap of every contact at S_{n+1}, in the first step and after an edit where it begins, too, and the pairs that touch.
void Environment::find_touching() {
  const Column<std::uint32_t>&now = data_.touching, &before = front().touching;
  // room for all: what grows moves, and spans are held
  now.resize(data_.contact_body.size());
  now.resize(0);
  const double share = locates_events() ? kLocatedShare : kTouchingShare;
  std::span<const std::uint32_t> touched = before.span();
  if (inner_ == 0) start_overlap_ = 0.0;
  for (std::size_t i = 0; i < data_.contact_key.size(); ++i) {
    const std::uint32_t a = data_.contact_body[2 * i], b = data_.contact_body[2 * i + 1];
    const double gap = gap_at(i, back());
    const bool begins = is_anew_ && inner_ == 0 && data_.contact_depth[i] > 0.0;
    if (begins) start_overlap_ = std::max(start_overlap_, -gap_at(i, front()));
    figures_.penetration = std::max(figures_.penetration, -gap);
    const bool touched_before = starts_with(data_.contact_body.span().subspan(2 * i, 2), &touched);
    // what touched, and opened no further in a very short inner step, is no flight
    const auto goes_on = [&] {
      return touched_before && gap <= kTouchingShare * margin_ && gap - gap_at(i, front()) <= share * margin_;
    };
    const bool touches = gap <= share * margin_ || !vector_at(data_.contact_impulse.span(), i).isZero(0.0) || goes_on();
    const std::uint64_t size = now.size();
    if (!touches || (size > 0 && now[size - 2] == a && now[size - 1] == b)) continue;
    now.resize(size + 2);
    now[size] = a, now[size + 1] = b;
  }
  figures_.penetration = std::max(figures_.penetration, start_overlap_);
  const auto key = [](const Column<std::uint32_t>& pair) {
    return [&](std::size_t i) { return std::array{pair[2 * i], pair[2 * i + 1]}; };
  };
  const auto goes_on = [&](std::size_t i) { return !is_awake(before[2 * i]) && !is_awake(before[2 * i + 1]); };
  merge_rows(now.size() / 2, key(now), sleepers_ > 0 ? before.size() / 2 : 0, key(before), goes_on, &merged_);
  copy_rows(merged_, 2, now, before, back().touching);
}

}  // namespace gravitas::kernel
