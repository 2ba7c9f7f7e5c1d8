#include "plugin_sdk/geometry/time_of_impact.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "plugin_sdk/geometry/penetration.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas {
namespace {

double norm_of(const Vector3& v) { return std::sqrt(v.squaredNorm()); }

// The core of a solid about the centre of its body, in world axes.
class TurningCore {
 public:
  explicit TurningCore(const MovingSolid& solid)
      : solid_(solid), map_(*solid.map), spin_(solid.motion.rotation), rate_(norm_of(spin_)) {
    place(0.0);
    reach_ = norm_of(solid.geometry.position) + map_.radius() - map_.rounding();
    if (!(rate_ > 0.0)) return;
    axis_ = spin_ / rate_;
    const TangentBasis basis = orthonormal_basis(axis_);
    const auto extent = [&](const Vector3& d) { return std::max(support(d), support(-d)); };
    const double first = extent(basis.first), second = extent(basis.second);
    // rounded up: a bound
    off_axis_ = std::min(std::sqrt(first * first + second * second), reach_) * (1.0 + 1e-12);
    up_ = support(axis_), down_ = support(-axis_);
  }

  void place(double time) {
    const Quaternion turned = rotate_by(solid_.start.orientation, time * spin_);
    R_ = to_rotation_matrix(normalized(turned * solid_.geometry.orientation));
    p_ = turned * solid_.geometry.position;
  }

  // The greatest m . x over the core, as it lies now.
  double support(const Vector3& m) const { return m.dot(p_) + m.dot(R_ * map_.support(R_.transpose() * m)); }
  // The same over all that the core sweeps when it turns once.
  double swept_support(const Vector3& m) const {
    if (!(rate_ > 0.0)) return support(m);
    const double along = axis_.dot(m);
    return (along > 0.0 ? along * up_ : -along * down_) + off_axis_ * norm_of(m - along * axis_);
  }
  // n . x of a point x while n turns along with w: n . x + s first . x + s^2/2 second . x, to within s^3/6 third.
  struct Swing {
    Vector3 n, first, second;
    double third;
  };
  Swing swing(const Vector3& n, const Vector3& w) const {
    const Vector3 relative = spin_ - w, first = n.cross(relative);
    const double rates = norm_of(w) + rate_;
    return {n, first, first.cross(spin_) - n.cross(w).cross(relative),
            w.isZero(0.0) ? norm_of(first) * rate_ * rate_ * off_axis_ : norm_of(relative) * rates * rates * reach_};
  }
  // The greatest of these, or more, convex in s: curvature that leads away counts as none.
  double support(const Swing& swing, double s) const {
    const Vector3 m = swing.n + s * swing.first;
    double most = support(m);
    if (!swing.second.isZero(0.0)) most = std::max(most, support(m + (0.5 * s * s) * swing.second));
    return most + s * s * s / 6.0 * swing.third;
  }

  const SupportMap& map() const { return map_; }
  const Matrix3& axes() const { return R_; }
  const Vector3& p() const { return p_; }
  const Vector3& spin() const { return spin_; }
  // Of the farthest point from the centre, and of what moves when the body turns.
  double reach() const { return reach_; }
  double travel() const { return rate_ * off_axis_; }
  double rate() const { return rate_; }

 private:
  const MovingSolid& solid_;
  const SupportMap& map_;
  Vector3 spin_;
  double rate_;
  Matrix3 R_;
  Vector3 p_;
  Vector3 axis_ = Vector3::UnitY();
  double reach_ = 0.0, off_axis_ = 0.0, up_ = 0.0, down_ = 0.0;
};

// How far a bound of third order is followed for solids that turn at these rates. Beyond kFarthestLook it says nothing, and
// chords that begin there are short by the square of the angle.
double look_ahead(double rates, double rest) {
  constexpr double kFarthestLook = 3.0;  // rad
  return rates * rest > kFarthestLook ? kFarthestLook / rates : rest;
}

// How far a bound f, positive at 0, surely stays positive: `rest` if all the way.
template <typename Bound>
double safe_step(const Bound& f, double at_zero, double rest) {
  double low = 0.0, at_low = at_zero, high = rest, at_high = f(rest);
  if (at_high >= 0.0) return rest;
  constexpr int kRounds = 6;
  for (int i = 0; i < kRounds && high - low > 0.05 * low; ++i) {
    // the chord of a concave bound crosses zero before the bound does
    double chord = (high - low) * (at_low / (at_low - at_high)), value = f(low + chord);
    // of a straight bound both cross in one place, where rounding has the sign
    if (!(value >= 0.0)) chord *= 0.5, value = f(low + chord);
    if (value >= 0.0) low += chord, at_low = value;
    const double middle = 0.5 * (low + high), there = f(middle);
    if (there >= 0.0) {
      low = middle, at_low = there;
    } else {
      high = middle, at_high = there;
    }
  }
  return low;
}

// n . c of the offset c of two centres while n turns along with w, or less, concave in s.
struct Drift {
  double at_zero, first, second, third;

