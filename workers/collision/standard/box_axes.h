// The separating axes of two boxes (§ 4.3.2.3): the six normals of the faces and the nine cross products of the edges.
#pragma once

#include <immintrin.h>

#include <limits>

#include "workers/collision/standard/convex_pair.h"
#include "workers/collision/standard/pair_functions.h"

namespace gravitas::collision {

// A face's normal as an axis: 0 ... 2 of its box.
struct FaceAxis {
  int axis = 0;
  double depth = std::numeric_limits<double>::infinity();  // m
};

// The axis across edge i of a and edge k of b.
struct EdgeAxis {
  int i = 0;
  int k = 0;
  double depth = std::numeric_limits<double>::infinity();  // m
  Vector3 normal = Vector3::UnitY();                       // unit, from a to b, in a
};

// Two boxes in the frame of a, their axes in the lanes of vector registers.
class BoxAxes {
 public:
  BoxAxes(const Shape& a, const Shape& b, const Placement& placement);

  // m; along the normals of a's and of b's faces.
  const Vector3& depths_a() const { return depths_a_; }
  const Vector3& depths_b() const { return depths_b_; }
  // Rotation and centre of b in a; centre of b, seen from a, in b's axes.
  const Matrix3& R_AB() const { return R_AB_; }
  const Vector3& p_AB() const { return p_AB_; }
  const Vector3& p_AB_B() const { return p_AB_B_; }

  // The shallowest of the edge axes that are shallower than `below` (m); of infinite depth if there is none.
  EdgeAxis shallowest_edges(double below) const;
  EdgeAxis across_edges(int i, int k) const;

 private:
  using Lanes = __m256d;

  const Shape& a_;
  const Shape& b_;
  Lanes columns_[3];  // of R_AB
  Lanes p_;
  Matrix3 R_AB_;
  Vector3 p_AB_;
  Vector3 p_AB_B_;
  Vector3 depths_a_;
  Vector3 depths_b_;
};

}  // namespace gravitas::collision
