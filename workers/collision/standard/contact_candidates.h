// Collects the contact points that a pair function finds and reduces them to a manifold.
#pragma once

#include <array>

#include "workers/collision/standard/manifold.h"

namespace gravitas::collision {

// Fixed capacity: two clipped patches give at most 16 points (4 rim points of each of two discs and
// two crossings, or 8 corners of a clipped polygon, with room for doubled corners).
class ContactCandidates {
 public:
  // Points nearer to each other than `merge_distance` (m) count as one; depths that differ by less
  // than `depth_tie` (m) count as equal. Contacts with a depth below -margin are dropped.
  ContactCandidates(double margin, double merge_distance, double depth_tie)
      : margin_(margin), merge_distance_(merge_distance), depth_tie_(depth_tie) {}

  // Adds a point unless it is too shallow, repeats a feature, or coincides with an earlier point
  // that is as deep: so the more telling features are added first. A doubled feature or place keeps
  // the deeper contact.
  void add(const ContactPoint& contact);

  int count() const { return count_; }
  double deepest() const;

  // Writes at most four of the points, sorted by feature: the deepest, the one farthest from it,
  // the one that spans the largest triangle with both, and the one farthest outside this triangle.
  // Ties fall to the lowest feature, so that a symmetric patch keeps its points under rounding.
  void reduce_to(Manifold* out) const;

 private:
  static constexpr int kCapacity = 24;

  double margin_;
  double merge_distance_;
  double depth_tie_;
  int count_ = 0;
  std::array<ContactPoint, kCapacity> contacts_;
};

}  // namespace gravitas::collision
