#include "kernel/model.h"

#include <algorithm>

#include "plugin_sdk/channel/digest.h"
#include "plugin_sdk/solver.h"

namespace gravitas::kernel {
namespace {

double inverse_or_zero(double value, bool can_be_pushed) { return can_be_pushed ? 1.0 / value : 0.0; }

std::uint64_t hash_of(const ShapeDescription& shape) {
  channel::Digest digest;
  digest.add(shape.type.data(), shape.type.size());
  digest.add(shape.parameters.data(), shape.parameters.size() * sizeof(double));
  return digest.value();
}

// Begin-rows of a list of parameter lists, and all parameters in one run.
template <typename Element>
std::uint64_t parameter_count(const std::vector<const Element*>& elements) {
  std::uint64_t count = 0;
  for (const Element* element : elements) count += element->parameters.size();
  return count;
}

template <typename Element>
void write_parameters(const std::vector<const Element*>& elements, const Column<std::uint32_t>& begin,
                      const Column<double>& parameter) {
  std::uint32_t next = 0;
  for (std::size_t i = 0; i < elements.size(); ++i) {
    begin[i] = next;
    std::copy(elements[i]->parameters.begin(), elements[i]->parameters.end(), parameter.data() + next);
    next += static_cast<std::uint32_t>(elements[i]->parameters.size());
  }
  begin[elements.size()] = next;
}

template <typename Element>
std::vector<const Element*> served_by(const std::vector<Element>& all, std::uint32_t plugin) {
  std::vector<const Element*> served;
  for (const Element& element : all)
    if (element.plugin == plugin) served.push_back(&element);
  return served;
}

std::vector<const ShapeDescription*> pointers(const std::vector<ShapeDescription>& shapes) {
  std::vector<const ShapeDescription*> all;
  for (const ShapeDescription& shape : shapes) all.push_back(&shape);
  return all;
}

}  // namespace

Model::Model(Arena* arena, const EnvironmentDescription& d)
    : body_count(static_cast<std::uint32_t>(d.bodies.size())),
      shape_count(static_cast<std::uint32_t>(d.shapes.size())),
      constraint_count(static_cast<std::uint32_t>(d.constraints.size())),
      application_count(0),
      material_count(d.material_count),
      material_pairs(d.material_pairs),
      constraints(d.constraints) {
  const std::uint64_t n = body_count;
  const auto numbers = [&](std::uint64_t components) { return Column<double>(arena, n * components, 0); };
  flags = Column<std::uint32_t>(arena, n, 0);
  mass = numbers(1), inverse_mass = numbers(1), inertia = numbers(3), inverse_inertia = numbers(3),
  damping = numbers(1);
  body_shape = Column<std::uint32_t>(arena, n, 0);
  geometry_position = numbers(3), geometry_orientation = numbers(4);
  filter_group = Column<std::uint64_t>(arena, n, 0), filter_mask = Column<std::uint64_t>(arena, n, 0);

  shape_hash = Column<std::uint64_t>(arena, shape_count, 0), shape_type = Column<std::uint64_t>(arena, shape_count, 0);
  shape_parameter_begin = Column<std::uint32_t>(arena, shape_count + 1, 0);
  shape_parameter = Column<double>(arena, parameter_count(pointers(d.shapes)), 0);

  for (const BodyDescription& body : d.bodies) {
    bound.push_back(body.bound);
    material.push_back(body.material);
    body_id.push_back(body.id);
    application_count += static_cast<std::uint32_t>(body.forces.size());
  }
  for (std::uint32_t plugin = 0; plugin < d.force.plugins.size(); ++plugin) {
    const auto served = served_by(d.forces, plugin);
    std::uint64_t rows = 0;
    for (const BodyDescription& body : d.bodies)
      for (const std::uint32_t force : body.forces) rows += d.forces[force].plugin == plugin ? 1 : 0;
    if (rows == 0) continue;
    ForceGroup& group = force_groups.emplace_back();
    group.target = plugin;
    group.type = Column<std::uint64_t>(arena, served.size(), 0);
    group.parameter_begin = Column<std::uint32_t>(arena, served.size() + 1, 0);
    group.parameter = Column<double>(arena, parameter_count(served), 0);
    group.application = Column<std::uint32_t>(arena, 2 * rows, 0);
  }
  for (std::uint32_t plugin = 0; plugin < d.constraint.plugins.size(); ++plugin) {
    const auto served = served_by(d.constraints, plugin);
    if (served.empty()) continue;
    ConstraintGroup& group = constraint_groups.emplace_back();
    group.target = plugin;
    group.type = Column<std::uint64_t>(arena, served.size(), 0);
    group.body = Column<std::uint32_t>(arena, 2 * served.size(), 0);
    group.parameter_begin = Column<std::uint32_t>(arena, served.size() + 1, 0);
    group.parameter = Column<double>(arena, parameter_count(served), 0);
    group.bind_body = Column<std::uint32_t>(arena, 2 * served.size(), 0);
    group.is_kept = Column<std::uint32_t>(arena, served.size(), 0);
    group.bind_position = Column<double>(arena, 6 * served.size(), 0);
    group.bind_orientation = Column<double>(arena, 8 * served.size(), 0);
    group.bound_begin = Column<std::uint32_t>(arena, served.size() + 1, 0);
    group.bound = Column<double>(arena, 0, 32 * served.size());
  }
}

void Model::write(const EnvironmentDescription& d) {
  for (std::size_t i = 0; i < d.bodies.size(); ++i) {
    const BodyDescription& body = d.bodies[i];
    const bool can_be_pushed = (body.flags & kMovable) != 0;
    flags[i] = body.flags;
    mass[i] = body.mass;
    inverse_mass[i] = inverse_or_zero(body.mass, can_be_pushed);
    set_vector(inertia.span(), i, body.inertia);
    for (int k = 0; k < 3; ++k)
      inverse_inertia[3 * i + static_cast<std::size_t>(k)] = inverse_or_zero(body.inertia[k], can_be_pushed);
    damping[i] = body.damping;
    body_shape[i] = body.shape;
    set_vector(geometry_position.span(), i, body.geometry.position);
    set_quaternion(geometry_orientation.span(), i, body.geometry.orientation);
    filter_group[i] = body.filter_group;
    filter_mask[i] = body.filter_mask;
    if (!body.motion.empty())
      curves.emplace_back(static_cast<std::uint32_t>(i), MotionCurve(body.motion, body.geometry));
  }
  for (std::size_t i = 0; i < d.shapes.size(); ++i) {
    shape_hash[i] = hash_of(d.shapes[i]);
    shape_type[i] = type_id(d.shapes[i].type);
  }
  write_parameters(pointers(d.shapes), shape_parameter_begin, shape_parameter);

  applications.resize(application_count);
  for (std::uint32_t g = 0; g < force_groups.size(); ++g) {
    ForceGroup& group = force_groups[g];
    std::vector<std::uint32_t> row_in_group(d.forces.size(), 0);
    std::vector<const ForceDescription*> served;
    for (std::size_t f = 0; f < d.forces.size(); ++f) {
      if (d.forces[f].plugin != group.target) continue;
      row_in_group[f] = static_cast<std::uint32_t>(served.size());
      group.type[served.size()] = type_id(d.forces[f].type);
      served.push_back(&d.forces[f]);
    }
    write_parameters(served, group.parameter_begin, group.parameter);
    std::uint32_t global = 0;
    for (std::uint32_t body = 0; body < body_count; ++body) {
      for (const std::uint32_t force : d.bodies[body].forces) {
        if (d.forces[force].plugin == group.target) {
          group.application[2 * group.row.size()] = row_in_group[force];
          group.application[2 * group.row.size() + 1] = body;
          applications[global] = {body, g, static_cast<std::uint32_t>(group.row.size())};
          group.row.push_back(global);
        }
        ++global;
      }
    }
  }

  for (ConstraintGroup& group : constraint_groups) {
    const auto served = served_by(d.constraints, group.target);
    write_parameters(served, group.parameter_begin, group.parameter);
    for (std::size_t i = 0; i < served.size(); ++i) {
      group.type[i] = type_id(served[i]->type);
      group.body[2 * i] = served[i]->body1;
      group.body[2 * i + 1] = served[i]->body2;
      group.is_kept[i] = served[i]->is_kept ? 1 : 0;
      group.row.push_back(static_cast<std::uint32_t>(served[i] - d.constraints.data()));
    }
  }
}

}  // namespace gravitas::kernel
