#include "plugin_sdk/event_location.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "plugin_sdk/math/rotation.h"

namespace gravitas {
namespace {

constexpr double kGravity = 9.81;         // m/s²
constexpr double kTargetGap = 1e-11;      // m
constexpr double kShortestFlight = 1e-8;  // s

// A point above a floor, whose gap is gap + speed t - kGravity t² / 2.
struct Flight {
  double gap = 0.0, speed = 0.0;

  Flight after(double time) const {
    return {gap + speed * time - 0.5 * kGravity * time * time, speed - kGravity * time};
  }

  // What a collision plugin says of the straight way to where it is after `length`.
  Encounter encounter(double length) const {
    const Flight end = after(length);
    if (gap <= kTargetGap) return {0.0, gap, speed, end.speed};
    if (end.gap > kTargetGap) return {1.0, end.gap, speed, end.speed};
    return {(gap - kTargetGap) / (gap - end.gap), kTargetGap, speed, end.speed};
  }
};

struct Landing {
  double time = 0.0, gap = 0.0;
  int steps = 0, trials = 0;
};

// Steps as a simulator takes them until the floor is met.
Landing land(Flight flight, double time_step) {
  Landing landing;
  for (; flight.gap > kTargetGap && landing.steps < 100; ++landing.steps) {
    NextStop next{time_step, true};
    for (; next.is_trial && landing.trials < 1000; ++landing.trials) {
      const double length = next.length;
      next = stop_before(flight.encounter(length), length, kTargetGap, kShortestFlight);
      next.length = std::min(next.length, length);
    }
    landing.time += next.length;
    flight = flight.after(next.length);
  }
  landing.gap = flight.gap;
  return landing;
}

TEST(EventLocation, AFallIsMetAtItsTime) {
  for (const double height : {1e-6, 1e-3, 0.1, 5.0}) {
    const double time = std::sqrt(2.0 * height / kGravity);
    for (const double share : {1.01, 3.0, 10.0}) {
      const Landing landing = land({height, 0.0}, share * time);
      const double speed = kGravity * time;
      EXPECT_NEAR(landing.time, time, 4.0 * kTargetGap / speed + 1e-15) << height << " m, " << share;
      // the contact is closed, and no deeper than said: two target gaps, and half of one for the bend
      EXPECT_LE(landing.gap, kTargetGap);
      EXPECT_GE(landing.gap, -3.0 * kTargetGap);
      EXPECT_LE(landing.steps, 80);
      EXPECT_LE(landing.trials, 160);
    }
  }
}

// All the way but where a solver would see it closed, and then the rest: what friction does in the step that meets is over in
// no time. At the very end of a step, too.
TEST(EventLocation, AStraightWayIsMetInTwoSteps) {
  constexpr double kSlop = 5.0 * kTargetGap, kSpeed = 100.0;
  for (const double length : {0.01, 0.0025 + 1e-14}) {
    const NextStop stop =
        stop_before({0.0025 / length, kTargetGap, -kSpeed, -kSpeed, kSlop}, length, kTargetGap, kShortestFlight);
    EXPECT_FALSE(stop.is_trial);
    EXPECT_DOUBLE_EQ(stop.length, 0.0025 - 2.0 * kSlop / kSpeed);
  }
  const double left = 0.0075;
  const NextStop last = stop_before({2.0 * kSlop / (kSpeed * left), kTargetGap, -kSpeed, -kSpeed, kSlop}, left,
                                    kTargetGap, kShortestFlight);
  EXPECT_FALSE(last.is_trial);
  EXPECT_NEAR(last.length, (2.0 * kSlop + 2.0 * kTargetGap) / kSpeed, 1e-25);
}

// Left between touching and the target, or overlapping without a contact, it is no rest.
TEST(EventLocation, WhatHasNearlyMetFliesOnUntilItTouches) {
  const NextStop stop = stop_before({0.0, 0.5 * kTargetGap, -100.0, -100.0}, 0.01, kTargetGap, kShortestFlight);
  EXPECT_DOUBLE_EQ(stop.length, 2.5 * kTargetGap / 100.0);
  const NextStop deeper = stop_before({0.0, -3.0 * kTargetGap, -100.0, -100.0}, 0.01, kTargetGap, kShortestFlight);
  EXPECT_DOUBLE_EQ(deeper.length, 5.0 * kTargetGap / 100.0);
}

TEST(EventLocation, WhatTheDetectorDidNotFollowToTheEndIsLookedAtAgain) {
  const NextStop stop = stop_before({0.5, 1e-3, -100.0, -100.0}, 0.01, kTargetGap, kShortestFlight);
  EXPECT_FALSE(stop.is_trial);
  EXPECT_DOUBLE_EQ(stop.length, 0.005);
}

// Beside a large body the detector tells no nearer.
TEST(EventLocation, WhatTheDetectorCallsMetBeforeItIsFliesOnUntilItIs) {
  constexpr double kGap = 150.0 * kTargetGap;
  const auto stop = [](double speed) {
    return stop_before({0.0, kGap, speed, speed}, 0.01, kTargetGap, kShortestFlight);
  };
  EXPECT_DOUBLE_EQ(stop(-100.0).length, (kGap + 2.0 * kTargetGap) / 100.0);
  EXPECT_EQ(stop(-1e-9).length, 0.01);
  EXPECT_EQ(stop(0.0).length, 0.01);
  EXPECT_EQ(stop(1.0).length, 0.01);
}

TEST(EventLocation, PairsThatRestPartOrPressNeedNoStop) {
  const double length = 0.01;
  const auto stop = [&](double start_speed, double end_speed) {
    return stop_before({0.0, 0.0, start_speed, end_speed, 0.0, true}, length, kTargetGap, kShortestFlight).length;
  };
  EXPECT_EQ(stop(0.0, -kGravity * length), length);  // rests
  EXPECT_EQ(stop(-1.0, -2.0), length);               // pressed: the solver's
  EXPECT_EQ(stop(1.0, 0.5), length);                 // parts
  // flights of 5e-12 m and 2e-11 m
  EXPECT_EQ(stop(1e-5, -kGravity * length), length);
  EXPECT_LT(stop(2e-5, -kGravity * length), length);
}

TEST(EventLocation, GrazingIsNotWorthAStep) {
  // met at the very end, at a speed that goes no deeper than the target in what is left
  const NextStop stop = stop_before({0.999, kTargetGap, -1e-9, -1e-9}, 0.01, kTargetGap, kShortestFlight);
  EXPECT_FALSE(stop.is_trial);
  EXPECT_EQ(stop.length, 0.01);
}

// Up at 0.01 m/s and back at 0.03 m/s in 4 ms: it is at the top of its flight, 5e-6 m, after 1 ms.
TEST(NextStop, FollowsAFlightToItsTop) {
  const NextStop top = stop_before({0.0, 0.0, 0.01, -0.03}, 0.004, 1e-10, 1e-9);
  EXPECT_NEAR(top.length, 0.001, 1e-15);
  EXPECT_FALSE(top.meets);
}

// From 1 mm and so near that the solver closes it, at 100 m/s: before the floor, and in it.
TEST(NextStop, TellsWhetherItMeets) {
  EXPECT_FALSE(
      stop_before({0.001, kTargetGap, -100.0, -100.0, 5.0 * kTargetGap}, 0.01, kTargetGap, kShortestFlight).meets);
  EXPECT_TRUE(
      stop_before({1e-9, kTargetGap, -100.0, -100.0, 5.0 * kTargetGap}, 0.01, kTargetGap, kShortestFlight).meets);
  EXPECT_TRUE(stop_before({0.0, 0.5 * kTargetGap, -100.0, -100.0}, 0.01, kTargetGap, kShortestFlight).meets);
}

// The straight motion to the end of the trial goes down at once, the bent one does not.
TEST(NextStop, FollowsAFlightToItsTopThoughTheStraightMotionMeetsBefore) {
  const NextStop top = stop_before({1e-5, 2e-10, 0.01, -0.03}, 0.004, 1e-10, 1e-9);
  EXPECT_NEAR(top.length, 0.001, 1e-15);
  // unless it comes back by turning: the motion to the top is looked at
  EXPECT_TRUE(top.is_trial);
  EXPECT_FALSE(stop_before({0.0, 0.0, 0.01, -0.03}, 0.004, 1e-10, 1e-9).is_trial);
}

// Bounced off at 10 m/s, with a spin that moves other parts by 50 m/s: 5 mm before the trial ends, of which 1 mm is harmless.
TEST(NextStop, LeavesFirstWhereOtherPartsMayMeet) {
  Encounter bounced{0.0, 0.0, 10.0, 10.0, 0.0, true};
  bounced.bounce_speed = 10.0, bounced.turning_speed = 50.0, bounced.harmless_depth = 1e-3;
  const auto left = [&] { return stop_before(bounced, 1e-4, kTargetGap, kShortestFlight).length; };
  // apart, beyond all doubt, and turned by nothing
  EXPECT_GT(10.0 * left(), 20.0 * kTargetGap);
  EXPECT_LT(50.0 * left(), 1e-6);
  bounced.turning_speed = 5.0;
  EXPECT_EQ(left(), 1e-4);
  // what only rolls away did not bounce, and is the solver's
  bounced.turning_speed = 50.0, bounced.bounce_speed = 1e-15;
  EXPECT_EQ(left(), 1e-4);
}

// 1e-10 m up, down at 2e-5 m/s: the straight motion to 0.5 mm below, after 10 ms, meets the floor a thousand times sooner.
TEST(NextStop, LooksAgainWhereWhatIsDrawnTogetherMeets) {
  constexpr double kWay = 1e-10, kSpeed = 2e-5;
  const NextStop stop =
      stop_before(Flight{kTargetGap + kWay, -kSpeed}.encounter(0.01), 0.01, kTargetGap, kShortestFlight);
  EXPECT_TRUE(stop.is_trial);
  const double met = (std::sqrt(kSpeed * kSpeed + 2.0 * kGravity * kWay) - kSpeed) / kGravity;
  EXPECT_NEAR(stop.length, 2.0 * met, 1e-12);
}

TEST(NextStop, TakesFlightsLowerThanTheTargetForRest) {
  EXPECT_EQ(stop_before({0.0, 0.0, 1e-6, -0.04}, 0.004, 1e-10, 1e-9).length, 0.004);
}

const Vector3 kUp(0, 1, 0);

// ---- slips at the start of a trial ---------------------------------------------------------------

constexpr double kTrial = 0.02;

// A body that turns steadily about a point, told by where a trial starts.
TrialMotion turning_about(const Vector3& centre, const Vector3& rate, const Vector3& at) {
  const Quaternion turn = exp_rotation(kTrial * rate);
  return {{at, Quaternion::Identity()}, {centre + turn * (at - centre), turn}, {rate.cross(at - centre), rate}};
}

// On a plate that turns about an edge, 0.1 m below its face, a ball of 0.2 m stays where it is on the plate, and rolls about
// its own centre.
TEST(StartSlip, OfABallThatRollsOnATurningPlateIsThatOfItsStart) {
  const Vector3 rate(0, 0, 3.0), own(0, 0, 5.0);
  const TrialMotion plate = turning_about(Vector3::Zero(), rate, Vector3(0.5, -0.1, 0));
  TrialMotion ball = turning_about(Vector3::Zero(), rate, Vector3(0.4, 0.2, 0));
  ball.velocity.angular = rate + own;
  ball.end.orientation = exp_rotation(kTrial * ball.velocity.angular);
  const Vector3 normal = exp_rotation(kTrial * rate) * kUp, point = ball.end.position - 0.2 * normal;
  // the ball's surface goes along the plate as fast as it turns against it
  const Vector3 slip = start_slip(point, point, normal, plate, ball);
  EXPECT_NEAR(slip.norm(), 1.0, kTrial * (rate + own).norm());
  EXPECT_NEAR(slip.dot(normal), 0.0, 1e-15);
  // and at the velocity that makes up for it not at all
  ball.velocity.linear -= Vector3(1.0, 0, 0);
  EXPECT_NEAR(start_slip(point, point, normal, plate, ball).norm(), 0.0, 1e-15);
  EXPECT_NEAR(start_slip(point, point, -normal, ball, plate).norm(), 0.0, 1e-15);
}

// A rod tips over its lower end, which sticks to the ground; and a plate turns on a corner of something that stands.
TEST(StartSlip, OfACornerThatSticksIsNone) {
  const TrialMotion still{};
  const Vector3 corner(0.3, 0, 0.1);
  const TrialMotion rod = turning_about(corner, {0.7, 0.2, -2.0}, Vector3(0.5, 1.0, 0));
  EXPECT_NEAR(start_slip(corner, corner, kUp, still, rod).norm(), 0.0, 1e-15);
  const Vector3 normal = rod.end.orientation * kUp;
  EXPECT_NEAR(start_slip(corner, corner, normal, rod, still).norm(), 0.0, 1e-15);
}

// Wheels of 0.1 and 0.3 m that turn on each other, the one about the other's centre.
TEST(StartSlip, OfABallThatRollsOnABallIsNone) {
  const double about = 2.0;  // rad/s of the line of the centres
  const TrialMotion inner{{Vector3::Zero(), Quaternion::Identity()}, {Vector3::Zero(), Quaternion::Identity()}, {}};
  TrialMotion outer = turning_about(Vector3::Zero(), Vector3(0, 0, about), Vector3(0.4, 0, 0));
  outer.velocity.angular = Vector3(0, 0, 4.0 * about);
  outer.end.orientation = exp_rotation(kTrial * outer.velocity.angular);
  const Vector3 normal = outer.end.position.normalized();
  EXPECT_NEAR(start_slip(0.3 * normal, 0.3 * normal, normal, inner, outer).norm(), 0.0, 1e-15);
}

// ---- slides -------------------------------------------------------------------------------------

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

// Pressed by 100 m/s^2 from rest, from an approach and while it parts: where s t + a t^2/2 = -most, if the trial comes so far.
TEST(Events, WhatIsPressedEndsBeforeItIsPressedThrough) {
  constexpr double kLength = 0.02, kMost = 5e-4, kAcceleration = 100.0;
  for (const double speed : {0.0, -0.05, 1e-7}) {
    Encounter pressed{0.0, 0.0, speed, speed - kAcceleration * kLength, 0.0, true};
    pressed.left_gap = 1e-6;
    EXPECT_EQ(stop_before(pressed, kLength, kTargetGap, kShortestFlight).length, kLength) << speed;
    pressed.most_pressed = kMost;
    const NextStop stop = stop_before(pressed, kLength, kTargetGap, kShortestFlight);
    EXPECT_NEAR(speed * stop.length - 0.5 * kAcceleration * stop.length * stop.length, -kMost, 1e-15) << speed;
    EXPECT_FALSE(stop.is_trial);
    pressed.most_pressed = 1.0;
    EXPECT_EQ(stop_before(pressed, kLength, kTargetGap, kShortestFlight).length, kLength) << speed;
    // however thin: some steps, not any number of them
    pressed.most_pressed = 1e-12;
    EXPECT_GE(stop_before(pressed, kLength, kTargetGap, kShortestFlight).length, 1e3 * kShortestFlight) << speed;
  }
}

}  // namespace
}  // namespace gravitas
