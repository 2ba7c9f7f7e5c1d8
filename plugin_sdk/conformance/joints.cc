#include "plugin_sdk/conformance/joints.h"

#include <algorithm>

#include "plugin_sdk/conformance/sample_values.h"

namespace gravitas::conformance {
namespace {

void check_bound(const Inquiry& inquiry, const std::vector<std::uint32_t>& begin, std::size_t numbers) {
  inquiry.expect(begin.front() == 0 && begin.back() == numbers && std::ranges::is_sorted(begin),
                 "bound_begin does not cut up the " + std::to_string(numbers) + " bound numbers");
}

}  // namespace

void Joints::add_poses(MessageColumns* request) const {
  for (const JointedBody& body : bodies) {
    append(&request->f64("position"), body.pose.position);
    append(&request->f64("orientation"), body.pose.orientation);
  }
}

MessageColumns Joints::bind_request() const {
  MessageColumns request = empty_request(stage::Method::kConstraintBind);
  request.u32("parameter_begin") = {0};
  for (const Joint& joint : joints) {
    request.u64("constraint_type").push_back(joint.type);
    request.u32("constraint_body").push_back(joint.body1);
    request.u32("constraint_body").push_back(joint.body2);
    request.u32("constraint_kept").push_back(0);
    std::vector<double>& all = request.f64("parameter");
    all.insert(all.end(), joint.properties.begin(), joint.properties.end());
    request.u32("parameter_begin").push_back(static_cast<std::uint32_t>(all.size()));
  }
  add_poses(&request);
  return request;
}

void Joints::bind(Inquiry* inquiry) {
  const MessageColumns reply = answer(inquiry, stage::Method::kConstraintBind);
  bound_begin_ = reply.u32("bound_begin");
  bound_ = reply.f64("bound");
  check_bound(*inquiry, bound_begin_, bound_.size());
}

Answer Joints::probe(Subject& subject) const {
  Answer answer = subject.ask(stage::Method::kConstraintBind, bind_request());
  if (!answer.ok()) return answer;
  Joints bound = *this;
  bound.bound_begin_ = answer.columns.u32("bound_begin");
  bound.bound_ = answer.columns.f64("bound");
  return subject.ask(stage::Method::kConstraintDiscrepancies, bound.describe_request());
}

MessageColumns Joints::describe_request() const {
  MessageColumns request = empty_request(stage::Method::kConstraintDiscrepancies);
  request.f64("time_step") = {0.01};
  request.f64("start_time") = {-0.01};
  for (const Joint& joint : joints) {
    request.u64("constraint_type").push_back(joint.type);
    request.u32("constraint_body").push_back(joint.body1);
    request.u32("constraint_body").push_back(joint.body2);
    request.u32("intact").push_back(joint.intact);
  }
  request.u32("bound_begin") = bound_begin_;
  request.f64("bound") = bound_;
  add_poses(&request);
  for (const JointedBody& body : bodies) {
    append(&request.f64("linear_velocity"), body.twist.linear);
    append(&request.f64("angular_velocity"), body.twist.angular);
    append(&request.f64("start_angular_velocity"), body.twist.angular);
    request.f64("inverse_mass").push_back(1.0);
    append(&request.f64("inverse_inertia"), Vector3(Vector3::Ones()));
  }
  return request;
}

std::vector<DescribedJoint> Joints::describe(Inquiry* inquiry) const {
  const MessageColumns reply = answer(inquiry, stage::Method::kConstraintDiscrepancies);
  const DiscrepancyColumns columns = discrepancy_columns(reply);
  inquiry->expect_unit("axes", columns.axes, 4);
  std::vector<DescribedJoint> described;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const std::uint32_t joint = reply.u32("constraint")[i];
    const std::string row = " of row " + std::to_string(i) + " ";
    inquiry->expect(joint < joints.size() && joints[joint].intact != 0,
                    "constraint" + row + "is " + std::to_string(joint) + ", no joint that holds");
    inquiry->expect(described.empty() || described.back().joint <= joint, "constraint" + row + "is out of order");
    inquiry->expect(is_valid_mode(columns.mode[i]), "mode" + row + "is " + std::to_string(columns.mode[i]));
    const Discrepancy d = columns.at(i);
    inquiry->expect(d.correction >= 0.0 && d.correction <= 1.0,
                    "correction" + row + "is " + number_text(d.correction) + ", outside 0 … 1");
    inquiry->expect(d.restitution >= 0.0 && d.restitution <= 1.0,
                    "restitution" + row + "is " + number_text(d.restitution) + ", outside 0 … 1");
    inquiry->expect((d.lower.array() <= d.upper.array()).all(),
                    "lower" + row + "is " + shown(d.lower) + ", above upper " + shown(d.upper));
    inquiry->expect(d.compliance.minCoeff() >= 0.0 && d.damping.minCoeff() >= 0.0 && d.maximum_force.minCoeff() >= 0.0,
                    "compliance, damping or maximum_force" + row + "is negative");
    described.push_back({joint, d});
  }
  return described;
}

