// Collects the contact points that a pair function finds and reduces them to a manifold.
#pragma once

#include <array>
#include <span>

#include "plugin_sdk/geometry/manifold.h"
#include "plugin_sdk/geometry/support_map.h"

namespace gravitas::collision {

// Writes the places in `contacts` of at most four of them that hold about as much as all: the deepest, the one farthest
// from it, the one that spans the largest triangle with both, and the one farthest outside this triangle; returns how
// many. Ties fall to the first. `contacts` is not empty; depths that differ by less than `depth_tie` (m) count as equal,
// points nearer than `merge_distance` (m) as one.
int choose_extremes(std::span<const ContactPoint> contacts, double depth_tie, double merge_distance,
                    std::array<int, kManifoldCapacity>* chosen);

// Room for all that two contours can give: the corners of both, and two crossings for each border of either.
class ContactCandidates {
 public:
  // Points nearer to each other than `merge_distance` (m) count as one; depths that differ by less
  // than `depth_tie` (m) count as equal. Contacts with a depth below -margin are dropped.
  ContactCandidates(double margin, double merge_distance, double depth_tie)
      : margin_(margin), merge_distance_(merge_distance), depth_tie_(depth_tie) {}
  ContactCandidates(const ContactCandidates&) = delete;
  ContactCandidates& operator=(const ContactCandidates&) = delete;
  ~ContactCandidates() = default;

  // Adds a point unless it is too shallow, repeats a feature, or coincides with an earlier point
  // that is as deep: so the more telling features are added first. A doubled feature or place keeps
  // the deeper contact.
  void add(const ContactPoint& contact);

  // Drops the contacts whose feature is_dropped(feature) names.
  template <typename IsDropped>
  void drop(const IsDropped& is_dropped) {
    int kept = 0;
    for (int i = 0; i < count_; ++i) {
      const ContactPoint contact = contacts_[static_cast<std::size_t>(i)];
      if (!is_dropped(contact.feature)) contacts_[static_cast<std::size_t>(kept++)] = contact;
    }
    count_ = kept;
  }

  void clear() { count_ = 0; }
  int count() const { return count_; }
  double deepest() const;

  // Writes at most four of the points, sorted by feature, chosen by choose_extremes(). Ties fall to the lowest feature,
  // so that a symmetric patch keeps its points under rounding.
  void reduce_to(Manifold* out) const;

 private:
  static constexpr int kCapacity = 4 * static_cast<int>(Contour::kCapacity);

  double margin_;
  double merge_distance_;
  double depth_tie_;
  int count_ = 0;
  // a union, so that the room is not filled with zeros for each pair
  union {
    std::array<ContactPoint, kCapacity> contacts_;
  };
};

}  // namespace gravitas::collision
