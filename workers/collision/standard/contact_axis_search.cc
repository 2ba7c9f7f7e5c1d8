// The curved families of contact_axis.h: Newton's method on the sphere, branch and bound on a great
// circle, and the minima of the distance between two rims.
#include <array>
#include <cmath>
#include <cstddef>

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

// The rate, up to a positive factor, at which a point of the small circle, given by its direction,
// moves away from the nearest point of the large circle when it goes round.
double recession(const Circle3& small, const Circle3& large, const Vector2& direction) {
  const Vector3 arm = small.at(direction) - large.centre;
  const Vector3 flat = arm - large.axis * large.axis.dot(arm);
  const double radial = std::sqrt(flat.squaredNorm());
  const double scale = radial > 0.0 ? large.radius / radial : 0.0;
  return small.tangent(direction).dot(arm - scale * flat);
}

// The direction between `from` (recession < 0) and `to` (> 0) where the distance has a minimum,
// bisected to a hundredth of a degree, near enough for Newton.
Vector2 bisected_minimum(const Circle3& small, const Circle3& large, Vector2 from, Vector2 to) {
  for (int i = 0; i < 10; ++i) {
    const Vector2 sum = from + to;
    const Vector2 middle = sum / std::sqrt(sum.squaredNorm());
    (recession(small, large, middle) < 0.0 ? from : to) = middle;
  }
  return from;
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

void search_rim_pair(const Circle3& small, const Circle3& large, ShallowestAxis* search) {
  // cosines and sines of multiples of pi / 8
  constexpr double c = 0.92387953251128674;
  constexpr double d = 0.70710678118654752;
  constexpr double s = 0.38268343236508977;
  const std::array<Vector2, 16> directions = {Vector2(1, 0),  Vector2(c, s),   Vector2(d, d),   Vector2(s, c),
                                              Vector2(0, 1),  Vector2(-s, c),  Vector2(-d, d),  Vector2(-c, s),
                                              Vector2(-1, 0), Vector2(-c, -s), Vector2(-d, -d), Vector2(-s, -c),
                                              Vector2(0, -1), Vector2(s, -c),  Vector2(d, -d),  Vector2(c, -s)};
  // the slope brackets a minimum also where a maximum hides it from a comparison of distances
  std::array<double, 16> rates;
  for (std::size_t i = 0; i < 16; ++i) rates[i] = recession(small, large, directions[i]);
  for (std::size_t i = 0; i < 16; ++i) {
    const std::size_t next = (i + 1) % 16;
    if (!(rates[i] < 0.0 && rates[next] >= 0.0)) continue;
    const Vector2 minimum = bisected_minimum(small, large, directions[i], directions[next]);
    offer_rim_contact(small, large, minimum, search);
  }
}

}  // namespace

void search_rims(ShallowestAxis* search) {
  const ConvexPair& pair = search->pair();
  const Vector3 axis = pair.R_AB.col(1);
  for (const double side_a : {1.0, -1.0}) {
    for (const double side_b : {1.0, -1.0}) {
      const Circle3 of_a{Vector3(0.0, side_a * pair.a.size.y(), 0.0), Vector3::UnitY(), Vector3::UnitZ(),
                         Vector3::UnitX(), pair.a.size.x()};
      const Circle3 of_b{pair.p_AB + (side_b * pair.b.size.y()) * axis, axis, pair.R_AB.col(2), pair.R_AB.col(0),
                         pair.b.size.x()};
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
