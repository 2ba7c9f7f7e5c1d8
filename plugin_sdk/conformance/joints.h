// Joints between bodies for questions to a constraint: bound at the present poses, described in any state.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/conformance/inquiry.h"
#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/dynamics.h"

namespace gravitas::conformance {

struct JointedBody {
  Pose pose = {};
  Twist twist = {};
};

struct Joint {
  std::uint64_t type = 0;
  std::uint32_t body1 = 0, body2 = 1;  // kNone: the world
  std::vector<double> properties;
  std::uint32_t intact = 1;
};

// A discrepancy and the joint it belongs to.
struct DescribedJoint {
  std::uint32_t joint;
  Discrepancy discrepancy;
};

class Joints {
 public:
  std::vector<JointedBody> bodies;
  std::vector<Joint> joints;

  MessageColumns bind_request() const;
  // Binds at the present poses.
  void bind(Inquiry* inquiry);
  // What the subject says of joints that are bound and described at once.
  Answer probe(Subject& subject) const;
  MessageColumns describe_request() const;
  // The discrepancies in the present state, checked for what every discrepancy must be.
  std::vector<DescribedJoint> describe(Inquiry* inquiry) const;

  // What is answered to bind_request(), or else to describe_request(), which may be refused only where a joint of these alone is.
  MessageColumns answer(Inquiry* inquiry, stage::Method method) const;

  JointedBody end(const Joint& joint, int which) const;
  // J v along an axis in the present state.
  double row_velocity(const DescribedJoint& described, const Vector3& axis) const;

 private:
  void add_poses(MessageColumns* request) const;
  // Between the same bodies, bound as it is among the others.
  Joints alone(std::size_t joint) const;

  std::vector<std::uint32_t> bound_begin_ = {0};
  std::vector<double> bound_;
};

// Two bodies somewhere, with a joint of a type between them.
Joints joined(const TypeDeclaration& type, Draw* draw);
// Types whose joints can be bound as sample_values() has them.
std::vector<TypeDeclaration> joint_types_of(Subject& subject, std::string* refusal = nullptr);

// Draws values of every property of a joint, where it can be bound and described with these.
void vary_joint(Subject& subject, const TypeDeclaration& type, std::size_t joint, Draw* draw, Joints* world);

// Joints that are bound, and their bodies moved by up to `way` (m, rad): those of make(true), or where `method` refuses these,
// of make(false). Nothing where they cannot be bound.
std::optional<Joints> bound_and_moved(Subject& subject, stage::Method method, double way, Draw* draw,
                                      const std::function<Joints(bool varies)>& make);

// Error x2 - x1 of a discrepancy as joint_error() measures it.
double error_of(const Discrepancy& discrepancy);

}  // namespace gravitas::conformance
