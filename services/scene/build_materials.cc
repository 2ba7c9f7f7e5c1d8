#include "services/scene/build_materials.h"

#include <cmath>
#include <string>

#include "services/scene/grammar.h"

namespace gravitas::scene {
namespace {

using v1::Material;

// The table has a row for every pair.
constexpr std::size_t kMaximumMaterials = 1024;

MaterialRow row_of(const Material& material) {
  MaterialRow row{};
  row[kRestitution] = material.restitution_coefficient();
  row[kStaticFriction] = material.static_friction_coefficient();
  row[kDynamicFriction] = material.has_dynamic_friction_coefficient() ? material.dynamic_friction_coefficient()
                                                                      : material.static_friction_coefficient();
  row[kRollingFriction] = material.rolling_friction_coefficient();
  row[kSpinningFriction] = material.spinning_friction_coefficient();
  row[kSurfacePerturbation] = material.surface_perturbation_coefficient();
  return row;
}

// The material of a body that names none: what an empty block would be.
MaterialRow default_row(Diagnostics* diagnostics) {
  Material material;
  fill_defaults(grammar_of(*Material::descriptor()), 0, &material, diagnostics);
  return row_of(material);
}

void check_friction(const Material& material, Diagnostics* diagnostics) {
  if (!material.has_dynamic_friction_coefficient() ||
      material.dynamic_friction_coefficient() <= material.static_friction_coefficient())
    return;
  diagnostics->warning(place_of(material, Material::kDynamicFrictionCoefficientFieldNumber),
                       "DynamicFrictionCoefficient of \"" + material.id() + "\" is " +
                           number_text(material.dynamic_friction_coefficient()) +
                           ", more than its StaticFrictionCoefficient " +
                           number_text(material.static_friction_coefficient()) +
                           ": a body at rest then starts more easily than it goes on");
}

}  // namespace

MaterialRow mixed(const MaterialRow& a, const MaterialRow& b) {
  MaterialRow row{};
  row[kRestitution] = (a[kRestitution] + b[kRestitution]) / 2;
  row[kSurfacePerturbation] = a[kSurfacePerturbation] + b[kSurfacePerturbation];
  // of equal ones exactly their own; the roots before the product, so that it cannot overflow
  for (const MaterialColumn c : {kStaticFriction, kDynamicFriction, kRollingFriction, kSpinningFriction})
    row[c] = a[c] == b[c] ? a[c] : std::sqrt(a[c]) * std::sqrt(b[c]);
  return row;
}

void build_materials(BuildContext* context) {
  const auto& materials = context->scene.materials().material();
  kernel::EnvironmentDescription& description = context->description;
  for (const Material& material : materials) check_friction(material, context->diagnostics);

  // rows of the materials in use
  std::vector<std::uint32_t> row_of_material(static_cast<std::size_t>(materials.size()) + 1, kNone);
  const auto slot = [&](std::uint32_t material) { return material == kNone ? row_of_material.size() - 1 : material; };
  for (const kernel::BodyDescription& body : description.bodies) row_of_material[slot(body.material)] = 0;
  if (description.bodies.empty()) row_of_material.back() = 0;
  std::vector<MaterialRow> rows;
  for (std::size_t i = 0; i < row_of_material.size(); ++i) {
    if (row_of_material[i] == kNone) continue;
    row_of_material[i] = static_cast<std::uint32_t>(rows.size());
    const bool is_default = i + 1 == row_of_material.size();
    rows.push_back(is_default ? default_row(context->diagnostics) : row_of(materials[static_cast<int>(i)]));
  }
  if (rows.size() > kMaximumMaterials) {
    context->diagnostics->error(place_of(context->scene.materials().location()),
                                "bodies have " + std::to_string(rows.size()) + " materials; allowed: up to " +
                                    std::to_string(kMaximumMaterials));
    return;
  }

  for (kernel::BodyDescription& body : description.bodies) body.material = row_of_material[slot(body.material)];
  description.material_count = static_cast<std::uint32_t>(rows.size());
  description.material_pairs.clear();
  for (const MaterialRow& a : rows) {
    for (const MaterialRow& b : rows) {
      const MaterialRow pair = mixed(a, b);
      description.material_pairs.insert(description.material_pairs.end(), pair.begin(), pair.end());
    }
  }
}

}  // namespace gravitas::scene
