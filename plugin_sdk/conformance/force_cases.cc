// Slot force: the known answers of the scene language's types, and laws that hold for any type: one row per
// application, each for itself; what an answer promises of other states; a potential whose slope is the force.
#include <algorithm>
#include <cmath>
#include <limits>

#include "plugin_sdk/conformance/hostile_numbers.h"
#include "plugin_sdk/conformance/inquiry.h"
#include "plugin_sdk/conformance/sample_values.h"
#include "plugin_sdk/conformance/slot_cases.h"
#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/force.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/wrench_jacobian.h"

namespace gravitas::conformance {
namespace {

constexpr stage::Method kWrenches = stage::Method::kForceWrenches;

struct PushedBody {
  double mass = 2.0;
  Pose geometry = {};
  Pose pose = {};
  Twist twist = {};
  std::uint32_t shape = 0;
};

// Forces, bodies, and who acts on whom.
class Forces {
 public:
  double time = 0.0;
  std::vector<PushedBody> bodies;
  std::vector<std::uint64_t> types;
  std::vector<std::vector<double>> parameters;
  std::vector<std::uint32_t> applications;  // force, body

  void add_force(std::uint64_t type, std::vector<double> values) {
    types.push_back(type);
    parameters.push_back(std::move(values));
  }
  void apply(std::size_t force, std::size_t body) {
    applications.insert(applications.end(), {static_cast<std::uint32_t>(force), static_cast<std::uint32_t>(body)});
  }
  MessageColumns request() const {
    MessageColumns columns = empty_request(kWrenches);
    columns.f64("time") = {time};
    columns.u64("force_type") = types;
    columns.u32("force_parameter_begin") = {0};
    for (const std::vector<double>& values : parameters) {
      std::vector<double>& all = columns.f64("force_parameter");
      all.insert(all.end(), values.begin(), values.end());
      columns.u32("force_parameter_begin").push_back(static_cast<std::uint32_t>(all.size()));
    }
    columns.u32("application") = applications;
    for (const PushedBody& body : bodies) {
      columns.f64("mass").push_back(body.mass);
      append(&columns.f64("geometry_position"), body.geometry.position);
      append(&columns.f64("geometry_orientation"), body.geometry.orientation);
      append(&columns.f64("position"), body.pose.position);
      append(&columns.f64("orientation"), body.pose.orientation);
      append(&columns.f64("linear_velocity"), body.twist.linear);
      append(&columns.f64("angular_velocity"), body.twist.angular);
      columns.u32("body_shape").push_back(body.shape);
    }
    // a ball and a box
    columns.u64("shape_type") = {type_id("Sphere"), type_id("Box")};
    columns.u32("shape_parameter_begin") = {0, 1, 4};
    columns.f64("shape_parameter") = {0.5, 0.3, 0.4, 0.5};
    return columns;
  }
};

struct ForceAnswer {
  Wrench wrench, impulse;
  double potential = 0.0;
  std::uint32_t flags = 0;
};

// Refused only where an application alone is.
MessageColumns answer(Inquiry* inquiry, stage::Method method, const Forces& forces) {
  return inquiry->answer_rows(method, forces.request(), forces.applications.size() / 2, [&](std::size_t i) {
    Forces alone = forces;
    alone.applications = {forces.applications[2 * i], forces.applications[2 * i + 1]};
    return alone.request();
  });
}

std::vector<ForceAnswer> ask(Inquiry* inquiry, const Forces& forces) {
  const MessageColumns reply = answer(inquiry, kWrenches, forces);
  std::vector<ForceAnswer> answers;
  for (std::size_t i = 0; i < reply.u32("flags").size(); ++i) {
    const std::vector<double>&wrench = reply.f64("wrench"), &impulse = reply.f64("impulse");
    answers.push_back({{vector_at(wrench, 2 * i), vector_at(wrench, 2 * i + 1)},
                       {vector_at(impulse, 2 * i), vector_at(impulse, 2 * i + 1)},
                       reply.f64("potential")[i],
                       reply.u32("flags")[i]});
    inquiry->expect(answers.back().flags <= (kConstantWrench | kHasPotential),
                    "flags of application " + std::to_string(i) + " are " + std::to_string(answers.back().flags) +
                        ": bits that have no meaning");
  }
  return answers;
}

PushedBody random_body(Draw* draw) {
  return {draw->uniform(0.5, 5.0), draw->pose(0.5), draw->pose(3.0), {draw->vector(2.0), draw->vector(2.0)}};
}

Answer probe(Subject& subject, const TypeDeclaration& type, Draw* draw) {
  Forces forces;
  forces.bodies = {random_body(draw)};
  forces.add_force(type_id(type.name), sample_values(type.properties, draw));
  forces.apply(0, 0);
  return subject.ask(kWrenches, forces.request());
}

std::vector<TypeDeclaration> force_types_of(Subject& subject, std::string* refusal = nullptr) {
  constexpr const char* kKnown[] = {"Gravity", "Basic"};
  return askable_types(subject.declaration(), kKnown, refusal,
                       [&](const TypeDeclaration& type, Draw* draw) { return probe(subject, type, draw); });
}

// Draws values of every property of a force, where these are taken.
void vary_force(Subject& subject, const TypeDeclaration& type, std::size_t force, Draw* draw, Forces* forces) {
  Forces alone = *forces;
  alone.applications.clear();
  for (std::size_t i = 0; i < forces->applications.size(); i += 2)
    if (forces->applications[i] == force) alone.apply(force, forces->applications[i + 1]);
  vary(type.properties, draw, &alone.parameters[force], [&] { return subject.ask(kWrenches, alone.request()); });
  forces->parameters[force] = alone.parameters[force];
}

// Calls judge(name, forces) with a force of each type on a body, by its defaults and with values of every property.
template <typename Judge>
void for_each_force(Subject& subject, Draw* draw, Judge&& judge) {
  for (const TypeDeclaration& type : force_types_of(subject)) {
    for (const bool varies : {false, true}) {
      Forces forces;
      forces.bodies = {random_body(draw)};
      forces.add_force(type_id(type.name), sample_values(type.properties, draw));
      forces.apply(0, 0);
      if (varies) vary_force(subject, type, 0, draw, &forces);
      try {
        judge(varies ? shown(type, forces.parameters[0]) : type.name, forces);
      } catch (const Refused&) {
        // drawn values may be, in any state
        if (!varies) throw;
      }
    }
  }
}

// Forces of all types on some bodies: one by its defaults, and one with values of every property if it varies.
Forces mixture(Subject& subject, std::size_t bodies, bool varies, Draw* draw) {
  const std::vector<TypeDeclaration> types = force_types_of(subject);
  Forces forces;
  forces.time = 0.4;
  for (std::uint32_t i = 0; i < bodies; ++i) {
    forces.bodies.push_back(random_body(draw));
    forces.bodies.back().shape = i % 2;
  }
  for (int copy = 0; copy < 2; ++copy)
    for (const TypeDeclaration& type : types)
      forces.add_force(type_id(type.name), sample_values(type.properties, draw));
  for (std::size_t force = 0; force < forces.types.size(); ++force) forces.apply(force, force % bodies);
  for (std::size_t body = 0; body < bodies && !types.empty(); ++body) forces.apply(body % forces.types.size(), body);
  for (std::size_t i = 0; i < types.size() && varies; ++i)
    vary_force(subject, types[i], types.size() + i, draw, &forces);
  return forces;
}

void expect_wrench(const Inquiry& inquiry, const std::string& what, const Wrench& came, const Wrench& right,
                   double tolerance) {
  inquiry.expect_near("force" + what, came.force, right.force, tolerance);
  inquiry.expect_near("torque" + what, came.torque, right.torque, tolerance);
}

// ---- laws of every type

void judge_force_nothing(Subject& subject) {
  Draw draw(31);
  Inquiry inquiry(subject, "no force and no body");
  inquiry.expect(ask(&inquiry, Forces{}).empty(), "answered rows that nobody asked for");
  Forces idle = mixture(subject, 3, true, &draw);
  idle.applications.clear();
  inquiry.now_asked("forces and bodies, nothing applied");
  inquiry.expect(ask(&inquiry, idle).empty(), "answered rows that nobody asked for");
}

void judge_force_independence(Subject& subject, bool varies) {
  Draw draw(32);
  const Forces forces = mixture(subject, 7, varies, &draw);
  const std::size_t count = forces.applications.size() / 2;
  Inquiry inquiry(subject, std::to_string(count) + " applications at once, and the same backwards");
  const MessageColumns all = answer(&inquiry, kWrenches, forces);
  Inquiry same = inquiry.demanding_answers();
  Forces backwards = forces;
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t k = 0; k < 2; ++k)
      backwards.applications[2 * i + k] = forces.applications[2 * (count - 1 - i) + k];
  const MessageColumns reversed = answer(&same, kWrenches, backwards);
  for (std::size_t i = 0; i < count; ++i) {
    Forces one = forces;
    one.applications = {forces.applications[2 * i], forces.applications[2 * i + 1]};
    same.now_asked("application " + std::to_string(i) + " of " + std::to_string(count) +
                   ", alone and among the others");
    const MessageColumns alone = answer(&same, kWrenches, one);
    for (const char* column : {"wrench", "impulse", "potential"}) {
      const std::size_t width = alone.f64(column).size();
      const std::span<const double> right = alone.f64(column);
      same.expect_equal(column, std::span(all.f64(column)).subspan(i * width, width), right);
      same.expect_equal(std::string(column) + " in another order",
                        std::span(reversed.f64(column)).subspan((count - 1 - i) * width, width), right);
    }
  }
}

// Of hundreds of bodies and applications: the same ones in other rows.
void judge_force_permutation(Subject& subject, bool varies) {
  Draw draw(38);
  const std::size_t bodies = 300;
  const Forces plain = mixture(subject, bodies, varies, &draw);
  const std::size_t count = plain.applications.size() / 2;
  const std::vector<std::uint32_t> place = draw.order(bodies), row = draw.order(count);
  Forces mixed = plain;
  for (std::size_t i = 0; i < bodies; ++i) mixed.bodies[place[i]] = plain.bodies[i];
  for (std::size_t i = 0; i < count; ++i) {
    mixed.applications[2 * row[i]] = plain.applications[2 * i];
    mixed.applications[2 * row[i] + 1] = place[plain.applications[2 * i + 1]];
  }
  for (std::size_t force = 0; force < plain.types.size(); ++force)
    for (const TypeDeclaration& type : subject.declaration().types)
      if (type_id(type.name) == plain.types[force]) rename_bodies(type.properties, place, &mixed.parameters[force]);
  Inquiry inquiry(subject, std::to_string(count) + " applications to 300 bodies, and the same in other rows");
  Inquiry same = inquiry.demanding_answers();
  const std::vector<ForceAnswer> a = ask(&inquiry, plain), b = ask(&same, mixed);
  for (std::size_t i = 0; i < count; ++i) {
    const ForceAnswer &one = a[i], &other = b[row[i]];
    const std::string of = " of application " + std::to_string(i) + " in another row";
    // a plugin may sum over all bodies
    const auto tolerance = [](const Wrench& w) { return 1e-11 * (1.0 + w.force.norm() + w.torque.norm()); };
    expect_wrench(inquiry, of, other.wrench, one.wrench, tolerance(one.wrench));
    expect_wrench(inquiry, " impulse" + of, other.impulse, one.impulse, tolerance(one.impulse));
    inquiry.expect_near("potential" + of, other.potential, one.potential, 1e-11 * (1.0 + std::fabs(one.potential)));
    inquiry.expect(other.flags == one.flags, "flags" + of + " are others");
  }
}

// A wrench that is said to be constant is taken once and for ever.
void judge_constant(Subject& subject) {
  Draw draw(33);
  for_each_force(subject, &draw, [&](const std::string& force, Forces& forces) {
    Inquiry inquiry(subject, "a force " + force + " in two states and at two times");
    const ForceAnswer first = ask(&inquiry, forces)[0];
    if ((first.flags & kConstantWrench) == 0) return;
    const Vector3 start = forces.bodies[0].pose.position;
    forces.bodies[0].pose = draw.pose(5.0);
    forces.bodies[0].twist = {draw.vector(9.0), draw.vector(9.0)};
    forces.time = 17.0;
    const ForceAnswer then = ask(&inquiry, forces)[0];
    const double tolerance = 1e-12 * (1.0 + first.wrench.force.norm() + first.wrench.torque.norm());
    expect_wrench(inquiry, ", said to be constant,", then.wrench, first.wrench, tolerance);
    if ((first.flags & kHasPotential) == 0) return;
    const double right = first.potential - first.wrench.force.dot(forces.bodies[0].pose.position - start);
    inquiry.expect_near("potential", then.potential, right, 1e-12 * (1.0 + std::fabs(right)));
  });
}

// f = -dU/dx and torque = -dU/dturn, by central differences, at rest.
void judge_potential(Subject& subject) {
  Draw draw(34);
  for_each_force(subject, &draw, [&](const std::string& force, Forces& forces) {
    forces.bodies[0].twist = {};
    Inquiry inquiry(subject, "a force " + force + " on a body at rest");
    const ForceAnswer here = ask(&inquiry, forces)[0];
    if ((here.flags & kHasPotential) == 0) return;
    constexpr double kStep = 1e-5;
    const PushedBody start = forces.bodies[0];
    const auto potential_at = [&](const Vector3& shift, const Vector3& turn) {
      forces.bodies[0].pose = displaced(start.pose, shift, turn);
      return ask(&inquiry, forces)[0].potential;
    };
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3 along = kStep * Vector3::Unit(axis);
      const double slope = (potential_at(along, Vector3::Zero()) - potential_at(-along, Vector3::Zero())) / (2 * kStep);
      const double turned =
          (potential_at(Vector3::Zero(), along) - potential_at(Vector3::Zero(), -along)) / (2 * kStep);
      // second order in the step, and rounding of U over it
      const double tolerance =
          1e-6 * (1.0 + here.wrench.force.norm() + here.wrench.torque.norm()) + 1e-10 * std::fabs(here.potential);
      const std::string name = std::string(1, static_cast<char>('x' + axis));
      inquiry.expect_near("force along " + name + " (against the slope of its potential)", here.wrench.force[axis],
                          -slope, tolerance);
      inquiry.expect_near("torque about " + name + " (against the slope of its potential)", here.wrench.torque[axis],
                          -turned, tolerance);
    }
  });
}

