#include "tests/bench/peers/judges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas::peers {
namespace {

void keep_largest(Figures* figures, const std::string& name, double value) {
  const auto [place, is_new] = figures->try_emplace(name, value);
  // a number that is none stays
  if (!is_new && !(value <= place->second)) place->second = value;
}

bool is_end(const Scene& scene, double time) { return time > scene.duration() - 0.5 * scene.time_step; }

// ---- the free top ------------------------------------------------------------------------------------------------
// Angular velocity in the body's frame, and attitude.
using TopState = std::array<long double, 7>;

TopState derivative(const Vector3& inertia, const TopState& s) {
  const long double a = inertia.x(), b = inertia.y(), c = inertia.z();
  return {(b - c) / a * s[1] * s[2],
          (c - a) / b * s[2] * s[0],
          (a - b) / c * s[0] * s[1],
          0.5L * (-s[4] * s[0] - s[5] * s[1] - s[6] * s[2]),
          0.5L * (s[3] * s[0] + s[5] * s[2] - s[6] * s[1]),
          0.5L * (s[3] * s[1] + s[6] * s[0] - s[4] * s[2]),
          0.5L * (s[3] * s[2] + s[4] * s[1] - s[5] * s[0])};
}

TopState moved(const TopState& s, long double h, const TopState& rate) {
  TopState next = s;
  for (std::size_t i = 0; i < s.size(); ++i) next[i] += h * rate[i];
  return next;
}

// Runge-Kutta of order 4 with steps of 20 us; half of it changes the answer by less than 1e-13 rad.
Quaternion attitude_after(const SceneBody& body, double time) {
  constexpr int kSteps = 500'000;
  const Vector3 spin = body.start.twist.angular;
  TopState s{spin.x(), spin.y(), spin.z(), 1, 0, 0, 0};
  const long double h = static_cast<long double>(time) / kSteps;
  for (int i = 0; i < kSteps; ++i) {
    const TopState one = derivative(body.inertia, s);
    const TopState two = derivative(body.inertia, moved(s, h / 2, one));
    const TopState three = derivative(body.inertia, moved(s, h / 2, two));
    const TopState four = derivative(body.inertia, moved(s, h, three));
    for (std::size_t k = 0; k < s.size(); ++k) s[k] += h / 6 * (one[k] + 2 * two[k] + 2 * three[k] + four[k]);
  }
  return normalized(Quaternion(static_cast<double>(s[3]), static_cast<double>(s[4]), static_cast<double>(s[5]),
                               static_cast<double>(s[6])));
}

double spin_energy(const SceneBody& body, const BodyState& state) {
  return kinetic_energy(body.mass, body.inertia, state.pose.orientation, state.twist);
}

// ---- overlaps ----------------------------------------------------------------------------------------------------
// How far a body reaches along a unit direction from its centre, m.
double reach(const SceneBody& body, const Matrix3& axes, const Vector3& direction) {
  if (body.form == Form::kSphere) return body.half_sizes.x();
  return (axes.transpose() * direction).cwiseAbs().dot(body.half_sizes);
}

double depth_under(const Plane& plane, const SceneBody& body, const Matrix3& axes, const Vector3& centre) {
  return plane.offset - plane.normal.dot(centre) + reach(body, axes, plane.normal);
}

// The shortest way that parts two boxes is along a normal of a face or across two edges; negative where they are apart.
double depth_of_boxes(const SceneBody& a, const Matrix3& axes_a, const SceneBody& b, const Matrix3& axes_b,
                      const Vector3& between) {
  double least = HUGE_VAL;
  const auto part = [&](const Vector3& axis) {
    if (const double length = axis.norm(); length > 1e-6)
      least = std::min(least, reach(a, axes_a, axis / length) + reach(b, axes_b, axis / length) -
                                  std::fabs(between.dot(axis)) / length);
  };
  for (int i = 0; i < 3; ++i) {
    part(axes_a.col(i));
    part(axes_b.col(i));
    for (int k = 0; k < 3; ++k) part(axes_a.col(i).cross(axes_b.col(k)));
  }
  return least;
}

// Of balls among themselves, boxes among themselves, and either with planes, m; 0: none.
double deepest(const Scene& scene, const std::vector<BodyState>& bodies) {
  std::vector<Matrix3> axes(bodies.size());
  std::vector<double> radius(bodies.size());  // of the sphere around it
  double most = 0.0;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const SceneBody& body = scene.bodies[i];
    axes[i] = to_rotation_matrix(bodies[i].pose.orientation);
    radius[i] = body.form == Form::kSphere ? body.half_sizes.x() : body.half_sizes.norm();
    for (const Plane& plane : scene.planes)
      most = std::max(most, depth_under(plane, body, axes[i], bodies[i].pose.position));
  }
  // sweep along x
  std::vector<std::size_t> order(bodies.size());
  std::iota(order.begin(), order.end(), 0);
  const auto start = [&](std::size_t i) { return bodies[i].pose.position.x() - radius[i]; };
  std::ranges::sort(order, {}, start);
  for (std::size_t m = 0; m < order.size(); ++m) {
    const std::size_t i = order[m];
    for (std::size_t n = m + 1; n < order.size() && start(order[n]) < start(i) + 2.0 * radius[i]; ++n) {
      const std::size_t k = order[n];
      const Vector3 between = bodies[k].pose.position - bodies[i].pose.position;
      const double spheres = radius[i] + radius[k] - between.norm();
      if (spheres <= most) continue;
      const bool has_boxes = scene.bodies[i].form == Form::kBox;
      most = std::max(
          most, has_boxes ? depth_of_boxes(scene.bodies[i], axes[i], scene.bodies[k], axes[k], between) : spheres);
    }
  }
  return most;
}

}  // namespace

