#include "plugin_sdk/event_location.h"

#include <gtest/gtest.h>

#include <cmath>

namespace gravitas {
namespace {

// Up at 0.01 m/s and back at 0.03 m/s in 4 ms: it is at the top of its flight, 5e-6 m, after 1 ms.
TEST(NextStop, FollowsAFlightToItsTop) {
  EXPECT_NEAR(stop_before({0.0, 0.0, 0.01, -0.03}, 0.004, 1e-10, 1e-9).length, 0.001, 1e-15);
}

// The straight motion to the end of the trial goes down at once, the bent one does not.
TEST(NextStop, FollowsAFlightToItsTopThoughTheStraightMotionMeetsBefore) {
  EXPECT_NEAR(stop_before({1e-5, 2e-10, 0.01, -0.03}, 0.004, 1e-10, 1e-9).length, 0.001, 1e-15);
}

TEST(NextStop, TakesFlightsLowerThanTheTargetForRest) {
  EXPECT_EQ(stop_before({0.0, 0.0, 1e-6, -0.04}, 0.004, 1e-10, 1e-9).length, 0.004);
}

const Vector3 kUp(0, 1, 0);

// mu g = 3 m/s^2 on 2 kg, in a trial of `length` of a slide that began at 3 m/s.
Slide slide_of(double length, double end_speed, double friction_impulse) {
  Slide slide;
  slide.add(kUp, 0.3, Vector3(3, -0.2, 0), Vector3(end_speed, 0, 0), Vector3(-friction_impulse, 20.0 * length, 0));
  return slide;
}

TEST(Slide, ThatGoesOnEndsBeyondTheTrial) { EXPECT_NEAR(slide_of(0.5, 1.5, 3.0).end(0.5), 1.0, 1e-15); }

TEST(Slide, ThatSlidesBackEndsWhereItTurns) { EXPECT_NEAR(slide_of(2.0, -3.0, 12.0).end(2.0), 1.0, 1e-15); }

// 2 kg lose 3 m/s: 6 N s of the 6 N times 4 s that there might be.
TEST(Slide, ThatSticksEndsWhenItsFrictionIsUsed) { EXPECT_NEAR(slide_of(4.0, 0.0, 6.0).end(4.0), 1.0, 1e-15); }

TEST(Slide, ThatIsNotSlowedNeverEnds) { EXPECT_TRUE(std::isinf(slide_of(1.0, 3.0, 0.0).end(1.0))); }

TEST(Slide, NeedsFrictionAndPressure) {
  EXPECT_EQ(Slide{}.start_speed(), 0.0);
  Slide smooth, lifted;
  smooth.add(kUp, 0.0, Vector3(3, 0, 0), Vector3::Zero(), kUp);
  lifted.add(kUp, 0.3, Vector3(3, 0, 0), Vector3::Zero(), Vector3::Zero());
  EXPECT_EQ(smooth.start_speed(), 0.0);
  EXPECT_EQ(lifted.start_speed(), 0.0);
}

// A turning box: its contacts slide in different directions, and all come to rest together.
TEST(Slide, OfManyContactsCountsEachByItsFriction) {
  Slide slide;
  for (const double side : {-1.0, 1.0})
    slide.add(kUp, 0.5, Vector3(0, 0, side), Vector3::Zero(), Vector3(0, 2.0, -0.25 * side));
  EXPECT_NEAR(slide.start_speed(), 1.0, 1e-15);
  EXPECT_NEAR(slide.end(1.0), 0.25, 1e-15);
}

}  // namespace
}  // namespace gravitas
