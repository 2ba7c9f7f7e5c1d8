// The rule by which rays meet bounds, against points that are known to lie on the ray and in the box.
#include "plugin_sdk/ray_rule.h"

#include <gtest/gtest.h>

#include <algorithm>
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

// How long a ray stays in a box, of its length; negative where it passes by. Slabs, in numbers of type T.
template <typename T>
T stay(const Vector3& origin, const Vector3& direction, double length, const Vector3& lower, const Vector3& upper) {
  T enter = 0, leave = length;
  for (int k = 0; k < 3; ++k) {
    const T one = (static_cast<T>(lower[k]) - static_cast<T>(origin[k])) / static_cast<T>(direction[k]);
    const T other = (static_cast<T>(upper[k]) - static_cast<T>(origin[k])) / static_cast<T>(direction[k]);
    enter = std::max(enter, std::min(one, other));
    leave = std::min(leave, std::max(one, other));
  }
  return (leave - enter) / static_cast<T>(length);
}

// Rays at the edges of boxes, so that half of them touch by as little as rounding: those that do, by a hundredth of a
// unit of rounding and more in longer numbers, meet the box, and every box around it. Plain slabs miss some.
TEST(RayRule, NothingIsMissedByRounding) {
  std::mt19937_64 random(7);
  const auto draw = [&](double reach) {
    std::uniform_real_distribution<double> one(-reach, reach);
    return Vector3(one(random), one(random), one(random));
  };
  int touching = 0, missed_by_plain_slabs = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vector3 place = draw(i % 2 == 0 ? 1.0 : 1e8), corner = place + draw(1.0), other = place + draw(1.0);
    const Vector3 lower = corner.cwiseMin(other), upper = corner.cwiseMax(other);
    Vector3 aim = lower;
    aim[i % 3] += 0.5 * (upper - lower)[i % 3];
    const Vector3 origin = place + draw(100.0), direction = (aim - origin).normalized();
    const double length = 2.0 * (aim - origin).norm();
    if (stay<long double>(origin, direction, length, lower, upper) < 1e-18L) continue;
    ++touching;
    missed_by_plain_slabs += stay<double>(origin, direction, length, lower, upper) < 0.0 ? 1 : 0;
    ASSERT_TRUE(meets(origin, direction, length, lower, upper)) << i;
    ASSERT_TRUE(meets(origin, direction, length, lower - draw(1.0).cwiseAbs(), upper + draw(1.0).cwiseAbs())) << i;
  }
  EXPECT_GT(touching, 5000);
  EXPECT_GT(missed_by_plain_slabs, 50);
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
