// What the shipped joints tell of their ways and angles, for motions whose coordinates are known: body 2 moved against body 1
// as the joint lets it, and both carried off together.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/math/rotation.h"
#include "tests/workers/plugin_fixture.h"

namespace gravitas::test {
namespace {

constexpr double kToldRounding = 1e-13;

// A motion of body 2 against body 1, in the world of the start.
struct RelativeMotion {
  Vector3 point = Vector3::Zero();  // that it turns about
  Quaternion turn = Quaternion::Identity();
  Vector3 way = Vector3::Zero();       // of the point
  Vector3 spin = Vector3::Zero();      // rad/s
  Vector3 velocity = Vector3::Zero();  // of the point, m/s
};

struct ToldValue {
  double value, rate;
};

std::vector<double> flattened_values(const TypeDeclaration& type,
                                     const std::map<std::string, std::vector<double>>& given) {
  std::vector<double> numbers;
  for (const Property& p : type.properties) {
    const auto found = given.find(p.name);
    std::vector<double> value(p.flat_size(), std::numeric_limits<double>::quiet_NaN());
    if (!p.default_numbers.empty()) value = p.default_numbers;
    if (found != given.end()) value = found->second;
    if (p.kind == PropertyKind::kTable)
      value.insert(value.begin(), found == given.end() ? 0.0 : static_cast<double>(value.size()) / p.columns);
    if (p.kind == PropertyKind::kTable && found == given.end()) value.resize(1);
    numbers.insert(numbers.end(), value.begin(), value.end());
  }
  return numbers;
}

// A joint of a shipped plugin between two bodies.
class JointUnderTest {
 public:
  JointUnderTest(const std::string& library, const std::map<std::string, std::vector<double>>& given)
      : plugin_(library) {
    const TypeDeclaration& type = plugin_.declaration().types[0];
    id_ = type_id(type.name);
    MessageColumns request = PluginUnderTest::request_of(stage::Method::kConstraintBind);
    request.u64("constraint_type") = {id_};
    request.u32("constraint_body") = {0, 1};
    request.u32("constraint_kept") = {0};
    request.f64("parameter") = flattened_values(type, given);
    request.u32("parameter_begin") = {0, static_cast<std::uint32_t>(request.f64("parameter").size())};
    put(start1_, start2_, &request);
    bound_ = plugin_.ask(stage::Method::kConstraintBind, request);
  }

  // By their names.
  std::map<std::string, ToldValue> after(const RelativeMotion& motion) {
    const Pose moved2{motion.point + motion.way + motion.turn * (start2_.position - motion.point),
                      motion.turn * start2_.orientation};
    const Vector3 velocity = motion.velocity + motion.spin.cross(moved2.position - motion.point - motion.way);
    const Pose carried1 = compose(carry_, start1_), carried2 = compose(carry_, moved2);
    MessageColumns request = PluginUnderTest::request_of(stage::Method::kConstraintCoordinates);
    request.f64("time_step") = {1e-3};
    request.u64("constraint_type") = {id_};
    request.u32("constraint_body") = {0, 1};
    request.u32("intact") = {1};
    request.u32("bound_begin") = bound_.u32("bound_begin");
    request.f64("bound") = bound_.f64("bound");
    put(carried1, carried2, &request);
    const Vector3 v1(0.4, -1.2, 0.7), w1(1.1, -0.6, 0.9);
    const Vector3 v2 = v1 + w1.cross(carried2.position - carried1.position) + carry_.orientation * velocity;
    const Vector3 w2 = w1 + carry_.orientation * motion.spin;
    request.f64("linear_velocity") = {v1.x(), v1.y(), v1.z(), v2.x(), v2.y(), v2.z()};
    request.f64("angular_velocity") = {w1.x(), w1.y(), w1.z(), w2.x(), w2.y(), w2.z()};
    request.f64("start_angular_velocity") = request.f64("angular_velocity");
    request.f64("inverse_mass").assign(2, 1.0);
    request.f64("inverse_inertia").assign(6, 1.0);
    const MessageColumns reply = plugin_.ask(stage::Method::kConstraintCoordinates, request);
    std::map<std::string, ToldValue> told;
    for (std::size_t i = 0; i < reply.u32("coordinate").size(); ++i)
      told[plugin_.declaration().types[0].coordinates.at(reply.u32("coordinate")[i]).name] = {reply.f64("value")[i],
                                                                                              reply.f64("rate")[i]};
    return told;
  }

