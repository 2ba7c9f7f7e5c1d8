// Closed forms of the primitive solids, sums by the parallel-axis theorem, and the principal axes
// by Jacobi's method, which on a 3x3 needs a handful of rotations, no transcendental function, and
// starts from the given axes, so that axes which are principal already stay where they are.
#include "plugin_sdk/geometry/mass_properties.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <sstream>
#include <vector>

#include "plugin_sdk/math/rotation.h"

namespace gravitas {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kNegligibleProduct = 0x1p-48;
constexpr double kWrittenPrecision = 1e-5;

// Jacobi converges quadratically; six sweeps suffice for any 3x3, the rest is reserve.
constexpr int kMaxSweeps = 24;

Matrix3 symmetric_part(const Matrix3& m) { return 0.5 * (m + m.transpose()); }

// Turns axes p and q of the symmetric matrix a so that a(p, q) becomes zero, and the columns of
// the axes along: tan(2 phi) = 2 a_pq / (a_qq - a_pp), |phi| <= pi/4.
void jacobi_rotate(Matrix3& a, Matrix3& axes, int p, int q) {
  const double theta = (a(q, q) - a(p, p)) / (2.0 * a(p, q));
  const double sign = theta >= 0.0 ? 1.0 : -1.0;
  const double t = sign / (std::fabs(theta) + std::sqrt(theta * theta + 1.0));
  const double c = 1.0 / std::sqrt(t * t + 1.0);
  const double s = t * c;

  const int r = 3 - p - q;
  const double a_pq = a(p, q);
  const double a_rp = a(r, p);
  const double a_rq = a(r, q);
  a(p, p) -= t * a_pq;
  a(q, q) += t * a_pq;
  a(p, q) = a(q, p) = 0.0;
  a(r, p) = a(p, r) = c * a_rp - s * a_rq;
  a(r, q) = a(q, r) = s * a_rp + c * a_rq;

  const Vector3 old_p = axes.col(p);
  const Vector3 old_q = axes.col(q);
  axes.col(p) = c * old_p - s * old_q;
  axes.col(q) = s * old_p + c * old_q;
}

// States the first broken rule; always false, for the caller to return.
template <typename... Parts>
bool refuse(std::string* why, const Parts&... parts) {
  if (why != nullptr) {
    std::ostringstream text;
    text.precision(17);
    (text << ... << parts);
    *why = text.str();
  }
  return false;
}

}  // namespace

MassProperties sphere_mass_properties(double radius, double density) {
  MassProperties result;
  result.mass = 4.0 / 3.0 * kPi * radius * radius * radius * density;
  result.inertia.diagonal().setConstant(0.4 * result.mass * radius * radius);
  return result;
}

MassProperties box_mass_properties(const Vector3& half_extents, double density) {
  const Vector3 square = half_extents.cwiseProduct(half_extents);
  MassProperties result;
  result.mass = 8.0 * half_extents.x() * half_extents.y() * half_extents.z() * density;
  result.inertia.diagonal() =
      result.mass / 3.0 * Vector3(square.y() + square.z(), square.x() + square.z(), square.x() + square.y());
  return result;
}

MassProperties cylinder_mass_properties(double radius, double height, double density) {
  MassProperties result;
  result.mass = kPi * radius * radius * height * density;
  const double along = 0.5 * result.mass * radius * radius;
  const double across = result.mass * (3.0 * radius * radius + height * height) / 12.0;
  result.inertia.diagonal() = Vector3(across, along, across);
  return result;
}

MassProperties capsule_mass_properties(double radius, double height, double density) {
  const MassProperties middle = cylinder_mass_properties(radius, height, density);
  MassProperties half;
  half.mass = 2.0 / 3.0 * kPi * radius * radius * radius * density;
  // about the centre of the ball 2/5 m r^2, so about the centroid 3/8 r away 83/320 m r^2 across the axis
  const double across = 83.0 / 320.0 * half.mass * radius * radius;
  half.inertia.diagonal() = Vector3(across, 0.4 * half.mass * radius * radius, across);
  const double arm = 0.5 * height + 0.375 * radius;
  MassProperties result;
  result.mass = middle.mass + 2.0 * half.mass;
  result.inertia = middle.inertia + 2.0 * translated_inertia(half.inertia, half.mass, arm * Vector3::UnitY());
  return result;
}

MassProperties cone_mass_properties(double radius, double height, double density) {
  MassProperties result;
  result.mass = kPi * radius * radius * height / 3.0 * density;
  result.centre_of_mass.y() = -0.25 * height;
  const double across = result.mass * (0.15 * radius * radius + 0.0375 * height * height);
  result.inertia.diagonal() = Vector3(across, 0.3 * result.mass * radius * radius, across);
  return result;
}

MassProperties solid_mass_properties(std::span<const Vector3> vertices, std::span<const std::uint32_t> triangles,
                                     double density) {
  // a point within, so that far from the origin nothing cancels
  Vector3 origin = Vector3::Zero();
  for (const Vector3& v : vertices) origin += v / static_cast<double>(vertices.size());
  double volume = 0.0;
  Vector3 moment = Vector3::Zero();
  Matrix3 second = Matrix3::Zero();
  for (std::size_t i = 0; i + 2 < triangles.size(); i += 3) {
    const Vector3 a = vertices[triangles[i]] - origin, b = vertices[triangles[i + 1]] - origin,
                  c = vertices[triangles[i + 2]] - origin;
    const Vector3 sum = a + b + c;
    const double six_volumes = a.dot(b.cross(c));
    volume += six_volumes / 6.0;
    moment += six_volumes / 24.0 * sum;
    second += six_volumes / 120.0 * (sum * sum.transpose() + a * a.transpose() + b * b.transpose() + c * c.transpose());
  }
  MassProperties result;
  result.mass = volume * density;
  const Vector3 centre = moment / volume;
  result.centre_of_mass = origin + centre;
  const Matrix3 central = density * symmetric_part(second - volume * (centre * centre.transpose()));
  result.inertia = central.trace() * Matrix3::Identity() - central;
  return result;
}