  Drift(const Vector3& n, const Vector3& c, const Vector3& v, const Vector3& w, double rest)
      : at_zero(n.dot(c)),
        first(n.dot(v - w.cross(c))),
        second(std::min(0.0, n.dot(w.cross(w.cross(c)) - 2.0 * w.cross(v)))),
        third(w.squaredNorm() * ((3.0 + norm_of(w) * rest) * norm_of(v) + norm_of(w) * norm_of(c))) {}
  double operator()(double s) const { return at_zero + s * (first + 0.5 * s * (second - s / 3.0 * third)); }
};

// Two bounded solids.
class ConvexApproach {
 public:
  ConvexApproach(const MovingSolid& a, const MovingSolid& b)
      : a_(a),
        b_(b),
        offset_(b.start.position - a.start.position),
        velocity_(b.motion.displacement - a.motion.displacement) {
    start_ = a.start.position, motion_ = a.motion.displacement;
  }

  double sizes() const { return a_.map().radius() + b_.map().radius(); }

  // Looks at the time t: the nearest points, and the plane between them.
  void look(double t) {
    a_.place(t), b_.place(t);
    centres_ = offset_ + t * velocity_;
    const PlacedPair pair{a_.map(), b_.map(), a_.axes().transpose() * b_.axes(),
                          a_.axes().transpose() * (centres_ + b_.p() - a_.p())};
    least_ = find_separation(pair, std::numeric_limits<double>::infinity());
    normal_ = a_.axes() * least_.normal;
    rounding_ = pair.rounding();
  }
  double gap() const { return -least_.depth; }
  Impact impact(double t) const {
    const Vector3 middle = 0.5 * (least_.point_a + least_.point_b);
    return {t, normal_, start_ + t * motion_ + a_.p() + a_.axes() * middle, least_.depth};
  }

  double step(double half_target, double rest) const {
    const double ahead = look_ahead(a_.rate() + b_.rate(), rest);
    double step = step_of(normal_, half_target, ahead, rest);
    if (step >= ahead) return step;
    const auto try_plane = [&](const Vector3& normal, const Vector3& turn) {
      if (step < ahead) step = std::max(step, step_along(normal, turn, half_target, ahead));
    };
    // rounding tilts the plane of points that lie close; those of the features it belongs to are exact
    Contour on_a, on_b;
    a_.map().contour(a_.axes().transpose() * normal_, kFlush, &on_a);
    b_.map().contour(b_.axes().transpose() * -normal_, kFlush, &on_b);
    if (on_a.is_face()) try_plane(a_.axes() * on_a.normal, a_.spin());
    if (on_b.is_face()) try_plane(b_.axes() * -on_b.normal, b_.spin());
    if (on_a.count != 2 || on_b.count != 2) return step;
    // the plane of two edges turns with neither: its normal n stays across both
    const Vector3 edge_a = (a_.axes() * (on_a.points[1] - on_a.points[0])).normalized();
    const Vector3 edge_b = (b_.axes() * (on_b.points[1] - on_b.points[0])).normalized();
    const Vector3 across = edge_a.cross(edge_b);
    const double square = across.squaredNorm();
    if (!(square > kFlush)) return step;
    const Vector3 n = across / std::copysign(std::sqrt(square), across.dot(normal_));
    // n' = p edge_a + q edge_b with n' . edge = -n . (w x edge) for both
    const double at_a = -n.dot(a_.spin().cross(edge_a)), at_b = -n.dot(b_.spin().cross(edge_b));
    const double cosine = edge_a.dot(edge_b);
    try_plane(n, n.cross((at_a - cosine * at_b) / square * edge_a + (at_b - cosine * at_a) / square * edge_b));
    return step;
  }

 private:
  // Of features that meet a plane.
  static constexpr double kFlush = 1e-6;

