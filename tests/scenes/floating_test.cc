// What floats and bobs keeps its energy, whatever its shape.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::literal;
using harness::SceneRun;
using harness::set;

// Let go askew, half in the air, by a method of high order: rocks and bobs without end.
TEST(FloatingRounds, KeepTheirEnergy) {
  for (const char* shape : {"Capsule", "Cylinder"}) {
    SceneRun run(
        std::string("Geometries { Geometry { Type = \"") + shape +
            "\" Id = \"Buoy\" CustomProperties { Radius = 0.3 Height = 1.2 } } }\n"
            "Forces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } }\n"
            "Force { Type = \"Buoyancy\" Id = \"Water\" CustomProperties { FluidDensity = 1000 FluidLevel = 0 } } }\n"
            "Simulator { CustomProperties { TimeStep = 0.01 Duration = 5 SleepEnergy = 0 } }\n"
            "Environment { Space { Bodies { Body { Id = \"Buoy\" GeometryId = \"Buoy\" Mass = 200 "
            "Forces = { \"Down\", \"Water\" } KineticProperties { Position = {0, 0.2, 0} Orientation = " +
            literal(harness::turned(Vector3(1, 0, 0.3).normalized(), 1.1)) + " } } } } }\n",
        {"Integrator=DormandPrince853"});
    const double start = run.energy();
    double kinetic = 0.0, drift = 0.0;
    while (!run.is_done()) {
      run.step();
      kinetic = std::fmax(kinetic, run.kinetic_energy());
      drift = std::fmax(drift, std::fabs(run.energy() - start));
    }
    EXPECT_GT(kinetic, 50.0) << shape;
    EXPECT_LE(drift, 1e-8 * kinetic) << shape;
  }
}

}  // namespace
}  // namespace gravitas
