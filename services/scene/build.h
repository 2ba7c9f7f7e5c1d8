// A scene and the plugins there are, to the description that the kernel makes an environment of:
// the second half of loading. Here ids become row numbers, names become plugins, free properties
// become the numbers that a plugin declared, shapes give masses, and poses become those of the
// centre of mass in principal axes.
//
// What is decided here, beyond the table of the grammar (schemas/gravitas/scene/v1/scene.proto):
//   mass         MassDensity; or Mass, with the moments of the shape scaled; or Mass and PrincipalMoments. A movable,
//                bounded body without any, or with MassDensity 0, has 1000 kg/m^3 and a warning. The shapes whose masses
//                are known are Sphere, Box and Cylinder; another one needs Mass and PrincipalMoments.
//   immovable    true for a Halfspace unless the body is Kinematic. Immovable and kinematic bodies have mass 0 here;
//                forces on them, and velocities of immovable ones, are dropped with a warning.
//   pose         Position and Orientation are those of the geometry's frame G; the body's frame B is the centre of mass
//                with principal axes, X_WB = X_WG X_GB, and `geometry` is X_BG.
//   bound        a ball for a Sphere; the shape's box for the box types and by default; the circumscribed ball for
//                "Sphere"; none for "None" and where the shape is not known here. It never changes a result.
//   materials    rows are the materials that bodies name, in the order of the scene, then one with all defaults if a
//                body names none. A pair has the mean of the restitutions, the sum of the perturbations and the
//                geometric means of the four friction coefficients.
//   plugins      Space, KineticIntegrator and ConstraintSolver name theirs; the collision plugin is "Standard", or the
//                only one, or that of a Plugin block; forces and joints go to the plugins that declare their types.
//                Where the scene has nothing for a slot to do and no such plugin is installed, the slot stays empty.
//   steps        Duration/TimeStep rounded when within 1e-9 (or rounding's size) of a whole number, else rounded up
//                with a shorter last step.
#pragma once

#include <optional>

#include "gravitas/scene/v1/scene.pb.h"
#include "kernel/description.h"
#include "services/catalog/catalog.h"
#include "services/scene/problem.h"

namespace gravitas::scene {

// Builds the environment of a scene that was read (and overridden) without errors. Libraries that
// the scene names are added to the catalogue. Returns nothing if there was an error. `threads` and
// `events` of the description are the caller's to set.
std::optional<kernel::EnvironmentDescription> build(const v1::Scene& scene, Catalog* catalog, Problems* problems);

}  // namespace gravitas::scene