  // How far a plane surely parts them that stays as it is, or turns along with either solid: within `ahead`, or of what is
  // out of reach however it turns, within `rest`.
  double step_of(const Vector3& normal, double half_target, double ahead, double rest) const {
    double step = step_along(normal, Vector3::Zero(), half_target, ahead);
    for (const TurningCore* core : {&a_, &b_})
      if (step > 0.0 && step < ahead && !core->spin().isZero(0.0))
        step = std::max(step, step_along(normal, core->spin(), half_target, ahead));
    const double swept =
        normal.dot(centres_) - a_.swept_support(normal) - b_.swept_support(-normal) - rounding_ - half_target;
    if (step < rest && swept > 0.0) {
      const double closing = -normal.dot(velocity_);
      step = std::max(step, closing * rest <= swept ? rest : swept / closing);
    }
    return step;
  }

  // The same of one that turns along with w.
  double step_along(const Vector3& normal, const Vector3& w, double half_target, double ahead) const {
    const Drift drift(normal, centres_, velocity_, w, ahead);
    const TurningCore::Swing of_a = a_.swing(normal, w), of_b = b_.swing(-normal, w);
    const auto bound = [&](double s) {
      return drift(s) - a_.support(of_a, s) - b_.support(of_b, s) - rounding_ - half_target;
    };
    const double at_zero = bound(0.0);
    return at_zero > 0.0 ? safe_step(bound, at_zero, ahead) : 0.0;
  }

  TurningCore a_, b_;
  Vector3 offset_, velocity_, start_, motion_;
  Separation least_;
  Vector3 normal_, centres_;
  double rounding_ = 0.0;
};

// A half-space, first, and a bounded solid.
class HalfspaceApproach {
 public:
  HalfspaceApproach(const MovingSolid& ground, const MovingSolid& solid)
      : ground_(ground),
        b_(solid),
        offset_(solid.start.position - ground.start.position),
        velocity_(solid.motion.displacement - ground.motion.displacement) {}

  double sizes() const { return b_.map().radius(); }

  void look(double t) {
    b_.place(t);
    centres_ = offset_ + t * velocity_;
    const Quaternion turned = rotate_by(ground_.start.orientation, t * ground_.motion.rotation);
    up_ = normalized(turned * ground_.geometry.orientation) * Vector3::UnitY();
    plane_ = up_.dot(turned * ground_.geometry.position);
    gap_ = up_.dot(centres_) - plane_ - b_.support(-up_) - b_.map().rounding();
  }
  double gap() const { return gap_; }
  Impact impact(double t) const {
    const Vector3 farthest = b_.map().support(b_.axes().transpose() * -up_);
    const Vector3 foot = b_.p() + b_.axes() * farthest - b_.map().rounding() * up_;
    const Vector3 centre = ground_.start.position + t * ground_.motion.displacement + centres_;
    return {t, up_, centre + foot - (0.5 * gap_) * up_, -gap_};
  }
  double step(double half_target, double rest) const {
    const Vector3& spin = ground_.motion.rotation;
    const double ahead = look_ahead(norm_of(spin) + b_.rate(), rest);
    const Drift drift(up_, centres_, velocity_, spin, ahead);
    const TurningCore::Swing swing = b_.swing(-up_, spin);
    const double nearer = plane_ + b_.map().rounding() + half_target;
    const auto bound = [&](double s) { return drift(s) - b_.support(swing, s) - nearer; };
    const double at_zero = bound(0.0);
    if (!(at_zero > 0.0)) return 0.0;
    double step = safe_step(bound, at_zero, ahead);
    const double swept = up_.dot(centres_) - b_.swept_support(-up_) - nearer;
    if (step < rest && swept > 0.0 && spin.isZero(0.0)) {
      const double closing = -up_.dot(velocity_);
      step = std::max(step, closing * rest <= swept ? rest : swept / closing);
    }
    return step;
  }

