#include "services/scene/build_shapes.h"

#include <algorithm>
#include <limits>
#include <span>

#include "plugin_sdk/body.h"
#include "services/scene/shape_values.h"

namespace gravitas::scene {
namespace {

using v1::Geometry;

class ShapeBuilder final : private SiblingShapes {
 public:
  ShapeBuilder(const InstalledPlugin* collision, BuildContext* context)
      : collision_(collision), context_(*context), geometries_(context->scene.geometries().geometry()) {}

  std::vector<Solid> build() {
    solids_.resize(static_cast<std::size_t>(geometries_.size()));
    states_.resize(solids_.size(), State::kNew);
    for (const Geometry& geometry : geometries_)
      context_.description.shapes.push_back({geometry.id(), geometry.type(), {}});
    for (std::size_t i = 0; i < solids_.size(); ++i) build_one(i);
    return solids_;
  }

 private:
  enum class State : std::uint8_t { kNew, kBegun, kDone };

  void build_one(std::size_t row) {
    if (states_[row] != State::kNew) return;
    states_[row] = State::kBegun;
    solids_[row].is_good = collision_ != nullptr && build_shape(row);
    states_[row] = State::kDone;
  }

  // A child of a compound; may come before it or after.
  Found find(const std::string& id) override {
    const auto found = std::find_if(geometries_.begin(), geometries_.end(),
                                    [&](const Geometry& geometry) { return geometry.id() == id; });
    std::vector<std::string> ids;
    if (found == geometries_.end()) {
      for (const Geometry& geometry : geometries_) ids.push_back(geometry.id());
      return {nullptr, "names no Geometry: \"" + id + "\"; " + allowed_names(id, ids)};
    }
    const auto row = static_cast<std::size_t>(found - geometries_.begin());
    if (states_[row] == State::kBegun) return {nullptr, "names \"" + id + "\", of which it is a part itself"};
    build_one(row);
    if (!solids_[row].is_good) return {nullptr, ""};
    if (!solids_[row].shape) return {nullptr, "names \"" + id + "\", whose type only its plugin knows"};
    return {solids_[row].shape, ""};
  }

  bool build_shape(std::size_t row) {
    const Geometry& geometry = geometries_[static_cast<int>(row)];
    const TypeDeclaration* type = find_type(collision_->declaration, geometry.type());
    if (type == nullptr) return refuse_type(geometry);
    const std::string what = geometry.type() + " \"" + geometry.id() + '"';
    const TextPosition written = place_of(geometry.custom_properties().location());
    const TextPosition block = written.known() ? written : place_of(geometry.location());
    std::vector<NamedValue> values = named_values(geometry.custom_properties());
    std::vector<PropertyProblem> problems;
    ShapeExpansion expansion;
    std::vector<double>& parameters = context_.description.shapes[row].parameters;
    const bool good = expand_shape_values(*type, folder_of(geometry), this, &values, &expansion, &problems) &&
                      flatten(type->properties, values, &parameters, &problems) &&
                      read(type->name, expansion, &parameters, row, &problems);
    context_.diagnostics->add(problems, block, what + ": ");
    return good;
  }

  bool refuse_type(const Geometry& geometry) {
    std::vector<std::string> names;
    for (const TypeDeclaration& known : collision_->declaration.types) names.push_back(known.name);
    const InstalledPlugin* other = context_.catalog->find_type(Slot::kCollision, geometry.type());
    const std::string hint = other == nullptr ? ""
                                              : "; the plugin \"" + other->declaration.name +
                                                    "\" knows it: Plugin { Slot = \"collision\" Name = … }";
    context_.diagnostics->error(place_of(geometry, Geometry::kTypeFieldNumber),
                                "the collision plugin \"" + collision_->declaration.name + "\" knows no shape \"" +
                                    geometry.type() + "\"; " + allowed_names(geometry.type(), names) + hint);
    return false;
  }

