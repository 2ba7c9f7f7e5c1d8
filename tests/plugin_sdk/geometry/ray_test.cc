// Rays against solids: where the answer is known, closed forms against support points, and against the surface itself.
#include "plugin_sdk/geometry/ray.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "plugin_sdk/geometry/penetration.h"
#include "tests/plugin_sdk/geometry/random_shapes.h"

namespace gravitas {
namespace {

SceneShape struck_shape_of(SceneShape::Kind kind, const Vector3& size) {
  SceneShape shape;
  shape.kind = kind, shape.size = size;
  return shape;
}

SceneShape cube_mesh(bool is_closed) {
  std::vector<Vector3> corners;
  for (int i = 0; i < 8; ++i) corners.emplace_back((i & 1) ? 1 : -1, (i & 2) ? 1 : -1, (i & 4) ? 1 : -1);
  std::vector<TriangleMesh::Triangle> faces = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}, {0, 1, 5}, {0, 5, 4},
                                               {2, 6, 7}, {2, 7, 3}, {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
  if (!is_closed) faces.resize(10);
  std::string why;
  SceneShape shape = struck_shape_of(SceneShape::Kind::kTriangleMesh, Vector3::Ones());
  shape.mesh = std::make_shared<TriangleMesh>(*TriangleMesh::make(corners, faces, {}, &why));
  return shape;
}

void expect_hit(const std::optional<RayHit>& hit, double distance, const Vector3& normal) {
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->distance, distance, 1e-14);
  EXPECT_LE((hit->normal - normal.normalized()).norm(), 1e-14);
}

TEST(Ray, MeetsSolidsWhereTheyAre) {
  const Vector3 x = Vector3::UnitX(), y = Vector3::UnitY(), z = Vector3::UnitZ();
  const SceneShape ball = struck_shape_of(SceneShape::Kind::kSphere, Vector3::Ones()),
                   can = struck_shape_of(SceneShape::Kind::kCylinder, {1, 2, 1}),
                   pill = struck_shape_of(SceneShape::Kind::kCapsule, {1, 1, 1}),
                   cone = struck_shape_of(SceneShape::Kind::kCone, {1, 1, 1});
  expect_hit(cast_ray(ball, {{-5, 0.6, 0}, x, 10}), 4.2, {-0.8, 0.6, 0});
  EXPECT_FALSE(cast_ray(ball, {{-5, 0.6, 0}, x, 4.19}));
  EXPECT_FALSE(cast_ray(ball, {{-5, 0.6, 0}, -x, 10}));
  EXPECT_FALSE(cast_ray(ball, {{-5, 1.0000001, 0}, x, 10}));
  expect_hit(cast_ray(ball, {{0.2, 0.1, 0}, x, 10}), 0.0, -x);
  expect_hit(cast_ray(struck_shape_of(SceneShape::Kind::kBox, {1, 2, 3}), {{0.5, 9, -2}, -y, 10}), 7, y);
  expect_hit(
      cast_ray(struck_shape_of(SceneShape::Kind::kBox, {1, 2, 3}), {{3.5, 4, 0}, Vector3(-1, -1, 0).normalized(), 10}),
      2.5 * std::sqrt(2.0), x);
  expect_hit(cast_ray(can, {{-5, 1, 0.6}, x, 10}), 4.2, {-0.8, 0, 0.6});
  expect_hit(cast_ray(can, {{0.5, -7, 0.5}, y, 10}), 5, -y);
  EXPECT_FALSE(cast_ray(can, {{-5, 2.01, 0}, x, 10}));
  expect_hit(cast_ray(pill, {{0.6, 9, 0}, -y, 10}), 7.2, {0.6, 0.8, 0});
  expect_hit(cast_ray(pill, {{-3, 0.5, 0}, x, 10}), 2, -x);
  expect_hit(cast_ray(cone, {{0, 0, 5}, -z, 10}), 4.5, {0, 0.5, 1});
  expect_hit(cast_ray(cone, {{0.25, 5, 0}, -y, 10}), 4.5, {1, 0.5, 0});
  expect_hit(cast_ray(cone, {{0.25, -5, 0}, y, 10}), 4, -y);
  EXPECT_FALSE(cast_ray(cone, {{-5, 1.5, 0}, x, 10}));  // through the cone's mirror image
  expect_hit(
      cast_ray(struck_shape_of(SceneShape::Kind::kHalfspace, Vector3::Ones()), {{1, 3, 1}, Vector3(0.6, -0.8, 0), 5}),
      3.75, y);
  EXPECT_FALSE(cast_ray(struck_shape_of(SceneShape::Kind::kHalfspace, Vector3::Ones()), {{1, 3, 1}, x, 1e300}));
}

TEST(Ray, MeetsAMeshFromEitherSideAndAClosedOneFromInsideAtOnce) {
  const Vector3 x = Vector3::UnitX(), z = Vector3::UnitZ();
  expect_hit(cast_ray(cube_mesh(true), {{-4, 0.3, 0.2}, x, 10}), 3, -x);
  expect_hit(cast_ray(cube_mesh(true), {{0.1, 0.3, 0.2}, x, 10}), 0, -x);
  // open at +z: in through the hole, to the far side from behind
  expect_hit(cast_ray(cube_mesh(false), {{0.3, 0.2, 5}, -z, 10}), 6, z);
  expect_hit(cast_ray(cube_mesh(false), {{0.1, 0.3, 0.2}, x, 10}), 0.9, -x);
}

TEST(Ray, MeetsTheFirstChildOfACompound) {
  SceneShape whole = struck_shape_of(SceneShape::Kind::kCompound, Vector3::Ones());
  const auto ball = std::make_shared<SceneShape>(struck_shape_of(SceneShape::Kind::kSphere, Vector3::Constant(0.5)));
  const auto box = std::make_shared<SceneShape>(struck_shape_of(SceneShape::Kind::kBox, {1, 1, 0.1}));
  const double quarter = std::sqrt(0.5);
  whole.children = {{ball, {Vector3(4, 0, 0), Quaternion::Identity()}, 0.0},
                    {box, {Vector3(2, 0, 0), Quaternion(quarter, 0, quarter, 0)}, 0.0}};
  expect_hit(cast_ray(whole, {{0, 0, 0.3}, Vector3::UnitX(), 10}), 1.9, -Vector3::UnitX());
  expect_hit(cast_ray(whole, {{2, 0, 9.5}, -Vector3::UnitZ(), 10}), 8.5, Vector3::UnitZ());
}

// The closed forms and the support points know nothing of each other.
TEST(Ray, ClosedFormsAgreeWithSupportPoints) {
  test::RandomShapes random(91);
  for (const SceneShape::Kind kind : test::kConvexKinds) {
    int hits = 0, misses = 0;
    for (int i = 0; i < 3000; ++i) {
      const SceneShape shape = random.convex(kind);
      const auto map = make_support_map(shape);
      const Vector3 origin = random.uniform(0.0, 4.0) * random.direction();
      const Ray ray{origin, (0.9 * random.direction() - 0.5 * origin).normalized(), random.uniform(0, 6)};
      const std::optional<RayHit> one = cast_ray(shape, ray), other = cast_ray(*map, ray);
      SCOPED_TRACE(testing::Message() << "kind " << static_cast<int>(kind) << ", ray " << i);
      ASSERT_EQ(one.has_value(), other.has_value());
      if (!one) {
        ++misses;
        continue;
      }
      ++hits;
      // short by 1e-9 of the radius along the normal, which is more along a grazing ray
      const double steep = std::max(1e-6, -one->normal.dot(ray.direction));
      EXPECT_NEAR(one->distance, other->distance, 4e-9 / steep);
    }
    EXPECT_GT(hits, 300);
    EXPECT_GT(misses, 300);
  }
}

// Just before the hit the end of the ray is outside, just after it inside, and the normal leads out.
TEST(Ray, EndsAtTheSurface) {
  test::RandomShapes random(92);
  const SceneShape dot = struck_shape_of(SceneShape::Kind::kSphere, Vector3::Constant(1e-12));
  const auto point = make_support_map(dot);
  for (const SceneShape::Kind kind : test::kConvexKinds) {
    for (int i = 0; i < 500; ++i) {
      const SceneShape shape = random.convex(kind);
      const auto map = make_support_map(shape);
      const Ray ray{3.0 * random.direction(), Vector3::UnitX(), 9.0};
      const Ray aimed{ray.origin, (0.2 * random.direction() - ray.origin).normalized(), 9.0};
      const std::optional<RayHit> hit = cast_ray(shape, aimed);
      if (!hit) continue;
      const auto depth_at = [&](double t) {
        return find_separation({*map, *point, Matrix3::Identity(), aimed.origin + t * aimed.direction}, 1e9).depth;
      };
      EXPECT_LT(depth_at(hit->distance - 1e-6), 1e-10);
      EXPECT_NEAR(depth_at(hit->distance), 0.0, 1e-8);
      EXPECT_LT(hit->normal.dot(aimed.direction), 0.0);
      EXPECT_NEAR(hit->normal.norm(), 1.0, 1e-14);
      // from a point just above the surface the way out is along the normal
      const Vector3 above = aimed.origin + hit->distance * aimed.direction + 1e-5 * hit->normal;
      EXPECT_NEAR(find_separation({*map, *point, Matrix3::Identity(), above}, 1e9).depth, -1e-5, 1e-8);
    }
  }
}

TEST(Ray, KeepsItsDigitsFarFromTheSolid) {
  const SceneShape ball = struck_shape_of(SceneShape::Kind::kSphere, Vector3::Ones());
  for (const double far : {1e3, 1e6, 1e8}) {
    const std::optional<RayHit> hit = cast_ray(ball, {{-far, 0.6, 0.0}, Vector3::UnitX(), 2.0 * far});
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->distance, far - 0.8, 4e-16 * far);
    const std::optional<RayHit> other =
        cast_ray(*make_support_map(ball), {{-far, 0.6, 0.0}, Vector3::UnitX(), 2.0 * far});
    ASSERT_TRUE(other);
    EXPECT_NEAR(other->distance, far - 0.8, 4e-9 + 4e-16 * far);
  }
  // half way down the slope of a cone of height 2
  const SceneShape cone = struck_shape_of(SceneShape::Kind::kCone, {1, 1, 1});
  for (const double far : {1e3, 1e6, 1e8}) {
    const std::optional<RayHit> hit = cast_ray(cone, {{-far, 0.0, 0.0}, Vector3::UnitX(), 2.0 * far});
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->distance, far - 0.5, 4e-16 * far);
  }
}

// Aimed at the diagonal that two triangles share, from all sides.
TEST(Ray, DoesNotSlipThroughBetweenTriangles) {
  const SceneShape cube = cube_mesh(false);
  std::mt19937_64 random(7);
  const auto draw = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  for (const double far : {5.0, 50.0, 1e3}) {
    for (int i = 0; i < 2000; ++i) {
      // of the face x = -1, from (-1, -1, -1) to (-1, 1, 1)
      const double along = draw(-0.9, 0.9);
      const Vector3 place(-1.0, along, along), way = Vector3(1.0, draw(-0.5, 0.5), draw(-0.5, 0.5)).normalized();
      const std::optional<RayHit> hit = cast_ray(cube, {place - far * way, way, 2.0 * far});
      ASSERT_TRUE(hit) << far;
      EXPECT_NEAR(hit->distance, far, 1e-12 * far);
    }
  }
}

}  // namespace
}  // namespace gravitas
