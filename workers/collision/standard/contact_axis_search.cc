// The curved families of contact_axis.h: Newton's method on the sphere, branch and bound on a great
// circle, and the minima of the distance between two rims.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "workers/collision/standard/contact_axis.h"
#include "workers/collision/standard/unit_vector.h"

namespace gravitas::collision {
namespace {

using Vector2 = Eigen::Vector2d;

constexpr int kNewtonLimit = 16;
// rad; longer steps leave the region where the quadratic model means anything
constexpr double kLongestStep = 0.25;

// The curvature that the rim or side of a cylinder adds to A - B at the normal n: the radius `rho`
// (m) along the unit tangent t. For the support function r |n x c| of a circle about c, the Hessian
// is (r / |n x c|) t t^T with t along c x n.
struct Curvature {
  Vector3 t = Vector3::Zero();
  double rho = 0.0;
};

Curvature curvature_of(const Shape& shape, const Vector3& axis, const Vector3& n) {
  if (shape.type != ShapeType::kCylinder) return {};
  const Vector3 tangent = axis.cross(n);
  const double sine = std::sqrt(tangent.squaredNorm());
  if (!(sine > 1e-12)) return {};
  return {tangent / sine, shape.size.x() / sine};
}

// A great circle through `start`, or the whole sphere when `pole` is zero.
struct NewtonStep {
  Vector3 step;
  bool downhill;
};

NewtonStep newton_step_on_circle(const Vector3& n, const Vector3& pole, const Vector3& x, const Curvature& a,
                                 const Curvature& b) {
  const Vector3 t = pole.cross(n);
  const double ta = a.t.dot(t);
  const double tb = b.t.dot(t);
  const double curvature = a.rho * ta * ta + b.rho * tb * tb - n.dot(x);
  if (!(curvature > 0.0)) return {Vector3::Zero(), false};
  return {t * (-t.dot(x) / curvature), true};
}

NewtonStep newton_step_on_sphere(const Vector3& n, const Vector3& x, const Curvature& a, const Curvature& b) {
  const Vector3 t1 = n.unitOrthogonal();
  const Vector3 t2 = n.cross(t1);
  const Vector2 ca(a.t.dot(t1), a.t.dot(t2));
  const Vector2 cb(b.t.dot(t1), b.t.dot(t2));
  const double h = n.dot(x);
  const double h11 = a.rho * ca.x() * ca.x() + b.rho * cb.x() * cb.x() - h;
  const double h22 = a.rho * ca.y() * ca.y() + b.rho * cb.y() * cb.y() - h;
  const double h12 = a.rho * ca.x() * ca.y() + b.rho * cb.x() * cb.y();
  const double determinant = h11 * h22 - h12 * h12;
  if (!(h11 > 0.0 && determinant > 0.0)) return {Vector3::Zero(), false};
  const double g1 = t1.dot(x);
  const double g2 = t2.dot(x);
  return {t1 * ((h12 * g2 - h22 * g1) / determinant) + t2 * ((h12 * g1 - h11 * g2) / determinant), true};
}

// Newton's method from `start`, on the great circle perpendicular to `pole` or, if that is zero, on
// the sphere. Offers where it ends: only the depth there decides, so a stray run does no harm.
void newton(const Vector3& start, const Vector3& pole, ShallowestAxis* search) {
  const ConvexPair& pair = search->pair();
  const bool on_circle = pole.squaredNorm() > 0.0;
  Vector3 n = direction_of(start - pole * pole.dot(start), start).unit;
  bool converged = false;
  for (int i = 0; i < kNewtonLimit; ++i) {
    const Vector3 x = pair.support_difference(n);
    const Curvature a = curvature_of(pair.a, Vector3::UnitY(), n);
    const Curvature b = curvature_of(pair.b, pair.R_AB.col(1), n);
    const NewtonStep newton = on_circle ? newton_step_on_circle(n, pole, x, a, b) : newton_step_on_sphere(n, x, a, b);
    if (!newton.downhill) break;
    const double length = std::sqrt(newton.step.squaredNorm());
    const double scale = length > kLongestStep ? kLongestStep / length : 1.0;
    n = direction_of(n + scale * newton.step, n).unit;
    // the error after a step is about the square of its length
    converged = length < 1e-9;
    if (length < 1e-12) break;
  }
  if (converged) {
    search->offer_refined(n);
  } else {
    search->offer_signed(n);
  }
}

}  // namespace

void refine_axis(const Vector3& start, ShallowestAxis* search) {
  const ConvexPair& pair = search->pair();
  newton(start, Vector3::Zero(), search);
  const auto along_line = [&](const Vector3& line) {
    if (std::fabs(line.dot(start)) < 0.25) newton(start, line, search);
  };
  for (int i = 0; i < 3; ++i) {
    if (pair.a.type == ShapeType::kBox || i == 1) along_line(Vector3::Unit(i));
    if (pair.b.type == ShapeType::kBox || i == 1) along_line(pair.R_AB.col(i));
  }
}

// ---- great circle ----

namespace {

// A direction on the circle, the support point of A - B there, both in the plane of the circle, and
// h.
struct Sample {
  Vector2 n;
  Vector2 x;
  double h;
};

struct Arc {
  Sample from;
  Sample to;
};

class Circle {
 public:
  Circle(const Vector3& u, const Vector3& v, const ConvexPair& pair) : u_(u), v_(v), pair_(pair) {}

