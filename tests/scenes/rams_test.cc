// A light head under a heavy ram that falls along a slanted guide, and jams there by its friction.
#include <gtest/gtest.h>

#include <string>

#include "plugin_sdk/conformance/draw.h"
#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using conformance::Draw;
using harness::literal;
using harness::SceneRun;

struct Ram {
  const char* shape;
  double mass, friction, restitution;
  Vector3 guide;
  bool is_hinged;  // within limits
};

std::string scene(const Ram& ram, const std::string& orientation, const char* solver, const char* simulator, double h) {
  const std::string shape = ram.shape == std::string("Box")      ? "HalfExtents = {0.2, 0.15, 0.25}"
                            : ram.shape == std::string("Sphere") ? "Radius = 0.2"
                                                                 : "Radius = 0.2 Height = 0.4";
  const std::string joint =
      ram.is_hinged
          ? "Revolute\" Id = \"Neck\" Body1 = \"Ram\" Body2 = \"Head\" CustomProperties { BindAxisPoint1 = {0, 0.6, "
            "0} BindAxisPoint2 = {0, 0.6, 1} LowerLimit = -0.3 UpperLimit = 0.3 }"
          : "Rigid\" Id = \"Neck\" Body1 = \"Ram\" Body2 = \"Head\"";
  return "Geometries { Geometry { Type = \"" + std::string(ram.shape) + "\" Id = \"Head\" CustomProperties { " + shape +
         " } } Geometry { Type = \"Halfspace\" Id = \"Ground\" CustomProperties { } } }\n"
         "Materials { Material { Id = \"M\" RestitutionCoefficient = " +
         literal(ram.restitution) + " StaticFrictionCoefficient = " + literal(ram.friction) +
         " } }\n"
         "Forces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
         "Simulator { Type = \"" +
         simulator + "\" CustomProperties { TimeStep = " + literal(h) +
         " Duration = 1 } }\n"
         "Environment { Space { Bodies {\n"
         "Body { Id = \"Head\" GeometryId = \"Head\" Material = \"M\" Mass = 1 Forces = { \"Down\" } KineticProperties "
         "{ "
         "Position = {0, 0.4, 0} Orientation = " +
         orientation +
         " } }\n"
         "Body { Id = \"Ram\" Mass = " +
         literal(ram.mass) +
         " PrincipalMoments = {1, 1, 1} Forces = { \"Down\" } KineticProperties { Position = {0, 1, 0} } }\n"
         "Body { Id = \"Ground\" GeometryId = \"Ground\" Material = \"M\" KineticProperties { Position = {0, -0.3, 0} "
         "} } } }\n"
         "Constraints { Constraint { Type = \"" +
         joint +
         " } Constraint { Type = \"Slider\" Id = \"Guide\" Body2 = \"Ram\" CustomProperties { BindPoint = {0, 1, 0} "
         "Axis = " +
         literal(ram.guide) + " } } }\nConstraintSolver = \"" + solver + "\" }\n";
}

// Friction of the impact alone would turn the head about several times. What its neck takes back of that was bounded like
// the recovery of bodies that are crushed: half of such rams opened by a metre in the step after, at rest.
TEST(Rams, StayClosedWhereFrictionHoldsThem) {
  Draw draw(1);
  const auto one_of = [&](auto first, auto second, auto third) {
    const double which = draw.uniform(0, 3);
    return which < 1 ? first : which < 2 ? second : third;
  };
  for (int i = 0; i < 30; ++i) {
    Ram ram;
    ram.shape = one_of("Box", "Sphere", "Cylinder");
    ram.mass = one_of(10.0, 50.0, 200.0);
    ram.friction = one_of(0.3, 0.5, 0.8);
    ram.restitution = one_of(0.0, 0.0, 0.3);
    ram.guide = Vector3(draw.uniform(-0.6, 0.6), 1, draw.uniform(-0.6, 0.6));
    ram.is_hinged = draw.uniform(0, 1) < 0.4;
    const Quaternion turn = draw.rotation();
    std::string orientation = "{" + literal(turn.w());
    for (const double x : {turn.x(), turn.y(), turn.z()}) orientation += ", " + literal(x);
    for (const char* solver : {"Newton", "Direct"})
      for (const char* simulator : {"Basic", "Continuous"}) {
        SceneRun run(scene(ram, orientation + "}", solver, simulator, 1.0 / 60));
        run.to_end();
        EXPECT_LE(run.report().max_joint_error(), 1e-8)
            << i << ' ' << ram.shape << ' ' << ram.mass << ' ' << solver << ' ' << simulator;
      }
  }
}

}  // namespace
}  // namespace gravitas
