// The rule by which rays meet bounds, against points that are known to lie on the ray and in the box.
#include "plugin_sdk/ray_rule.h"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <random>

#include "plugin_sdk/math/types.h"
#include "plugin_sdk/message_columns.h"

namespace gravitas {
namespace {

constexpr double kEndless = std::numeric_limits<double>::infinity();

MessageColumns one_ray(const Vector3& origin, const Vector3& direction, double length) {
  MessageColumns request(stage::method_info(stage::Method::kSpaceRays).request);
  request.f64("origin").assign(origin.data(), origin.data() + 3);
  request.f64("direction").assign(direction.data(), direction.data() + 3);
  request.f64("length") = {length};
  return request;
}

bool meets(const Vector3& origin, const Vector3& direction, double length, const Vector3& lower, const Vector3& upper) {
  const MessageColumns request = one_ray(origin, direction, length);
  const std::vector<gravitas_column> columns = request.plain();
  return RayRule(stage::SpaceRaysRequest(columns.data())).meets(0, lower.data(), upper.data());
}

TEST(RayRule, ClosedBoxesAreMetAtFacesEdgesAndCorners) {
  const Vector3 x = Vector3::UnitX(), lower(1, -1, -1), upper(2, 1, 1);
  EXPECT_TRUE(meets({0, 0, 0}, x, 5, lower, upper));
  EXPECT_TRUE(meets({0, 0, 0}, x, 1, lower, upper)) << "it ends on the face";
  EXPECT_FALSE(meets({0, 0, 0}, x, 0.999, lower, upper));
  EXPECT_TRUE(meets({0, 1, 1}, x, 5, lower, upper)) << "along an edge";
  EXPECT_FALSE(meets({0, 1.0000001, 1}, x, 5, lower, upper));
  EXPECT_FALSE(meets({0, 0, 0}, -x, 5, lower, upper)) << "it goes the other way";
  EXPECT_TRUE(meets({1.5, 0, 0}, -x, 0, lower, upper)) << "it begins inside";
  EXPECT_TRUE(meets({0, 9, 0}, -Vector3::UnitY(), 10, Vector3(-kEndless, -kEndless, -kEndless),
                    Vector3(kEndless, 0, kEndless)));
  EXPECT_FALSE(meets({0, 0, 0}, x, 5, upper, lower)) << "upside down";
  EXPECT_FALSE(meets({0, 0, 0}, x, 5, Vector3(std::nan(""), -1, -1), upper));
}

// A ray through a point of a box meets it, wherever both are, and every box around it; so rounding misses nothing.
TEST(RayRule, NothingIsMissedByRounding) {
  std::mt19937_64 random(7);
  const auto draw = [&](double reach) {
    std::uniform_real_distribution<double> one(-reach, reach);
    return Vector3(one(random), one(random), one(random));
  };
  for (int i = 0; i < 20000; ++i) {
    const Vector3 place = draw(1e8), corner = place + draw(1.0), other = place + draw(1.0);
    const Vector3 lower = corner.cwiseMin(other), upper = corner.cwiseMax(other);
    // a corner is the point that rounding loses first
    const Vector3 origin = place + draw(100.0), direction = (lower - origin).normalized();
    const double length = (lower - origin).norm() * (1.0 + 1e-12);
    const double slack = 1e-7;  // of the ray itself, 1e8 m from the origin
    ASSERT_TRUE(
        meets(origin, direction, length + slack, lower - Vector3::Constant(slack), upper + Vector3::Constant(slack)));
    if (meets(origin, direction, length, lower, upper)) {
      ASSERT_TRUE(meets(origin, direction, length, lower - draw(1.0).cwiseAbs(), upper + draw(1.0).cwiseAbs()));
    }
  }
}

TEST(RayRule, ImpossibleRaysAreRefused) {
  const auto refused = [](const Vector3& origin, const Vector3& direction, double length) {
    try {
      meets(origin, direction, length, Vector3::Zero(), Vector3::Ones());
    } catch (const Refusal&) {
      return true;
    }
    return false;
  };
  EXPECT_TRUE(refused({kEndless, 0, 0}, Vector3::UnitX(), 1));
  EXPECT_TRUE(refused({0, 0, 0}, {1, 1, 0}, 1));
  EXPECT_TRUE(refused({0, 0, 0}, Vector3::UnitX(), -1));
  EXPECT_TRUE(refused({0, 0, 0}, Vector3::UnitX(), kEndless));
}

}  // namespace
}  // namespace gravitas
