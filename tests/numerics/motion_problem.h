// Problems of motion with known answers, as worlds made by hand, and the methods that are measured on them.
#pragma once

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "kernel/environment.h"
#include "tests/kernel/world_builder.h"

namespace gravitas::harness {

// An integrator as it is shown and started.
struct MotionMethod {
  std::string name;     // "SymplecticSplitting 4"
  std::string library;  // "integrator_symplectic_splitting"
  std::vector<double> settings;
  double order = 0.0;  // of its theory, on smooth problems
};

// All shipped integrators; adaptive ones at an accuracy.
std::vector<MotionMethod> fixed_step_methods();
std::vector<MotionMethod> adaptive_methods(double accuracy);

struct MotionProblem {
  std::string name;
  double duration;  // s
  bool is_jointed;
  WorldBuilder world;  // without integrator, steps
  // Distance of a final state from the known one, relative to the problem's size.
  std::function<double(const kernel::StateView&)> error;
};

MotionProblem tumbling_box();                    // PROBLEMS' torque-free box: attitude
MotionProblem spring_and_spin();                 // a mass on a spring, with rotation: position, attitude
MotionProblem point_pendulum();                  // on a rod, a quarter swing from rest
MotionProblem spherical_pendulum();              // on a rod
MotionProblem double_pendulum();                 // two hinged rods
MotionProblem heavy_top();                       // about a fixed point
MotionProblem four_bar(double duration = 10.0);  // 10 or 20 s of the N-four-bar of two loops: singular, redundant
MotionProblem mujoco_box();                      // a free box: attitude
MotionProblem symmetric_rotor();                 // J/I = 0.2: attitude, in closed form
MotionProblem lagrange_top();                    // fast, tilted, without precession at the start: axis
MotionProblem bricard();           // five rods, six hinges, over-constrained: no reference, it keeps its energy
MotionProblem triple_pendulum();   // three links of 0.3 m: no reference, it keeps its energy
MotionProblem squeezer();          // Andrews' seven bodies, to 0.03 s: attitudes
MotionProblem sprung_wheel();      // an Axle's damped spring on a turning arm: position, in closed form
MotionProblem steered_wheel();     // an Axle's, that rolls and steers at once: attitude, in closed form
MotionProblem flyball_governor();  // stiff: height of the slider

// A spring on the last body, from a point of it (its principal axes) to a point of another body, or of the world (kNone).
struct SpringValues {
  double stiffness = 0.0, damping = 0.0, rest_length = 0.0;  // N/m, N s/m, m
};
void spring_between(WorldBuilder* world, const SpringValues& spring, const Vector3& attachment,
                    std::uint32_t anchor_body, const Vector3& anchor);

// Kinetic energy and what forces report as potential, J; angular momentum about the origin, kg m^2/s.
double energy_of(kernel::Environment* environment);
Vector3 angular_momentum_of(const kernel::Environment& environment);

// What a run came to.
struct MotionResult {
  double error = 0.0;
  double joint_error = 0.0;     // largest at a committed step, m
  double energy_error = 0.0;    // largest change at a committed step, J
  double momentum_error = 0.0;  // of the angular momentum about the origin, largest change, kg m^2/s
  double seconds = 0.0;         // of the steps, CPU
  std::uint64_t derivatives = 0;
};

// Runs with steps of duration/steps. Jointed problems: with the simulator and solver Direct. Throws std::runtime_error
// with the fault where the run pauses, and where it takes more than most_seconds of CPU.
MotionResult run_motion(const MotionProblem& problem, const MotionMethod& method, std::uint32_t steps,
                        kernel::Simulator simulator = kernel::Simulator::kSmooth, double most_seconds = HUGE_VAL);

}  // namespace gravitas::harness
