// Gears, racks and screws against closed forms: ratios, power, trains whose meshes depend on each other, many turns.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "tests/paths.h"
#include "tests/scenes/watched_run.h"

namespace gravitas::gears {
namespace {

using harness::literal;
using harness::SceneRun;
using harness::set;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

const Vector3 kUp = Vector3::UnitZ(), kCentre = Vector3::Zero();

struct Part {
  std::string id;
  Vector3 position = Vector3::Zero();
  double spin = 0.0, mass = 1.0, moment = 0.1;  // about z
  std::string force = {};
  Vector3 velocity = Vector3::Zero();
};

std::string parts(const std::vector<Part>& all) {
  std::string text;
  for (const Part& p : all)
    text += "Body { Id = \"" + p.id + "\" Mass = " + literal(p.mass) +
            " PrincipalMoments = " + literal(Vector3(0.6 * p.moment, 0.6 * p.moment, p.moment)) +
            (p.force.empty() ? "" : " Forces = { \"" + p.force + "\" }") +
            " KineticProperties { Position = " + literal(p.position) + " LinearVelocity = " + literal(p.velocity) +
            " AngularVelocity = " + literal(Vector3(p.spin * kUp)) + " } }\n";
  return text;
}

// A joint with the bodies and properties given; a body without name is the world.
std::string link(const std::string& type, const std::string& one, const std::string& two,
                 const std::string& properties) {
  static int count = 0;
  const auto end = [](int which, const std::string& id) {
    return id.empty() ? "" : " Body" + std::to_string(which) + " = \"" + id + "\"";
  };
  return "Constraint { Type = \"" + type + "\" Id = \"" + type + std::to_string(++count) + "\"" + end(1, one) +
         end(2, two) + " CustomProperties { " + properties + " } }\n";
}

std::string axis_through(const Vector3& point) {
  return "BindAxisPoint1 = " + literal(point) + " BindAxisPoint2 = " + literal(Vector3(point + kUp));
}
std::string bearing(const std::string& one, const std::string& two, const Vector3& point) {
  return link("Revolute", one, two, axis_through(point));
}
std::string motor(const std::string& one, const std::string& two, const Vector3& point, double speed) {
  return link("AngularMotor", one, two, axis_through(point) + " AngularSpeed = " + literal(speed));
}
std::string mesh(const std::string& one, int teeth1, const std::string& two, int teeth2, const std::string& more = "") {
  return link(
      "Gear", one, two,
      "Axis = {0, 0, 1} Teeth1 = " + std::to_string(teeth1) + " Teeth2 = " + std::to_string(teeth2) + " " + more);
}

std::string geared(const std::vector<Part>& bodies, const std::string& joints, const std::string& forces = "") {
  return "Forces { " + forces +
         " }\nSimulator { CustomProperties { TimeStep = 0.016666666666666666 Duration = 1 SleepEnergy = 0 } }\n"
         "Environment { Space { Bodies {\n" +
         parts(bodies) + "} }\nConstraints {\n" + joints + "}\nConstraintSolver = \"Newton\" }\n";
}

std::string torque(const std::string& id, double about_z) {
  return "Force { Type = \"Basic\" Id = \"" + id +
         "\" CustomProperties { Force = {0, 0, 0} Torque = " + literal(Vector3(about_z * kUp)) + " } }\n";
}
std::string gravity(const std::string& id, const Vector3& g) {
  return "Force { Type = \"Gravity\" Id = \"" + id + "\" CustomProperties { Acceleration = " + literal(g) + " } }\n";
}

double spin(const SceneRun& run, const std::string& id) { return run.body(id).twist.angular.z(); }

// Turn about z within half a turn.
double turn_of(const SceneRun& run, const std::string& id) {
  const Quaternion q = run.body(id).pose.orientation;
  return 2.0 * std::atan2(q.z(), q.w());
}

double wrapped(double angle) { return std::remainder(angle, 2.0 * kPi); }

// All turns of a body, from step to step by less than half a turn.
class Turned {
 public:
  explicit Turned(std::string id) : id_(std::move(id)) {}
  void look(const SceneRun& run) {
    const double now = turn_of(run, id_);
    whole_ += std::lround((wrapped(now - last_) + last_ - now) / (2.0 * kPi)), last_ = now;
  }
  double sum() const { return 2.0 * kPi * static_cast<double>(whole_) + last_; }
  long whole() const { return whole_; }

