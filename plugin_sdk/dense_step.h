// For authors of explicit integrators with error control: dense output. What an inner step says of every time within it, so
// that it may be longer than the steps that the kernel asks for, and is kept from one to the next.
//
// Of the stages k_j of an inner step from (x0, q0, v0, w0) at t0 over H, with theta = (t - t0)/H and weights b_j of its end,
//
//   y(theta) = y0 + theta c_1 + theta (1-theta) c_2 + theta^2 (1-theta) c_3 + theta^2 (1-theta)^2 c_4
//   c_1 = H sum b_j k_j,   c_2 = H k_1 - c_1,   c_3 = c_1 - H k_last - c_2,   c_4 = H sum d_j k_j
//
// where y is the position, the rotation vector from q0, and the velocities; of a body with damping d what they deviate from the
// motion under the accelerations of the start by (motion_stages.h), velocities freed of damping, e^(d (t-t0)) v. It goes
// through both ends with the slopes there; d_j are of the method. Source: Hairer, Norsett, Wanner, Solving ODEs I (1993), II.6.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "plugin_sdk/motion_stages.h"

namespace gravitas {

class DenseStep {
 public:
  // Of the stages of an accepted inner step over `length`, all evaluated, the last one at its end; from its start.
  // Precondition: damping * length is no more than some units (its inverse factor grows as e^(d H)).
  void assign(const stage::IntegratorIntegrateRequest& request, const MotionStages<GroupChart>& stages,
              std::span<const double> weights, std::span<const double> dense_weights, std::span<const double> nodes,
              double length);

  // In plugin_state, behind `first` numbers of the plugin's own: true if there is one and it has been going on until now,
  // that is where it was left at the request's time and nothing has changed a body since.
  bool load(const stage::IntegratorIntegrateRequest& request, std::size_t first);
  static std::size_t size(std::size_t bodies) { return kHead + kNumbers * bodies; }
  // Where it is left off at `time`. `out` has size() numbers.
  void save(double time, std::span<double> out) const;

  double length() const { return length_; }
  // s to its end, from where it was loaded or assigned.
  double left() const { return length_ - elapsed_; }
  void go_on(double time_step) { elapsed_ += time_step; }

  // State of a movable body, and its rates of change without damping (m/s^2, rad/s^2), s further on.
  BodyState at(std::size_t body, double damping, double ahead) const;
  Acceleration acceleration(std::size_t body, double damping, double ahead) const;

 private:
  // elapsed, length, time; of a body: position, orientation, velocities and accelerations at its start, then c_1 to c_4
  static constexpr std::size_t kHead = 3, kStart = 19, kCoefficient = 12, kNumbers = kStart + 4 * kCoefficient;

  // sum of weights times one of position, rotation vector, linear or angular velocity's coefficients
  Vector3 sum(std::size_t body, std::size_t part, const std::array<double, 4>& weights) const;
  Vector3 start(std::size_t body, std::size_t place) const;
  DampedMotion known_motion(std::size_t body, double damping, double passed) const;

  double elapsed_ = 0.0, length_ = 0.0;
  std::vector<double> numbers_;
};

}  // namespace gravitas