void judge_force_hostile(Subject& subject) {
  Draw draw(35);
  for (const TypeDeclaration& type : force_types_of(subject)) {
    Forces forces;
    forces.bodies = {random_body(&draw), random_body(&draw)};
    forces.bodies[1].shape = 1;
    forces.add_force(type_id(type.name), sample_values(type.properties, &draw));
    forces.apply(0, 0);
    forces.apply(0, 1);
    const std::string scene = "a force " + type.name + " on two bodies";
    expect_hostile_numbers_survived(subject, scene, kWrenches, forces.request());
    expect_foreign_indices_refused(subject, scene, kWrenches, forces.request());

    // the last number missing
    if (forces.parameters[0].empty()) continue;
    forces.parameters[0].pop_back();
    Inquiry inquiry(subject, scene + ", its last parameter missing");
    inquiry.answer_or_refusal(kWrenches, forces.request());
  }
  Inquiry inquiry(subject, "a force of a type that the plugin did not declare");
  Forces foreign;
  foreign.bodies = {random_body(&draw)};
  foreign.add_force(type_id("NoSuchForce"), {1.0, 2.0});
  foreign.apply(0, 0);
  inquiry.answer_or_refusal(kWrenches, foreign.request());
}

// ---- how wrenches change

constexpr stage::Method kJacobians = stage::Method::kForceJacobians;

