// The linear-algebra types every public interface speaks. They are fixed-size Eigen types in double
// precision, so that no result depends on a run-time choice of kernel, and they are named here so
// that no other file has to decide.
//
// Vectors are columns, matrices act from the left, and quaternions are (w, x, y, z) Hamilton
// quaternions: the product q * p rotates by p first and by q second.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace gravitas {

// A point, direction, velocity, force or any other triple; its unit and frame are stated where it
// is used.
using Vector3 = Eigen::Vector3d;

// A rotation, an inertia tensor or any other linear map of triples.
using Matrix3 = Eigen::Matrix3d;

// A homogeneous transform.
using Matrix4 = Eigen::Matrix4d;

// A rotation. Unit norm is a precondition wherever a quaternion rotates something.
using Quaternion = Eigen::Quaterniond;

}  // namespace gravitas
