// Mass, centre of mass and inertia of solids of uniform density, and what turns them into the form
// in which bodies are kept: moments about the principal axes through the centre of mass.
//
// Everything here is a function of its arguments by a fixed sequence of IEEE operations. The
// eigenvectors come from our own cyclic Jacobi, whose bits depend on no library.
//
// Preconditions common to all functions: sizes and densities are finite and greater than zero,
// masses finite and not negative. The caller checks them; numbers that break them give
// meaningless or non-finite results, which validate() finds.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "plugin_sdk/math/pose.h"
#include "plugin_sdk/math/types.h"

namespace gravitas {

// The inertia of a point mass m at r from the centre of mass adds m (r^2 1 - r r^T): moments of
// inertia on the diagonal, products of inertia with the minus sign of § 2.3.2.2, (2.30).
struct MassProperties {
  double mass = 0.0;                         // kg
  Vector3 centre_of_mass = Vector3::Zero();  // m, geometry frame
  Matrix3 inertia = Matrix3::Zero();         // kg m^2, about the centre of mass, geometry axes
};

// The inertia of MassProperties is R diag(moments) R^T with R the matrix of the orientation.
struct PrincipalAxes {
  Vector3 moments = Vector3::Zero();                // kg m^2
  Quaternion orientation = Quaternion::Identity();  // geometry frame <- principal frame, unit
};

// A ball about the origin: m = 4/3 pi r^3 rho, I = 2/5 m r^2. Radius in m, density in kg/m^3.
// Source: § 2.3.2.3, (2.37a), corrected: 8/15 pi r^5 rho, where the seed has r^4.
MassProperties sphere_mass_properties(double radius, double density);

// A box about the origin with half extents (a, b, c) in m: m = 8abc rho, I_x = m/3 (b^2 + c^2) and
// cyclic. Source: (2.37b), whose w, h, d are full sizes.
MassProperties box_mass_properties(const Vector3& half_extents, double density);

// A cylinder about the origin, its axis along y, of full height h: m = pi r^2 h rho,
// I_y = m r^2/2, I_x = I_z = m (3 r^2 + h^2)/12. Source: (2.37c).
MassProperties cylinder_mass_properties(double radius, double height, double density);

// A capsule about the origin, its axis along y, h between the centres of its half balls: the cylinder of height h and the
// two halves of a ball, whose centroids lie 3/8 r beyond the ends.
MassProperties capsule_mass_properties(double radius, double height, double density);

// A cone about the y axis, apex at +h/2, base at -h/2: m = pi r^2 h/3 rho, centroid at -h/4, about it
// I_y = 3/10 m r^2, I_x = I_z = m (3/20 r^2 + 3/80 h^2).
MassProperties cone_mass_properties(double radius, double height, double density);

// The solid within a closed surface of triangles (three indices each, counter-clockwise from outside), exactly: the sum
// over signed tetrahedra, which equals the surface integrals of B. Mirtich, "Fast and accurate computation of polyhedral
// mass properties" (1996). (2.32) is the distribution tensor that it sums.
MassProperties solid_mass_properties(std::span<const Vector3> vertices, std::span<const std::uint32_t> triangles,
                                     double density);

// An open surface as thin plates, its triangles, exactly: the corners' distances d from the centroid give each the second moment
// m/12 sum(d d^T). Density in kg/m^2. § 4.3.1.5 has point masses at the centroids, without which a single triangle has no inertia.
MassProperties shell_mass_properties(std::span<const Vector3> vertices, std::span<const std::uint32_t> triangles,
                                     double density);

// The same body with its density changed so that it has this mass (kg). Precondition: the given
// mass is not zero.
MassProperties scaled_to_mass(const MassProperties& properties, double mass);

// The parallel-axis theorem: I_d = I_c + m (r^2 1 - r r^T), from the inertia about the centre of
// mass to that about a point at distance r (m), same axes. Source: (2.33), with column vectors.
Matrix3 translated_inertia(const Matrix3& inertia_about_centre, double mass, const Vector3& r);

// The same body described in frame A, given the pose X_AB of its frame B in A. The inertia stays
// exactly symmetric.
MassProperties transformed(const MassProperties& properties, const Pose& X_AB);

// One rigid body out of several, all described in the same frame; overlapping parts count twice. An
// empty list, or one without mass, gives zero mass at the origin without inertia.
MassProperties combined(std::span<const MassProperties> parts);

// The principal moments and axes. The inertia's symmetric part is used.
//
// Products of inertia below 2^-48 of the largest moment count as zero, so an inertia that is
// diagonal within rounding (a plain box, a ball) keeps its axes and their order, with orientation
// exactly the identity. Otherwise the axes are right-handed, and the moments are not sorted: each
// axis is the one the Jacobi rotations (each at most pi/4) lead to, so that a small product of
// inertia turns the frame by a small angle only, except between equal moments, where any axes of
// their plane are principal. Non-finite entries give NaN moments and the identity.
PrincipalAxes principal_axes(const MassProperties& properties);

// Whether this can be the mass and inertia of a solid body: every number finite, mass and principal
// moments positive, the inertia symmetric, and no moment greater than the sum of the other two
// (§ 2.3.2.2: I_x + I_y - I_z = 2 sum m z^2). Symmetry and the sum are tested to 1e-5 of the
// largest moment, so that a flat plate written with six digits passes. If not, *why, when given,
// says which rule is broken and by which number.
bool validate(const MassProperties& properties, std::string* why);

}  // namespace gravitas
