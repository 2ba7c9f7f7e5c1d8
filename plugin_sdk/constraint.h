// For authors of joints: the loops over the joints of Constraint.Bind and Constraint.Discrepancies.
//
// What is refused in them says which joint it is about (plugin_sdk/refused_row.h), so that a text need not.
//
// Bind turns what the scene says in world coordinates at the start into numbers that are fixed in the bodies.
// Discrepancies turns those numbers and a state into discrepancies (plugin_sdk/discrepancy.h).
#pragma once

#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/plugin.h"
#include "plugin_sdk/refused_row.h"

namespace gravitas {

// A joint in a state. The world is a body at the origin, at rest.
struct JointBodies {
  Pose pose1, pose2;  // of the centres of mass
  bool has_body2 = true;
  // It held before an edit of the scene, and is bound anew in the poses in which it was first. What it holds may be elsewhere.
  bool is_kept = false;
  // rad/s and m/s of the centres of mass, world, and the step that came or leads to this state (in stages of Smooth the whole of
  // it), s; zero when joints are bound
  Vector3 spin1 = Vector3::Zero(), spin2 = Vector3::Zero();
  Vector3 velocity1 = Vector3::Zero(), velocity2 = Vector3::Zero();
  double time_step = 0.0;
  // s, since the step began; in stages of Smooth a part of it
  double elapsed = 0.0;
  // rad/s, where the step begins
  Vector3 start_spin1 = Vector3::Zero(), start_spin2 = Vector3::Zero();
  // Of the state, s; zero when joints are bound
  double time = 0.0;
  // 1/kg, and 1/(kg m^2) about the principal axes; zero of what nothing pushes, and when joints are bound
  double inverse_mass1 = 0.0, inverse_mass2 = 0.0;
  Vector3 inverse_inertia1 = Vector3::Zero(), inverse_inertia2 = Vector3::Zero();

  // The centre of mass of body 2, or where that is the world of body 1: a place that is no long way from what the joint
  // holds, wherever the origin is.
  const Vector3& centre() const { return has_body2 ? pose2.position : pose1.position; }
};

// Appends numbers that PropertyCursor reads back.
class BoundWriter {
 public:
  void number(double value) { numbers_.push_back(value); }
  void vector(const Vector3& v) { numbers_.insert(numbers_.end(), {v.x(), v.y(), v.z()}); }
  const std::vector<double>& numbers() const { return numbers_; }

 private:
  std::vector<double> numbers_;
};

namespace detail {
JointBodies bodies_of(std::span<const std::uint32_t> constraint_body, std::span<const double> position,
                      std::span<const double> orientation, std::size_t joint);
JointBodies bodies_of(const stage::ConstraintBindRequest& request, std::size_t joint);
JointBodies bodies_of(const stage::ConstraintDiscrepanciesRequest& request, std::size_t joint);
void push_bound(const stage::ConstraintBindReply& reply, std::span<const double> numbers);
void push_discrepancy(const stage::ConstraintDiscrepanciesReply& reply, std::size_t joint, const Discrepancy& d);
std::span<const double> slice(std::span<const double> numbers, std::span<const std::uint32_t> begin, std::size_t row);
}  // namespace detail

// Calls bind(type id, properties of the joint, bodies at the start, writer) for every joint. Throws Refusal for a body
// that does not exist, and for bound numbers that are not finite.
template <typename Bind>
void bind_each(const stage::ConstraintBindRequest& request, const stage::ConstraintBindReply& reply, Bind&& bind) {
  reply.bound_begin().push(0);
  for (std::size_t i = 0; i < request.constraint_type().size(); ++i) {
    name_refused_row(kJointRow, i, [&] {
      BoundWriter writer;
      bind(request.constraint_type()[i],
           PropertyCursor(detail::slice(request.parameter(), request.parameter_begin(), i)),
           detail::bodies_of(request, i), writer);
      detail::push_bound(reply, writer.numbers());
    });
    reply.bound_begin().push(reply.bound().count());
  }
}

// Calls describe(type id, bound numbers, bodies, emit) for every joint that holds; emit(discrepancy) adds one.
// Throws Refusal for a discrepancy that is not finite.
template <typename Describe>
void describe_each(const stage::ConstraintDiscrepanciesRequest& request,
                   const stage::ConstraintDiscrepanciesReply& reply, Describe&& describe) {
  for (std::size_t i = 0; i < request.constraint_type().size(); ++i) {
    if (request.intact()[i] == 0) continue;
    name_refused_row(kJointRow, i, [&] {
      describe(request.constraint_type()[i], PropertyCursor(detail::slice(request.bound(), request.bound_begin(), i)),
               detail::bodies_of(request, i), [&](const Discrepancy& d) { detail::push_discrepancy(reply, i, d); });
    });
  }
}

// The ball-and-socket discrepancy d_s (2.83): two anchors, fixed in the bodies, coincide.
Discrepancy point_discrepancy(const Vector3& anchor1_in_body1, const Vector3& anchor2_in_body2,
                              const JointBodies& bodies);

}  // namespace gravitas
