// The contacts of one pair of shapes, any number of them. Keeps its room from query to query.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "plugin_sdk/geometry/manifold.h"

namespace gravitas::collision {

// Which parts of two bodies touch: 0, or of a compound what key_of_part() makes of the numbers of its children.
struct Parts {
  std::uint64_t of_a = 0, of_b = 0;

  void swap() { std::swap(of_a, of_b); }
};

class ContactList {
 public:
  void clear();
  std::size_t size() const { return contacts_.size(); }
  const ContactPoint& operator[](std::size_t i) const { return contacts_[i].contact; }
  const Parts& parts(std::size_t i) const { return contacts_[i].parts; }
  double deepest() const;

  // A contact as it is to be answered.
  void add(const ContactPoint& contact) { contacts_.push_back({contact, {}}); }

  // A contact of one part of a mesh or compound with another; `key` names the parts and triangles, contact.feature the features on
  // them. Points nearer than `merge_distance` (m) with one normal are one contact.
  void collect(std::uint64_t key, const Parts& parts, const ContactPoint& contact, double merge_distance);
  // The same of two parts that touch with a face of the first. The order is that of the features on the second (15 bits), as
  // it is of two convex shapes: solvers take contacts in order.
  void collect_on_face(std::uint64_t key, const Parts& parts, const ContactPoint& contact, double merge_distance);
  // Answers what was collected: at most four contacts for every normal (normals within half a degree are one), features
  // folded to 32 bits and made unique, ascending; moved by `origin`, normals turned round if `is_swapped`.
  void finish(const Vector3& origin, bool is_swapped);

 private:
  struct Collected {
    std::uint64_t key;
    std::uint32_t group;
    ContactPoint contact;
    Parts parts;
  };
  struct Answered {
    ContactPoint contact;
    Parts parts;
  };
  // Of the deepest contacts of the group, the one farthest from its middle: the choice of extremes begins there, and of flush
  // surfaces many points are equally deep.
  std::size_t at_rim() const;

  std::vector<Collected> collected_;
  std::vector<Vector3> normals_;  // of the groups
  std::vector<ContactPoint> group_;
  std::vector<Answered> contacts_;
  double merge_distance_ = 0.0;
};

// Mixes a part's number into the key of the whole.
inline std::uint64_t key_of_part(std::uint64_t key, std::uint64_t part) {
  std::uint64_t mixed = (key ^ (part + 0x9E3779B97F4A7C15ULL)) * 0xBF58476D1CE4E5B9ULL;
  return mixed ^ (mixed >> 31);
}

}  // namespace gravitas::collision
