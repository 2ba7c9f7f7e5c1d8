// Shapes as plugins receive them: mass against point sampling (§ 2.3.2.1), tight bounds, and the way there and back.
#include "plugin_sdk/geometry/scene_shape.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "plugin_sdk/body.h"
#include "plugin_sdk/geometry/support_map.h"
#include "tests/plugin_sdk/geometry/random_shapes.h"
#include "tests/sanitized.h"

namespace gravitas {
namespace {

// A cube of 2 m as polyhedron (by hull) or closed mesh, moved by `offset`.
SceneShape cube(SceneShape::Kind kind, const Vector3& offset = Vector3::Zero()) {
  std::vector<double> numbers{8};
  for (int i = 0; i < 8; ++i)
    for (int k = 0; k < 3; ++k) numbers.push_back(((i >> k) & 1 ? 1.0 : -1.0) + offset[k]);
  const double faces[12][3] = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}, {0, 1, 5}, {0, 5, 4},
                               {2, 6, 7}, {2, 7, 3}, {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
  if (kind == SceneShape::Kind::kTriangleMesh) {
    numbers.push_back(12);
    for (const auto& face : faces) numbers.insert(numbers.end(), face, face + 3);
    numbers.insert(numbers.end(), {1.0, 48.0, 4.0});
  } else {
    numbers.push_back(0);
  }
  std::string why;
  auto shape = read_scene_shape(type_id(kind == SceneShape::Kind::kTriangleMesh ? "TriangleMesh" : "ConvexPolyhedron"),
                                numbers, &why);
  EXPECT_TRUE(shape) << why;
  return *shape;
}

SceneShape compound_of(const SceneShape& a, const Pose& X_a, const SceneShape& b, const Pose& X_b, double density_b) {
  SceneShape whole;
  whole.kind = SceneShape::Kind::kCompound;
  whole.children.push_back({std::make_shared<SceneShape>(a), X_a, 0.0});
  whole.children.push_back({std::make_shared<SceneShape>(b), X_b, density_b});
  return whole;
}

// Mass properties by point masses in the middle of the cells of a grid (§ 2.3.2.1), n cells along the longest side.
// The surface's cells are counted wholly or not: the error of volume and moments is about the surface's share, 1/n, times
// a random sign, and far less in the mean.
MassProperties sampled(const SceneShape& shape, int n) {
  const Box3 box = local_box(shape);
  const double step = (box.upper - box.lower).maxCoeff() / n;
  const auto map = make_support_map(shape);
  MassProperties result;
  std::vector<MassProperties> points;
  for (double x = box.lower.x() + 0.5 * step; x < box.upper.x(); x += step) {
    for (double y = box.lower.y() + 0.5 * step; y < box.upper.y(); y += step) {
      for (double z = box.lower.z() + 0.5 * step; z < box.upper.z(); z += step) {
        const Vector3 p(x, y, z);
        const double radial = std::hypot(x, z);
        bool is_inside = false;
        if (shape.kind == SceneShape::Kind::kCapsule)
          is_inside = (p - Vector3(0, std::clamp(y, -shape.size.y(), shape.size.y()), 0)).norm() < shape.size.x();
        if (shape.kind == SceneShape::Kind::kCone)
          is_inside = radial < shape.size.x() * (shape.size.y() - y) / (2.0 * shape.size.y());
        if (shape.kind == SceneShape::Kind::kConvexPolyhedron)
          is_inside = std::all_of(shape.polyhedron->faces.begin(), shape.polyhedron->faces.end(),
                                  [&](const auto& face) { return face.normal.dot(p) < face.offset; });
        if (!is_inside) continue;
        MassProperties& point = points.emplace_back();
        point.mass = 1000.0 * step * step * step;
        point.centre_of_mass = p;
        // a cube of its own (2.37b)
        point.inertia = point.mass * step * step / 6.0 * Matrix3::Identity();
      }
    }
  }
  return combined(points);
}

TEST(SceneShapeMass, AgreesWithPointSampling) {
  test::RandomShapes random(21);
  for (const SceneShape::Kind kind :
       {SceneShape::Kind::kCapsule, SceneShape::Kind::kCone, SceneShape::Kind::kConvexPolyhedron}) {
    for (int i = 0; i < harness::unless_sanitized(3); ++i) {
      const SceneShape shape = random.convex(kind);
      const MassProperties exact = mass_properties(shape, 1000.0), counted = sampled(shape, 80);
      EXPECT_NEAR(counted.mass, exact.mass, 0.01 * exact.mass) << static_cast<int>(kind);
      EXPECT_LE((counted.centre_of_mass - exact.centre_of_mass).norm(), 0.01);
      EXPECT_LE((counted.inertia - exact.inertia).norm(), 0.02 * exact.inertia.norm());
    }
  }
}

TEST(SceneShapeMass, OfACubeIsThatOfABoxWhereverItLies) {
  const MassProperties box = box_mass_properties(Vector3::Ones(), 500.0);
  for (const SceneShape::Kind kind : {SceneShape::Kind::kConvexPolyhedron, SceneShape::Kind::kTriangleMesh}) {
    for (const Vector3& offset : {Vector3(0, 0, 0), Vector3(3, -2, 1), Vector3(1e6, 0, 0)}) {
      const MassProperties mass = mass_properties(cube(kind, offset), 500.0);
      // the coordinates are exact; what is left is the rounding of the origin of the sums
      const double rounding = 1e-14 * (1.0 + offset.norm());
      EXPECT_NEAR(mass.mass, box.mass, rounding * box.mass);
      EXPECT_LE((mass.centre_of_mass - offset).norm(), rounding);
      EXPECT_LE((mass.inertia - box.inertia).norm(), 4.0 * rounding * box.inertia.norm());
    }
  }
}

// I = 1/10 m (b^2 + c^2) ... of the tetrahedron spanned by the axes, about its centroid: m/80 (3 off -1 by symmetry).
TEST(SceneShapeMass, OfATetrahedronIsExact) {
  const double numbers[] = {4, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0};
  std::string why;
  const auto shape = read_scene_shape(type_id("ConvexPolyhedron"), numbers, &why);
  ASSERT_TRUE(shape) << why;
  const MassProperties mass = mass_properties(*shape, 6.0);
  EXPECT_NEAR(mass.mass, 1.0, 1e-15);
  EXPECT_LE((mass.centre_of_mass - Vector3::Constant(0.25)).norm(), 1e-15);
  // second moments about the centroid: 3/80 along an axis, -1/80 between two
  Matrix3 expected = Matrix3::Constant(1.0 / 80.0);
  expected.diagonal().setConstant(6.0 / 80.0);
  EXPECT_LE((mass.inertia - expected).norm(), 1e-15);
}

TEST(SceneShapeMass, OfAnOpenMeshIsThatOfItsTriangles) {
  // two triangles of area 1/2, centroids (1/3, 0, 1/3) and (2/3, 0, 2/3)
  const double numbers[] = {4, 0, 0, 0, 1, 0, 0, 1, 0, 1, 0, 0, 1, 2, 0, 2, 1, 0, 3, 2, 1, 48, 4};
  std::string why;
  const auto shape = read_scene_shape(type_id("TriangleMesh"), numbers, &why);
  ASSERT_TRUE(shape) << why;
  ASSERT_FALSE(shape->mesh->is_closed());
  const MassProperties mass = mass_properties(*shape, 2.0);
  EXPECT_NEAR(mass.mass, 2.0, 1e-15);
  EXPECT_LE((mass.centre_of_mass - Vector3(0.5, 0, 0.5)).norm(), 1e-15);
}

TEST(SceneShapeMass, OfACompoundIsThatOfItsParts) {
  const SceneShape block = cube(SceneShape::Kind::kConvexPolyhedron);
  const SceneShape whole = compound_of(block, {Vector3(-1, 0, 0), Quaternion::Identity()}, block,
                                       {Vector3(1, 0, 0), Quaternion::Identity()}, 0);
  const MassProperties expected = box_mass_properties({2, 1, 1}, 300.0), mass = mass_properties(whole, 300.0);
  EXPECT_NEAR(mass.mass, expected.mass, 1e-12 * expected.mass);
  EXPECT_LE((mass.inertia - expected.inertia).norm(), 1e-12 * expected.inertia.norm());
  const SceneShape heavy = compound_of(block, {Vector3(-1, 0, 0), Quaternion::Identity()}, block,
                                       {Vector3(1, 0, 0), Quaternion::Identity()}, 900.0);
  EXPECT_NEAR(mass_properties(heavy, 300.0).centre_of_mass.x(), 0.5, 1e-14);
}

TEST(SceneShapeBounds, AreTight) {
  test::RandomShapes random(22);
  for (const SceneShape::Kind kind : test::kConvexKinds) {
    for (int i = 0; i < 20; ++i) {
      const SceneShape shape = random.convex(kind);
      const auto map = make_support_map(shape);
      const Matrix3 R = random.rotation().toRotationMatrix();
      for (const Matrix3& axes : {Matrix3(Matrix3::Identity()), R}) {
        const Box3 box = local_box(shape, axes);
        for (int k = 0; k < 3; ++k) {
          const Vector3 n = axes.col(k);
          EXPECT_NEAR(box.upper[k], n.dot(map->support(n)) + map->rounding(), 1e-14);
          EXPECT_NEAR(box.lower[k], n.dot(map->support(-n)) - map->rounding(), 1e-14);
        }
      }
      // the farthest of many surface points comes near the ball's radius and never beyond it
      const Ball ball = bounding_ball(shape);
      double farthest = 0.0;
      for (int k = 0; k < 2000; ++k) {
        const Vector3 n = random.direction();
        farthest = std::max(farthest, (map->support(n) + map->rounding() * n - ball.centre).norm());
      }
      EXPECT_LE(farthest, ball.radius * (1.0 + 1e-14));
      EXPECT_GE(farthest, 0.95 * ball.radius);
    }
  }
}

TEST(SceneShapeBounds, OfACompoundHoldItsParts) {
  test::RandomShapes random(23);
  for (int i = 0; i < 30; ++i) {
    const SceneShape a = random.convex(SceneShape::Kind::kCone), b = random.convex(SceneShape::Kind::kCapsule);
    const Pose X_a{random.vector(-1, 1), random.rotation()}, X_b{random.vector(-1, 1), random.rotation()};
    const SceneShape whole = compound_of(a, X_a, b, X_b, 0.0);
    const auto map = make_support_map(a);
    const Box3 box = local_box(whole);
    const Ball ball = bounding_ball(whole);
    for (int k = 0; k < 200; ++k) {
      const Vector3 p = transform_point(X_a, map->support(random.direction()));
      EXPECT_TRUE(box.widened(1e-12).overlaps({p, p}));
      EXPECT_LE((p - ball.centre).norm(), ball.radius * (1.0 + 1e-12));
    }
  }
}

TEST(SceneShape, GoesThereAndBack) {
  test::RandomShapes random(24);
  for (const SceneShape::Kind kind : test::kConvexKinds) {
    const SceneShape shape = random.convex(kind);
    const SceneShape whole =
        compound_of(shape, {random.vector(-1, 1), random.rotation()}, cube(SceneShape::Kind::kTriangleMesh), {}, 3.0);
    for (const SceneShape& one : {shape, whole}) {
      const std::vector<double> numbers = flattened_shape(one);
      std::string why;
      const auto again = read_scene_shape(type_of(one), numbers, &why);
      ASSERT_TRUE(again) << why;
      EXPECT_EQ(flattened_shape(*again), numbers);
      EXPECT_EQ(mass_properties(*again, 7.0).mass, mass_properties(one, 7.0).mass);
    }
  }
}

TEST(SceneShape, SaysWhatIsWrong) {
  const auto refusal = [](const char* type, const std::vector<double>& numbers) {
    std::string why;
    EXPECT_FALSE(read_scene_shape(type_id(type), numbers, &why));
    return why;
  };
  EXPECT_EQ(refusal("Capsule", {1, 0}), "has a size that is not finite and positive");
  EXPECT_EQ(refusal("Blob", {1}), "is of a type that this plugin does not know");
  EXPECT_EQ(refusal("Compound", {0, 0}), "the compound has no child");
  EXPECT_EQ(refusal("TriangleMesh", {3, 0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 0, 1, 2.5, 1, 48, 4}),
            "face 0 has an index that is none");
  EXPECT_THROW(refusal("Cone", {1}), std::out_of_range);
  // nested in itself more often than allowed
  SceneShape whole = cube(SceneShape::Kind::kConvexPolyhedron);
  for (int i = 0; i < 10; ++i) {
    SceneShape outer;
    outer.kind = SceneShape::Kind::kCompound;
    outer.children.push_back({std::make_shared<SceneShape>(whole), {}, 0.0});
    whole = outer;
  }
  std::string why;
  EXPECT_FALSE(read_scene_shape(type_of(whole), flattened_shape(whole), &why));
  EXPECT_THAT(why, testing::HasSubstr("nested more than eight deep"));
}

// A compound's child passes through its flattened properties on its way to a plugin.
TEST(SceneShapeFlattened, AMeshKeepsTheOptionsOfItsTree) {
  std::vector<double> numbers = flattened_shape(cube(SceneShape::Kind::kTriangleMesh));
  numbers[numbers.size() - 2] = 1.0;
  numbers[numbers.size() - 1] = 3.0;
  std::string why;
  const auto mesh = read_scene_shape(type_id("TriangleMesh"), numbers, &why);
  ASSERT_TRUE(mesh) << why;
  EXPECT_EQ(flattened_shape(*mesh), numbers);
  // one division only
  EXPECT_EQ(mesh->mesh->nodes().size(), 3U);
  const SceneShape whole = compound_of(*mesh, {}, *mesh, {}, 0.0);
  const auto again = read_scene_shape(type_id("Compound"), flattened_shape(whole), &why);
  ASSERT_TRUE(again) << why;
  EXPECT_EQ(again->children[1].shape->mesh->nodes().size(), 3U);
}

}  // namespace
}  // namespace gravitas
