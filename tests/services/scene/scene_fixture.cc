#include "tests/services/scene/scene_fixture.h"

#include <utility>

namespace gravitas::scene {
namespace {

InstalledPlugin plugin(Slot slot, const std::string& name, std::vector<TypeDeclaration> types = {},
                       std::vector<Property> properties = {}) {
  PluginDeclaration declaration;
  declaration.name = name;
  declaration.version = "1";
  declaration.slot = slot;
  declaration.types = std::move(types);
  declaration.properties = std::move(properties);
  return {"/plugins/" + std::string(slot_name(slot)) + '_' + name + ".so", declaration};
}

Property length(const char* name) { return Property::number(name, "m").above(0.0).required(); }
Property point(const char* name) { return Property::vector(name, "m", "world").required(); }

}  // namespace

std::vector<InstalledPlugin> declared_plugins() {
  return {
      plugin(Slot::kSpace, "DynamicBVH", {}),
      plugin(Slot::kSpace, "Grid", {}, {Property::number("CellSize", "m").above(0.0)}),
      plugin(Slot::kSpace, "KDTree", {}, {Property::integer("MaximumDepth").at_least(1.0).defaults_to({8.0})}),
      plugin(Slot::kCollision, "Standard",
             {{"Sphere", "", {length("Radius")}},
              {"Box", "", {Property::vector("HalfExtents", "m", "geometry").above(0.0).required()}},
              {"Cylinder", "", {length("Radius"), length("Height")}},
              {"Halfspace", "", {}},
              {"Blob", "", {Property::number("Wobble", "1").defaults_to({1.0})}}},
             {Property::number("Margin", "m").at_least(0.0).defaults_to({0.001})}),
      plugin(Slot::kForce, "Gravity",
             {{"Gravity", "", {Property::vector("Acceleration", "m/s^2", "world").required()}}}),
      plugin(Slot::kForce, "Drag", {{"Drag", "", {Property::number("LinearCoefficient", "kg/s").required()}}},
             {Property::flag("Fast").defaults_to({0.0})}),
      plugin(Slot::kConstraint, "Joints",
             {{"Spherical", "", {point("BindPoint")}},
              {"AngularMotor",
               "",
               {point("BindAxisPoint1"), point("BindAxisPoint2"), Property::number("AngularSpeed", "rad/s").required(),
                Property::number("MaximumTorque", "N*m").above(0.0)}}}),
      plugin(Slot::kSolver, "Sequential", {},
             {Property::integer("Iterations").at_least(1.0).defaults_to({100.0}),
              Property::number("CorrectionFactor", "1").at_least(0.0).at_most(1.0).defaults_to({1.0})}),
      plugin(Slot::kSolver, "LCP"),
      plugin(Slot::kIntegrator, "Euler"),
      plugin(Slot::kIntegrator, "SemiImplicitEuler"),
      plugin(Slot::kIntegrator, "RK4"),
  };
}

ReadScene read(const std::string& text) {
  ReadScene result;
  const std::vector<SceneText> texts = {{"scene", text}};
  result.is_good = read_texts(texts, result.document.get(), &result.problems);
  return result;
}

BuiltScene build(const std::string& text, const std::vector<std::string>& overrides) {
  return build(text, overrides, Catalog(declared_plugins()));
}

BuiltScene build(const std::string& text, const std::vector<std::string>& overrides, Catalog catalog) {
  BuiltScene result{read(text), std::nullopt};
  bool is_good = result.read.is_good;
  for (const std::string& one : overrides)
    is_good = is_good && apply_override(&result.read.scene(), one, &result.read.problems);
  if (is_good) result.description = scene::build(result.read.scene(), &catalog, &result.read.problems);
  return result;
}

std::vector<std::string> texts(const std::vector<SceneError>& errors) {
  std::vector<std::string> all;
  for (const SceneError& error : errors) all.push_back(to_string(error));
  return all;
}

std::vector<std::string> BuiltScene::errors() const { return texts(read.problems.errors); }
std::vector<std::string> BuiltScene::warnings() const { return texts(read.problems.warnings); }

std::string scene_with_body(const std::string& body) {
  return "Environment { Id = \"World\" Space { Type = \"Grid\" Bodies { Body { Id = \"Ball\"\n" + body +
         "\n} } } }\n"
         "Geometries { Geometry { Type = \"Sphere\" Id = \"Unit\" CustomProperties { Radius = 0.5 "
         "} }\n"
         "Geometry { Type = \"Box\" Id = \"Brick\" CustomProperties { HalfExtents = {1, 2, 3} } }\n"
         "Geometry { Type = \"Cylinder\" Id = \"Rod\" CustomProperties { Radius = 0.5 Height = 2 } "
         "}\n"
         "Geometry { Type = \"Halfspace\" Id = \"Ground\" }\n"
         "Geometry { Type = \"Blob\" Id = \"Blob\" } }\n"
         "Materials { Material { Id = \"Ice\" StaticFrictionCoefficient = 0 } }\n"
         "Forces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, "
         "-9.81, 0} } }\n"
         "Force { Type = \"Drag\" Id = \"Air\" CustomProperties { LinearCoefficient = 0.1 } } }\n";
}

}  // namespace gravitas::scene
