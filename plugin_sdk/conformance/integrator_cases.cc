// Slot integrator: closed forms of free motion, laws of any method, and convergence of the declared order
// (capability `order=N`; without it order 1 is asked). A method of set accuracy (a property named `Accuracy`) is held
// to that where a law is not exact by itself.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "plugin_sdk/conformance/free_bodies.h"
#include "plugin_sdk/conformance/hostile_numbers.h"
#include "plugin_sdk/conformance/sample_values.h"
#include "plugin_sdk/conformance/slot_cases.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/math/transcendental.h"

namespace gravitas::conformance {
namespace {

constexpr stage::Method kIntegrate = stage::Method::kIntegratorIntegrate;
// Some roundings of the numbers that meet.
constexpr double kRounding = 64.0 * std::numeric_limits<double>::epsilon();

double order_of(const PluginDeclaration& declaration) {
  return std::max(1.0, capability_number(declaration, "order", 1.0));
}

// Largest relative error of a step that the method's own control allows; 0 for a method without.
double accuracy_of(const PluginDeclaration& declaration) {
  for (const Property& p : declaration.properties)
    if (p.name == "Accuracy" && !p.default_numbers.empty()) return 100.0 * p.default_numbers[0];
  return 0.0;
}

FreeBodies random_bodies(std::size_t count, Draw* draw) {
  FreeBodies free;
  for (std::size_t i = 0; i < count; ++i) {
    FreeBody body{.mass = draw->uniform(0.5, 5.0), .damping = i % 3 == 0 ? draw->uniform(0.0, 2.0) : 0.0};
    body.moments = Vector3{draw->uniform(1, 2), draw->uniform(1, 2), draw->uniform(1, 2)};
    body.state = {draw->pose(3.0), {draw->vector(2.0), draw->vector(2.0)}};
    body.wrench = {draw->vector(3.0), draw->vector(3.0)};
    body.flags = i % 7 == 5 ? kKinematic : kMovable;
    free.bodies.push_back(body);
  }
  return free;
}

// What answers the derivative: 3 N/m between each body and the origin.
DerivativeAnswer pull_of_springs(const stage::IntegratorDerivativeRequest& question) {
  std::vector<double> wrenches(2 * question.position().size(), 0.0);
  for (std::size_t i = 0; i < question.position().size(); ++i)
    wrenches[6 * (i / 3) + i % 3] = -3.0 * question.position()[i];
  return wrenches;
}

std::string of_moving_body(const char* what, std::size_t body) {
  return std::string(what) + " of body " + std::to_string(body);
}

// ---- exact laws

void judge_integrator_nothing(Subject& subject) {
  Inquiry inquiry(subject, "no bodies");
  const MessageColumns reply = FreeBodies{}.ask(&inquiry);
  inquiry.expect(reply.f64("position").empty(), "answered positions of bodies that do not exist");
}

void judge_rest(Subject& subject) {
  Draw draw(21);
  FreeBodies free;
  for (int i = 0; i < 8; ++i) {
    FreeBody body{.damping = i % 2 == 0 ? 0.0 : 0.7};
    body.state.pose = draw.pose(100.0);
    free.bodies.push_back(body);
  }
  Inquiry inquiry(subject, "8 bodies at rest, no wrench");
  const FreeBodies start = free;
  for (int n = 0; n < 5; ++n) {
    free.step(&inquiry);
    for (std::size_t i = 0; i < 8; ++i) {
      const BodyState& came = free.bodies[i].state;
      const BodyState& right = start.bodies[i].state;
      inquiry.expect_near(of_moving_body("position", i), came.pose.position, right.pose.position, 0.0);
      inquiry.expect(came.pose.orientation.coeffs() == right.pose.orientation.coeffs(),
                     of_moving_body("orientation", i) + " is " + shown(came.pose.orientation) + ", should be " +
                         shown(right.pose.orientation) + " bit for bit");
      inquiry.expect_near(of_moving_body("linear velocity", i), came.twist.linear, Vector3::Zero(), 0.0);
      inquiry.expect_near(of_moving_body("angular velocity", i), came.twist.angular, Vector3::Zero(), 0.0);
    }
  }
}

void judge_straight_line(Subject& subject) {
  Draw draw(22);
  for (const double h : {1.0 / 60.0, 1e-3, 0.5}) {
    FreeBodies free;
    free.time_step = h;
    for (int i = 0; i < 5; ++i) {
      FreeBody body;
      body.state = {draw.pose(3.0), {draw.vector(4.0), Vector3::Zero()}};
      free.bodies.push_back(body);
    }
    Inquiry inquiry(subject, "free bodies that do not turn, h = " + number_text(h));
    const FreeBodies start = free;
    free.steps(&inquiry, 3);
    for (std::size_t i = 0; i < free.bodies.size(); ++i) {
      const BodyState& came = free.bodies[i].state;
      const BodyState& first = start.bodies[i].state;
      const double size = first.pose.position.norm() + first.twist.linear.norm();
      // a method that keeps positions has its velocity from their difference
      inquiry.expect_near(of_moving_body("linear velocity", i), came.twist.linear, first.twist.linear,
                          kRounding * (size + size / h));
      inquiry.expect_near(of_moving_body("position", i), came.pose.position,
                          first.pose.position + 3.0 * h * first.twist.linear, kRounding * size);
      inquiry.expect_near(of_moving_body("orientation", i), came.pose.orientation, first.pose.orientation, kRounding);
    }
  }
}

void judge_integrator_immovable(Subject& subject) {
  FreeBodies free;
  FreeBody ground{.damping = 2.0, .wrench = {Vector3(5, 5, 5), Vector3(1, 2, 3)}, .flags = kHasShape};
  ground.state.pose.position = Vector3(-0.0, std::numeric_limits<double>::denorm_min(), 3);
  // unit to rounding only: renormalised it would change
  ground.state.pose.orientation = Quaternion(0.5, 0.5, 0.5, 0.5 + 0x1p-50);
  free.bodies = {FreeBody{}, ground, FreeBody{}};
  free.bodies[0].wrench.force = Vector3(1, 0, 0);
  Inquiry inquiry(subject, "an immovable body between two that move, all under wrenches");
  const MessageColumns request = free.request();
  const MessageColumns reply = free.ask(&inquiry);
  for (const char* column : {"position", "orientation", "linear_velocity", "angular_velocity"}) {
    const std::size_t width = reply.f64(column).size() / 3;
    inquiry.expect(std::memcmp(&reply.f64(column)[width], &request.f64(column)[width], width * sizeof(double)) == 0,
                   std::string(column) + " of the immovable body is not the request's bit for bit");
  }
}

void judge_kinematic(Subject& subject) {
  FreeBodies free;
  free.time_step = 0.1;
  FreeBody lift{.damping = 3.0, .wrench = {Vector3(5, 5, 5), Vector3(5, 0, 5)}, .flags = kKinematic};
  lift.state = {{Vector3(1, 2, 3), exp_rotation(Vector3(0.3, -0.2, 0.1))}, {Vector3(0, 2, 1), Vector3(4, 0, 40)}};
  free.bodies = {lift, FreeBody{}};
  Inquiry inquiry(subject, "a kinematic body under a wrench, v = (0, 2, 1), w = (4, 0, 40), h = 0.1");
  const BodyState came = FreeBodies::state_in(free.ask(&inquiry), 0);
  inquiry.expect_near("linear velocity", came.twist.linear, lift.state.twist.linear, 0.0);
  inquiry.expect_near("angular velocity", came.twist.angular, lift.state.twist.angular, 0.0);
  inquiry.expect_near("position", came.pose.position, lift.state.pose.position + 0.1 * lift.state.twist.linear,
                      kRounding);
  inquiry.expect_near("orientation", came.pose.orientation,
                      rotate_by(lift.state.pose.orientation, 0.1 * lift.state.twist.angular), 1e-13);
}

// ---- forces

void judge_constant_force(Subject& subject) {
  const double order = order_of(subject.declaration());
  for (const double h : {0.1, 0.01}) {
    FreeBodies free;
    free.time_step = h;
    FreeBody body{.mass = 2.0, .wrench = {.force = Vector3(2, -4, 6)}};
    body.state.pose.position = Vector3(1, 2, 3);
    body.state.twist.linear = Vector3(0, 3, 1);
    free.bodies = {body};
    Inquiry inquiry(subject, "2 kg under (2, -4, 6) N, v = (0, 3, 1), h = " + number_text(h));
    const BodyState came = FreeBodies::state_in(free.ask(&inquiry), 0);
    const Vector3 a(1, -2, 3);
    const Vector3 parabola = body.state.pose.position + h * body.state.twist.linear + 0.5 * h * h * a;
    inquiry.expect_near("linear velocity", came.twist.linear, body.state.twist.linear + h * a, 10.0 * kRounding / h);
    // a method of first order may take the old or the new velocity
    inquiry.expect_near("position", came.pose.position, parabola,
                        10.0 * kRounding + (order < 2.0 ? 0.5 * h * h * a.norm() : 0.0));
  }
}

// A force that stays acts as an impulse of each step: what it adds to the velocity moves the pose by the share theta.
void judge_theta(Subject& subject) {
  constexpr double h = 0.1;
  FreeBodies free;
  free.time_step = h;
  free.bodies = {FreeBody{.mass = 2.0, .wrench = {.force = Vector3(2, -4, 6)}}};
  free.bodies[0].state.twist.linear = Vector3(0, 3, 1);
  Inquiry inquiry(subject, "2 kg under (2, -4, 6) N, v = (0, 3, 1), h = 0.1, after forty steps");
  // a method with history may start by another
  free.steps(&inquiry, 40);
  const BodyState before = free.bodies[0].state;
  free.step(&inquiry);
  const BodyState& after = free.bodies[0].state;
  const Vector3 change = after.twist.linear - before.twist.linear;
  const Vector3 by_change = after.pose.position - before.pose.position - h * before.twist.linear;
  const double allowed = (10.0 * kRounding + accuracy_of(subject.declaration())) / (h * change.norm());
  inquiry.expect_near("declared theta (against (x' - x - h v) / (h (v' - v)))", subject.declaration().theta,
                      by_change.dot(change) / (h * change.squaredNorm()), allowed);
}

void judge_constant_torque(Subject& subject) {
  const double order = order_of(subject.declaration());
  Draw draw(23);
  for (int axis = 0; axis < 3; ++axis) {
    const double h = 0.05;
    FreeBodies free;
    free.time_step = h;
    FreeBody body;
    body.state.pose.orientation = draw.rotation();
    const Vector3 along = body.state.pose.orientation * Vector3::Unit(axis);
    body.wrench.torque = 8.0 * along;
    const double a = 8.0 / body.moments[axis];
    free.bodies = {body};
    Inquiry inquiry(subject, "8 N m about principal axis " + std::to_string(axis) + " of moment " +
                                 number_text(body.moments[axis]) + " kg m^2 from rest, h = 0.05");
    const BodyState came = FreeBodies::state_in(free.ask(&inquiry), 0);
    const double allowed = accuracy_of(subject.declaration());
    inquiry.expect_near("angular velocity", came.twist.angular, h * a * along, 1e-12 + allowed);
    inquiry.expect_near(
        "rotation vector of the step", log_rotation(came.pose.orientation * body.state.pose.orientation.conjugate()),
        0.5 * h * h * a * along, order < 2.0 ? 0.501 * h * h * a : 1e-12 + allowed + h * h * h * h * a * a);
  }
}

// The damping coefficient c makes exp(-c h) of both velocities, whatever the method.
void judge_damping(Subject& subject) {
  for (const double c : {0.3, 5.0, 1000.0}) {
    FreeBodies free;
    free.time_step = 0.1;
    FreeBody body{.moments = Vector3::Constant(2.0), .damping = c};
    body.state.twist = {Vector3(1, 2, 3), Vector3(0.5, -1, 2)};
    free.bodies = {body};
    Inquiry inquiry(subject, "a free body with damping " + number_text(c) + " 1/s, h = 0.1");
    const BodyState came = FreeBodies::state_in(free.ask(&inquiry), 0);
    const double left = math::exp(-0.1 * c);
    inquiry.expect_near("linear velocity", came.twist.linear, left * body.state.twist.linear, 1e-12);
    inquiry.expect_near("angular velocity", came.twist.angular, left * body.state.twist.angular, 1e-12);
    // on its way, and no further than undamped
    const double share = came.pose.position.dot(body.state.twist.linear) / body.state.twist.linear.squaredNorm();
    inquiry.expect(share >= 0.0 && share <= 0.1 * (1.0 + 1e-12),
                   "moved by " + number_text(share) + " s of its first velocity; right is 0 … 0.1");
  }
}

// With wrench_is_constant = 0 the answers of the derivative count, asked in sound states and within the step.
void judge_derivative(Subject& subject) {
  FreeBodies free;
  free.time = 3.0;
  free.time_step = 0.1;
  free.bodies = {FreeBody{.wrench = {.force = Vector3(1e6, 0, 0)}}, FreeBody{.wrench = {.torque = Vector3(0, 1e6, 0)}}};
  free.bodies[1].state.pose.position = Vector3(4, 5, 6);
  std::string wrong;
  free.derivative = [&wrong](const stage::IntegratorDerivativeRequest& question) {
    if (question.position().size() != 6 || question.orientation().size() != 8)
      wrong = "asked for a derivative of " + std::to_string(question.position().size() / 3) + " bodies, there are 2";
    if (!(question.time() >= 3.0 && question.time() <= 3.1 + 1e-12))
      wrong = "asked for a derivative at " + number_text(question.time()) + " s, outside the step 3 … 3.1";
    return std::vector<double>{2, 0, 0, 0, 0, 0, 0, 4, 0, 0, 0, 0};
  };
  Inquiry inquiry(subject, "two bodies of 2 kg at rest; the derivative answers (2, 0, 0) N and (0, 4, 0) N");
  const MessageColumns reply = free.ask(&inquiry);
  inquiry.expect(wrong.empty(), wrong);
  inquiry.expect_near("linear velocity of body 0", vector_at(reply.f64("linear_velocity"), 0), Vector3(0.1, 0, 0),
                      1e-12);
  inquiry.expect_near("linear velocity of body 1", vector_at(reply.f64("linear_velocity"), 1), Vector3(0, 0.2, 0),
                      1e-12);
  inquiry.expect_near("angular velocity of body 1", vector_at(reply.f64("angular_velocity"), 1), Vector3::Zero(),
                      1e-12);
}

// Two bodies on a damped spring: told how its wrenches change, an integrator answers as it does when it finds out itself.
void judge_jacobian(Subject& subject) {
  constexpr double kStiffness = 300.0, kDamping = 4.0;
  FreeBodies free;
  free.time_step = 0.02;
  free.bodies = {FreeBody{}, FreeBody{}, FreeBody{}};
  free.bodies[1].state.pose.position = Vector3(1.5, 0.2, -0.3);
  free.bodies[1].state.twist = {Vector3(0.3, -0.5, 0.1), Vector3(1, 2, -1)};
  free.bodies[2].state.twist.angular = Vector3(-1, 0.5, 3);
  std::string wrong;
  int wanted = 0;
  free.derivative = [&](const stage::IntegratorDerivativeRequest& question) -> DerivativeAnswer {
    const Vector3 force =
        kStiffness * (vector_at(question.position(), 1) - vector_at(question.position(), 0)) +
        kDamping * (vector_at(question.linear_velocity(), 1) - vector_at(question.linear_velocity(), 0));
    std::vector<double> wrench(18, 0.0);
    set_vector(wrench, 0, force), set_vector(wrench, 2, -force);
    if (question.question() != static_cast<std::uint32_t>(DerivativeQuestion::kWithJacobian)) return wrench;
    ++wanted;
    if (free.jacobian_blocks == 0) wrong = "asked for a Jacobian that cannot be had";
    JacobianBlock block = JacobianBlock::Zero();
    block.block<3, 3>(0, 0) = -kStiffness * Matrix3::Identity(),
                         block.block<3, 3>(0, 6) = -kDamping * Matrix3::Identity();
    DerivativeAnswer answer(wrench, {0, 0, 0, 1, 1, 0, 1, 1});
    for (const double sign : {1.0, -1.0, -1.0, 1.0})
      for (Eigen::Index i = 0; i < block.size(); ++i) answer.jacobian.push_back(sign * block.data()[i]);
    return answer;
  };
  Inquiry inquiry(subject, "two bodies of 2 kg on a spring of 300 N/m, and one that turns freely");
  const MessageColumns without = free.ask(&inquiry);
  free.jacobian_blocks = 6;
  inquiry.now_asked("the same with the spring's Jacobian");
  const MessageColumns with = free.ask(&inquiry);
  inquiry.expect(wrong.empty(), wrong);
  for (std::size_t body = 0; body < 3; ++body) {
    const BodyState a = FreeBodies::state_in(without, body), b = FreeBodies::state_in(with, body);
    const std::string of = " of body " + std::to_string(body);
    inquiry.expect_near("position" + of, b.pose.position, a.pose.position, 1e-5);
    inquiry.expect_near("angle" + of, log_rotation(b.pose.orientation * a.pose.orientation.conjugate()),
                        Vector3::Zero(), 1e-5);
    inquiry.expect_near("velocity" + of, b.twist.linear, a.twist.linear, 1e-4);
    inquiry.expect_near("angular velocity" + of, b.twist.angular, a.twist.angular, 1e-4);
  }
  if (wanted == 0) return;
  // what it may have been promised is not there any more
  inquiry.now_asked("the same with a Jacobian that was promised and does not come");
  const DerivativeFunction full = free.derivative;
  free.derivative = [&](const stage::IntegratorDerivativeRequest& question) -> DerivativeAnswer {
    return full(question).wrench;
  };
  const MessageColumns late = free.ask(&inquiry);
  for (std::size_t body = 0; body < 3; ++body)
    inquiry.expect_near("position of body " + std::to_string(body), FreeBodies::state_in(late, body).pose.position,
                        FreeBodies::state_in(without, body).pose.position, 1e-5);
}

// ---- rotation

// Turning about a principal axis: w stays, the angle is w T to the method's order.
void judge_principal_axis(Subject& subject) {
  const double order = order_of(subject.declaration());
  Draw draw(24);
  for (int axis = 0; axis < 3; ++axis) {
    const double speed = 2.0, h = 1.0 / 32.0;
    FreeBodies free;
    free.time_step = h;
    FreeBody body;
    body.state.pose.orientation = draw.rotation();
    const Vector3 w = speed * (body.state.pose.orientation * Vector3::Unit(axis));
    body.state.twist.angular = w;
    free.bodies = {body};
    Inquiry inquiry(
        subject, "a free body turning at 2 rad/s about principal axis " + std::to_string(axis) + " for 1 s, h = 1/32");
    free.steps(&inquiry, 32);
    const BodyState& came = free.bodies[0].state;
    const double allowed = 1e-11 + accuracy_of(subject.declaration());
    const double by_order = 0.5 * speed * math::pow(speed * h, order);
    inquiry.expect_near("angular velocity", came.twist.angular, w, allowed + 0.1 * by_order);
    inquiry.expect_near("orientation", came.pose.orientation, rotate_by(body.state.pose.orientation, w),
                        allowed + by_order);
  }
}

// At any speed: the attitude stays a rotation.
void judge_unit(Subject& subject) {
  Draw draw(25);
  for (const double speed : {0.1, 30.0, 300.0}) {
    FreeBodies free;
    free.time_step = 0.01;
    for (int i = 0; i < 4; ++i) {
      FreeBody body{.moments = Vector3::Constant(1.0 + i)};
      body.state = {draw.pose(1.0), {Vector3::Zero(), speed * draw.direction()}};
      free.bodies.push_back(body);
    }
    Inquiry inquiry(subject, "balls that turn at " + number_text(speed) + " rad/s, h = 0.01, 50 steps");
    // each answer is checked for unit attitudes
    free.steps(&inquiry, 50);
  }
}

// ---- symmetries

void judge_integrator_permutation(Subject& subject) {
  Draw draw(26);
  // enough to show what ends at some row
  const std::size_t count = 300;
  FreeBodies plain = random_bodies(count, &draw);
  FreeBodies mixed = plain;
  const std::vector<std::uint32_t> place = draw.order(count);
  for (std::size_t i = 0; i < count; ++i) mixed.bodies[place[i]] = plain.bodies[i];
  for (const bool on_springs : {false, true}) {
    if (on_springs) plain.derivative = mixed.derivative = pull_of_springs;
    Inquiry inquiry(subject, on_springs ? "300 bodies on springs in two orders" : "300 random bodies in two orders");
    // implicit and adaptive methods take all bodies together
    const double tolerance = on_springs ? 1e-11 + accuracy_of(subject.declaration()) : 0.0;
    const MessageColumns a = plain.ask(&inquiry), b = mixed.ask(&inquiry);
    for (std::size_t i = 0; i < count; ++i) {
      const BodyState one = FreeBodies::state_in(a, i), other = FreeBodies::state_in(b, place[i]);
      inquiry.expect_near("linear velocity in another row", other.twist.linear, one.twist.linear, tolerance);
      inquiry.expect_near("angular velocity in another row", other.twist.angular, one.twist.angular, tolerance);
      inquiry.expect_near("position in another row", other.pose.position, one.pose.position, tolerance);
      inquiry.expect(on_springs || other.pose.orientation.coeffs() == one.pose.orientation.coeffs(),
                     "orientation in another row is " + shown(other.pose.orientation) + ", should be " +
                         shown(one.pose.orientation) + " bit for bit");
    }
  }
}

void judge_integrator_frames(Subject& subject) {
  Draw draw(27);
  const FreeBodies plain = random_bodies(9, &draw);
  const Pose moved = draw.pose(5.0);
  FreeBodies other = plain;
  for (FreeBody& body : other.bodies) {
    body.state.pose = compose(moved, body.state.pose);
    body.state.pose.orientation = normalized(body.state.pose.orientation);
    body.state.twist = {moved.orientation * body.state.twist.linear, moved.orientation * body.state.twist.angular};
    body.wrench = {moved.orientation * body.wrench.force, moved.orientation * body.wrench.torque};
  }
  Inquiry inquiry(subject, "9 random bodies, and the same in a world that is shifted and turned, h = 0.01");
  const MessageColumns a = plain.ask(&inquiry), b = other.ask(&inquiry);
  // positions of size 10 and, where velocities come from them, their rounding over h
  const double tolerance = 1e-11 + accuracy_of(subject.declaration());
  for (std::size_t i = 0; i < plain.bodies.size(); ++i) {
    const BodyState one = FreeBodies::state_in(a, i), turned = FreeBodies::state_in(b, i);
    inquiry.expect_near(of_moving_body("linear velocity", i), turned.twist.linear, moved.orientation * one.twist.linear,
                        tolerance);
    inquiry.expect_near(of_moving_body("angular velocity", i), turned.twist.angular,
                        moved.orientation * one.twist.angular, tolerance);
    inquiry.expect_near(of_moving_body("position", i), turned.pose.position, transform_point(moved, one.pose.position),
                        tolerance);
    inquiry.expect_near(of_moving_body("orientation", i), turned.pose.orientation,
                        moved.orientation * one.pose.orientation, tolerance);
  }
}

// ---- convergence

// An error that a step h and half of it leave, and what must be between them.
void expect_order(Subject& subject, const std::string& motion, const std::function<double(Inquiry*, int)>& error_of) {
  const double order = order_of(subject.declaration());
  const int steps = order < 2.0 ? 64 : order < 4.0 ? 32 : 16;
  Inquiry inquiry(subject, motion);
  const double coarse = error_of(&inquiry, steps), fine = error_of(&inquiry, 2 * steps);
  // half an order is left for the terms beyond the first
  const double most = std::max(coarse / math::pow(2.0, order - 0.5), 1e-11 + accuracy_of(subject.declaration()));
  inquiry.expect(fine <= most, "the error is " + number_text(coarse) + " in " + std::to_string(steps) + " steps and " +
                                   number_text(fine) + " in " + std::to_string(2 * steps) + "; a method of order " +
                                   number_text(order) + " should leave at most " + number_text(most));
  inquiry.expect_at_most("the error in " + std::to_string(steps) + " steps", coarse, 0.5);
}

void judge_oscillator(Subject& subject) {
  expect_order(subject, "1 kg on a spring of 1 N/m, let go at 1 m, after 1 s", [](Inquiry* inquiry, int steps) {
    FreeBodies free;
    free.time_step = 1.0 / steps;
    free.bodies = {FreeBody{.mass = 1.0}};
    free.bodies[0].state.pose.position = Vector3(1, 0, 0);
    free.derivative = [](const stage::IntegratorDerivativeRequest& question) {
      return std::vector<double>{-question.position()[0], 0, 0, 0, 0, 0};
    };
    free.steps(inquiry, steps);
    const BodyState& state = free.bodies[0].state;
    return Vector3(state.pose.position.x() - math::cos(1.0), state.twist.linear.x() + math::sin(1.0), 0.0).norm();
  });
}

void judge_forced(Subject& subject) {
  expect_order(subject, "1 kg under the force cos t, after 1 s", [](Inquiry* inquiry, int steps) {
    FreeBodies free;
    free.time_step = 1.0 / steps;
    free.bodies = {FreeBody{.mass = 1.0}};
    free.bodies[0].state.pose.position = Vector3(-1, 0, 0);
    free.derivative = [](const stage::IntegratorDerivativeRequest& question) {
      return std::vector<double>{math::cos(question.time()), 0, 0, 0, 0, 0};
    };
    free.steps(inquiry, steps);
    const BodyState& state = free.bodies[0].state;
    return Vector3(state.pose.position.x() + math::cos(1.0), state.twist.linear.x() - math::sin(1.0), 0.0).norm();
  });
}

// The angular momentum of a free rotor of three different moments stays: without the gyroscopic term it is off by its
// own size.
void judge_rotor(Subject& subject) {
  expect_order(subject, "a free rotor of moments 1, 2, 4 kg m^2 at 1.2 rad/s: change of its angular momentum in 1 s",
               [](Inquiry* inquiry, int steps) {
                 FreeBodies free;
                 free.time_step = 1.0 / steps;
                 FreeBody body;
                 body.state.pose.orientation = exp_rotation(Vector3(0.4, -0.3, 0.2));
                 body.state.twist.angular = Vector3(0.3, 1.1, 0.4);
                 free.bodies = {body};
                 const auto momentum = [&] {
                   const BodyState& s = free.bodies[0].state;
                   return angular_momentum(body.mass, body.moments, {Vector3::Zero(), s.pose.orientation}, s.twist);
                 };
                 const Vector3 before = momentum();
                 free.steps(inquiry, steps);
                 return (momentum() - before).norm() / before.norm();
               });
}

// ---- history

// A body that something else changed goes on as one without history would.
void judge_changed(Subject& subject) {
  FreeBodies free;
  free.time_step = 1.0 / 32.0;
  free.bodies = {FreeBody{.mass = 1.0}, FreeBody{.mass = 2.0}};
  free.bodies[0].state.pose.position = Vector3(1, 0, 0);
  free.bodies[1].state.twist.linear = Vector3(0, 0, 1);
  free.derivative = [](const stage::IntegratorDerivativeRequest& question) {
    std::vector<double> wrenches(12, 0.0);
    for (std::size_t body = 0; body < 2; ++body)
      for (std::size_t k = 0; k < 3; ++k) wrenches[6 * body + k] = -question.position()[3 * body + k];
    return wrenches;
  };
  Inquiry inquiry(subject, "two oscillators after 5 steps, body 0 kicked to v = (-3, 1, 0) and flagged as changed");
  free.steps(&inquiry, 5);
  free.bodies[0].state.twist.linear = Vector3(-3, 1, 0);
  free.bodies[0].state.pose.position += Vector3(0.5, 0, 0);
  FreeBodies without_history = free;
  without_history.plugin_state.clear();
  without_history.changed = {1, 1};
  free.changed = {1, 0};
  const BodyState came = FreeBodies::state_in(free.ask(&inquiry), 0);
  const BodyState right = FreeBodies::state_in(without_history.ask(&inquiry), 0);
  const double tolerance = 1e-10 + accuracy_of(subject.declaration());
  inquiry.expect_near("position of body 0 (against a start without history)", came.pose.position, right.pose.position,
                      tolerance);
  inquiry.expect_near("linear velocity of body 0 (against a start without history)", came.twist.linear,
                      right.twist.linear, tolerance);

  // what another plugin left behind
  free.changed = {1, 1};
  for (const std::size_t size : {std::size_t{1}, std::size_t{7}, std::size_t{1000}}) {
    free.plugin_state.assign(size, -1e9);
    inquiry.now_asked("two bodies flagged as changed, with " + std::to_string(size) +
                      " numbers of plugin_state that are not its own");
    inquiry.answer_or_refusal(kIntegrate, free.request(), free.answers());
  }
}

void judge_integrator_hostile(Subject& subject) {
  Draw draw(28);
  FreeBodies free = random_bodies(3, &draw);
  free.bodies[2].flags = kKinematic;
  const std::string scene = "three random bodies";
  expect_hostile_numbers_survived(subject, scene + " under constant wrenches", kIntegrate, free.request(),
                                  free.answers());
  free.derivative = [](const stage::IntegratorDerivativeRequest& question) {
    std::vector<double> wrenches(2 * question.position().size(), 0.0);
    for (std::size_t i = 0; i < question.position().size(); ++i)
      wrenches[6 * (i / 3) + i % 3] = -question.position()[i] - 0.1 * question.linear_velocity()[i];
    return wrenches;
  };
  expect_hostile_numbers_survived(subject, scene + " on springs", kIntegrate, free.request(), free.answers());
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e300}) {
    free.derivative = [bad](const stage::IntegratorDerivativeRequest& question) {
      return std::vector<double>(2 * question.position().size(), bad);
    };
    Inquiry inquiry(subject, scene + " whose derivative answers " + number_text(bad));
    inquiry.answer_or_refusal(kIntegrate, free.request(), free.answers());
  }
}

}  // namespace

