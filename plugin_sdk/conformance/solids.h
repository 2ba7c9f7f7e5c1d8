// Solid bodies for questions to a collision plugin: shapes of the scene language with their surfaces, shapes of
// other types by their declaration, and the contacts that come back.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/conformance/inquiry.h"
#include "plugin_sdk/dynamics.h"

namespace gravitas::conformance {

struct Solid {
  std::string type;
  std::vector<double> parameters;
  // Signed distance of a point of the solid's frame from its surface (m, < 0 inside); null for types that are not
  // known.
  std::function<double(const Vector3&)> distance;
  double radius = 1.0;  // of a ball about the origin that holds it; of no meaning for a half-space
  double inside = 0.0;  // of a ball about the origin that is inside

  bool is_known() const { return static_cast<bool>(distance); }
  bool is_halfspace() const { return type == "Halfspace"; }
};

Solid make_sphere(const PluginDeclaration& declaration, double radius);
Solid make_box(const PluginDeclaration& declaration, const Vector3& half_extents);
Solid make_cylinder(const PluginDeclaration& declaration, double radius, double height);
Solid make_halfspace(const PluginDeclaration& declaration);
Solid make_capsule(const PluginDeclaration& declaration, double radius, double height);
Solid make_cone(const PluginDeclaration& declaration, double radius, double height);
// A solid of a declared type, with sizes about a metre.
Solid random_solid(const PluginDeclaration& declaration, const TypeDeclaration& type, Draw* draw);

inline Pose at(const Vector3& position) { return {position, Quaternion::Identity()}; }

struct SolidBody {
  std::uint32_t solid = 0;
  Pose pose = {};
  Twist twist = {};
  Pose geometry = {};
};

struct Touch {
  std::uint32_t pair = 0, feature = 0;
  Vector3 normal, point;
  double depth = 0.0;
  Vector3 velocity;
};

class Solids {
 public:
  double margin = 0.0;
  std::vector<Solid> solids;
  std::vector<SolidBody> bodies;
  std::vector<std::uint32_t> pairs;

  // Two bodies and their pair.
  static Solids two(const Solid& a, const Pose& pose_a, const Solid& b, const Pose& pose_b, double margin = 0.0);

  MessageColumns request() const;
  // Contacts, checked for what every answer must be.
  std::vector<Touch> ask(Inquiry* inquiry) const;
  // Where the solid of a body lies in the world.
  Pose placed(std::size_t body) const { return compose(bodies[body].pose, bodies[body].geometry); }
};

// Hashes of the shapes of a request from their content.
void hash_shapes(MessageColumns* request);

// The deepest contact, or null.
const Touch* deepest(const std::vector<Touch>& touches);

}  // namespace gravitas::conformance
