// Contacts over seams: where bodies lie flush, what slides from one onto the next feels no edge.
//
// In a trial a body that slides on a floor dips below it, as only the solver will hold it up. Where it comes over the next
// tile of the floor, the shortest way out of that may then lead sideways, and the body would run against an edge that lies
// no higher than what it slides on. One pair cannot know this; so after all pairs have been looked at
//
//   a body A touches C: the plane of that contact, with the normal m from C to A, through C's surface
//   A touches B, too, along another normal; B has a flat face with the normal m, or is a triangle of a mesh, and stands no higher than
//   the plane, to 1e-6 of the smallest half extent; and A lies in B, along m, no deeper than twice as deep as in C
//
// make the contacts of A with B those along m: none where their features do not lie opposite each other there. All that A shares
// with B is then in the layer out of which C lifts it. What stands above the plane is run against as before. The children of a
// compound and the triangles of a mesh are looked at one by one; among its own triangles a mesh has no seams
// (composite_pairs.h), and a mesh is no C for its own: over its edge each of two faces lies below the other's plane. The parts of a
// compound are C and B to each other, of whatever shape.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "plugin_sdk/collision.h"
#include "plugin_sdk/geometry/penetration.h"
#include "workers/collision/standard/contact_list.h"
#include "workers/collision/standard/shapes.h"

namespace gravitas::collision {

// What a body touches.
struct Rest {
  Vector3 normal;               // unit, from the other body to this one
  Vector3 point;                // of the other's surface
  double depth;                 // m
  std::size_t pair = kSeveral;  // whose contact it is
  std::uint64_t part = 0;       // of the other body (Parts)

  static constexpr std::size_t kSeveral = ~std::size_t{0};

  double height(const Vector3& x) const { return normal.dot(x - point); }
  double lowest() const { return depth > 0.0 ? -2.0 * depth : 0.0; }
  // To 4.5e-5 rad.
  bool is_along(const Vector3& n) const { return normal.dot(n) > 1.0 - 1e-9; }
};

// Of both bodies of a pair.
struct PairRests {
  std::span<const Rest> of_a, of_b;
  Vector3 origin = Vector3::Zero();  // of the frame that shapes are placed in, world; as are the rests
  std::size_t pair = 0;              // the one that is looked at
  Parts parts{};                     // of it

  void swap() { std::swap(of_a, of_b), parts.swap(); }
  bool are_none() const { return of_a.empty() && of_b.empty(); }
};

// m; of two shapes, what stands out no farther is flush.
double flush_length(const Shape& a, const Shape& b);

// Replaces the contacts of two bounded convex shapes, in a frame F with world axes, where the above asks for it.
void lay_flush(const Shape& a, const Pose& X_FA, const Shape& b, const Pose& X_FB, const PairRests& rests,
               double margin, Manifold* manifold);
// Of a triangle of a mesh, and what it touches: the side (unit) to which contacts lead out of the mesh, in the frame of the triangle.
struct Fronts {
  Vector3 of_a;
  Vector3 of_b = Vector3::Zero();  // zero: b is a convex part, not a triangle
};

// The same of a triangle of a mesh and a convex part or another triangle, with the contacts in the frame of the triangle, which
// lies at X_FA.
void lay_flush(const PlacedPair& pair, const Fronts& fronts, const Pose& X_FA, const PairRests& rests, double flush,
               double margin, Manifold* manifold);
// The normal that it takes instead of this one, both in the frame of the triangle; zero where it leaves that.
Vector3 flush_normal(const PlacedPair& pair, const Fronts& fronts, const Vector3& normal, const Pose& X_FA,
                     const PairRests& rests, double flush);

class Seams {
 public:
  // Mends the contacts of all pairs (two bodies each), as collide() of narrow_phase.h found them.
  void mend(std::span<const Shape> shapes, const BodyColumns& bodies, std::span<const std::uint32_t> pair,
            double margin, std::span<ContactList> contacts);

 private:
  // A body's are the first so many: a floor under a thousand bodies knows one plane, and what touches more rests on none.
  static constexpr std::uint32_t kMostRests = 16;

  void find_rests(std::span<const std::uint32_t> pair, std::span<const ContactList> contacts, std::size_t bodies,
                  double margin);
  void add_rest(std::uint32_t body, const Rest& rest, double same_height);
  std::span<const Rest> rests_of(std::uint32_t body) const { return {&rests_[begin_[body]], count_[body]}; }

  // scratch, filled anew in every call
  std::vector<std::uint32_t> begin_, count_;  // by body, of rests_
  std::vector<Rest> rests_;
  std::vector<std::pair<std::size_t, ContactList>> mended_;
};

}  // namespace gravitas::collision