// Six rows and twelve columns a body.
Eigen::MatrixXd jacobian_of(Inquiry* inquiry, const Forces& forces) {
  const MessageColumns reply = answer(inquiry, kJacobians, forces);
  const std::vector<std::uint32_t>& bodies = reply.u32("block_body");
  const auto count = static_cast<Eigen::Index>(forces.bodies.size());
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(6 * count, 12 * count);
  inquiry->expect(bodies.size() <= kMostBlocksOfApplication * forces.applications.size(),
                  "there are more than four blocks for each application");
  for (std::size_t i = 0; i < bodies.size() / 2; ++i) {
    inquiry->expect(bodies[2 * i] < forces.bodies.size() && bodies[2 * i + 1] < forces.bodies.size(),
                    "block " + std::to_string(i) + " names a body that does not exist");
    all.block<6, 12>(6 * bodies[2 * i], 12 * bodies[2 * i + 1]) +=
        Eigen::Map<const JacobianBlock>(&reply.f64("block")[kBlockNumbers * i]);
  }
  return all;
}

Eigen::VectorXd wrenches_of(Inquiry* inquiry, const Forces& forces) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(6 * static_cast<Eigen::Index>(forces.bodies.size()));
  const std::vector<ForceAnswer> answers = ask(inquiry, forces);
  for (std::size_t i = 0; i < answers.size(); ++i) {
    auto of_body = sum.segment<6>(6 * static_cast<Eigen::Index>(forces.applications[2 * i + 1]));
    of_body.head<3>() += answers[i].wrench.force, of_body.tail<3>() += answers[i].wrench.torque;
  }
  return sum;
}

