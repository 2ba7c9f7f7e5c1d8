// Chains of narrow cones that whip: stops close and open a thousand times within a step, and what a trial of a whole step holds,
// it has long left.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::literal;
using harness::SceneRun;

// Links of 0.2 m and 0.2 kg in a row from the world on, which turn about its end as one at `speed` (rad/s), and fall.
std::string whip(int links, double cone, double speed, const Vector3& moments) {
  std::string bodies, joints;
  for (int i = 0; i < links; ++i) {
    const double middle = 0.1 + 0.2 * i;
    bodies += "Body { Id = \"L" + std::to_string(i) + "\" Mass = 0.2 PrincipalMoments = " + literal(moments) +
              " Forces = {\"G\"} KineticProperties { Position = " + literal(Vector3(middle, 0, 0)) +
              " LinearVelocity = " + literal(Vector3(0, 0, -speed * middle)) +
              " AngularVelocity = " + literal(Vector3(0, speed, 0)) + " } }\n";
    joints += "Constraint { Type = \"Spherical\" Id = \"J" + std::to_string(i) + "\" Body1 = \"" +
              (i == 0 ? "" : "L" + std::to_string(i - 1)) + "\" Body2 = \"L" + std::to_string(i) +
              "\" CustomProperties { BindPoint = " + literal(Vector3(0.2 * i, 0, 0)) +
              " Axis = {1, 0, 0} ReachConeAngle = " + literal(cone) + " } }\n";
  }
  return "Forces { Force { Type = \"Gravity\" Id = \"G\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
         "Simulator { Type = \"Smooth\" CustomProperties { TimeStep = 0.0333333333333333 Duration = 0.1 } }\n"
         "Environment { Space { Bodies {\n" +
         bodies + "} }\nConstraints {\n" + joints +
         "}\nKineticIntegrator { Type = \"DormandPrince54\" } ConstraintSolver { Type = \"Newton\" } }\n";
}

// The trial of the whole step ran away to a thousand times the speeds, where no Accuracy can be met: the run paused in its first
// steps. A link bends by no more than its cone, and stops only take energy.
TEST(WhippingChain, GoesOnAtALongStep) {
  const Vector3 rod(8e-5, 7.5e-4, 7.5e-4), ball = Vector3::Constant(7e-4);
  struct Chain {
    int links;
    double cone, speed;
    Vector3 moments;
  };
  for (const Chain& chain : {Chain{3, 0.05, 10.0, ball}, Chain{4, 0.2, 10.0, rod}}) {
    SceneRun run(whip(chain.links, chain.cone, chain.speed, chain.moments));
    double before = run.energy();
    const double start = before;
    while (!run.is_done()) {
      run.step();
      EXPECT_LE(run.energy(), before + 1e-6 * start) << chain.links << ' ' << run.time();
      before = run.energy();
      Vector3 last = Vector3::UnitX();
      for (int i = 0; i < chain.links; ++i) {
        const Vector3 axis = run.body("L" + std::to_string(i)).pose.orientation * Vector3::UnitX();
        EXPECT_LE(std::acos(std::min(axis.dot(last), 1.0)), chain.cone + 1e-5) << chain.links << ' ' << run.time();
        last = axis;
      }
    }
    EXPECT_LE(run.report().max_joint_error(), 1e-9) << chain.links;
    EXPECT_EQ(run.report().faults_size(), 0) << "an answer that less of the step can be made is no fault";
  }
}

}  // namespace
}  // namespace gravitas