  Vector3 direction(const Vector2& n) const { return u_ * n.x() + v_ * n.y(); }
  Sample sample(const Vector2& n) const {
    const Vector3 x = pair_.support_difference(direction(n));
    const Vector2 in_plane(u_.dot(x), v_.dot(x));
    return {n, in_plane, n.dot(in_plane)};
  }

 private:
  Vector3 u_;
  Vector3 v_;
  const ConvexPair& pair_;
};

}  // namespace

void search_great_circle(const Vector3& pole, const Vector3& u, const Vector3& v, double tolerance,
                         ShallowestAxis* search) {
  // more samples than this end the search with what it has; ordinary pairs need 8 to 40
  constexpr int kSampleLimit = 160;
  constexpr std::size_t kStackSize = 64;
  const double d = std::sqrt(0.5);
  const std::array<Vector2, 8> starts = {Vector2(1, 0),  Vector2(d, d),   Vector2(0, 1),  Vector2(-d, d),
                                         Vector2(-1, 0), Vector2(-d, -d), Vector2(0, -1), Vector2(d, -d)};
  const Circle circle(u, v, search->pair());
  const auto improve = [&](const Sample& s) {
    if (!(s.h < search->depth() - tolerance)) return;
    search->offer_signed(circle.direction(s.n));
    newton(circle.direction(s.n), pole, search);
  };

  std::array<Sample, 8> samples;
  for (std::size_t i = 0; i < 8; ++i) {
    samples[i] = circle.sample(starts[i]);
    improve(samples[i]);
  }
  std::array<Arc, kStackSize> stack;
  std::size_t depth = 0;
  for (std::size_t i = 0; i < 8; ++i) stack[depth++] = {samples[i], samples[(i + 1) % 8]};

  int count = 0;
  while (depth > 0) {
    const Arc arc = stack[--depth];
    // the outward normal of the chord between the support points; it lies between the two
    // directions, unless the chord is so short that nothing is left to find
    const Vector2 chord = arc.to.x - arc.from.x;
    const double length = std::sqrt(chord.squaredNorm());
    if (!(length > 1e-14 * search->pair().reach)) continue;
    const Vector2 n(chord.y() / length, -chord.x() / length);
    const double cosine = arc.from.n.dot(arc.to.n);
    if (n.dot(arc.from.n) <= cosine || n.dot(arc.to.n) <= cosine) continue;

    const double bound = n.dot(arc.from.x);
    if (bound >= search->depth() - tolerance) continue;
    const Sample middle = circle.sample(n);
    improve(middle);
    if (middle.h - bound <= tolerance || ++count > kSampleLimit || depth + 2 > kStackSize) {
      if (middle.h < search->depth() + tolerance) newton(circle.direction(n), pole, search);
      continue;
    }
    stack[depth++] = {arc.from, middle};
    stack[depth++] = {middle, arc.to};
  }
}

// ---- rim against rim ----

namespace {

struct Circle3 {
  Vector3 centre;
  Vector3 axis;
  Vector3 u;
  Vector3 v;
  double radius;

