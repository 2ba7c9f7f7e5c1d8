// What the standard collision plugin refuses of a request.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "plugin_sdk/body.h"
#include "tests/workers/plugin_fixture.h"

namespace gravitas::test {
namespace {

constexpr stage::Method kManifolds = stage::Method::kCollisionManifolds;

// Two unit balls that overlap by 0.5 m.
MessageColumns two_balls() {
  MessageColumns request = PluginUnderTest::request_of(kManifolds);
  request.u64("shape_hash") = {1};
  request.u64("shape_type") = {type_id("Sphere")};
  request.u32("shape_parameter_begin") = {0, 1};
  request.f64("shape_parameter") = {1.0};
  request.u32("body_shape") = {0, 0};
  request.f64("geometry_position") = std::vector<double>(6, 0.0);
  request.f64("position") = {0, 0, 0, 1.5, 0, 0};
  for (const char* column : {"geometry_orientation", "orientation"}) request.f64(column) = {1, 0, 0, 0, 1, 0, 0, 0};
  for (const char* column : {"linear_velocity", "angular_velocity"}) request.f64(column).assign(6, 0.0);
  request.u32("pair") = {0, 1};
  return request;
}

class StandardCollision : public testing::Test {
 protected:
  PluginUnderTest plugin_{"collision_standard"};
};

TEST_F(StandardCollision, AnswersAGoodRequest) {
  const MessageColumns reply = plugin_.ask(kManifolds, two_balls());
  EXPECT_EQ(reply.f64("depth"), std::vector<double>{0.5});
}

TEST_F(StandardCollision, RefusesNumbersThatAreNotFinite) {
  struct Place {
    const char* column;
    const char* name;
    std::size_t components;
  };
  const Place places[] = {{"geometry_position", "geometry position", 3},
                          {"geometry_orientation", "geometry orientation", 4},
                          {"position", "position", 3},
                          {"orientation", "orientation", 4},
                          {"linear_velocity", "linear velocity", 3},
                          {"angular_velocity", "angular velocity", 3}};
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), -std::numeric_limits<double>::infinity()}) {
    for (const Place& place : places) {
      MessageColumns request = two_balls();
      request.f64(place.column)[place.components] = bad;
      EXPECT_EQ(plugin_.refusal(kManifolds, request),
                std::string("body 1 has a ") + place.name + " that is not finite");
    }
    MessageColumns request = two_balls();
    request.f64("margin") = {-1.0};
    EXPECT_EQ(plugin_.refusal(kManifolds, request), "the margin is negative, or no number");
  }
}

// Two unit balls 1 m apart, of which one comes by 4 m.
TEST_F(StandardCollision, BallsAboutTheirCentresMayTurnByAnyAngle) {
  constexpr stage::Method kTimes = stage::Method::kCollisionTimesOfImpact;
  const MessageColumns still = two_balls();
  MessageColumns request = PluginUnderTest::request_of(kTimes);
  for (const char* column : {"shape_hash", "shape_type"}) request.u64(column) = still.u64(column);
  for (const char* column : {"shape_parameter_begin", "body_shape", "pair"}) request.u32(column) = still.u32(column);
  for (const char* column : {"shape_parameter", "geometry_position", "geometry_orientation", "orientation"})
    request.f64(column) = still.f64(column);
  request.f64("target_gap") = {1e-6};
  request.f64("position") = {0, 0, 0, 3, 0, 0};
  request.f64("displacement") = {4, 0, 0, 0, 0, 0};
  for (const double turn : {0.0, 1e3, 1e9, 1e300}) {
    request.f64("rotation") = {0, turn, 0, 0, 0, turn};
    EXPECT_NEAR(plugin_.ask(kTimes, request).f64("fraction").at(0), 0.25, 2.5e-7) << turn;
  }
  // off its centre it goes round
  request.f64("geometry_position") = {0, 0, 0, 0, 0, 0.1};
  EXPECT_EQ(plugin_.refusal(kTimes, request),
            "body 1 turns by more than 1e8 rad in the interval; allowed: a shorter TimeStep");
  // what meets nothing may do as it likes
  request.u32("pair") = {};
  EXPECT_TRUE(plugin_.ask(kTimes, request).f64("fraction").empty());
}

TEST_F(StandardCollision, RefusesAContactThatOverflows) {
  MessageColumns request = two_balls();
  request.f64("linear_velocity") = {-1.5e308, 0, 0, 1.5e308, 0, 0};
  EXPECT_EQ(plugin_.refusal(kManifolds, request),
            "a contact of pair 0 is not finite: sizes, positions or velocities overflow");
}

}  // namespace
}  // namespace gravitas::test
