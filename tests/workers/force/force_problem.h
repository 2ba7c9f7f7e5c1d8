// One body under one force, for the tests of forces.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/dynamics.h"
#include "tests/workers/plugin_fixture.h"

namespace gravitas::test {

struct ForcedBody {
  double mass = 2.0;
  Pose pose = {};      // of the centre of mass
  Pose geometry = {};  // of the geometry's frame in the body's
  Twist twist = {};
  std::uint32_t shape = kNone;  // row of the problem's shapes
};

struct ForceShape {
  std::uint64_t type;
  std::vector<double> parameters;
};

struct ForceAnswer {
  Wrench wrench, impulse;
  double potential;
  std::uint32_t flags;
};

// A request with the given forces, bodies and applications (force, body).
struct ForceProblem {
  double time = 0.0;
  std::vector<std::uint64_t> types;
  std::vector<std::vector<double>> properties;
  std::vector<ForcedBody> bodies;
  std::vector<std::uint32_t> applications;
  std::vector<ForceShape> shapes = {};

  MessageColumns request() const {
    MessageColumns columns = PluginUnderTest::request_of(stage::Method::kForceWrenches);
    const auto append = [&](const char* column, const Vector3& v) {
      std::vector<double>& numbers = columns.f64(column);
      numbers.insert(numbers.end(), {v.x(), v.y(), v.z()});
    };
    const auto append_rotation = [&](const char* column, const Quaternion& q) {
      std::vector<double>& numbers = columns.f64(column);
      numbers.insert(numbers.end(), {q.w(), q.x(), q.y(), q.z()});
    };
    columns.f64("time") = {time};
    columns.u64("force_type") = types;
    columns.u32("force_parameter_begin") = {0};
    for (const std::vector<double>& numbers : properties) {
      std::vector<double>& all = columns.f64("force_parameter");
      all.insert(all.end(), numbers.begin(), numbers.end());
      columns.u32("force_parameter_begin").push_back(static_cast<std::uint32_t>(all.size()));
    }
    columns.u32("application") = applications;
    for (const ForcedBody& body : bodies) {
      columns.f64("mass").push_back(body.mass);
      append("geometry_position", body.geometry.position);
      append_rotation("geometry_orientation", body.geometry.orientation);
      append("position", body.pose.position);
      append_rotation("orientation", body.pose.orientation);
      append("linear_velocity", body.twist.linear);
      append("angular_velocity", body.twist.angular);
      columns.u32("body_shape").push_back(body.shape);
    }
    columns.u32("shape_parameter_begin") = {0};
    for (const ForceShape& shape : shapes) {
      columns.u64("shape_type").push_back(shape.type);
      std::vector<double>& all = columns.f64("shape_parameter");
      all.insert(all.end(), shape.parameters.begin(), shape.parameters.end());
      columns.u32("shape_parameter_begin").push_back(static_cast<std::uint32_t>(all.size()));
    }
    return columns;
  }
};

inline std::vector<ForceAnswer> ask_wrenches(PluginUnderTest* force, const ForceProblem& problem) {
  const MessageColumns reply = force->ask(stage::Method::kForceWrenches, problem.request());
  std::vector<ForceAnswer> answers;
  const auto wrench = [&](const char* column, std::size_t row) {
    return Wrench{vector_at(reply.f64(column), 2 * row), vector_at(reply.f64(column), 2 * row + 1)};
  };
  for (std::size_t i = 0; i < reply.u32("flags").size(); ++i)
    answers.push_back({wrench("wrench", i), wrench("impulse", i), reply.f64("potential")[i], reply.u32("flags")[i]});
  return answers;
}

// The answer for one force on one body.
inline ForceAnswer ask_wrench(PluginUnderTest* force, std::string_view type, const std::vector<double>& properties,
                              const ForcedBody& body, double time = 0.0) {
  const ForceProblem problem{time, {type_id(type)}, {properties}, {body}, {0, 0}};
  return ask_wrenches(force, problem).at(0);
}

}  // namespace gravitas::test