MassProperties shell_mass_properties(std::span<const Vector3> vertices, std::span<const std::uint32_t> triangles,
                                     double density) {
  std::vector<MassProperties> plates;
  for (std::size_t i = 0; i + 2 < triangles.size(); i += 3) {
    const Vector3 &a = vertices[triangles[i]], &b = vertices[triangles[i + 1]], &c = vertices[triangles[i + 2]];
    MassProperties& plate = plates.emplace_back();
    plate.mass = 0.5 * density * std::sqrt((b - a).cross(c - a).squaredNorm());
    plate.centre_of_mass = (a + b + c) / 3.0;
    Matrix3 second = Matrix3::Zero();
    for (const Vector3& corner : {a, b, c}) {
      const Vector3 arm = corner - plate.centre_of_mass;
      second += plate.mass / 12.0 * (arm * arm.transpose());
    }
    plate.inertia = second.trace() * Matrix3::Identity() - second;
  }
  return combined(plates);
}

MassProperties scaled_to_mass(const MassProperties& properties, double mass) {
  MassProperties result = properties;
  result.mass = mass;
  result.inertia = properties.inertia * (mass / properties.mass);
  return result;
}

Matrix3 translated_inertia(const Matrix3& inertia_about_centre, double mass, const Vector3& r) {
  const double xx = r.x() * r.x();
  const double yy = r.y() * r.y();
  const double zz = r.z() * r.z();
  const double xy = -r.x() * r.y();
  const double xz = -r.x() * r.z();
  const double yz = -r.y() * r.z();
  Matrix3 point;
  point << yy + zz, xy, xz, xy, xx + zz, yz, xz, yz, xx + yy;
  return inertia_about_centre + mass * point;
}

MassProperties transformed(const MassProperties& properties, const Pose& X_AB) {
  const Matrix3 R = to_rotation_matrix(X_AB.orientation);
  MassProperties result;
  result.mass = properties.mass;
  result.centre_of_mass = transform_point(X_AB, properties.centre_of_mass);
  result.inertia = symmetric_part(R * properties.inertia * R.transpose());
  return result;
}

MassProperties combined(std::span<const MassProperties> parts) {
  MassProperties result;
  Vector3 moment = Vector3::Zero();
  for (const MassProperties& part : parts) {
    result.mass += part.mass;
    moment += part.mass * part.centre_of_mass;
  }
  if (result.mass == 0.0) return MassProperties{};
  result.centre_of_mass = moment / result.mass;
  for (const MassProperties& part : parts) {
    result.inertia += translated_inertia(part.inertia, part.mass, part.centre_of_mass - result.centre_of_mass);
  }
  return result;
}

PrincipalAxes principal_axes(const MassProperties& properties) {
  PrincipalAxes result;
  Matrix3 a = symmetric_part(properties.inertia);
  if (!a.allFinite()) {
    result.moments.setConstant(std::numeric_limits<double>::quiet_NaN());
    return result;
  }
  const double negligible = kNegligibleProduct * a.diagonal().cwiseAbs().maxCoeff();
  Matrix3 axes = Matrix3::Identity();
  bool turned = false;
  for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
    bool diagonal = true;
    for (int p = 0; p < 2; ++p) {
      for (int q = p + 1; q < 3; ++q) {
        if (std::fabs(a(p, q)) <= negligible) continue;
        jacobi_rotate(a, axes, p, q);
        diagonal = false;
        turned = true;
      }
    }
    if (diagonal) break;
  }
  result.moments = a.diagonal();
  if (turned) result.orientation = to_quaternion(axes);
  return result;
}

bool validate(const MassProperties& properties, std::string* why) {
  if (!std::isfinite(properties.mass)) return refuse(why, "mass is not finite");
  if (!properties.centre_of_mass.allFinite()) return refuse(why, "centre of mass is not finite");
  if (!properties.inertia.allFinite()) return refuse(why, "inertia is not finite");
  if (!(properties.mass > 0.0)) {
    return refuse(why, "mass must be positive, is ", properties.mass, " kg");
  }
  const Matrix3& I = properties.inertia;
  const double skewness = (I - I.transpose()).cwiseAbs().maxCoeff();
  if (!(skewness <= kWrittenPrecision * I.cwiseAbs().maxCoeff())) {
    return refuse(why, "inertia must be symmetric, deviates by ", skewness, " kg m^2");
  }
  const Vector3 moments = principal_axes(properties).moments;
  if (!(moments.minCoeff() > 0.0)) {
    return refuse(why, "principal moments must be positive, the least is ", moments.minCoeff(), " kg m^2");
  }
  const double largest = moments.maxCoeff();
  const double others = moments.sum() - largest;
  if (!(largest <= others + kWrittenPrecision * largest)) {
    return refuse(why, "a principal moment of ", largest, " kg m^2 exceeds the sum of the other two, ", others,
                  " kg m^2");
  }
  return true;
}

}  // namespace gravitas
