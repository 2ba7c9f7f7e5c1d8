// `--set PATH=VALUE`: changes a scene that was read, before it is built.
//
//   Integrator=RK4   Solver=LCP   Solver.Iterations=50   Space=KDTree   Space.CellSize=2
//   Collision=Standard Simulator=Basic  Simulator.TimeStep=0.001 Environment.Id=Elsewhere
//   Body.Ball01.LinearVelocity={1,0,0}   Geometry.Unit.Radius=2
//   Material.Ice.StaticFrictionCoefficient=0 Force.Down.Acceleration={0,-1,0}
//   Constraint.Hinge.Body2=Door   Plugin.solver.Deadline=5
//
// KineticIntegrator and ConstraintSolver may be written in full. A path that ends at a plugin sets
// its name; if that changes, the properties written for the old one are dropped with a warning.
// Names inside KineticProperties and CustomProperties may be written with or without that step of
// the path. Values are written as in a scene, and a word without quotes is a text. Rules are those
// of the reader and builder.
#pragma once

#include <string_view>

#include "gravitas/scene/v1/scene.pb.h"
#include "services/scene/problem.h"

namespace gravitas::scene {

// Applies one override, "PATH=VALUE". Errors name it: file `name`, "--set PATH=VALUE" if that is empty, the column counted
// in PATH=VALUE. Returns true if there was no error.
bool apply_override(v1::Scene* scene, std::string_view override_text, Problems* problems, std::string_view name = {});

}  // namespace gravitas::scene