 private:
  std::string id_;
  double last_ = 0.0;
  long whole_ = 0;
};

constexpr std::array kSolvers = {"Newton", "Direct", "Sequential"};

class Gears : public ::testing::TestWithParam<const char*> {
 protected:
  std::vector<std::string> solver(std::vector<std::string> more = {}) const {
    more.push_back(set("Solver", std::string(GetParam())));
    return more;
  }
  double tolerance(double of_factors, double of_sweeps) const {
    return std::string(GetParam()) == "Sequential" ? of_sweeps : of_factors;
  }
};
INSTANTIATE_TEST_SUITE_P(Each, Gears, ::testing::ValuesIn(kSolvers),
                         [](const auto& which) { return std::string(which.param); });

// 17:23, coprime: teeth meet anew after 23 turns. Ten thousand turns at 100 rad/s, counted by the test alone.
TEST_P(Gears, KeepTheirPhaseOverTenThousandTurns) {
  constexpr double kSpeed = 100.0;
  const Vector3 other(0.3, 0.2, 0);
  SceneRun run(geared({{"A", kCentre, kSpeed}, {"B", other, -kSpeed * 17.0 / 23.0, 2.0, 0.4}},
                      bearing("", "A", kCentre) + bearing("", "B", other) + mesh("A", 17, "B", 23)),
               solver({"Simulator.Duration=700"}));
  Turned a("A"), b("B");
  double largest = 0.0;
  while (a.whole() < 10000) {
    run.step();
    a.look(run), b.look(run);
    const double whole = 2.0 * kPi * static_cast<double>(17 * a.whole() + 23 * b.whole());
    largest = std::max(largest, std::fabs(17.0 * turn_of(run, "A") + 23.0 * turn_of(run, "B") + whole));
  }
  // rounding of angles, 23 of them
  EXPECT_LT(largest, 1e-12);
  EXPECT_NEAR(spin(run, "B") / spin(run, "A"), -17.0 / 23.0, 1e-13);
  EXPECT_LT(run.report().max_joint_error(), 1e-13);
}

// One wheel turns and meets another at rest: what the mesh exerts takes I1 w1/N1 - I2 w2/N2 along nowhere.
TEST_P(Gears, ShareWhatOneBrings) {
  const Vector3 other(0, -0.5, 0);
  SceneRun run(geared({{"A", kCentre, 2.0, 1.0, 0.1}, {"B", other, 0.0, 1.0, 0.4}},
                      bearing("", "A", kCentre) + bearing("", "B", other) + mesh("A", 20, "B", 40)),
               solver());
  run.to_end();
  const double w1 = 2.0 * 0.1 / (0.1 + 0.4 * 0.25);
  // the first step closes 0.033 rad, half of it on either side: of the second order
  EXPECT_NEAR(spin(run, "A"), w1, 0.0167 * 0.0167);
  EXPECT_NEAR(spin(run, "B"), -0.5 * spin(run, "A"), tolerance(1e-13, 1e-9));
}

TEST_P(Gears, PassTheSamePower) {
  const Vector3 other(0.6, 0, 0);
  for (const bool is_internal : {false, true}) {
    SceneRun run(geared({{"A", kCentre, 0.0, 1.0, 0.1, "Drive"}, {"B", other, 0.0, 1.0, 0.5}},
                        bearing("", "A", kCentre) + bearing("", "B", other) +
                            mesh("A", 17, "B", 51, is_internal ? "Internal = true" : ""),
                        torque("Drive", 0.3)),
                 solver());
    run.to_end();
    const double alpha = 0.3 / (0.1 + 0.5 / 9.0);
    // turns of 5e-4 rad between free motion and the joints, squared
    EXPECT_NEAR(spin(run, "A"), alpha, 1e-5) << is_internal;
    EXPECT_NEAR(spin(run, "B"), (is_internal ? 1.0 : -1.0) / 3.0 * spin(run, "A"), 1e-6) << is_internal;
    EXPECT_LT(std::fabs(wrapped(turn_of(run, "A") + (is_internal ? -3.0 : 3.0) * turn_of(run, "B"))), 1e-6);
  }
}

// A pinion of 0.1 g m^2 under 1 N m: free it would turn by 2.8 rad in a step, and takes inner steps. Whichever body it is.
TEST_P(Gears, TakeWhatALightPinionIsLoadedWith) {
  const Vector3 other(0.5, 0, 0);
  for (const bool is_first : {true, false}) {
    SceneRun run(geared({{"Pinion", kCentre, 0.0, 0.1, 1e-4, "Drive"}, {"Wheel", other, 0.0, 20.0, 10.0}},
                        bearing("", "Pinion", kCentre) + bearing("", "Wheel", other) +
                            (is_first ? mesh("Pinion", 17, "Wheel", 230) : mesh("Wheel", 230, "Pinion", 17)),
                        torque("Drive", 1.0)),
                 solver());
    run.to_end();
    const double speed = 1.0 / (1e-4 + 10.0 * std::pow(17.0 / 230.0, 2));
    // of the third order of the 0.25 rad that inner steps are short enough for
    EXPECT_NEAR(spin(run, "Pinion") / speed, 1.0, 1e-3) << is_first;
    EXPECT_NEAR(-230.0 / 17.0 * spin(run, "Wheel") / speed, 1.0, 1e-3) << is_first;
    EXPECT_LT(std::fabs(wrapped(17.0 * turn_of(run, "Pinion") + 230.0 * turn_of(run, "Wheel"))),
              17 * 0.25 * 0.25 * 0.25);
  }
}

constexpr int kSun = 12, kPlanet = 18, kRing = 48;

// Sun, three planets on a carrier, ring: two meshes of six say nothing new.
std::string planetary(double speed) {
  std::vector<Part> bodies = {{"Sun", kCentre, 0.0}, {"Carrier", kCentre, 0.0, 1.0, 0.2}};
  std::string joints = motor("", "Sun", kCentre, speed) + bearing("", "Carrier", kCentre);
  for (int i = 0; i < 3; ++i) {
    const std::string id = "Planet" + std::to_string(i);
    const double angle = 2.0 * kPi * i / 3.0;
    const Vector3 at(0.3 * std::cos(angle), 0.3 * std::sin(angle), 0);
    bodies.push_back({id, at, 0.0, 0.5, 0.01});
    joints += bearing("Carrier", id, at) + mesh("Sun", kSun, id, kPlanet) +
              mesh(id, kPlanet, "", kRing, "Internal = true BindAxisPoint2 = {0, 0, 0}");
  }
  return geared(bodies, joints);
}

// Willis: the carrier of a sun at w, the ring held, turns at w/(1 + Nr/Ns) = w/5, planets at w_c - (w_s - w_c) Ns/Np.
TEST_P(Gears, OfAPlanetaryTrainTurnItsCarrier) {
  SceneRun run(planetary(5.0), solver({"Simulator.Duration=20"}));
  Turned sun("Sun"), carrier("Carrier"), planet("Planet1");
  while (!run.is_done()) {
    run.step();
    sun.look(run), carrier.look(run), planet.look(run);
  }
  // speeds are met to the second order of a step's turn of the carrier, 1/60 rad
  EXPECT_NEAR(spin(run, "Sun"), 5.0, tolerance(1e-9, 1e-4));
  EXPECT_NEAR(spin(run, "Carrier"), 1.0, 1e-4);
  EXPECT_NEAR(spin(run, "Planet1"), 1.0 - 4.0 * 12.0 / 18.0, 4.0 / 3600.0);
  EXPECT_NEAR(carrier.sum(), 0.2 * sun.sum(), 1e-4);
  EXPECT_NEAR(planet.sum(), (1.0 - 4.0 * 12.0 / 18.0) / 5.0 * sun.sum(), 3e-4);
  EXPECT_LT(run.report().max_joint_error(), 1e-4);
}

// Suns with as many teeth, coupled by two planets that mesh: (w1 - wc) = -(w2 - wc).
std::string differential(double speed1, double speed2) {
  const Vector3 at1(0.3, 0.1, 0), at2(0.3, -0.1, 0.1), other(0, 0, 0.1);
  const std::vector<Part> bodies = {{"One", kCentre},
                                    {"Two", other},
                                    {"Case", kCentre, 0.0, 1.0, 0.2},
                                    {"P1", at1, 0.0, 0.3, 0.01},
                                    {"P2", at2, 0.0, 0.3, 0.01}};
  return geared(bodies, motor("", "One", kCentre, speed1) + motor("", "Two", kCentre, speed2) +
                            bearing("", "Case", kCentre) + bearing("Case", "P1", at1) + bearing("Case", "P2", at2) +
                            mesh("One", 24, "P1", 10) + mesh("Two", 24, "P2", 10) + mesh("P1", 10, "P2", 10));
}

TEST_P(Gears, OfADifferentialAverage) {
  for (const auto& [w1, w2] : {std::pair(3.0, 1.0), std::pair(2.0, -2.0)}) {
    SceneRun run(differential(w1, w2), solver({"Simulator.Duration=3"}));
    Turned one("One"), two("Two"), its_case("Case");
    while (!run.is_done()) {
      run.step();
      one.look(run), two.look(run), its_case.look(run);
    }
    EXPECT_NEAR(spin(run, "Case"), 0.5 * (w1 + w2), 1e-3);
    EXPECT_NEAR(its_case.sum(), 0.5 * (one.sum() + two.sum()), 1e-3);
  }
}

// The same of bevel wheels: a planet between two equal ones on the axis, on a pin of the case that turns.
TEST_P(Gears, OfABevelDifferentialAverage) {
  const Vector3 at1(0, 0, -0.1), at2(0, 0, 0.1), at(0.2, 0, 0);
  const std::string pin = "BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {1, 0, 0}";
  const std::string axes = "Axis2 = {1, 0, 0}";
  SceneRun run(geared({{"One", at1}, {"Two", at2}, {"Case", kCentre, 0.0, 1.0, 0.2}, {"Planet", at, 0.0, 0.3, 0.01}},
                      motor("", "One", kCentre, 3.0) + motor("", "Two", kCentre, 1.0) + bearing("", "Case", kCentre) +
                          link("Revolute", "Case", "Planet", pin) + mesh("One", 30, "Planet", 15, axes) +
                          mesh("Two", 30, "Planet", 15, axes)),
               solver({"Simulator.Duration=3"}));
  Turned one("One"), two("Two"), its_case("Case");
  while (!run.is_done()) {
    run.step();
    one.look(run), two.look(run), its_case.look(run);
  }
  // of the second order of a step's turn of 2/60 rad
  EXPECT_NEAR(spin(run, "Case"), 2.0, 4e-3);
  EXPECT_NEAR(its_case.sum(), 0.5 * (one.sum() + two.sum()), 1e-3);
  // about its pin it turns by the difference to either
  const SceneRun::Motion planet = run.body("Planet"), its = run.body("Case");
  const Vector3 along = its.pose.orientation * Vector3::UnitX();
  EXPECT_NEAR(std::fabs(along.dot(planet.twist.angular)), 2.0, 1e-2);
  EXPECT_LT(run.report().max_joint_error(), 1e-3);
}

// Two wheels with weights off their axes swing as one freedom: (I1 + I2 r^2) a'' = torque, r = -N1/N2.
TEST(GearsSmooth, KeepTheOrderOfTheIntegrator) {
  constexpr double kM1 = 2.0, kM2 = 3.0, kI1 = 0.1, kI2 = 0.3, kArm1 = 0.2, kArm2 = 0.25, kRatio = -17.0 / 23.0;
  const auto acceleration = [&](double turn) {
    const double inertia = kI1 + kM1 * kArm1 * kArm1 + kRatio * kRatio * (kI2 + kM2 * kArm2 * kArm2);
    return -kG * (kM1 * kArm1 * std::cos(turn) + kRatio * kM2 * kArm2 * std::cos(kRatio * turn)) / inertia;
  };
  // a reference of a thousand times as many steps
  double turn = 0.0, rate = 3.0;
  constexpr int kFine = 20000;
  for (int i = 0; i < kFine; ++i) {
    constexpr double kH = 1.0 / kFine;
    const double k1 = acceleration(turn), k2 = acceleration(turn + 0.5 * kH * rate + 0.125 * kH * kH * k1),
                 k3 = acceleration(turn + kH * rate + 0.5 * kH * kH * k2);
    turn += kH * rate + kH * kH / 6.0 * (k1 + 2.0 * k2);
    rate += kH / 6.0 * (k1 + 4.0 * k2 + k3);
  }
  const Vector3 other(0.5, 0.3, 0);
  const std::string scene =
      geared({{"A", {kArm1, 0, 0}, 3.0, kM1, kI1, "Down", {0, 3.0 * kArm1, 0}},
              {"B", other + Vector3(kArm2, 0, 0), 3.0 * kRatio, kM2, kI2, "Down", {0, 3.0 * kRatio * kArm2, 0}}},
             bearing("", "A", kCentre) + bearing("", "B", other) +
                 mesh("A", 17, "B", 23, "BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = " + literal(other)),
             gravity("Down", {0, -kG, 0}));
  for (const char* solver : {"Newton", "Direct"}) {
    const auto error = [&](const char* integrator, double h) {
      SceneRun run(scene, {"Simulator=Smooth", set("Integrator", std::string(integrator)),
                           set("Solver", std::string(solver)), set("Simulator.TimeStep", h)});
      run.to_end();
      EXPECT_LT(std::fabs(wrapped(17.0 * turn_of(run, "A") + 23.0 * turn_of(run, "B"))), 1e-12);
      return std::fabs(wrapped(turn_of(run, "A") - turn));
    };
    const double coarse = error("RK4", 0.02), fine = error("RK4", 0.01);
    EXPECT_NEAR(std::log2(coarse / fine), 4.0, 0.4) << solver << " " << coarse << " " << fine;
    EXPECT_LT(error("DormandPrince853", 0.02), 1e-10) << solver;
    EXPECT_LT(error("Radau", 0.02), 1e-8) << solver;
    EXPECT_LT(error("Rosenbrock", 0.02), 1e-6) << solver;
  }
}

// ---- racks and screws

report::v1::Reaction reaction_of(const std::string& type, const harness::WatchedRun& watched) {
  for (const report::v1::Reaction& one : watched.reactions())
    if (one.constraint().starts_with(type)) return one;
  throw std::runtime_error("no reaction of " + type);
}

constexpr int kTeeth = 20;
constexpr double kPitch = 0.0157, kRadius = kTeeth * kPitch / (2.0 * kPi);

TEST_P(Gears, OfARackMoveAndHoldIt) {
  for (const double side : {1.0, -1.0}) {
    // the rack stands upright beside the pinion and is lifted or let down
    const Vector3 at(0.2 * side, 0, 0);
    harness::WatchedRun lift(geared({{"Pinion", kCentre}, {"Rack", at, 0.0, 3.0, 0.1, "Down"}},
                                    motor("", "Pinion", kCentre, 4.0) +
                                        link("Slider", "", "Rack", "Axis = {0, 1, 0} BindPoint = " + literal(at)) +
                                        link("Rack", "Pinion", "Rack",
                                             "Axis = {0, 0, 1} Direction = {0, 2, 0} Teeth = " +
                                                 std::to_string(kTeeth) + " Pitch = " + literal(kPitch)),
                                    gravity("Down", {0, -kG, 0})),
                             solver({"Simulator.Duration=20"}));
    SceneRun& run = lift.run;
    Turned pinion("Pinion");
    while (!run.is_done()) {
      run.step();
      pinion.look(run);
    }
    EXPECT_NEAR(spin(run, "Pinion"), 4.0, tolerance(1e-9, 1e-6));
    EXPECT_NEAR(run.body("Rack").twist.linear.y(), side * kRadius * 4.0, tolerance(1e-9, 1e-4));
    EXPECT_NEAR(run.body("Rack").pose.position.y(), side * kRadius * pinion.sum(), 1e-6);
    // the weight of 3 kg
    EXPECT_NEAR(reaction_of("Rack", lift).force(1), 3.0 * kG, tolerance(1e-6, 0.1));
    EXPECT_NEAR(reaction_of("AngularMotor", lift).torque(2), side * 3.0 * kG * kRadius, tolerance(1e-6, 0.01));
  }
}

// A jack: a motor turns the spindle, the nut is guided; 200 kg rise by 5 mm a turn for m g Lead/(2 pi).
TEST_P(Gears, OfAScrewLiftForTheTorqueOfItsLead) {
  for (const double lead : {0.005, -0.005, 0.002}) {
    harness::WatchedRun jack(
        geared({{"Spindle", kCentre}, {"Nut", {0, 0, 0.2}, 0.0, 200.0, 4.0, "Down"}},
               motor("", "Spindle", kCentre, -6.0) +
                   link("Slider", "", "Nut", "Axis = {0, 0, 1} BindPoint = {0, 0, 0.2}") +
                   link("Screw", "Spindle", "Nut", axis_through(kCentre) + " Lead = " + literal(lead)),
               gravity("Down", {0, 0, -kG})),
        solver({"Simulator.Duration=5"}));
    Turned spindle("Spindle");
    while (!jack.run.is_done()) {
      jack.run.step();
      spindle.look(jack.run);
    }
    const SceneRun::Motion nut = jack.run.body("Nut");
    EXPECT_NEAR(nut.twist.linear.z(), 6.0 * lead / (2.0 * kPi), tolerance(1e-9, 1e-5)) << lead;
    EXPECT_NEAR(nut.pose.position.z(), 0.2 - lead / (2.0 * kPi) * spindle.sum(), 1e-5) << lead;
    EXPECT_NEAR(reaction_of("AngularMotor", jack).torque(2), -200.0 * kG * lead / (2.0 * kPi), tolerance(1e-6, 0.1))
        << lead;
    EXPECT_NEAR(reaction_of("Screw", jack).force(2), 200.0 * kG, tolerance(1e-6, 10.0)) << lead;
  }
}

// Without friction a nut runs down: a = g/(1 + I (2 pi/Lead)^2/m), however fine the thread is beside what it falls by freely.
TEST_P(Gears, OfAScrewRunDownAtTheirPace) {
  for (const double lead : {0.5, 0.02, 0.002}) {
    for (const char* integrator : {"SemiImplicitEuler", "Verlet", "RK4", "Euler"}) {
      SceneRun run(geared({{"Nut", {0.01, 0, 1}, 0.0, 2.0, 0.001, "Down"}},
                          link("Screw", "", "Nut", axis_through({0.01, 0, 0}) + " Lead = " + literal(lead)),
                          gravity("Down", {0, 0, -kG})),
                   solver({set("Integrator", std::string(integrator))}));
      run.to_end();
      const double per_way = 2.0 * kPi / lead, a = kG / (1.0 + 0.001 * per_way * per_way / 2.0);
      // a step turns the nut back by a per_way h^2 at most: of the second order of it
      const double turned = a * per_way / 3600.0, tolerated = 1.2 * turned * turned;
      EXPECT_NEAR(run.body("Nut").twist.linear.z() / -a, 1.0, tolerated) << lead << " " << integrator;
      EXPECT_NEAR(spin(run, "Nut") / (-a * per_way), 1.0, tolerated) << lead << " " << integrator;
      EXPECT_NEAR((run.body("Nut").pose.position.z() - 1.0) / (-0.5 * a), 1.0, 0.02) << lead << " " << integrator;
    }
  }
}

// With joints inside the derivative it is a fall of constant acceleration, exact with every method of order 2 that turns
// bodies right at any spin.
TEST(GearsSmooth, RunANutDownExactly) {
  for (const double lead : {0.5, -0.002}) {
    for (const char* integrator : {"RKMK4", "Verlet", "DormandPrince54"}) {
      SceneRun run(geared({{"Nut", {0.01, 0, 1}, 0.0, 2.0, 0.001, "Down"}},
                          link("Screw", "", "Nut", axis_through({0.01, 0, 0}) + " Lead = " + literal(lead)),
                          gravity("Down", {0, 0, -kG})),
                   {"Simulator=Smooth", set("Integrator", std::string(integrator))});
      run.to_end();
      const double per_way = 2.0 * kPi / lead, a = kG / (1.0 + 0.001 * per_way * per_way / 2.0);
      EXPECT_NEAR(run.body("Nut").twist.linear.z(), -a, 1e-10) << lead << " " << integrator;
      EXPECT_NEAR(run.body("Nut").pose.position.z(), 1.0 - 0.5 * a, 1e-10) << lead << " " << integrator;
      EXPECT_NEAR(spin(run, "Nut"), -a * per_way, 1e-9) << lead << " " << integrator;
    }
  }
}

// A mirror turns turns around and a right hand into a left one: to the bit, where it changes signs alone.
TEST(GearsMirrored, GoTheOtherWay) {
  const auto run = [](double sign) {
    SceneRun made(geared({{"Nut", {0, 0, 1}, 0.0, 2.0, 0.001, "Down"}},
                         link("Screw", "", "Nut", axis_through(kCentre) + " Lead = " + literal(sign * 0.03)),
                         gravity("Down", {0, 0, -kG})));
    made.to_end();
    return std::pair(spin(made, "Nut"), made.body("Nut").pose.position.z());
  };
  const auto right = run(1.0), left = run(-1.0);
  EXPECT_NEAR(left.first, -right.first, 1e-11);
  EXPECT_NEAR(left.second, right.second, 1e-13);
  const auto wheels = [](double sign) {
    const Vector3 other(sign * 0.3, 0.2, 0);
    SceneRun made(geared({{"A", kCentre, 0.0, 1.0, 0.1, "Drive"}, {"B", other}},
                         bearing("", "A", kCentre) + bearing("", "B", other) + mesh("A", 9, "B", 13),
                         torque("Drive", sign * 0.4)));
    made.to_end();
    return std::pair(turn_of(made, "A"), turn_of(made, "B"));
  };
  const auto plain = wheels(1.0), mirrored = wheels(-1.0);
  EXPECT_NEAR(mirrored.first, -plain.first, 1e-12);
  EXPECT_NEAR(mirrored.second, -plain.second, 1e-12);
}

// What the head of the sample says.
TEST(GearsSample, TurnsItsCarrierAndItsLoad) {
  SceneRun run(in_source("/deploy/scenes/planetary.gravitas"));
  Turned sun("Sun"), carrier("Carrier");
  while (!run.is_done()) {
    run.step();
    sun.look(run), carrier.look(run);
  }
  // of the second order of a step's turn, 4 mrad of the carrier
  EXPECT_NEAR(spin(run, "Sun"), 5.0, 1e-9);
  EXPECT_NEAR(spin(run, "Carrier"), 1.0, 2e-5);
  EXPECT_NEAR(run.body("Load").twist.angular.x(), 2.0, 4e-5);
  EXPECT_NEAR(carrier.sum(), 0.2 * sun.sum(), 2e-5);
  EXPECT_LT(run.report().max_joint_error(), 1e-12);
}

// ---- refusals

void expect_refused(const std::string& joint, const std::string& words) {
  const std::string scene = geared({{"A", kCentre}, {"B", {0.3, 0, 0}}}, joint);
  EXPECT_THAT([&] { SceneRun(scene).step(); }, ThrowsMessage<std::exception>(HasSubstr(words))) << joint;
}

TEST(GearsRefused, NameWhatIsAmiss) {
  expect_refused(mesh("A", 0, "B", 20), "Teeth1");
  expect_refused(link("Gear", "A", "B", "Axis = {0, 0, 1} Teeth1 = 12.5 Teeth2 = 20"), "Teeth1");
  expect_refused(link("Gear", "A", "B", "Axis = {0, 0, 0} Teeth1 = 12 Teeth2 = 20"), "Gear: Axis has no direction");
  expect_refused(link("Gear", "A", "B", "Axis = {1, 0, 0} Teeth1 = 12 Teeth2 = 20"), "the axes coincide");
  expect_refused(mesh("A", 20, "B", 20, "Internal = true"), "an Internal mesh needs Teeth1 and Teeth2 that differ");
  expect_refused(mesh("A", 20, "B", 20, "Axis2 = {0, 1, 0} BindAxisPoint1 = {0, 0, 1}"),
                 "neither meet nor are parallel");
  const std::string rack = "Axis = {0, 0, 1} Teeth = 12 Pitch = 0.01 Direction = ";
  expect_refused(link("Rack", "A", "B", rack + "{0, 1, 1}"), "Rack: Direction is not across Axis");
  expect_refused(link("Rack", "A", "B", rack + "{1, 0, 0}"), "on neither side");
  expect_refused(link("Rack", "A", "B", "Axis = {0, 0, 1} Teeth = 12 Pitch = 0 Direction = {0, 1, 0}"), "Pitch");
  expect_refused(link("Screw", "A", "B", axis_through(kCentre) + " Lead = 0"), "Lead is 0");
  expect_refused(link("Screw", "A", "B", "BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 0, 0} Lead = 1"),
                 "are the same point");
}

}  // namespace
}  // namespace gravitas::gears
