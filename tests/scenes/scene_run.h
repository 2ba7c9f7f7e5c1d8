// A scene that runs inside the test: what the tests of motion share.
//
//   SceneRun run("bounce.gravitas", {set("Simulator.TimeStep", 1e-3)});
//   run.to_end();
//   EXPECT_NEAR(run.body("Ball").pose.position.y(), 0.5, 1e-9);
//
// The way is that of `gravitas run`: files or text, overrides, gravitas::load(), gravitas::start(). All plugins are
// hosted directly, so that a run of a thousand steps takes milliseconds; tests/determinism shows that the hosting
// changes no bit.
#pragma once

#include <cstdint>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "kernel/environment.h"
#include "plugin_sdk/dynamics.h"
#include "services/events/event_source.h"
#include "services/run/figures.h"
#include "services/run/session.h"

namespace gravitas {

inline constexpr double kG = 9.81;  // m/s^2
inline constexpr double kPi = std::numbers::pi;

}  // namespace gravitas

namespace gravitas::harness {

// One override, "PATH=VALUE", with numbers that are read back bit for bit.
std::string set(const std::string& path, double value);
std::string set(const std::string& path, const Vector3& value);
std::string set(const std::string& path, const Quaternion& value);
std::string set(const std::string& path, const std::string& value);

// A number or vector as a scene writes it, bit for bit.
std::string literal(double value);
std::string literal(const Vector3& value);
std::string literal(const Quaternion& value);

// Rotation by `angle` (rad) about an axis.
Quaternion turned(const Vector3& axis, double angle);

// Angle (rad, 0 … pi) of the rotation between two attitudes.
double angle_between(const Quaternion& a, const Quaternion& b);

class SceneRun final : private EventListener {
 public:
  // `scene` is a file of tests/scenes/, a path, or the text of a scene (it has a brace). Throws BadInput.
  explicit SceneRun(const std::string& scene, std::vector<std::string> overrides = {});
  SceneRun(const SceneRun&) = delete;
  SceneRun& operator=(const SceneRun&) = delete;

  // Throws std::runtime_error with the reason if the environment pauses.
  void step();
  void steps(std::uint32_t count);
  void to_end();

  double time() const { return environment_->time(); }
  double time_step() const { return environment_->time_step(); }
  std::uint32_t step_count() const { return environment_->step_count(); }
  bool is_done() const { return environment_->step_count() == environment_->total_steps(); }

  // A body's centre of mass in principal axes: pose and velocities, world.
  struct Motion {
    Pose pose;
    Twist twist;
  };
  Motion body(const std::string& id) const;
  double mass(const std::string& id) const;      // kg
  Vector3 moments(const std::string& id) const;  // principal, kg m^2
  std::vector<std::string> movable_bodies() const;
  bool holds(const std::string& joint) const;

  // Of all movable bodies; angular momentum about the origin.
  double kinetic_energy() const;
  double energy() const { return kinetic_energy() + environment_->potential_energy(); }
  Vector3 momentum() const;
  Vector3 angular_momentum() const;

  // As --swap has it: "solver=Newton@step=40".
  void order_swap(const std::string& order);

  // What `gravitas run` would report so far.
  const report::v1::Report& report();
  const std::vector<Event>& events() const { return events_; }
  std::uint32_t count_events(EventKind kind) const;
  const std::vector<std::string>& warnings() const { return warnings_; }
  kernel::Environment& environment() { return *environment_; }
  const kernel::Environment& environment() const { return *environment_; }
  const kernel::EnvironmentDescription& description() const { return description_; }

 private:
  void on_event(const Event& event) override { events_.push_back(event); }
  std::uint32_t row(const std::string& id) const;
  Motion motion(std::uint32_t body) const;
  // beside those that a run looks for unless it is told otherwise: limits that are met
  static EventKinds kinds() {
    EventKinds all = default_event_kinds();
    all.add(EventKind::kLimitStart);
    return all;
  }

  std::vector<std::string> warnings_;
  Catalog catalog_;
  kernel::EnvironmentDescription description_;
  std::unique_ptr<kernel::Environment> environment_;
  std::unique_ptr<Figures> figures_;
  std::vector<Event> events_;
  EventSource source_{this, kinds()};
  report::v1::Report report_;
};

}  // namespace gravitas::harness