  Vector3 at(const Vector2& d) const { return centre + radius * (u * d.x() + v * d.y()); }
  Vector3 tangent(const Vector2& d) const { return v * d.x() - u * d.y(); }
};

// How the squared distance F between a point of the small circle and the large circle changes when the point goes round:
// with the arm from the large circle's centre, its part `flat` in the large circle's plane and rho = |flat|,
//
//   F = |arm|^2 + R^2 - 2 R rho
//
// differentiated by the angle.
struct Recession {
  double rate;       // F' / 2
  double curvature;  // F'' / 2
  double rho;        // m
  double distance;   // sqrt(F), m
};

// The small circle, seen in the frame of the large one: the rows u and v of its plane, and its axis.
class RimPair {
 public:
  RimPair(const Circle3& small, const Circle3& large)
      : centre_(in_frame(large, small.centre - large.centre)),
        u_(small.radius * in_frame(large, small.u)),
        v_(small.radius * in_frame(large, small.v)),
        radius_(large.radius) {}

  Recession recession(const Vector2& direction) const {
    const Vector3 out = u_ * direction.x() + v_ * direction.y();
    const Vector3 velocity = v_ * direction.x() - u_ * direction.y();
    const Vector3 arm = centre_ + out;
    const double rho = std::sqrt(arm.head<2>().squaredNorm());
    const Vector2 radial = rho > 0.0 ? Vector2(arm.head<2>() / rho) : Vector2::UnitX();
    const double across = radial.x() * velocity.y() - radial.y() * velocity.x();
    const double turning = rho > 0.0 ? across * across / rho : 0.0;
    return {velocity.dot(arm) - radius_ * radial.dot(velocity.head<2>()),
            velocity.squaredNorm() - out.dot(arm) + radius_ * (radial.dot(out.head<2>()) - turning), rho,
            std::sqrt(Vector2(arm.z(), rho - radius_).squaredNorm())};
  }

 private:
  static Vector3 in_frame(const Circle3& large, const Vector3& v) {
    return {large.u.dot(v), large.v.dot(v), large.axis.dot(v)};
  }

