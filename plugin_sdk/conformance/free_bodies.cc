#include "plugin_sdk/conformance/free_bodies.h"

#include "plugin_sdk/derivative_question.h"

namespace gravitas::conformance {

MessageColumns FreeBodies::request() const {
  MessageColumns columns = empty_request(stage::Method::kIntegratorIntegrate);
  columns.f64("time") = {time};
  columns.f64("time_step") = {time_step};
  columns.u32("wrench_is_constant") = {derivative ? 0U : 1U};
  columns.u32("jacobian_blocks") = {jacobian_blocks};
  columns.f64("plugin_state") = plugin_state;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const FreeBody& body = bodies[i];
    const bool movable = (body.flags & kMovable) != 0;
    columns.u32("flags").push_back(body.flags);
    columns.f64("inverse_mass").push_back(movable ? 1.0 / body.mass : 0.0);
    append(&columns.f64("inertia"), body.moments);
    append(&columns.f64("inverse_inertia"), movable ? Vector3(body.moments.cwiseInverse()) : Vector3::Zero());
    columns.f64("damping").push_back(body.damping);
    append(&columns.f64("wrench"), body.wrench.force);
    append(&columns.f64("wrench"), body.wrench.torque);
    append(&columns.f64("position"), body.state.pose.position);
    append(&columns.f64("orientation"), body.state.pose.orientation);
    append(&columns.f64("linear_velocity"), body.state.twist.linear);
    append(&columns.f64("angular_velocity"), body.state.twist.angular);
    columns.u32("state_changed").push_back(changed.empty() ? 0U : changed[i]);
  }
  return columns;
}

DerivativeFunction FreeBodies::answers() const {
  // no joint holds them: nothing is to be said of impulses
  if (derivative) {
    return [of_wrenches = derivative](const stage::IntegratorDerivativeRequest& question) {
      return question.question() < kFirstOfImpulses ? of_wrenches(question) : DerivativeAnswer({});
    };
  }
  // a method may ask although the wrench is constant
  std::vector<double> wrenches;
  for (const FreeBody& body : bodies) {
    append(&wrenches, body.wrench.force);
    append(&wrenches, body.wrench.torque);
  }
  return [wrenches](const stage::IntegratorDerivativeRequest& question) {
    return question.question() < kFirstOfImpulses ? wrenches : std::vector<double>();
  };
}

MessageColumns FreeBodies::ask(Inquiry* inquiry) const {
  MessageColumns reply = inquiry->answer(stage::Method::kIntegratorIntegrate, request(), answers());
  inquiry->expect_unit("orientation", reply.f64("orientation"), 4);
  return reply;
}

void FreeBodies::step(Inquiry* inquiry) {
  const MessageColumns reply = ask(inquiry);
  for (std::size_t i = 0; i < bodies.size(); ++i) bodies[i].state = state_in(reply, i);
  plugin_state = reply.f64("plugin_state");
  changed.clear();
  time += time_step;
}

void FreeBodies::steps(Inquiry* inquiry, int count) {
  for (int i = 0; i < count; ++i) step(inquiry);
}

BodyState FreeBodies::state_in(const MessageColumns& reply, std::size_t body) {
  return {{vector_at(reply.f64("position"), body), quaternion_at(reply.f64("orientation"), body)},
          {vector_at(reply.f64("linear_velocity"), body), vector_at(reply.f64("angular_velocity"), body)}};
}

}  // namespace gravitas::conformance