  // Shapes are known by their names and properties; a plugin that declares them otherwise is taken at its word.
  bool read(const std::string& type, const ShapeExpansion& expansion, std::vector<double>* parameters, std::size_t row,
            std::vector<PropertyProblem>* problems) {
    const auto& known = scene_shape_types();
    const auto standard = std::find_if(known.begin(), known.end(), [&](const auto& t) { return t.name == type; });
    if (standard == known.end()) return true;
    const TypeDeclaration& declared = *find_type(collision_->declaration, type);
    splice(declared.properties, expansion, parameters);
    const std::optional<std::vector<double>> numbers = as_declared_by(*standard, declared, *parameters);
    if (!numbers) return true;
    std::string why;
    std::optional<SceneShape> shape;
    try {
      shape = read_scene_shape(type_id(type), *numbers, &why);
    } catch (const std::out_of_range& missing) {
      why = missing.what();
    }
    if (!shape) {
      const bool is_size = why.starts_with("has a size");
      problems->push_back(
          {expansion.position, is_size ? "a size is zero or less; allowed: sizes > 0" : expansion.prefix + why, false});
      return false;
    }
    if (shape->mesh && shape->mesh->dropped() > 0)
      problems->push_back(
          {expansion.position,
           expansion.prefix + std::to_string(shape->mesh->dropped()) + " triangles without area were dropped", true});
    // the faces of a hull are found here, once, and not by every worker
    if (shape->polyhedron && declared.properties.size() == standard->properties.size())
      *parameters = flattened_shape(*shape);
    solids_[row].shape = std::make_shared<SceneShape>(std::move(*shape));
    return true;
  }

  // The numbers of a declared type in the order of the standard one; nothing where it lacks a property.
  static std::optional<std::vector<double>> as_declared_by(const TypeDeclaration& standard,
                                                           const TypeDeclaration& declared,
                                                           std::span<const double> numbers) {
    std::vector<double> ordered;
    for (const Property& wanted : standard.properties) {
      std::size_t begin = 0;
      bool is_found = false;
      for (const Property& property : declared.properties) {
        const std::span<const double> own = numbers.subspan(begin, flat_size_of(property, numbers.subspan(begin)));
        is_found = property.name == wanted.name && property.kind == wanted.kind && property.columns == wanted.columns;
        if (is_found) ordered.insert(ordered.end(), own.begin(), own.end());
        if (is_found) break;
        begin += own.size();
      }
      if (!is_found) return std::nullopt;
    }
    return ordered;
  }

  std::string folder_of(const Geometry& geometry) const {
    const auto file = static_cast<int>(geometry.location().file());
    if (file >= context_.scene.files_size()) return "";
    const std::string& name = context_.scene.files(file);
    const std::size_t slash = name.rfind('/');
    return slash == std::string::npos ? "" : name.substr(0, slash + 1);
  }

  const InstalledPlugin* collision_;
  BuildContext& context_;
  const google::protobuf::RepeatedPtrField<Geometry>& geometries_;
  std::vector<Solid> solids_;
  std::vector<State> states_;
};

}  // namespace

LocalBound local_bound(const Solid& solid, const std::string& bounding_volume_type, const Pose& X_BG) {
  LocalBound bound;
  if (!solid.has_mass()) return bound;
  const SceneShape& shape = *solid.shape;
  const Box3 box = local_box(shape);
  Vector3 half_extents = box.half_extents();
  // the middle of two coordinates is rounded where they are not opposite
  if (box.centre() != Vector3::Zero())
    half_extents += 4.0 * std::numeric_limits<double>::epsilon() * box.centre().cwiseAbs();
  measure(half_extents, &bound);
  const bool is_sphere = shape.kind == SceneShape::Kind::kSphere;
  if (is_sphere) bound.reach = shape.size.x();
  if (bounding_volume_type == "None") return bound;
  bound.orientation = X_BG.orientation;
  // no corner outside by a rounding
  const double widened = 1.0 + 4.0 * std::numeric_limits<double>::epsilon();
  if (is_sphere) {
    bound.kind = BoundKind::kSphere;
    bound.centre = X_BG.position;
    bound.half_extents = {shape.size.x(), 0.0, 0.0};
  } else if (bounding_volume_type == "Sphere") {
    const Ball ball = bounding_ball(shape);
    bound.kind = BoundKind::kSphere;
    bound.centre = transform_point(X_BG, ball.centre);
    bound.half_extents = {ball.radius * widened, 0.0, 0.0};
  } else {
    bound.kind = BoundKind::kBox;
    bound.centre = transform_point(X_BG, box.centre());
    bound.half_extents = half_extents;
  }
  return bound;
}

std::vector<Solid> build_shapes(const InstalledPlugin* collision, BuildContext* context) {
  return ShapeBuilder(collision, context).build();
}

}  // namespace gravitas::scene
