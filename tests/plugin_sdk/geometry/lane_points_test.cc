#include "plugin_sdk/geometry/lane_points.h"

#include <gtest/gtest.h>

#include "tests/plugin_sdk/geometry/random_shapes.h"

namespace gravitas {
namespace {

TEST(LanePoints, FindsWhatALookAtEveryPointFinds) {
  test::RandomShapes random(51);
  for (std::size_t count = 1; count <= 40; ++count) {
    LanePoints points;
    std::vector<Vector3> all;
    for (std::size_t i = 0; i < count; ++i) {
      // on a grid, so that many are equally far and every product is exact
      all.push_back((2.0 * random.vector(-1, 1)).array().round().matrix());
      points.add(all.back());
    }
    for (int k = 0; k < 50; ++k) {
      const Vector3 d = (2.0 * random.vector(-1, 1)).array().round().matrix();
      std::uint32_t first = 0;
      for (std::uint32_t i = 1; i < count; ++i)
        if (d.dot(all[i]) > d.dot(all[first])) first = i;
      ASSERT_EQ(points.farthest(d), first) << count << " points, along " << d.transpose();
    }
  }
}

TEST(LanePoints, AlongWhatIsNoNumberTheFirstWillDo) {
  LanePoints points;
  points.add(Vector3(1, 2, 3));
  EXPECT_EQ(points.farthest(Vector3::Constant(std::nan(""))), 0U);
}

}  // namespace
}  // namespace gravitas
