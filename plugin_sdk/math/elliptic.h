// Jacobi's elliptic functions sn, cn, dn of real arguments, and the quarter period, by the arithmetic-geometric mean.
#pragma once

#include <array>
#include <cstddef>

namespace gravitas {

struct EllipticValues {
  double sn, cn, dn;
};

// For a fixed modulus. Same bits on every machine: arithmetic, sqrt and plugin_sdk/math alone.
class EllipticFunctions {
 public:
  // From the complementary parameter m_c = 1 - k^2 in (0, 1]; smaller ones are taken as 1e-300, whose quarter period is 347.
  explicit EllipticFunctions(double complementary_parameter);

  // K, a quarter of the period of sn and cn, half of dn's: pi / (2 agm(1, sqrt(m_c))).
  double quarter_period() const { return quarter_period_; }

  // Descending Landen transformation: with means a_0 = 1, b_0 = sqrt(m_c), a_{n+1} = (a_n + b_n)/2, b_{n+1} = sqrt(a_n b_n)
  // until they agree, and y_n = a_n cs(a_n u, k_n), which is a_N cot(a_N u) in the end,
  //   dn_n = (b_n + A) / (a_n + A),  A = y_{n+1}^2 / a_{n+1},     y_n = y_{n+1} dn_{n+1},     cs = y_0, dn = dn_0.
  // Source: Bulirsch, Numer. Math. 7 (1965) 78. Error: some roundings, plus one of u itself.
  EllipticValues at(double u) const;

 private:
  static constexpr std::size_t kMostMeans = 24;
  std::array<double, kMostMeans> a_{}, b_{};
  std::size_t means_ = 0;
  double limit_ = 1.0;  // of the means
  double quarter_period_ = 0.0;
};

}  // namespace gravitas