void nothing(const Scene&, const std::vector<BodyState>&, double, Figures*) {}

void fall(const Scene& scene, const std::vector<BodyState>& bodies, double time, Figures* figures) {
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const BodyState& start = scene.bodies[i].start;
    const Vector3 exact = start.pose.position + time * start.twist.linear + 0.5 * time * time * scene.gravity;
    keep_largest(figures, "error_m", (bodies[i].pose.position - exact).norm());
  }
}

void turn(const Scene& scene, const std::vector<BodyState>& bodies, double time, Figures* figures) {
  if (!is_end(scene, time)) return;
  static const Quaternion exact = attitude_after(scene.bodies[0], scene.duration());
  const double before = spin_energy(scene.bodies[0], scene.bodies[0].start);
  (*figures)["energy_drift"] = spin_energy(scene.bodies[0], bodies[0]) / before - 1.0;
  (*figures)["attitude_error_rad"] =
      log_rotation(shorter_arc(normalized(bodies[0].pose.orientation) * exact.conjugate())).norm();
}

void stand(const Scene& scene, const std::vector<BodyState>& bodies, double time, Figures* figures) {
  bool stands = true;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const Vector3 off = bodies[i].pose.position - scene.bodies[i].start.pose.position;
    keep_largest(figures, "sag_mm", -1e3 * off.y());
    stands = stands && off.norm() < scene.bodies[i].half_sizes.y();
  }
  if (is_end(scene, time)) (*figures)["stands"] = stands ? 1.0 : 0.0;
}

void hang(const Scene& scene, const std::vector<BodyState>& bodies, double time, Figures* figures) {
  // where the point of a joint, fixed in a body, has gone
  const auto carried = [&](std::uint32_t body, const Vector3& point) -> Vector3 {
    if (body == kNone) return point;
    const Pose &start = scene.bodies[body].start.pose, &now = bodies[body].pose;
    return now.position + now.orientation * (start.orientation.conjugate() * (point - start.position));
  };
  for (const BallJoint& joint : scene.joints)
    keep_largest(figures, "gap_m", (carried(joint.body1, joint.point) - carried(joint.body2, joint.point)).norm());
  if (is_end(scene, time))
    (*figures)["tip_error_m"] = (bodies.back().pose.position - Vector3(-0.49554864, -10.4881963, 0.0)).norm();
}

void rebound(const Scene& scene, const std::vector<BodyState>& bodies, double time, Figures* figures) {
  if (!is_end(scene, time)) return;
  const double g = -scene.gravity.y(), radius = scene.bodies[0].half_sizes.x();
  const double before = g * (scene.bodies[0].start.pose.position.y() - radius);
  const double after = g * (bodies[0].pose.position.y() - radius) + 0.5 * bodies[0].twist.linear.squaredNorm();
  (*figures)["energy_error"] = after / before - 1.0;
}

void stop(const Scene& scene, const std::vector<BodyState>& bodies, double time, Figures* figures) {
  if (!is_end(scene, time)) return;
  const BodyState& start = scene.bodies[0].start;
  Vector3 way = bodies[0].pose.position - start.pose.position;
  way.y() = 0.0;
  const Vector3& velocity = start.twist.linear;
  const double wanted = velocity.squaredNorm() / (-2.0 * scene.friction * scene.gravity.y());
  (*figures)["distance_error"] = way.norm() / wanted - 1.0;
  const double angle = std::atan2(velocity.cross(way).norm(), velocity.dot(way));
  (*figures)["direction_error_deg"] = 180.0 / std::numbers::pi * angle;
}

void overlap(const Scene& scene, const std::vector<BodyState>& bodies, double, Figures* figures) {
  keep_largest(figures, "depth_mm", 1e3 * deepest(scene, bodies));
}

void stand_and_overlap(const Scene& scene, const std::vector<BodyState>& bodies, double time, Figures* figures) {
  stand(scene, bodies, time, figures);
  overlap(scene, bodies, time, figures);
}

void settle(const Scene& scene, const std::vector<BodyState>& bodies, double time, Figures* figures) {
  const double depth = 1e3 * deepest(scene, bodies);
  keep_largest(figures, "depth_mm", depth);
  if (time > scene.duration() - 1.0) keep_largest(figures, "settled_depth_mm", depth);
  if (!is_end(scene, time)) return;
  (*figures)["lost"] = static_cast<double>(std::ranges::count_if(bodies, [&](const BodyState& body) {
    return std::ranges::any_of(scene.planes,
                               [&](const Plane& plane) { return plane.normal.dot(body.pose.position) < plane.offset; });
  }));
}

}  // namespace gravitas::peers