void judge_jacobians(Subject& subject, bool varies) {
  constexpr double kMoved = 1e-5, kTolerance = 1e-4;
  Draw draw(39);
  Forces forces = mixture(subject, 3, varies, &draw);
  Inquiry inquiry(subject, "forces of all types on three bodies");
  const Eigen::MatrixXd came = jacobian_of(&inquiry, forces);
  const double scale = std::max(1.0, came.cwiseAbs().maxCoeff());
  for (std::size_t body = 0; body < forces.bodies.size(); ++body) {
    const PushedBody before = forces.bodies[body];
    for (int number = 0; number < 12; ++number) {
      move_state(number, kMoved, &forces.bodies[body].pose, &forces.bodies[body].twist);
      const Eigen::VectorXd after = wrenches_of(&inquiry, forces);
      forces.bodies[body] = before;
      move_state(number, -kMoved, &forces.bodies[body].pose, &forces.bodies[body].twist);
      const Eigen::VectorXd slope = (after - wrenches_of(&inquiry, forces)) / (2.0 * kMoved);
      forces.bodies[body] = before;
      const Eigen::Index column = 12 * static_cast<Eigen::Index>(body) + number;
      Eigen::Index row = 0;
      (slope - came.col(column)).cwiseAbs().maxCoeff(&row);
      inquiry.expect_near("change of wrench number " + std::to_string(row % 6) + " of body " + std::to_string(row / 6) +
                              " with number " + std::to_string(number) + " of the state of body " +
                              std::to_string(body),
                          came(row, column), slope[row], kTolerance * scale);
    }
  }
}

