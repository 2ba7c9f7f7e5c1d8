// The three cases of a frictional contact, and the search for the direction of a slide.
#include "plugin_sdk/solver/coulomb_contact.h"

#include <array>
#include <cmath>

#include "plugin_sdk/solver/bodies.h"

namespace gravitas {
namespace {

using Vector2 = Eigen::Vector2d;
using Matrix2 = Eigen::Matrix2d;

constexpr int kDirections = 64;
// cos and sin of 2 pi / 64
constexpr double kStepCosine = 0.99518472667219688624;
constexpr double kStepSine = 0.098017140329560601994;

double cross(const Vector2& a, const Vector2& b) { return a.x() * b.y() - a.y() * b.x(); }
Vector2 turned(const Vector2& v) { return {-v.y(), v.x()}; }

// The slide as a function of the slip's direction.
struct Slide {
  Matrix2 tangent;   // W_TT
  Vector2 coupling;  // W_TN
  Vector2 slip;      // q_T
  double normal;     // W_NN
  double missing;    // b - q_N > 0
  double friction;   // mu

  double strength(const Vector2& d) const { return normal - friction * coupling.dot(d); }
  // D u_T
  Vector2 scaled_slip(const Vector2& d) const {
    return strength(d) * slip + missing * (coupling - friction * (tangent * d));
  }
  // D d x u_T and its derivative by the angle of d.
  double misalignment(const Vector2& d) const { return cross(d, scaled_slip(d)); }
  double slope(const Vector2& d) const {
    const Vector2 e = turned(d);
    const Vector2 change = -friction * coupling.dot(e) * slip - missing * friction * (tangent * e);
    return cross(e, scaled_slip(d)) + cross(d, change);
  }
  // What misalignment() is rounded against.
  double size() const {
    return (normal + friction * coupling.norm()) * slip.norm() +
           missing * (coupling.norm() + friction * tangent.norm());
  }
  bool holds(const Vector2& d) const { return strength(d) > 0.0 && d.dot(scaled_slip(d)) >= 0.0; }
};

// Newton, at most an eighth of a turn at once.
bool refine(const Slide& slide, Vector2* direction) {
  const double still = 4.0 * kEpsilon * slide.size();
  Vector2 d = *direction;
  for (int i = 0; i < 12; ++i) {
    const double value = slide.misalignment(d);
    const double slope = slide.slope(d);
    if (slope == 0.0) return false;
    const double step = -value / slope;
    if (!(std::fabs(step) < 0.75)) return false;
    d = (d + step * turned(d)).normalized();
    if (std::fabs(step) <= 2.0 * kEpsilon || std::fabs(value) <= still) {
      *direction = d;
      return slide.holds(d);
    }
  }
  return false;
}

// The root between two directions with misalignments of different sign.
Vector2 bisected(const Slide& slide, Vector2 low, Vector2 high) {
  const bool low_sign = slide.misalignment(low) > 0.0;
  for (int i = 0; i < 60; ++i) {
    const Vector2 middle = (low + high).normalized();
    ((slide.misalignment(middle) > 0.0) == low_sign ? low : high) = middle;
  }
  return (low + high).normalized();
}

// The direction of slip nearest to `direction` among all that hold.
bool search(const Slide& slide, Vector2* direction) {
  bool found = false;
  Vector2 best = *direction;
  Vector2 low = *direction;
  for (int i = 0; i < kDirections; ++i) {
    const Vector2 high = (kStepCosine * low + kStepSine * turned(low)).normalized();
    if ((slide.misalignment(low) > 0.0) != (slide.misalignment(high) > 0.0)) {
      const Vector2 root = bisected(slide, low, high);
      if (slide.holds(root) && (!found || root.dot(*direction) > best.dot(*direction))) {
        best = root;
        found = true;
      }
    }
    low = high;
  }
  if (found) *direction = best;
  return found;
}

}  // namespace

bool solve_coulomb_contact(const Matrix3& response, const Matrix3& inverse, const Vector3& free_velocity, double target,
                           double friction, Vector3* impulse) {
  if (free_velocity.x() >= target) {
    impulse->setZero();
    return true;
  }
  const Vector3 sticking = inverse * (Vector3(target, 0.0, 0.0) - free_velocity);
  if (sticking.x() > 0.0 && sticking.tail<2>().norm() <= friction * sticking.x()) {
    *impulse = sticking;
    return true;
  }

  const Slide slide{response.bottomRightCorner<2, 2>(),
                    response.col(0).tail<2>(),
                    free_velocity.tail<2>(),
                    response(0, 0),
                    target - free_velocity.x(),
                    friction};
  // the friction there is, else what would stop the slip
  Vector2 direction = -impulse->tail<2>();
  if (direction.isZero(0.0)) direction = -sticking.tail<2>();
  const double length = direction.norm();
  if (!(length > 0.0)) return false;
  direction /= length;
  if (!refine(slide, &direction) && !search(slide, &direction)) return false;
  const double normal = slide.missing / slide.strength(direction);
  impulse->x() = normal;
  impulse->tail<2>() = -(friction * normal) * direction;
  return true;
}

}  // namespace gravitas