 private:
  static void put(const Pose& one, const Pose& two, MessageColumns* request) {
    for (const Pose& pose : {one, two}) {
      const Quaternion& q = pose.orientation;
      for (const double x : pose.position) request->f64("position").push_back(x);
      for (const double x : {q.w(), q.x(), q.y(), q.z()}) request->f64("orientation").push_back(x);
    }
  }

  PluginUnderTest plugin_;
  std::uint64_t id_ = 0;
  conformance::Draw draw_{7};
  const Pose start1_ = draw_.pose(2.0), start2_ = draw_.pose(2.0), carry_ = draw_.pose(2.0);
  MessageColumns bound_{stage::method_info(stage::Method::kConstraintBind).reply};
};

std::vector<double> numbers_of(const Vector3& v) { return {v.x(), v.y(), v.z()}; }

void expect_told(const std::map<std::string, ToldValue>& told, const std::map<std::string, ToldValue>& expected) {
  EXPECT_EQ(told.size(), expected.size());
  for (const auto& [name, right] : expected) {
    SCOPED_TRACE(name);
    const auto found = told.find(name);
    ASSERT_NE(found, told.end());
    EXPECT_NEAR(found->second.value, right.value, 10 * kToldRounding);
    EXPECT_NEAR(found->second.rate, right.rate, 10 * kToldRounding);
  }
}

const Vector3 kJointPoint(0.3, -0.2, 0.5);
const Vector3 kJointAxis = Vector3(1.0, 2.0, -2.0) / 3.0;

std::map<std::string, std::vector<double>> hinge_points() {
  return {{"BindAxisPoint1", numbers_of(kJointPoint)}, {"BindAxisPoint2", numbers_of(kJointPoint + 0.7 * kJointAxis)}};
}

TEST(Coordinates, AHingeTellsItsAngleWithinHalfATurn) {
  JointUnderTest revolute("constraint_revolute", hinge_points());
  auto motor_properties = hinge_points();
  motor_properties["AngularSpeed"] = {3.0};
  JointUnderTest motor("constraint_angular_motor", motor_properties);
  for (const double angle : {0.0, 0.3, -2.5, 3.1, 3.5, -6.0}) {
    const RelativeMotion motion{
        .point = kJointPoint, .turn = exp_rotation(angle * kJointAxis), .spin = 0.7 * kJointAxis};
    const double within = angle - kWholeTurn * std::round(angle / kWholeTurn);
    expect_told(revolute.after(motion), {{"angle", {within, 0.7}}});
    expect_told(motor.after(motion), {{"angle", {within, 0.7}}});
  }
}

// Beyond half a turn, too: 3.5 rad is within 0 ... 4, -2.78 is not.
TEST(Coordinates, AHingeWithLimitsTellsWhatTheyAreComparedWith) {
  auto properties = hinge_points();
  properties["LowerLimit"] = {0.0}, properties["UpperLimit"] = {4.0};
  JointUnderTest revolute("constraint_revolute", properties);
  for (const double angle : {0.2, 3.5, 3.9})
    expect_told(
        revolute.after({.point = kJointPoint, .turn = exp_rotation(angle * kJointAxis), .spin = -0.2 * kJointAxis}),
        {{"angle", {angle, -0.2}}});
}

TEST(Coordinates, AGuideTellsItsWayAndAScrewItsTurnToo) {
  JointUnderTest slider("constraint_slider",
                        {{"BindPoint", numbers_of(kJointPoint)}, {"Axis", numbers_of(2.0 * kJointAxis)}});
  expect_told(slider.after({.point = kJointPoint, .way = 0.8 * kJointAxis, .velocity = -1.3 * kJointAxis}),
              {{"displacement", {0.8, -1.3}}});
  auto properties = hinge_points();
  properties["Lead"] = {0.02};
  JointUnderTest screw("constraint_screw", properties);
  expect_told(screw.after({.point = kJointPoint,
                           .turn = exp_rotation(-2.0 * kJointAxis),
                           .way = 0.3 * kJointAxis,
                           .spin = 5.0 * kJointAxis,
                           .velocity = 0.1 * kJointAxis}),
              {{"displacement", {0.3, 0.1}}, {"angle", {-2.0, 5.0}}});
}

TEST(Coordinates, ARodTellsItsLength) {
  const Vector3 point2 = kJointPoint + Vector3(1.0, 2.0, 2.0);
  JointUnderTest rod("constraint_distance",
                     {{"BindPoint1", numbers_of(kJointPoint)}, {"BindPoint2", numbers_of(point2)}});
  // x2 - x1 is (3, 0, 4)
  const Vector3 velocity(0.5, 7.0, -1.0);
  expect_told(rod.after({.point = point2,
                         .turn = exp_rotation({0.3, 0.1, -0.4}),
                         .way = {2.0, -2.0, 2.0},
                         .spin = {4.0, 5.0, 6.0},
                         .velocity = velocity}),
              {{"length", {5.0, 0.6 * 0.5 - 0.8}}});
}

TEST(Coordinates, ACrossTellsTheTurnsAboutItsBars) {
  const auto [second, third] = orthonormal_basis(kJointAxis);
  for (const Vector3& bar2 : {second, Vector3(0.6 * kJointAxis + 0.8 * second)}) {
    JointUnderTest cross(
        "constraint_universal",
        {{"BindPoint", numbers_of(kJointPoint)}, {"Axis1", numbers_of(kJointAxis)}, {"Axis2", numbers_of(bar2)}});
    for (const double angle1 : {0.4, -2.8}) {
      const Quaternion turn1 = exp_rotation(angle1 * kJointAxis);
      expect_told(cross.after({.point = kJointPoint,
                               .turn = turn1 * exp_rotation(1.7 * bar2),
                               .spin = 0.3 * kJointAxis - 2.0 * (turn1 * bar2)}),
                  {{"angle1", {angle1, 0.3}}, {"angle2", {1.7, -2.0}}});
    }
  }
}

// Azimuths about z count from x, about x from -z.
struct Azimuth {
  Vector3 axis, zero;
};
const Azimuth kAzimuths[] = {{Vector3::UnitZ(), Vector3::UnitX()}, {Vector3::UnitX(), -Vector3::UnitZ()}};

TEST(Coordinates, ShaftsTellTheirBend) {
  for (const auto& [axis, zero] : kAzimuths) {
    JointUnderTest shafts(
        "constraint_constant_velocity",
        {{"BindPoint", numbers_of(kJointPoint)}, {"Axis1", numbers_of(axis)}, {"Axis2", numbers_of(axis)}});
    for (const double azimuth : {0.5, -2.9}) {
      const Vector3 towards = exp_rotation(azimuth * axis) * zero, normal = axis.cross(towards);
      expect_told(
          shafts.after({.point = kJointPoint, .turn = exp_rotation(0.6 * normal), .spin = 0.8 * normal + 1.5 * axis}),
          {{"bend", {0.6, 0.8}}, {"azimuth", {azimuth, 1.5}}});
    }
    // straight, and about to bend
    expect_told(shafts.after({.point = kJointPoint, .spin = 0.8 * zero + 1.5 * axis}), {{"bend", {0.0, 0.8}}});
  }
}

TEST(Coordinates, ABallJointWithAnAxisTellsSwingAndTwist) {
  for (const auto& [axis, zero] : kAzimuths) {
    const std::map<std::string, std::vector<double>> given[] = {
        {{"BindPoint", numbers_of(kJointPoint)}, {"Axis", numbers_of(3.0 * axis)}},
        {{"BindPoint", numbers_of(kJointPoint)}, {"Axis", numbers_of(axis)}, {"ReachConeAngle", {1.0}}},
        {{"BindPoint", numbers_of(kJointPoint)},
         {"Axis", numbers_of(axis)},
         {"TwistLower", {-3.0}},
         {"TwistUpper", {3.0}}},
        {{"BindPoint", numbers_of(kJointPoint)}, {"Axis", numbers_of(axis)}, {"Stiffness", {2.0}}}};
    for (const auto& properties : given) {
      JointUnderTest ball("constraint_spherical", properties);
      const double azimuth = -2.0, swing = 1.2, twist = 2.6;
      const Vector3 normal = axis.cross(exp_rotation(azimuth * axis) * zero);
      const Quaternion swung = exp_rotation(swing * normal);
      expect_told(ball.after({.point = kJointPoint,
                              .turn = swung * exp_rotation(twist * axis),
                              .spin = 0.4 * normal - 0.9 * (swung * axis)}),
                  {{"swing", {swing, 0.4}}, {"azimuth", {azimuth, 0.0}}, {"twist", {twist, -0.9}}});
    }
  }
}

TEST(Coordinates, ABallJointWithoutAnAxisTellsNothing) {
  JointUnderTest ball("constraint_spherical", {{"BindPoint", numbers_of(kJointPoint)}});
  EXPECT_TRUE(ball.after({.point = kJointPoint, .turn = exp_rotation({0.3, 0.1, -0.4})}).empty());
  JointUnderTest sprung("constraint_spherical", {{"BindPoint", numbers_of(kJointPoint)}, {"Stiffness", {2.0}}});
  EXPECT_TRUE(sprung.after({.point = kJointPoint, .turn = exp_rotation({0.3, 0.1, -0.4})}).empty());
}

TEST(Coordinates, ABushingTellsAllSixInItsAxes) {
  const Quaternion axes = exp_rotation({0.4, -0.3, 1.0});
  JointUnderTest bushing("constraint_bushing", {{"BindPoint", numbers_of(kJointPoint)},
                                                {"Axes", {axes.w(), axes.x(), axes.y(), axes.z()}},
                                                {"Stiffness", {1.0, 1.0, 1.0}}});
  const Vector3 turn(0.8, -0.5, 1.1);
  expect_told(bushing.after({.point = kJointPoint,
                             .turn = exp_rotation(axes * turn),
                             .way = axes * Vector3(0.1, 0.2, -0.3),
                             .spin = 0.5 * (axes * turn),
                             .velocity = axes * Vector3(-1.0, 2.0, 3.0)}),
              {{"displacement_x", {0.1, -1.0}},
               {"displacement_y", {0.2, 2.0}},
               {"displacement_z", {-0.3, 3.0}},
               {"rotation_x", {0.8, 0.4}},
               {"rotation_y", {-0.5, -0.25}},
               {"rotation_z", {1.1, 0.55}}});
}

// With the rolling axis across the steering axis, and with it inclined by 10 degrees (camber).
TEST(Coordinates, AWheelTellsSteeringSuspensionAndRolling) {
  const auto [second, third] = orthonormal_basis(kJointAxis);
  const double inclined = std::cos(0.17);
  for (const Vector3& rolling : {second, Vector3(std::sin(0.17) * kJointAxis + inclined * second)}) {
    for (const bool is_limited : {false, true}) {
      std::map<std::string, std::vector<double>> given = {{"BindPoint", numbers_of(kJointPoint)},
                                                          {"SteeringAxis", numbers_of(kJointAxis)},
                                                          {"RollingAxis", numbers_of(rolling)},
                                                          {"SuspensionStiffness", {1e4}}};
      if (is_limited) given["SteeringLowerLimit"] = {-0.6}, given["SteeringUpperLimit"] = {0.6};
      if (is_limited) given.erase("SuspensionStiffness"), given["SuspensionUpperLimit"] = {0.1};
      JointUnderTest wheel("constraint_axle", given);
      const double angle = 0.4, turned = 0.3;
      const Quaternion steered = exp_rotation(angle * kJointAxis);
      expect_told(wheel.after({.point = kJointPoint,
                               .turn = steered * exp_rotation(-2.2 * rolling),
                               .way = 0.05 * kJointAxis,
                               .spin = turned * kJointAxis + 40.0 * (steered * rolling),
                               .velocity = -0.6 * kJointAxis}),
                  {{"steering", {angle, turned}}, {"suspension", {0.05, -0.6}}, {"rolling", {-2.2, 40.0}}});
    }
  }
}

// A castor turns whole turns; a wheel without suspension has no travel.
TEST(Coordinates, AWheelThatIsFreeToSteerTellsAnyAngle) {
  const auto [second, third] = orthonormal_basis(kJointAxis);
  JointUnderTest castor("constraint_axle", {{"BindPoint", numbers_of(kJointPoint)},
                                            {"SteeringAxis", numbers_of(kJointAxis)},
                                            {"RollingAxis", numbers_of(second)}});
  expect_told(castor.after({.point = kJointPoint, .turn = exp_rotation(3.0 * kJointAxis), .spin = 2.0 * kJointAxis}),
              {{"steering", {3.0, 2.0}}, {"rolling", {0.0, 0.0}}});
}

}  // namespace
}  // namespace gravitas::test