Joints Joints::alone(std::size_t joint) const {
  Joints one = *this;
  one.joints = {joints[joint]};
  if (bound_begin_.size() != joints.size() + 1) return one;
  one.bound_.assign(bound_.begin() + bound_begin_[joint], bound_.begin() + bound_begin_[joint + 1]);
  one.bound_begin_ = {0, static_cast<std::uint32_t>(one.bound_.size())};
  return one;
}

MessageColumns Joints::answer(Inquiry* inquiry, stage::Method method) const {
  const auto request = [&](const Joints& of) {
    return method == stage::Method::kConstraintBind ? of.bind_request() : of.describe_request();
  };
  return inquiry->answer_rows(method, request(*this), joints.size(), [&](std::size_t i) { return request(alone(i)); });
}

JointedBody Joints::end(const Joint& joint, int which) const {
  const std::uint32_t body = which == 1 ? joint.body1 : joint.body2;
  return body == kNone ? JointedBody{} : bodies[body];
}

double Joints::row_velocity(const DescribedJoint& described, const Vector3& axis) const {
  const JointedBody one = end(joints[described.joint], 1), other = end(joints[described.joint], 2);
  return jacobian_row(described.discrepancy, axis, one.pose.position, other.pose.position)
      .velocity(one.twist.linear, one.twist.angular, other.twist.linear, other.twist.angular);
}

Joints joined(const TypeDeclaration& type, Draw* draw) {
  Joints world;
  for (int i = 0; i < 2; ++i) world.bodies.push_back({draw->pose(3.0), {draw->vector(2.0), draw->vector(2.0)}});
  world.joints = {{.type = type_id(type.name), .properties = sample_values(type.properties, draw)}};
  return world;
}

std::vector<TypeDeclaration> joint_types_of(Subject& subject, std::string* refusal) {
  constexpr const char* kKnown[] = {"Spherical", "AngularMotor"};
  return askable_types(subject.declaration(), kKnown, refusal, [&](const TypeDeclaration& type, Draw* draw) {
    return subject.ask(stage::Method::kConstraintBind, joined(type, draw).bind_request());
  });
}

void vary_joint(Subject& subject, const TypeDeclaration& type, std::size_t joint, Draw* draw, Joints* world) {
  Joints alone;
  alone.bodies = world->bodies;
  alone.joints = {world->joints[joint]};
  vary(type.properties, draw, &alone.joints[0].properties, [&] { return alone.probe(subject); });
  world->joints[joint] = alone.joints[0];
}

std::optional<Joints> bound_and_moved(Subject& subject, stage::Method method, double way, Draw* draw,
                                      const std::function<Joints(bool varies)>& make) {
  for (const bool varies : {true, false}) {
    Joints joints = make(varies);
    try {
      Inquiry inquiry(subject, "several joints");
      joints.bind(&inquiry);
    } catch (const Finding&) {
      return std::nullopt;  // C5 says what is wrong with its bind
    }
    for (JointedBody& body : joints.bodies) body.pose = displaced(body.pose, draw->vector(way), draw->vector(way));
    if (!varies || !is_refusal(subject.ask(method, joints.describe_request()))) return joints;
  }
  return std::nullopt;
}

double error_of(const Discrepancy& discrepancy) {
  return joint_error(discrepancy, discrepancy.point2 - discrepancy.point1);
}

}  // namespace gravitas::conformance