std::vector<Case> integrator_cases(const PluginDeclaration&) {
  return {
      make_case("integrator/nothing", "Of no bodies there is no motion.", judge_integrator_nothing),
      make_case("integrator/rest", "What rests without a wrench stays, bit for bit.", judge_rest),
      make_case("integrator/straight-line", "A free body moves in a straight line, exactly.", judge_straight_line),
      make_case("integrator/immovable", "An immovable body's state is copied, bit for bit.",
                judge_integrator_immovable),
      make_case("integrator/kinematic", "A kinematic body goes on with its velocities, whatever acts on it.",
                judge_kinematic),
      make_case("integrator/constant-force", "A constant force gives the velocity exactly, the parabola to the order.",
                judge_constant_force),
      make_case("integrator/theta", "What a force adds to velocities moves poses by the declared theta.", judge_theta),
      make_case("integrator/constant-torque", "A torque about a principal axis gives the angular velocity tau h / I.",
                judge_constant_torque),
      make_case("integrator/damping", "Damping c leaves exp(-c h) of both velocities.", judge_damping),
      make_case("integrator/derivative", "Where the wrench is not constant the derivative's answers count.",
                judge_derivative),
      make_case("integrator/jacobian", "A Jacobian changes the work, not the answer.", judge_jacobian),
      make_case("integrator/principal-axis", "About a principal axis w stays and the angle is w t.",
                judge_principal_axis),
      make_case("integrator/unit", "Attitudes stay unit at any speed.", judge_unit),
      make_case("integrator/permutation", "The order of the bodies changes no bit of a body's motion.",
                judge_integrator_permutation),
      make_case("integrator/frames", "The motion is the same in a shifted and turned world.", judge_integrator_frames),
      make_case("integrator/oscillator", "The error of an oscillator shrinks with the declared order.",
                judge_oscillator),
      make_case("integrator/forced", "So does that of a motion under a force of time.", judge_forced),
      make_case("integrator/rotor", "And a free rotor keeps its angular momentum to that order.", judge_rotor),
      make_case("integrator/changed", "A body changed from outside goes on without its history.", judge_changed),
      make_case("integrator/hostile", "Hostile numbers are refused with a reason, or answered with finite ones.",
                judge_integrator_hostile),
  };
}

std::vector<Question> integrator_questions(Draw* draw) {
  std::vector<Question> questions;
  for (const std::size_t count : {std::size_t{1}, std::size_t{12}, std::size_t{300}}) {
    FreeBodies free = random_bodies(count, draw);
    const std::string bodies = std::to_string(count) + " bodies";
    questions.push_back({bodies + " under constant wrenches", kIntegrate, free.request(), free.answers()});
    free.derivative = pull_of_springs;
    questions.push_back({bodies + " on springs", kIntegrate, free.request(), free.answers()});
  }
  return questions;
}

}  // namespace gravitas::conformance
