// The exact motion of a rigid body that nothing turns.
//
// In principal axes with J = 1/I and body momentum m, m^. = m x J m has the integrals G = |m| and 2T = m.Jm. With the
// moments sorted, I_1 <= I_2 <= I_3, a_1 = J_2 - J_3, a_2 = J_1 - J_3, a_3 = J_1 - J_2 and
//
//   M_1^2 = m_1^2 + (a_1/a_2) m_2^2,   M_3^2 = m_3^2 + (a_3/a_2) m_2^2      (M_1^2 + M_3^2 = G^2)
//   delta = a_1 m_3^2 - a_3 m_1^2
//
// delta > 0 is motion around axis 3,  m = (M_1 cn u, M_1 sqrt(a_2/a_1) sn u, +-M_3 dn u) at the modulus
// 1 - k^2 = delta / (a_1 M_3^2), u' = +-M_3 sqrt(a_1 a_2); delta < 0 that around axis 1, with 1 and 3 exchanged;
// delta = 0 the separatrix, k = 1. From m at the start the addition theorem leads on. No difference of nearly equal
// numbers enters but those of the moments.
//
// Attitude: the space-fixed direction L of the momentum is n = m/G in the body. A body axis e_k goes around L at
//   Psi' = G (J_i m_i^2 + J_j m_j^2) / (m_i^2 + m_j^2),     i, j the others,
// so with B(n) = (f_2 x n, f_2, n), f_2 = e_k x n / |e_k x n|, R(t) = R(0) Rot(n_0, Psi) B(n_0) B(n_t)^T. With k in
// {1, 3} the axis of the smaller of M_1, M_3 the denominator is never below G^2/2, and Psi is got by Gauss-Legendre
// quadrature of eight points on panels so short (0.35 in u; the nearest pole is pi/4 away) that it is exact to rounding;
// whole periods are counted, not summed.
//
// Where u moves by 0.08 at most, as in most steps, n is summed from its Taylor series, and R(0)^T R(t) is the shortest turn
// from n_t to n_0 and one about n_0 by 2T t/G less the area between the path of n and the arc (by quadrature): without axes
// and elliptic functions, in a fifth of the time, and as exact.
//
// Sources: Landau-Lifshitz, Mechanics § 37; Celledoni, Fasso, Safstrom, Zanna, SIAM J. Sci. Comput. 30 (2008) 2084, who
// take Psi from theta functions.
#pragma once

#include "plugin_sdk/math/types.h"

namespace gravitas {

struct RotorMotion {
  Vector3 momentum;  // body axes, kg m^2/s
  Quaternion turn;   // of the body in its own axes: q' = q turn
};

// The motion in `time` (s, of either sign) of a body with the inverse principal moments `inverse_moments`
// (1/(kg m^2), all > 0) and the angular momentum `momentum` in body axes. Exact to rounding for any time: the error
// grows as 1e-16 times the angle turned. NaN in gives NaN out.
RotorMotion free_rotor(const Vector3& inverse_moments, const Vector3& momentum, double time);

// The same of a body in the world: attitude (body to world) and angular velocity (world, rad/s) after `time`. At rest it keeps
// both bit for bit. Its energy and momentum do not drift: velocities are turned to and fro with one rounding, and divided by
// the moments (kg m^2, all > 0) themselves.
struct Turning {
  Quaternion orientation;
  Vector3 angular_velocity;
};
Turning turned_freely(const Turning& start, const Vector3& moments, const Vector3& inverse_moments, double time);

}  // namespace gravitas
