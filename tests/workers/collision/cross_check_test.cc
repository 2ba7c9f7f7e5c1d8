// The two collision plugins against each other, through their libraries: `Standard` finds closed forms and separating
// axes, `GjkOnly` knows support points alone.
//
// GRAVITAS_CROSS_CHECK_POSES sets the number of poses per pair of types (a million is about an hour).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>
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
  MessageColumns request = PluginUnderTest::request_of(kAskManifolds);
  request.f64("margin") = {kMargin};
  request.u32("shape_parameter_begin") = {0};
  for (std::uint32_t i = 0; i < bodies.size(); ++i) {
    const std::vector<double> numbers = flattened_shape(bodies[i].shape);
    std::vector<double>& all = request.f64("shape_parameter");
    all.insert(all.end(), numbers.begin(), numbers.end());
    request.u32("shape_parameter_begin").push_back(static_cast<std::uint32_t>(all.size()));
    request.u64("shape_type").push_back(type_of(bodies[i].shape));
    static std::uint64_t hash = 0;
    request.u64("shape_hash").push_back(++hash);
    request.u32("body_shape").push_back(i);
    const Vector3& p = bodies[i].pose.position;
    const Quaternion& q = bodies[i].pose.orientation;
    const auto append = [&](const char* column, std::initializer_list<double> values) {
      request.f64(column).insert(request.f64(column).end(), values);
    };
    append("geometry_position", {0, 0, 0});
    append("geometry_orientation", {1, 0, 0, 0});
    append("position", {p.x(), p.y(), p.z()});
    append("orientation", {q.w(), q.x(), q.y(), q.z()});
    append("linear_velocity", {0, 0, 0});
    append("angular_velocity", {0, 0, 0});
    if (i % 2 == 1) request.u32("pair").insert(request.u32("pair").end(), {i - 1, i});
  }
  return request;
}

// The deepest contact of every pair, -infinity where there is none.
std::vector<double> depths_of(PluginUnderTest* plugin, const MessageColumns& request, std::size_t pairs) {
  MessageColumns reply = plugin->ask(kAskManifolds, request);
  std::vector<double> depths(pairs, -std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < reply.f64("depth").size(); ++i) {
    double& deepest = depths[reply.u32("contact_pair")[i]];
    deepest = std::max(deepest, reply.f64("depth")[i]);
  }
  return depths;
}

TEST(CollisionCrossCheck, StandardAndGjkOnlyAgree) {
  const char* wanted = std::getenv("GRAVITAS_CROSS_CHECK_POSES");
  const std::size_t poses = wanted == nullptr ? harness::unless_sanitized(1500) : std::strtoull(wanted, nullptr, 10);
  constexpr std::size_t kBatch = 500;
  PluginUnderTest standard("collision_standard"), gjk_only("collision_gjk_only");
  const std::vector<Kind> kinds = {Kind::kSphere,   Kind::kBox,  Kind::kCylinder,
                                   Kind::kCapsule,  Kind::kCone, Kind::kConvexPolyhedron,
                                   Kind::kHalfspace};
  RandomShapes random(71);
  std::size_t touching = 0, compared = 0;
  for (std::size_t ka = 0; ka + 1 < kinds.size(); ++ka) {
    for (std::size_t kb = ka; kb < kinds.size(); ++kb) {
      for (std::size_t done = 0; done < poses; done += kBatch) {
        const std::size_t pairs = std::min(kBatch, poses - done);
        std::vector<Placed> bodies;
        for (std::size_t i = 0; i < pairs; ++i) {
          Placed a{random.convex(kinds[ka]), {random.vector(-5, 5), random.rotation()}};
          SceneShape b = random.convex(kinds[kb] == Kind::kHalfspace ? Kind::kBox : kinds[kb]);
          if (kinds[kb] == Kind::kHalfspace) b.kind = Kind::kHalfspace, b.size.setOnes();
          const Pose X_b{a.pose.position + random.uniform(0.0, 2.6) * random.direction(), random.rotation()};
          bodies.push_back(std::move(a));
          bodies.push_back({std::move(b), X_b});
        }
        // as they lie, and brought to within a tenth of a millimetre of touching
        for (const bool is_near : {false, true}) {
          const MessageColumns request = request_of(bodies);
          const std::vector<double> one = depths_of(&standard, request, pairs),
                                    other = depths_of(&gjk_only, request, pairs);
          for (std::size_t i = 0; i < pairs; ++i) {
            // either may prefer a face by up to 1 % of the depth; 1e-6 of the sizes, about a metre, otherwise. Two that
            // are at the margin apart may differ about it.
            const double deeper = std::max(one[i], other[i]);
            if (deeper < -kMargin + 1e-5) continue;
            const double tolerance = 0.021 * std::max(0.0, deeper) + 5e-6;
            ASSERT_NEAR(one[i], other[i], tolerance)
                << "kinds " << static_cast<int>(kinds[ka]) << ", " << static_cast<int>(kinds[kb]) << ", pair " << i
                << (is_near ? ", near" : "");
            ++compared;
            touching += deeper > 0.0 ? 1 : 0;
          }
          if (is_near) break;
          const MessageColumns reply = standard.ask(kAskManifolds, request);
          std::vector<bool> moved(pairs, false);
          for (std::size_t k = 0; k < reply.f64("depth").size(); ++k) {
            const std::size_t i = reply.u32("contact_pair")[k];
            if (moved[i] || reply.f64("depth")[k] < one[i]) continue;
            moved[i] = true;
            bodies[2 * i + 1].pose.position +=
                (one[i] + random.uniform(-1e-4, 1e-4)) * vector_at(reply.f64("normal"), k);
          }
        }
      }
    }
  }
  // the poses are such that the comparison means something
  EXPECT_GT(compared, 27 * poses);
  EXPECT_GT(touching, 10 * poses);
}

}  // namespace
}  // namespace gravitas::test
