// The two collision plugins against each other, through their libraries: `Standard` finds closed forms and separating
// axes, `GjkOnly` knows support points alone.
//
// GRAVITAS_CROSS_CHECK_POSES sets the number of poses of each pair of types.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/geometry/scene_shape.h"
#include "tests/plugin_sdk/geometry/random_shapes.h"
#include "tests/sanitized.h"
#include "tests/workers/plugin_fixture.h"

namespace gravitas::test {
namespace {

using Kind = SceneShape::Kind;
constexpr stage::Method kAskManifolds = stage::Method::kCollisionManifolds;
constexpr double kMargin = 0.5;

struct Placed {
  SceneShape shape;
  Pose pose;
};

MessageColumns request_of(const std::vector<Placed>& bodies) {
  static std::uint64_t hash = 0;
  MessageColumns request = PluginUnderTest::request_of(kAskManifolds);
  request.f64("margin") = {kMargin};
  request.u32("shape_parameter_begin") = {0};
  std::vector<double>&numbers = request.f64("shape_parameter"), &position = request.f64("position"),
  &orientation = request.f64("orientation"), &geometry_orientation = request.f64("geometry_orientation");
  std::vector<std::uint32_t>&begin = request.u32("shape_parameter_begin"), &shape = request.u32("body_shape"),
  &pair = request.u32("pair");
  std::vector<std::uint64_t>&type = request.u64("shape_type"), &hashes = request.u64("shape_hash");
  for (std::uint32_t i = 0; i < bodies.size(); ++i) {
    const std::vector<double> own = flattened_shape(bodies[i].shape);
    numbers.insert(numbers.end(), own.begin(), own.end());
    begin.push_back(static_cast<std::uint32_t>(numbers.size()));
    type.push_back(type_of(bodies[i].shape));
    hashes.push_back(++hash);
    shape.push_back(i);
    const Vector3& p = bodies[i].pose.position;
    const Quaternion& q = bodies[i].pose.orientation;
    position.insert(position.end(), {p.x(), p.y(), p.z()});
    orientation.insert(orientation.end(), {q.w(), q.x(), q.y(), q.z()});
    geometry_orientation.insert(geometry_orientation.end(), {1, 0, 0, 0});
    if (i % 2 == 1) pair.insert(pair.end(), {i - 1, i});
  }
  for (const char* column : {"geometry_position", "linear_velocity", "angular_velocity"})
    request.f64(column).assign(3 * bodies.size(), 0.0);
  return request;
}

// The deepest contact of a pair.
struct Deepest {
  double depth = -std::numeric_limits<double>::infinity();  // where there is none
  Vector3 normal = Vector3::Zero();
};

std::vector<Deepest> deepest_of(PluginUnderTest* plugin, const MessageColumns& request, std::size_t pairs) {
  const MessageColumns reply = plugin->ask(kAskManifolds, request);
  const std::vector<double>&depth = reply.f64("depth"), &normal = reply.f64("normal");
  const std::vector<std::uint32_t>& pair = reply.u32("contact_pair");
  std::vector<Deepest> deepest(pairs);
  for (std::size_t i = 0; i < depth.size(); ++i)
    if (depth[i] > deepest[pair[i]].depth) deepest[pair[i]] = {depth[i], vector_at(normal, i)};
  return deepest;
}

constexpr std::array kKinds = {Kind::kSphere,           Kind::kBox,      Kind::kCylinder, Kind::kCapsule, Kind::kCone,
                               Kind::kConvexPolyhedron, Kind::kHalfspace};

// All pairs but that of two halfspaces.
std::vector<std::pair<std::size_t, std::size_t>> pairs_of_kinds() {
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t a = 0; a + 1 < kKinds.size(); ++a)
    for (std::size_t b = a; b < kKinds.size(); ++b) pairs.emplace_back(a, b);
  return pairs;
}

using PairOfKinds = std::pair<std::size_t, std::size_t>;

std::string name_of(const ::testing::TestParamInfo<PairOfKinds>& pair) {
  constexpr std::array kNames = {"Sphere", "Box", "Cylinder", "Capsule", "Cone", "Polyhedron", "Halfspace"};
  return kNames[pair.param.first] + std::string("And") + kNames[pair.param.second];
}

class CollisionCrossCheck : public ::testing::TestWithParam<PairOfKinds> {};
INSTANTIATE_TEST_SUITE_P(Of, CollisionCrossCheck, ::testing::ValuesIn(pairs_of_kinds()), name_of);

TEST_P(CollisionCrossCheck, StandardAndGjkOnlyAgree) {
  const char* wanted = std::getenv("GRAVITAS_CROSS_CHECK_POSES");
  const std::size_t poses = wanted == nullptr ? harness::unless_sanitized(1500) : std::strtoull(wanted, nullptr, 10);
  constexpr std::size_t kBatch = 500;
  const Kind kind1 = kKinds[GetParam().first], kind2 = kKinds[GetParam().second];
  PluginUnderTest standard("collision_standard"), gjk_only("collision_gjk_only");
  RandomShapes random(71 + 10 * GetParam().first + GetParam().second);
  SceneShape shape1, shape2;
  std::size_t touching = 0, compared = 0;
  for (std::size_t done = 0; done < poses; done += kBatch) {
    const std::size_t pairs = std::min(kBatch, poses - done);
    std::vector<Placed> bodies;
    for (std::size_t i = 0; i < pairs; ++i) {
      // a hull takes longer to find than its contacts: each serves in twenty poses
      if (kind1 != Kind::kConvexPolyhedron || i % 20 == 0) shape1 = random.convex(kind1);
      if (kind2 == Kind::kHalfspace)
        shape2.kind = kind2, shape2.size.setOnes();
      else if (kind2 != Kind::kConvexPolyhedron || i % 20 == 0)
        shape2 = random.convex(kind2);
      const Pose X_1{random.vector(-5, 5), random.rotation()};
      const Pose X_2{X_1.position + random.uniform(0.0, 2.6) * random.direction(), random.rotation()};
      bodies.push_back({shape1, X_1});
      bodies.push_back({shape2, X_2});
    }
    // as they lie, and brought to within a tenth of a millimetre of touching
    for (const bool is_near : {false, true}) {
      const MessageColumns request = request_of(bodies);
      const std::vector<Deepest> one = deepest_of(&standard, request, pairs),
                                 other = deepest_of(&gjk_only, request, pairs);
      for (std::size_t i = 0; i < pairs; ++i) {
        if (!is_near && one[i].depth > -kMargin)
          bodies[2 * i + 1].pose.position += (one[i].depth + random.uniform(-1e-4, 1e-4)) * one[i].normal;
        // either may prefer a face by up to 1 % of the depth; 1e-6 of the sizes, about a metre, otherwise. Two that
        // are at the margin apart may differ about it.
        const double deeper = std::max(one[i].depth, other[i].depth);
        if (deeper < -kMargin + 1e-5) continue;
        const double tolerance = 0.021 * std::max(0.0, deeper) + 5e-6;
        ASSERT_NEAR(one[i].depth, other[i].depth, tolerance) << "pose " << done + i << (is_near ? ", near" : "");
        ++compared;
        touching += deeper > 0.0 ? 1 : 0;
      }
    }
  }
  // the poses are such that the comparison means something
  EXPECT_GT(compared, poses);
  EXPECT_GT(touching, poses / 3);
}

}  // namespace
}  // namespace gravitas::test
