// Changes of a scene that was read, while it runs: elements come, go, and have other properties. Rules are those of the
// reader, the overrides and the builder.
//
//   add      a text that holds Geometries, Materials, Forces, Bodies and Constraints (Addition of scene.proto); its elements
//            come behind those that there are
//   remove   Body.Ball01, Constraint.Hinge, Geometry.Unit, Material.Ice, Force.Down
//   set      a path of overrides.h that begins with one of these words
#pragma once

#include <google/protobuf/repeated_field.h>

#include <map>
#include <set>
#include <string>

#include "gravitas/edit/v1/edit.pb.h"
#include "gravitas/scene/v1/scene.pb.h"
#include "services/scene/problem.h"

namespace gravitas::scene {

// Which of a body's kinetic properties were set.
struct SetMotion {
  bool position = false, orientation = false, linear_velocity = false, angular_velocity = false;
};

// What changes did, as far as the scene does not tell: ids of elements that are new, though there may have been ones of the
// same name, and motions that were set, though they may be those that stood there.
struct ChangeLog {
  std::set<std::string> new_bodies, new_joints;
  std::map<std::string, SetMotion> motions;
};

// Carries out changes one after the other. Returns true if there was no error; otherwise the scene must not be used.
bool apply_changes(const google::protobuf::RepeatedPtrField<edit::v1::Change>& changes, v1::Scene* scene,
                   ChangeLog* log, Problems* problems);

}  // namespace gravitas::scene
