// One contact with Coulomb friction, solved exactly: the local problem of a relaxation.
//
//   u = q + W lambda,   0 <= lambda_N  _|_  u_N - b >= 0,
//   |lambda_T| <= mu lambda_N,  u_T = 0  or  lambda_T = -mu lambda_N u_T/|u_T|
//
// in the contact's frame (normal first), W symmetric positive definite. Tried in this order, the
// first that holds is the answer (with much friction and strong coupling there may be several):
//
//   open    lambda = 0                      if q_N >= b
//   stick   lambda = W^-1 (b e_N - q)       if in the cone
//   slide   lambda = lambda_N (1, -mu d), d the unit direction of the slip:
//           lambda_N = (b - q_N)/D(d),  D = W_NN - mu W_NT d,  and d x u_T = 0, d.u_T >= 0.
//
// Times D, d x u_T is a trigonometric polynomial of degree two in the angle of d: Newton from the
// present direction of friction, and where that fails all its sign changes over 64 directions,
// bisected. The alternation of normal row and friction that is usual instead converges slowly where
// normal and tangent are coupled, and not at all where friction drives the surfaces together (D <=
// 0 for the present slip).
#pragma once

#include "plugin_sdk/math/types.h"

namespace gravitas {

// False, with `impulse` untouched, if there is no answer but for rounding; the caller keeps what it
// has. `inverse` is W^-1; `impulse` holds the present one, whose friction is the first guess of d.
bool solve_coulomb_contact(const Matrix3& response, const Matrix3& inverse, const Vector3& free_velocity, double target,
                           double friction, Vector3* impulse);

}  // namespace gravitas