// The same blocks whatever the state.
void judge_jacobian_pattern(Subject& subject, bool varies) {
  Draw draw(40);
  Forces forces = mixture(subject, 3, varies, &draw);
  Inquiry inquiry(subject, "forces of all types on three bodies, in one state and in another");
  const std::vector<std::uint32_t> here = answer(&inquiry, kJacobians, forces).u32("block_body");
  for (PushedBody& body : forces.bodies) body = random_body(&draw);
  const std::vector<std::uint32_t> there = answer(&inquiry, kJacobians, forces).u32("block_body");
  inquiry.expect(here == there, "answered other blocks");
  forces.applications.clear();
  inquiry.now_asked("forces and bodies, nothing applied");
  inquiry.expect(inquiry.answer(kJacobians, forces.request()).u32("block_body").empty(), "answered blocks");
}

void judge_jacobian_hostile(Subject& subject) {
  Draw draw(41);
  const MessageColumns request = mixture(subject, 2, true, &draw).request();
  expect_hostile_numbers_survived(subject, "forces of all types on two bodies", kJacobians, request);
  expect_foreign_indices_refused(subject, "forces of all types on two bodies", kJacobians, request);
}

// ---- known answers of the scene language

// f = m g at the centre of mass, U = -m g.x.
void judge_gravity(Subject& subject) {
  Draw draw(36);
  const TypeDeclaration& type = *find_type(subject.declaration(), "Gravity");
  for (const Vector3& g : {Vector3(0, -9.81, 0), Vector3(1, 2, -3), Vector3(0, 0, 0)}) {
    Forces forces;
    for (int i = 0; i < 4; ++i) forces.bodies.push_back(random_body(&draw));
    forces.add_force(type_id("Gravity"), flattened(type, {given("Acceleration", g)}));
    for (std::size_t i = 0; i < 4; ++i) forces.apply(0, i);
    Inquiry inquiry(subject, "");
    inquiry.now_asked("Gravity " + shown(g) + " on four bodies");
    const std::vector<ForceAnswer> answers = ask(&inquiry, forces);
    for (std::size_t i = 0; i < 4; ++i) {
      const PushedBody& body = forces.bodies[i];
      inquiry.now_asked("Gravity " + shown(g) + " on " + number_text(body.mass) + " kg at " +
                        shown(body.pose.position));
      expect_wrench(inquiry, "", answers[i].wrench, {body.mass * g, Vector3::Zero()}, 1e-13 * (1.0 + g.norm()));
      expect_wrench(inquiry, " impulse", answers[i].impulse, {}, 0.0);
      inquiry.expect((answers[i].flags & kHasPotential) != 0, "is not said to have a potential");
      const double right = -body.mass * g.dot(body.pose.position);
      inquiry.expect_near("potential", answers[i].potential, right, 1e-12 * (1.0 + g.norm()));
    }
  }
}

