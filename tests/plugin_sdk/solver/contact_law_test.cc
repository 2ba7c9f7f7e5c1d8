// The share of restitution with which an impact adds no energy, on works that are known.
#include "plugin_sdk/solver/contact_law.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace gravitas {
namespace {

double share_of(const std::function<double(double)>& work) {
  SharedRestitution restitution(work(1.0));
  int solutions = 1;
  while (restitution.goes_on(work(restitution.share()) > 0.0, work(restitution.share()))) ++solutions;
  EXPECT_LE(solutions, 4);
  EXPECT_LE(work(restitution.share()), 0.0);
  return restitution.share();
}

// w(s) = c + b s + a s^2, c < 0 < w(1).
TEST(SharedRestitution, IsTheRootOfAParabola) {
  for (const double c : {-1e-9, -0.1, -1.0, -100.0})
    for (const double b : {-3.0, 0.0, 0.05, 2.0}) {
      const double a = 0.5 - b - c;
      const double root = (std::sqrt(b * b - 4.0 * a * c) - b) / (2.0 * a);
      EXPECT_NEAR(share_of([&](double s) { return c + (b + a * s) * s; }), root, 1e-8) << c << ", " << b;
    }
}

// Other contacts push from some share on: the best of what was tried stands.
TEST(SharedRestitution, IsOneThatWasTriedWhereWorkIsNoParabola) {
  EXPECT_EQ(share_of([](double s) { return s > 0.55 ? 1.0 : -1.0; }), 0.5);
  EXPECT_EQ(share_of([](double s) { return s > 0.1 ? 1.0 : -1.0; }), 0.0);
}

}  // namespace
}  // namespace gravitas
