// Collects the contact points that a pair function finds and reduces them to a manifold.
#pragma once

#include <array>
#include <span>

#include "plugin_sdk/geometry/manifold.h"

namespace gravitas::collision {

// Writes the places in `contacts` of at most four of them that hold about as much as all: the deepest, the one farthest
// from it, the one that spans the largest triangle with both, and the one farthest outside this triangle; returns how
// many. Ties fall to the first. `contacts` is not empty; depths that differ by less than `depth_tie` (m) count as equal,
// points nearer than `merge_distance` (m) as one.
int choose_extremes(std::span<const ContactPoint> contacts, double depth_tie, double merge_distance,
                    std::array<int, kManifoldCapacity>* chosen);

// Fixed capacity: two clipped patches give at most 16 points (4 rim points of each of two discs and
// two crossings, or 8 corners of a clipped polygon, with room for doubled corners), two round ends of 13 points 52.
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

  // Writes at most four of the points, sorted by feature, chosen by choose_extremes(). Ties fall to the lowest feature,
  // so that a symmetric patch keeps its points under rounding.
  void reduce_to(Manifold* out) const;

 private:
  static constexpr int kCapacity = 56;

  double margin_;
  double merge_distance_;
  double depth_tie_;
  int count_ = 0;
  std::array<ContactPoint, kCapacity> contacts_;
};

}  // namespace gravitas::collision