struct BasicTrial {
  const char* name;
  std::vector<NamedValue> values;
  Vector3 force;  // as given, in the axes of the frame
  Vector3 point = Vector3::Zero();
  Vector3 torque = Vector3::Zero();
  bool in_body = false;
  bool instantaneous = false;
};

NamedValue force_table() {
  std::vector<PropertyValue> rows;
  for (const std::vector<double>& row : {std::vector<double>{1, 0, 0, 0}, {2, 4, 0, -8}, {4, 0, 6, 0}})
    rows.push_back(PropertyValue::numbers(row));
  return {"Table", PropertyValue::of(rows), {}};
}

std::vector<BasicTrial> basic_trials() {
  const Vector3 f(3, -2, 1), p(0.3, -0.1, 0.7), t(0.5, 0, -2);
  std::vector<BasicTrial> trials = {
      {"at the geometry's origin", {given("Force", f)}, f},
      {"at a point", {given("Force", f), given("ApplicationPoint", p)}, f, p},
      {"with a torque", {given("Force", f), given("Torque", t)}, f, Vector3::Zero(), t},
      {"in body axes",
       {given("Force", f), given("ApplicationPoint", p), given("Torque", t), given("Frame", "Body")},
       f,
       p,
       t,
       true},
      {"as an impulse", {given("Force", f), given("ApplicationPoint", p), given("Instantaneous", true)}, f, p}};
  trials.back().instantaneous = true;
  return trials;
}

// f at x_G + q_G p about the centre of mass, plus the torque; geometry frame G.
void judge_basic(Subject& subject) {
  Draw draw(37);
  const TypeDeclaration& type = *find_type(subject.declaration(), "Basic");
  for (const BasicTrial& trial : basic_trials()) {
    Forces forces;
    forces.bodies = {random_body(&draw)};
    const PushedBody& body = forces.bodies[0];
    forces.add_force(type_id("Basic"), flattened(type, trial.values));
    forces.apply(0, 0);
    Inquiry inquiry(subject, "Basic force (3, -2, 1) N " + std::string(trial.name));
    const ForceAnswer came = ask(&inquiry, forces)[0];
    const Quaternion to_world = body.pose.orientation * body.geometry.orientation;
    const Vector3 arm = body.pose.orientation * body.geometry.position + to_world * trial.point;
    const Vector3 force = trial.in_body ? Vector3(to_world * trial.force) : trial.force;
    const Vector3 torque = trial.in_body ? Vector3(to_world * trial.torque) : trial.torque;
    const Wrench right{force, arm.cross(force) + torque};
    expect_wrench(inquiry, "", came.wrench, trial.instantaneous ? Wrench{} : right, 1e-13);
    expect_wrench(inquiry, " impulse", came.impulse, trial.instantaneous ? right : Wrench{}, 1e-13);
  }
}

