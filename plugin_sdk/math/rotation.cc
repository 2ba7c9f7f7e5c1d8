// Conversions and repairs of rotations; the formulas stand in the header. Lengths are taken after
// scaling by a power of two where squares could leave the range of a double.
#include "plugin_sdk/math/rotation.h"

#include <cmath>

#include "plugin_sdk/math/transcendental.h"

namespace gravitas {
namespace {

// Squared angle (rad^2) below which the series of sin(x/2)/x ends at x^4 within 2^-57, that of cos(x/2) at x^6 within
// 2^-76.
constexpr double kSeriesAngleSquared = 1e-4;

// Tangent of the half angle below which atan(x)/x ends at x^2 within 2^-100.
constexpr double kSeriesTangent = 1e-8;

constexpr double kDependentSine = 1e-9;

// A power of two that brings a number of this magnitude to where its square is harmless; 1 if it
// is there already, zero, or not finite.
double range_scale(double magnitude) {
  if (magnitude == 0.0 || !std::isfinite(magnitude)) return 1.0;
  if (magnitude > 1e-140 && magnitude < 1e140) return 1.0;
  return magnitude > 1.0 ? 0x1p-600 : 0x1p600;
}

double length(const Vector3& v) {
  const double scale = range_scale(v.cwiseAbs().maxCoeff());
  const Vector3 in_range = v * scale;
  const double square = in_range.x() * in_range.x() + in_range.y() * in_range.y() + in_range.z() * in_range.z();
  return std::sqrt(square) / scale;
}

Quaternion negated(const Quaternion& q) { return Quaternion(-q.w(), -q.x(), -q.y(), -q.z()); }

}  // namespace

Quaternion normalized(const Quaternion& q) {
  // of most, the squares are harmless as they are
  const double square = (q.w() * q.w() + q.x() * q.x()) + (q.y() * q.y() + q.z() * q.z());
  if (square > 1e-200 && square < 1e200) {
    const double norm = std::sqrt(square);
    return Quaternion(q.w() / norm, q.x() / norm, q.y() / norm, q.z() / norm);
  }
  const double scale = range_scale(q.coeffs().cwiseAbs().maxCoeff());
  const double w = q.w() * scale;
  const double x = q.x() * scale;
  const double y = q.y() * scale;
  const double z = q.z() * scale;
  const double norm = std::sqrt((w * w + x * x) + (y * y + z * z));
  return Quaternion(w / norm, x / norm, y / norm, z / norm);
}

Quaternion shorter_arc(const Quaternion& q) { return q.w() < 0.0 ? negated(q) : q; }

Quaternion shorter_arc(const Quaternion& q, const Quaternion& reference) {
  const double cosine =
      (q.w() * reference.w() + q.x() * reference.x()) + (q.y() * reference.y() + q.z() * reference.z());
  return cosine < 0.0 ? negated(q) : q;
}

Matrix3 to_rotation_matrix(const Quaternion& q) {
  const double w = q.w();
  const double x = q.x();
  const double y = q.y();
  const double z = q.z();
  Matrix3 R;
  R << 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w), 2.0 * (x * y + z * w),
      1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w), 2.0 * (x * z - y * w), 2.0 * (y * z + x * w),
      1.0 - 2.0 * (x * x + y * y);
  return R;
}

Quaternion to_quaternion(const Matrix3& rotation) {
  const Matrix3& R = rotation;
  const double trace = R(0, 0) + R(1, 1) + R(2, 2);
  int largest = 0;
  for (int i = 1; i < 3; ++i) {
    if (R(i, i) > R(largest, largest)) largest = i;
  }

  // each branch is the quaternion times four times its largest component
  if (trace >= R(largest, largest)) {
    return normalized(Quaternion(1.0 + trace, R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1)));
  }
  const int i = largest;
  const int j = (i + 1) % 3;
  const int k = (i + 2) % 3;
  Vector3 u;
  u[i] = 1.0 + R(i, i) - R(j, j) - R(k, k);
  u[j] = R(i, j) + R(j, i);
  u[k] = R(i, k) + R(k, i);
  return shorter_arc(normalized(Quaternion(R(k, j) - R(j, k), u.x(), u.y(), u.z())));
}

