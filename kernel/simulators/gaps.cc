// How far apart two surfaces that meet in a trial are in another state, and which pairs touch where an inner step ends.
#include <algorithm>
#include <array>
#include <limits>

#include "kernel/environment.h"
#include "kernel/simulators/location.h"
#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/merged_rows.h"

namespace gravitas::kernel {
namespace {

// A pair touches if a contact of it carries an impulse, or its gap is below this share of the margin; where impacts are
// located, a step that ends just before one touches nothing.
constexpr double kTouchingShare = 1e-3, kLocatedShare = 1e-7;

// From the surface point of a contact's first body to that of its second, where they are in another state.
Vector3 between_surfaces(const StepData& data, std::size_t contact, const State& state) {
  const Vector3 point = vector_at(data.contact_point.span(), contact);
  const Vector3 normal = vector_at(data.contact_normal.span(), contact);
  const Vector3 half = 0.5 * data.contact_depth[contact] * normal;
  const auto carry = [&](const Vector3& from, std::uint32_t body) {
    return carried(from,
                   {vector_at(data.trial_position.span(), body), quaternion_at(data.trial_orientation.span(), body)},
                   {vector_at(state.position.span(), body), quaternion_at(state.orientation.span(), body)});
  };
  return carry(point - half, data.contact_body[2 * contact + 1]) - carry(point + half, data.contact_body[2 * contact]);
}

// Of a body's extent along the normal, at most.
double half_width(const LocalBound& bound, const Quaternion& orientation, const Vector3& normal) {
  if (bound.reach == 0.0) return std::numeric_limits<double>::infinity();
  if (bound.kind != BoundKind::kBox) return bound.reach;
  const Quaternion box = orientation * bound.orientation;
  return std::min(bound.reach, (box.conjugate() * normal).cwiseAbs().dot(bound.half_extents));
}

}  // namespace

double InnerStep::start_overlap(std::size_t contact, const LocalBound& one, const LocalBound& two, bool surely) const {
  const Vector3 normal = vector_at(data.contact_normal.span(), contact);
  const Vector3 apart = between_surfaces(data, contact, before);
  const double depth = -normal.dot(apart);
  // what has come across may have been apart; what slid lay as deep
  if (!(depth > 0.0) || (surely && (apart + depth * normal).norm() > depth)) return 0.0;
  // a way out that is the longer of the two tells nothing: the step has led through the middle
  const auto width = [&](const LocalBound& bound, std::size_t side) {
    return half_width(bound, quaternion_at(before.orientation.span(), data.contact_body[2 * contact + side]), normal);
  };
  return depth > width(one, 0) + width(two, 1) ? 0.0 : depth;
}

double Environment::gap_at(std::size_t contact, const State& state) const {
  return vector_at(data_.contact_normal.span(), contact).dot(between_surfaces(data_, contact, state));
}

// Overlap of every contact at S_{n+1}, in the first step and after an edit where it begins, too, and the pairs that touch.
void Environment::find_touching() {
  const Column<std::uint32_t>&now = data_.touching, &before = front().touching;
  const InnerStep inner{inner_, data_, front(), back(), inner_end_time(), {}};
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
    if (begins)
      start_overlap_ = std::max(start_overlap_, inner.start_overlap(i, model_.bound[a], model_.bound[b], false));
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
