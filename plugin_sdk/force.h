// For authors of forces: the loop over the applications of a Force.Wrenches call. What is refused in it says which
// application it is about (plugin_sdk/refused_row.h), so that a text need not.
#pragma once

#include <cmath>
#include <string>

#include "plugin_sdk/body.h"
#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/plugin.h"
#include "plugin_sdk/refused_row.h"

namespace gravitas {

// What one force does to one body.
struct ApplicationAnswer {
  Wrench wrench = {};       // N and N m about the centre of mass, world
  Wrench impulse = {};      // N s and N m s, applied once at the start
  double potential = 0.0;   // J
  std::uint32_t flags = 0;  // ApplicationFlag bits
};

// Throws Refusal if the body's shape is none of the request's.
inline void require_shape(const stage::ForceWrenchesRequest& request, std::uint32_t body) {
  const std::uint32_t shape = body < request.body_shape().size() ? request.body_shape()[body] : kNone;
  if (shape == kNone) return;
  const std::span<const std::uint32_t> begin = request.shape_parameter_begin();
  if (shape >= request.shape_type().size() || shape + std::size_t{1} >= begin.size() ||
      begin[shape] > begin[shape + 1] || begin[shape + 1] > request.shape_parameter().size())
    throw Refusal("body " + std::to_string(body) + " has a shape that does not exist");
}

// Who acts on whom, by the row of the applications.
struct Application {
  std::uint32_t force, body;
  PropertyCursor properties;  // of the force
};

// Throws Refusal for an index outside the request.
inline Application application_at(const stage::ForceWrenchesRequest& request, std::size_t row) {
  const std::span<const std::uint32_t> begin = request.force_parameter_begin();
  const std::uint32_t force = request.application()[2 * row], body = request.application()[2 * row + 1];
  if (force + std::size_t{1} >= begin.size() || body >= request.mass().size() || begin[force] > begin[force + 1] ||
      begin[force + 1] > request.force_parameter().size())
    throw Refusal("application " + std::to_string(row) + " names a force or body that does not exist");
  require_shape(request, body);
  return {force, body,
          PropertyCursor(request.force_parameter().subspan(begin[force], begin[force + 1] - begin[force]))};
}

namespace detail {
inline void push_answer(const stage::ForceWrenchesReply& reply, std::uint32_t body, const ApplicationAnswer& a) {
  if (!a.wrench.force.allFinite() || !a.wrench.torque.allFinite() || !a.impulse.force.allFinite() ||
      !a.impulse.torque.allFinite() || !std::isfinite(a.potential))
    throw Refusal("the wrench on body " + std::to_string(body) +
                  " is not finite: the force's properties or the body's mass or state are not, or too large");
  const auto push = [](const stage::ReplyColumn<double>& column, const Wrench& w) {
    column.push(w.force.x(), w.force.y(), w.force.z(), w.torque.x(), w.torque.y(), w.torque.z());
  };
  push(reply.wrench(), a.wrench);
  push(reply.impulse(), a.impulse);
  reply.potential().push(a.potential);
  reply.flags().push(a.flags);
}
}  // namespace detail

// Calls answer(type id, flattened properties of the force, body) for every application in order and writes what it
// returns. Throws Refusal for an index outside the request, and for an answer that is not finite.
template <typename Answer>
void for_each_application(const stage::ForceWrenchesRequest& request, const stage::ForceWrenchesReply& reply,
                          Answer&& answer) {
  for (std::size_t row = 0; row < request.application().size() / 2; ++row) {
    const Application one = application_at(request, row);
    name_refused_row(kApplicationRow, row, [&] {
      detail::push_answer(reply, one.body, answer(request.force_type()[one.force], one.properties, one.body));
    });
  }
}

}  // namespace gravitas
