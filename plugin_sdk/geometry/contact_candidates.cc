// Collection and reduction of contact points.
//
// The reduction keeps extremes, by fixed rules (§ 4.3.2.19 samples at random, which would let a
// resting body rock and make the answer depend on a generator). A reduced manifold can hold the
// same wrenches as the full patch about as far as its four points span it.
#include "plugin_sdk/geometry/contact_candidates.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gravitas::collision {
namespace {

// a later score must beat the best one by this factor: symmetric patches give equal scores up to
// rounding
constexpr double kScoreGain = 1.0 + 1e-6;

using Span = const ContactPoint*;

// index of the largest score(contact), the first of equal ones; -1 if none exceeds `at_least`
template <typename Score>
int index_of_largest(Span contacts, int count, double at_least, const Score& score) {
  int best = -1;
  double best_score = at_least;
  for (int i = 0; i < count; ++i) {
    const double s = score(contacts[i]);
    if (s > (best < 0 ? best_score : best_score * kScoreGain)) {
      best = i;
      best_score = s;
    }
  }
  return best;
}

// signed doubled area of (p, q, x) seen against the normal
double area(const ContactPoint& p, const ContactPoint& q, const ContactPoint& x) {
  return (q.point - p.point).cross(x.point - p.point).dot(p.normal);
}

}  // namespace

int choose_extremes(std::span<const ContactPoint> all, double depth_tie, double merge_distance,
                    std::array<int, kManifoldCapacity>* out) {
  const Span contacts = all.data();
  const int count = static_cast<int>(all.size());
  int* chosen = out->data();
  const double deepest = std::max_element(all.begin(), all.end(), [](const ContactPoint& x, const ContactPoint& y) {
                           return x.depth < y.depth;
                         })->depth;
  int n = 0;
  for (int i = 0; i < count && n == 0; ++i) {
    if (contacts[i].depth >= deepest - depth_tie) chosen[n++] = i;
  }
  const ContactPoint& first = contacts[chosen[0]];

  const double smallest = merge_distance * merge_distance;
  const int far = index_of_largest(contacts, count, smallest,
                                   [&](const ContactPoint& x) { return (x.point - first.point).squaredNorm(); });
  if (far < 0) return n;
  chosen[n++] = far;
  const ContactPoint& second = contacts[far];

  // points on one line add nothing to its two ends
  const double thin = merge_distance * (second.point - first.point).norm();
  const int third_index =
      index_of_largest(contacts, count, thin, [&](const ContactPoint& x) { return std::fabs(area(first, second, x)); });
  if (third_index < 0) return n;
  chosen[n++] = third_index;
  const ContactPoint& third = contacts[third_index];

  const double turn = area(first, second, third) > 0.0 ? 1.0 : -1.0;
  const int outside = index_of_largest(contacts, count, thin, [&](const ContactPoint& x) {
    return -std::min({turn * area(first, second, x), turn * area(second, third, x), turn * area(third, first, x)});
  });
  if (outside >= 0) chosen[n++] = outside;
  return n;
}

void ContactCandidates::add(const ContactPoint& contact) {
  if (!(contact.depth >= -margin_)) return;
  const double merge = merge_distance_ * merge_distance_;
  int same = -1;
  for (int i = 0; i < count_ && same < 0; ++i) {
    if (contacts_[static_cast<std::size_t>(i)].feature == contact.feature) same = i;
  }
  for (int i = 0; i < count_ && same < 0; ++i) {
    const Vector3& point = contacts_[static_cast<std::size_t>(i)].point;
    if ((point - contact.point).squaredNorm() <= merge) same = i;
  }
  if (same >= 0) {
    ContactPoint& other = contacts_[static_cast<std::size_t>(same)];
    if (contact.depth > other.depth + depth_tie_) other = contact;
  } else if (count_ < kCapacity) {
    contacts_[static_cast<std::size_t>(count_++)] = contact;
  }
}

double ContactCandidates::deepest() const {
  double depth = -std::numeric_limits<double>::infinity();
  for (int i = 0; i < count_; ++i) {
    depth = std::max(depth, contacts_[static_cast<std::size_t>(i)].depth);
  }
  return depth;
}

void ContactCandidates::reduce_to(Manifold* out) const {
  std::array<ContactPoint, kCapacity> sorted;
  std::copy_n(contacts_.begin(), count_, sorted.begin());
  const auto by_feature = [](const ContactPoint& x, const ContactPoint& y) { return x.feature < y.feature; };
  std::sort(sorted.begin(), sorted.begin() + count_, by_feature);

  out->count = 0;
  if (count_ == 0) return;
  std::array<bool, kCapacity> is_kept{};
  if (count_ <= kManifoldCapacity) {
    is_kept.fill(true);
  } else {
    std::array<int, kManifoldCapacity> chosen{};
    const std::span<const ContactPoint> all(sorted.data(), static_cast<std::size_t>(count_));
    const int n = choose_extremes(all, depth_tie_, merge_distance_, &chosen);
    for (int i = 0; i < n; ++i) is_kept[static_cast<std::size_t>(chosen[static_cast<std::size_t>(i)])] = true;
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(count_); ++i)
    if (is_kept[i]) out->contacts[static_cast<std::size_t>(out->count++)] = sorted[i];
}

}  // namespace gravitas::collision
