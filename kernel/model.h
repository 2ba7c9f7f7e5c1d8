// What does not change while an environment runs: bodies, shapes, materials, forces, joints as columns. Written
// once by Environment; read by every stage.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "kernel/arena.h"
#include "kernel/description.h"
#include "plugin_sdk/motion_curve.h"

namespace gravitas::kernel {

// Forces that one plugin serves. Rows of `application` are (force of this group, body).
struct ForceGroup {
  std::uint32_t target = 0;  // plugin of the slot
  Column<std::uint64_t> type;
  Column<std::uint32_t> parameter_begin;
  Column<double> parameter;
  Column<std::uint32_t> application;
  std::vector<std::uint32_t> row;  // row of each application in the order of the scene
};

// Joints that one plugin serves.
struct ConstraintGroup {
  std::uint32_t target = 0;
  Column<std::uint64_t> type;
  Column<std::uint32_t> body;
  Column<std::uint32_t> parameter_begin;
  Column<double> parameter;
  Column<std::uint32_t> bind_body, is_kept;  // 2 a joint: rows of the poses that it is bound in, or kNone; 1 a joint
  Column<double> bind_position, bind_orientation;  // 2 a joint
  Column<std::uint32_t> bound_begin;               // written once by Constraint.Bind
  Column<double> bound;
  std::vector<std::uint32_t> row;  // joint of the scene
};

struct Model {
  Model(Arena* arena, const EnvironmentDescription& description);

  // Fills the columns; after Arena::seal().
  void write(const EnvironmentDescription& description);

  std::uint32_t body_count, shape_count, constraint_count, application_count;

  // Bodies: a row each.
  Column<std::uint32_t> flags;
  Column<double> mass, inverse_mass;        // kg, 1/kg; inverse 0 where nothing can push the body
  Column<double> inertia, inverse_inertia;  // principal, 3 per body
  Column<double> damping;                   // 1/s
  Column<std::uint32_t> body_shape;
  Column<double> geometry_position, geometry_orientation;  // of the shape's frame in the body's
  Column<std::uint64_t> filter_group, filter_mask;
  std::vector<LocalBound> bound;
  std::vector<std::uint32_t> material;
  std::vector<std::string> body_id;
  std::vector<std::pair<std::uint32_t, MotionCurve>> curves;  // kinematic bodies that follow one

  // Shapes.
  Column<std::uint64_t> shape_hash, shape_type;
  Column<std::uint32_t> shape_parameter_begin;
  Column<double> shape_parameter;

  // Material rows for pairs of materials, material_count squared.
  std::uint32_t material_count;
  std::vector<double> material_pairs;

  std::vector<ForceGroup> force_groups;
  // In the order of the scene, which is the order of summation; `place` in the group's.
  struct Application {
    std::uint32_t body, group, place;
  };
  std::vector<Application> applications;
  std::vector<ConstraintGroup> constraint_groups;
  std::vector<ConstraintDescription> constraints;
};

}  // namespace gravitas::kernel