// Linear between the rows {1, 0 0 0}, {2, 4 0 -8}, {4, 0 6 0}, constant outside.
void judge_basic_table(Subject& subject) {
  const TypeDeclaration& type = *find_type(subject.declaration(), "Basic");
  Forces forces;
  forces.bodies = {PushedBody{}};
  forces.add_force(type_id("Basic"), flattened(type, {force_table()}));
  forces.apply(0, 0);
  const std::pair<double, Vector3> known[] = {{0.0, {0, 0, 0}},    {1.5, {2, 0, -4}}, {2.0, {4, 0, -8}},
                                              {3.5, {1, 4.5, -2}}, {4.0, {0, 6, 0}},  {9.0, {0, 6, 0}}};
  for (const auto& [time, right] : known) {
    forces.time = time;
    Inquiry inquiry(subject, "Basic force by a table at t = " + number_text(time));
    const ForceAnswer came = ask(&inquiry, forces)[0];
    inquiry.expect_near("force", came.wrench.force, right, 1e-13);
    inquiry.expect((came.flags & kConstantWrench) == 0, "is said to be constant");
  }
}

}  // namespace

std::vector<Case> force_cases(const PluginDeclaration& declaration) {
  std::vector<Case> cases = {
      make_types_case("force/types", force_types_of),
      make_case("force/nothing", "Without an application there is no row.", judge_force_nothing),
      make_varied_case("force/independence", "Each application is answered for itself, in any order, bit for bit.",
                       judge_force_independence),
      make_varied_case("force/permutation", "The order of bodies and applications changes no wrench.",
                       judge_force_permutation),
      make_case("force/constant", "A wrench said to be constant is the same in every state.", judge_constant),
      make_case("force/potential", "Force and torque are the slope of the potential.", judge_potential),
      make_case("force/hostile", "Hostile numbers are refused with a reason, or answered with finite ones.",
                judge_force_hostile)};
  if (find_type(declaration, "Gravity") != nullptr)
    cases.push_back(make_case("force/gravity", "Gravity pulls with m g at the centre of mass.", judge_gravity));
  if (find_type(declaration, "Basic") != nullptr) {
    cases.push_back(make_case("force/basic", "A given force acts at its point, in its axes.", judge_basic));
    cases.push_back(
        make_case("force/basic-table", "A force by a table is linear between its rows.", judge_basic_table));
  }
  if (!has_capability(declaration, "jacobians")) {
    cases.push_back(unknown_case("force/jacobians-unknown", kJacobians));
    return cases;
  }
  cases.push_back(make_varied_case("force/jacobians", "Jacobians are the slopes of the wrenches.", judge_jacobians));
  cases.push_back(
      make_varied_case("force/jacobian-blocks", "Which blocks there are depends on no state.", judge_jacobian_pattern));
  cases.push_back(make_case("force/jacobian-hostile",
                            "Hostile numbers are refused with a reason, or answered with finite ones.",
                            judge_jacobian_hostile));
  return cases;
}

std::vector<Question> force_questions(Subject& subject, Draw* draw) {
  std::vector<Question> questions;
  for (const std::size_t count : {std::size_t{1}, std::size_t{12}, std::size_t{300}}) {
    Forces forces = mixture(subject, count, true, draw);
    questions.push_back(
        {"forces of every type on " + std::to_string(count) + " bodies", kWrenches, forces.request(), {}});
    if (has_capability(subject.declaration(), "jacobians"))
      questions.push_back(
          {"Jacobians of such forces on " + std::to_string(count) + " bodies", kJacobians, forces.request(), {}});
  }
  return questions;
}

}  // namespace gravitas::conformance
