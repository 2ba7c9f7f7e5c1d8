// The contact normal of two cylinders, or of a box and a cylinder: the direction n that minimises h(n) of
// convex_pair.h over the unit sphere.
//
// If the solids overlap, a minimum of h can lie only where the boundary of A - B is flat or curves
// away slowly enough, so finitely many families cover all minima:
//
//   flat      normals of box faces and caps; cross products of two line directions (box edges, the
//             cylinder's axis)
//   circles   n perpendicular to an axis of one shape: a box vertex against the side of a cylinder
//             (closed form), or a line (box edge, side) against a rim, one unknown, searched
//             exactly by search_great_circle()
//   rim-rim   the local minima of the distance between two circles, at most a few, then Newton
//             with two unknowns
//
// The axes of §§ 4.3.2.5 and 4.3.2.6 lack the last two families, so they call pairs touching that
// are apart. If the solids are apart there is one minimum, and GJK finds it.
#pragma once

#include <limits>

#include "plugin_sdk/math/types.h"
#include "workers/collision/standard/convex_pair.h"

namespace gravitas::collision {

enum class AxisKind { kFaceOfA, kFaceOfB, kFree };

// A direction with its depth. Faces of a box are numbered by axis 0..2, both caps of a cylinder are
// face 1 (its axis); which of the two opposite faces it is follows from the normal.
struct ContactAxis {
  Vector3 normal = Vector3::UnitY();                       // in A, unit, from a to b
  double depth = std::numeric_limits<double>::infinity();  // h(normal), m
  AxisKind kind = AxisKind::kFree;
  int face = -1;
};

// The contact normals to try, in this order.
struct ContactAxes {
  // A face of A is preferred to one of B, and both to a free axis, unless the later one is
  // shallower by more than face_preference().
  ContactAxis preferred;
  // The least depth of all. A preferred face that is a little off it may have nothing opposite:
  // then this one has. Equal to `preferred` if that is the least itself.
  ContactAxis shallowest;
};

// Writes the contact normals of the pair and returns true, or returns false if the solids are apart
// by more than `margin` (m, >= 0). A free axis is exact to rounding: the angle is off by a few
// 1e-16 times reach over the smallest radius of curvature.
bool find_contact_axes(const ConvexPair& pair, double margin, ContactAxes* out);

// How much shallower (m) a later axis must be to replace an earlier one of depth `earlier`: 1 % of
// the depth if that is positive, and 1e-7 of the thinnest half extent.
double face_preference(const ConvexPair& pair, double earlier);

// Keeps the shallowest axis that is offered. The machinery below works on this.
class ShallowestAxis {
 public:
  explicit ShallowestAxis(const ConvexPair& pair) : pair_(pair) {}

  // Offers a direction of any length, of either sign: the sign that points from a to b is taken.
  // Directions shorter than `shortest` are ignored: their rounding errors would speak.
  void offer(const Vector3& direction, double shortest = 0.0);
  // Offers an axis whose depth is known: what cannot beat it is not searched for afterwards.
  void offer_axis(const ContactAxis& axis);
  // Offers a unit normal whose sign is settled.
  void offer_signed(const Vector3& normal);
  // The same for a stationary direction. It also replaces one that is as shallow within rounding:
  // near the minimum h is flat, and cannot tell a direction from another one 1e-8 rad away.
  void offer_refined(const Vector3& normal);

  const ConvexPair& pair() const { return pair_; }
  double depth() const { return best_.depth; }
  const ContactAxis& best() const { return best_; }

 private:
  const ConvexPair& pair_;
  ContactAxis best_;
};

// Offers the local minimum of h that Newton's method reaches from `start` (unit), on the sphere and
// on each great circle perpendicular to a line direction of the pair that passes near. On a smooth
// piece of h with gradient x and Hessian D (the radii of curvature of A - B), the step along the
// tangent is -inverse(D - h 1) x.
void refine_axis(const Vector3& start, ShallowestAxis* search);

// Offers the least h among the unit vectors perpendicular to the unit vector `pole` to within
// `tolerance` (m), given as starting frame the orthonormal u, v perpendicular to it. Branch and
// bound: between two directions with support points x1, x2, h is at least the distance of the line
// through x1 and x2 from the origin, which is why nothing is overlooked between samples. Branches
// that cannot beat the best depth known so far are dropped.
void search_great_circle(const Vector3& pole, const Vector3& u, const Vector3& v, double tolerance,
                         ShallowestAxis* search);

// Offers the minima of h that touch rim against rim, if they are less than the depth known. Both shapes are cylinders,
// and they overlap or touch.
void search_rims(ShallowestAxis* search);

}  // namespace gravitas::collision