Quaternion exp_rotation(const Vector3& rotation_vector) {
  const Vector3& v = rotation_vector;
  // one that underflows has no part in the series, one that overflows none of the series
  const double square = v.x() * v.x() + v.y() * v.y() + v.z() * v.z();
  if (square < kSeriesAngleSquared) {
    const double factor = 0.5 - square * (1.0 / 48.0 - square * (1.0 / 3840.0));
    const double cosine = 1.0 - square * (1.0 / 8.0 - square * (1.0 / 384.0 - square * (1.0 / 46080.0)));
    return Quaternion(cosine, factor * v.x(), factor * v.y(), factor * v.z());
  }
  const double angle = length(v);
  const math::SinCos half = math::sincos(0.5 * angle);
  return Quaternion(half.cos, v.x() / angle * half.sin, v.y() / angle * half.sin, v.z() / angle * half.sin);
}

Vector3 log_rotation(const Quaternion& q) {
  const Quaternion nearer = shorter_arc(q);
  const double w = nearer.w();
  const Vector3 u = nearer.vec();
  const double sine = length(u);
  if (sine < kSeriesTangent * w) {
    const double tangent = sine / w;
    return u * (2.0 / w * (1.0 - tangent * tangent / 3.0));
  }
  return u / sine * (2.0 * math::atan2(sine, w));
}

Quaternion rotate_by(const Quaternion& q, const Vector3& rotation_vector) {
  if (rotation_vector == Vector3::Zero()) return q;
  return normalized(exp_rotation(rotation_vector) * q);
}

Vector3 rotation_vector_rate(const Vector3& rotation_vector, const Vector3& angular_velocity) {
  // below this squared angle the series of the factor ends within 2^-53
  constexpr double kSeriesRateSquared = 4e-3;
  const Vector3 &r = rotation_vector, &w = angular_velocity;
  const Vector3 turned = r.cross(w);
  if (turned.isZero(0.0)) return w;
  const double square = r.squaredNorm();
  double factor = 1.0 / 12.0 + square * (1.0 / 720.0 + square * (1.0 / 30240.0 + square / 1209600.0));
  if (square > kSeriesRateSquared) {
    const double half = 0.5 * std::sqrt(square);
    const math::SinCos angle = math::sincos(half);
    factor = (1.0 - half * angle.cos / angle.sin) / square;
  }
  return w - 0.5 * turned + factor * r.cross(turned);
}

std::optional<Matrix3> orthonormalized(const Matrix3& matrix) {
  if (!matrix.allFinite()) return std::nullopt;
  Matrix3 unit;
  for (int i = 0; i < 3; ++i) {
    const Vector3 column = matrix.col(i) * range_scale(matrix.col(i).cwiseAbs().maxCoeff());
    const double size = length(column);
    if (size == 0.0) return std::nullopt;
    unit.col(i) = column / size;
  }
  const Vector3 u = unit.col(0);
  Vector3 v = unit.col(1);
  v -= v.dot(u) * u;
  const double sine = length(v);
  if (sine < kDependentSine) return std::nullopt;
  v /= sine;
  // the first projection leaves a rounding error divided by the sine
  v -= v.dot(u) * u;
  v /= length(v);
  const Vector3 w = u.cross(v);
  if (!(w.dot(unit.col(2)) >= kDependentSine)) return std::nullopt;
  Matrix3 result;
  result << u, v, w;
  return result;
}

TangentBasis orthonormal_basis(const Vector3& normal) {
  const double x = normal.x();
  const double y = normal.y();
  const double z = normal.z();
  const double sign = z >= 0.0 ? 1.0 : -1.0;
  const double a = -1.0 / (sign + z);
  const double b = x * y * a;
  return {Vector3(1.0 + sign * x * x * a, sign * b, -sign * x), Vector3(b, sign + y * y * a, -y)};
}

Matrix3 skew(const Vector3& v) {
  Matrix3 result;
  result << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return result;
}

Matrix3 world_inertia(const Quaternion& orientation, const Vector3& principal_moments) {
  const Matrix3 R = to_rotation_matrix(orientation);
  const Vector3& m = principal_moments;
  Matrix3 result;
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) {
      result(i, j) = R(i, 0) * m[0] * R(j, 0) + R(i, 1) * m[1] * R(j, 1) + R(i, 2) * m[2] * R(j, 2);
      result(j, i) = result(i, j);
    }
  }
  return result;
}

Matrix3 world_inverse_inertia(const Quaternion& orientation, const Vector3& inverse_principal_moments) {
  return world_inertia(orientation, inverse_principal_moments);
}

}  // namespace gravitas