 private:
  const MovingSolid& ground_;
  TurningCore b_;
  Vector3 offset_, velocity_;
  Vector3 up_, centres_;
  double plane_ = 0.0, gap_ = 0.0;
};

// A vertex, edge or triangle at one instant.
class CornersMap final : public SupportMap {
 public:
  void place(const MovingCorners& corners, const Vector3& origin, double t) {
    count_ = corners.count;
    radius_ = 0.0;
    for (std::size_t i = 0; i < count_; ++i) {
      corners_[i] = (corners.start[i] - origin) + t * (corners.end[i] - corners.start[i]);
      radius_ = std::max(radius_, norm_of(corners_[i]));
    }
    centre_ = corners_[0];
  }
  Vector3 support(const Vector3& d) const override {
    std::size_t farthest = 0;
    for (std::size_t i = 1; i < count_; ++i)
      if (d.dot(corners_[i]) > d.dot(corners_[farthest])) farthest = i;
    return corners_[farthest];
  }

 private:
  std::array<Vector3, 3> corners_;
  std::size_t count_ = 0;
};

class CornersApproach {
 public:
  CornersApproach(const MovingCorners& a, const MovingCorners& b) : a_(a), b_(b), origin_(a.start[0]) {
    for (const MovingCorners* side : {&a, &b})
      for (std::size_t i = 0; i < side->count; ++i)
        size_ = std::max({size_, norm_of(side->start[i] - origin_), norm_of(side->end[i] - origin_)});
  }
  double sizes() const { return size_; }
  void look(double t) {
    map_a_.place(a_, origin_, t), map_b_.place(b_, origin_, t);
    time_ = t;
    least_ = find_separation({map_a_, map_b_, Matrix3::Identity(), Vector3::Zero()},
                             std::numeric_limits<double>::infinity());
  }
  double gap() const { return -least_.depth; }
  double parted(double s) const { return -farthest(a_, least_.normal, s) - farthest(b_, -least_.normal, s); }
  double step(double half_target, double rest) const {
    const auto bound = [&](double s) { return parted(s) - half_target; };
    const double at_zero = bound(0.0);
    return at_zero > 0.0 ? safe_step(bound, at_zero, rest) : 0.0;
  }
  Impact impact(double t) const {
    return {t, least_.normal, origin_ + 0.5 * (least_.point_a + least_.point_b), least_.depth};
  }

 private:
  double farthest(const MovingCorners& corners, const Vector3& n, double s) const {
    double most = -std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < corners.count; ++i)
      most = std::max(most, n.dot(corners.start[i] - origin_) + (time_ + s) * n.dot(corners.end[i] - corners.start[i]));
    return most;
  }

  const MovingCorners &a_, &b_;
  Vector3 origin_;
  double size_ = 0.0, time_ = 0.0;
  CornersMap map_a_, map_b_;
  Separation least_;
};

template <typename Approach>
std::optional<Impact> advance(Approach* approach, double target_gap, const TimeSpan& span) {
  const double target = std::max(target_gap, 1e-10 * approach->sizes()), half = 0.5 * target;
  double t = span.begin;
  for (int i = 0;; ++i) {
    approach->look(t);
    if (!(approach->gap() > target) || i == kMostSteps) return approach->impact(t);
    const double rest = span.end - t, step = approach->step(half, rest);
    if (step >= rest) return std::nullopt;
    // the plane of the nearest points parts them less than their distance by rounding alone
    if (!(t + step > t)) return approach->impact(t);
    t += step;
  }
}

}  // namespace

std::optional<Impact> first_impact(const MovingSolid& a, const MovingSolid& b, double target_gap,
                                   const TimeSpan& span) {
  if (a.map == nullptr && b.map == nullptr) return std::nullopt;
  if (a.map != nullptr && b.map != nullptr) {
    ConvexApproach approach(a, b);
    return advance(&approach, target_gap, span);
  }
  const bool is_reversed = b.map == nullptr;
  HalfspaceApproach approach(is_reversed ? b : a, is_reversed ? a : b);
  std::optional<Impact> impact = advance(&approach, target_gap, span);
  if (impact && is_reversed) impact->normal = -impact->normal;
  return impact;
}

std::optional<Impact> first_impact(const MovingCorners& a, const MovingCorners& b, double target_gap) {
  CornersApproach approach(a, b);
  return advance(&approach, target_gap, {});
}

double greatest_travel(const MovingSolid& solid, const MovingSolid& other) {
  const Vector3 offset = solid.start.position - other.start.position;
  const Vector3 velocity = solid.motion.displacement - other.motion.displacement;
  const TurningCore core(solid);
  const double farthest = std::max(norm_of(offset), norm_of(offset + velocity)) + core.reach();
  return (norm_of(velocity) + core.travel() + norm_of(other.motion.rotation) * farthest) * (1.0 + 1e-12);
}

}  // namespace gravitas