  Vector3 centre_;  // m
  Vector3 u_;       // m
  Vector3 v_;       // m
  double radius_;   // m, of the large circle
};

// A part of the small circle between two directions, `half` radians from its middle to either.
struct RimArc {
  Vector2 from;
  Vector2 to;
  double half;
};

Vector2 middle_of(const RimArc& arc) {
  const Vector2 sum = arc.from + arc.to;
  return sum / std::sqrt(sum.squaredNorm());
}

// A direction near that in an arc in which the rate rises through zero; Newton's method ends the search.
Vector2 bisected_minimum(const RimPair& rims, RimArc arc) {
  for (int i = 0; i < 20; ++i) {
    const Vector2 middle = middle_of(arc);
    (rims.recession(middle).rate < 0.0 ? arc.from : arc.to) = middle;
  }
  return arc.from;
}

// the axis of the contact between the point of the small circle and the nearest of the large one is
// perpendicular to both tangents
void offer_rim_contact(const Circle3& small, const Circle3& large, const Vector2& direction, ShallowestAxis* search) {
  const Vector3 arm = small.at(direction) - large.centre;
  const Vector3 radial = arm - large.axis * large.axis.dot(arm);
  const Vector3 tangent = large.axis.cross(radial);
  const Direction n = direction_of(small.tangent(direction).cross(tangent), Vector3::UnitY());
  if (!(n.length > 1e-6 * large.radius)) return;
  const double along = n.unit.dot(search->pair().p_AB);
  newton(along < 0.0 ? Vector3(-n.unit) : n.unit, Vector3::Zero(), search);
}

// Offers all minima of the distance between the circles: arcs are halved until F is monotone, convex or concave on them,
// which bounds of its derivatives tell, so that neither of two minima close to each other is overlooked.
// Arcs farther from the large circle than the least depth known have nothing to offer.
void search_rim_pair(const Circle3& small, const Circle3& large, ShallowestAxis* search) {
  // where there are more arcs or shorter ones, each is taken to hold one minimum at most; ordinary pairs need some 30
  constexpr std::size_t kArcLimit = 256;
  constexpr double kShortest = 1e-5;               // rad
  constexpr double kEighth = 0.78539816339744831;  // of the circle, rad
  const std::array<Vector2, 4> quarters = {Vector2(1, 0), Vector2(0, 1), Vector2(-1, 0), Vector2(0, -1)};
  std::array<RimArc, kArcLimit> arcs;
  std::size_t count = 0;
  for (std::size_t i = 0; i < 4; ++i) arcs[count++] = {quarters[i], quarters[(i + 1) % 4], kEighth};

  const RimPair rims(small, large);
  const double r = small.radius;
  const Vector3 between = small.centre - large.centre;
  const double offset = std::sqrt(Vector2(small.u.dot(between), small.v.dot(between)).squaredNorm());
  // flat = c + r d with |d|^2 = 1 - (axis . direction)^2, so the derivatives of rho^2 are at most q1, q2, q3
  const double beside = 2.0 * r * std::sqrt((between - large.axis * large.axis.dot(between)).squaredNorm());
  const double tilt = r * r * Vector2(small.u.dot(large.axis), small.v.dot(large.axis)).squaredNorm();
  const double q1 = beside + tilt, q2 = beside + 2.0 * tilt, q3 = beside + 4.0 * tilt;
  for (std::size_t i = 0; i < count; ++i) {
    const RimArc arc = arcs[i];
    const Vector2 middle = middle_of(arc);
    const Recession there = rims.recession(middle);
    if (there.distance - r * arc.half > search->depth()) continue;
    // bounds of |rho^(3)|: from derivatives of flat, at most r long, and, where the circles are nearly coaxial, of rho^2
    const double rho = there.rho - r * arc.half, ratio = r / rho;
    const double third_rho =
        std::min(r * (1.0 + 3.0 * ratio * (1.0 + ratio)),
                 (0.5 * q3 + (0.75 * q1 * q2 + 0.375 * q1 * q1 * q1 / (rho * rho)) / (rho * rho)) / rho);
    const double change =
        rho > 0.0 ? arc.half * (r * offset + large.radius * third_rho) : std::numeric_limits<double>::infinity();
    if (std::fabs(there.rate) > arc.half * (std::fabs(there.curvature) + 0.5 * change)) continue;
    if (there.curvature <= -change) continue;
    if (there.curvature >= change || arc.half < kShortest || count + 2 > kArcLimit) {
      if (rims.recession(arc.from).rate < 0.0 && rims.recession(arc.to).rate >= 0.0)
        offer_rim_contact(small, large, bisected_minimum(rims, arc), search);
      continue;
    }
    arcs[count++] = {arc.from, middle, 0.5 * arc.half};
    arcs[count++] = {middle, arc.to, 0.5 * arc.half};
  }
}

}  // namespace

void search_rims(ShallowestAxis* search) {
  const ConvexPair& pair = search->pair();
  const Vector3 axis = pair.R_AB.col(1);
  const double sine = std::sqrt(Vector2(axis.x(), axis.z()).squaredNorm());
  for (const double side_a : {1.0, -1.0}) {
    for (const double side_b : {1.0, -1.0}) {
      const Circle3 of_a{Vector3(0.0, side_a * pair.a.size.y(), 0.0), Vector3::UnitY(), Vector3::UnitZ(),
                         Vector3::UnitX(), pair.a.size.x()};
      const Circle3 of_b{pair.p_AB + (side_b * pair.b.size.y()) * axis, axis, pair.R_AB.col(2), pair.R_AB.col(0),
                         pair.b.size.x()};
      // The solids overlap, so at a minimum of h the point of a's rim lies within b's cap, and that of b's rim within
      // a's, by no more than the depth there.
      const Vector3 between = of_a.centre - of_b.centre;
      const double within_a = side_a * of_a.axis.dot(between), within_b = -side_b * of_b.axis.dot(between);
      if (within_a + of_b.radius * sine < 0.0 || within_a - of_b.radius * sine > search->depth()) continue;
      if (within_b + of_a.radius * sine < 0.0 || within_b - of_a.radius * sine > search->depth()) continue;
      // the smaller circle is sampled: what happens on it has its scale
      if (of_a.radius < of_b.radius) {
        search_rim_pair(of_a, of_b, search);
      } else {
        search_rim_pair(of_b, of_a, search);
      }
    }
  }
}

}  // namespace gravitas::collision
