// Collection and reduction of contact points.
//
// The reduction keeps extremes, by fixed rules (§ 4.3.2.19 samples at random, which would let a
// resting body rock and make the answer depend on a generator). A reduced manifold can hold the
// same wrenches as the full patch about as far as its four points span it.
#include "plugin_sdk/geometry/contact_candidates.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>

namespace gravitas::collision {
namespace {

// a later score must beat the best one by this factor: symmetric patches give equal scores up to
// rounding
constexpr double kScoreGain = 1.0 + 1e-6;

// index of the largest score(contact), the first of equal ones; -1 if none exceeds `at_least`
template <typename Contacts, typename Score>
int index_of_largest(const Contacts& contacts, int count, double at_least, const Score& score) {
  int best = -1;
  double best_score = at_least;
  for (int i = 0; i < count; ++i) {
    const double s = score(contacts(i));
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

// choose_extremes() of the contacts contacts(0) to contacts(count - 1).
template <typename Contacts>
int choose(const Contacts& contacts, int count, double depth_tie, double merge_distance,
           std::array<int, kManifoldCapacity>* out) {
  int* chosen = out->data();
  double deepest = contacts(0).depth;
  for (int i = 1; i < count; ++i) deepest = std::max(deepest, contacts(i).depth);
  int n = 0;
  for (int i = 0; i < count && n == 0; ++i) {
    if (contacts(i).depth >= deepest - depth_tie) chosen[n++] = i;
  }
  const ContactPoint& first = contacts(chosen[0]);

  const double smallest = merge_distance * merge_distance;
  const int far = index_of_largest(contacts, count, smallest,
                                   [&](const ContactPoint& x) { return (x.point - first.point).squaredNorm(); });
  if (far < 0) return n;
  chosen[n++] = far;
  const ContactPoint& second = contacts(far);

  // points on one line add nothing to its two ends
  const double thin = merge_distance * (second.point - first.point).norm();
  const int third_index =
      index_of_largest(contacts, count, thin, [&](const ContactPoint& x) { return std::fabs(area(first, second, x)); });
  if (third_index < 0) return n;
  chosen[n++] = third_index;
  const ContactPoint& third = contacts(third_index);

  const double turn = area(first, second, third) > 0.0 ? 1.0 : -1.0;
  const int outside = index_of_largest(contacts, count, thin, [&](const ContactPoint& x) {
    return -std::min({turn * area(first, second, x), turn * area(second, third, x), turn * area(third, first, x)});
  });
  if (outside >= 0) chosen[n++] = outside;
  return n;
}

}  // namespace

int choose_extremes(std::span<const ContactPoint> contacts, double depth_tie, double merge_distance,
                    std::array<int, kManifoldCapacity>* chosen) {
  const auto at = [&](int i) -> const ContactPoint& { return contacts[static_cast<std::size_t>(i)]; };
  return choose(at, static_cast<int>(contacts.size()), depth_tie, merge_distance, chosen);
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
    std::construct_at(&contacts_[static_cast<std::size_t>(count_++)], contact);
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
  static_assert(kCapacity <= 255);
  out->count = 0;
  if (count_ == 0) return;
  std::array<std::uint8_t, kCapacity> order;
  const auto end = order.begin() + count_;
  std::iota(order.begin(), end, std::uint8_t{0});
  std::sort(order.begin(), end,
            [&](std::uint8_t x, std::uint8_t y) { return contacts_[x].feature < contacts_[y].feature; });
  const auto sorted = [&](int i) -> const ContactPoint& { return contacts_[order[static_cast<std::size_t>(i)]]; };
  std::array<int, kManifoldCapacity> chosen = {0, 1, 2, 3};
  int count = count_;
  if (count_ > kManifoldCapacity) {
    count = choose(sorted, count_, depth_tie_, merge_distance_, &chosen);
    std::sort(chosen.begin(), chosen.begin() + count);
  }
  for (int i = 0; i < count; ++i)
    out->contacts[static_cast<std::size_t>(out->count++)] = sorted(chosen[static_cast<std::size_t>(i)]);
}

}  // namespace gravitas::collision
