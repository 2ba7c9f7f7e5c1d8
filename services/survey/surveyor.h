// Questions about the committed state of an environment, put to its plugins between two steps, beside the run: the
// state is read and never written, and the plugins are asked in hosts of their own (asked_slot.h). So a run with
// questions has the bits of one without, a scene whose plan left a slot out can be asked all the same, and where
// nobody asks there is neither process nor column nor call.
//
// The plugins are those that answer in the run: after a swap the new one (follow()). What cannot be answered throws
// NoAnswer with the reason: a missing capability, a plugin that failed more often than its ladder bears.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "kernel/environment.h"
#include "services/survey/asked_slot.h"

namespace gravitas::survey {

struct Contact {
  std::uint32_t a = 0, b = 0, feature = 0;
  Vector3 normal = Vector3::UnitY();  // unit, from a to b
  Vector3 point = Vector3::Zero();    // midway between the surface points, m
  double depth = 0.0;                 // m, > 0: overlap
};

// A point of a joint that holds.
struct Anchor {
  std::uint32_t joint = 0;
  Vector3 point1 = Vector3::Zero(), point2 = Vector3::Zero();  // on either body, m
  double error = 0.0;                                          // along the axes that are held, m
};

struct AppliedForce {
  std::uint32_t force = 0, body = 0;
  Wrench wrench;  // about the centre of mass
};

// Of a joint that holds, by the name that its type declares.
struct JointCoordinate {
  std::uint32_t joint = 0;
  std::string name;
  double value = 0.0;  // m or rad
  double rate = 0.0;   // m/s or rad/s
};

class Surveyor {
 public:
  // `description`: that of the environments to come, as it was before the plan left anything out.
  explicit Surveyor(const kernel::EnvironmentDescription& description,
                    const kernel::HostStarter& starter = kernel::start_host);

  // A plugin was exchanged in the run.
  void follow(const kernel::Decision& decision);

  const kernel::EnvironmentDescription& description() const { return description_; }
  AskedSlot& slot(Slot which);
  // Throws NoAnswer unless the slot has a plugin and it declares the capability; `what` it would be for.
  void require(Slot which, const char* capability, const char* what);

  // Contacts of all pairs that may touch, by (a, b, feature), up to the run's margin apart.
  std::vector<Contact> contacts(const kernel::Environment& environment);
  // Linear points alone: an angular error has no place.
  std::vector<Anchor> anchors(const kernel::Environment& environment);
  // By joint, as their types declare them; joints whose plugins offer none have none. `missing` gets why some could not be had.
  std::vector<JointCoordinate> coordinates(const kernel::Environment& environment, std::vector<std::string>* missing);
  std::vector<AppliedForce> forces(const kernel::Environment& environment);

  // A request with every column filled that says something about shapes and bodies; `margin` (m) widens their bounds.
  MessageColumns request(stage::Method method, const kernel::Environment& environment, double margin = 0.0) const;
  MessageColumns ask(stage::Method method, const MessageColumns& request, const AskedSlot::Check& check = {}) {
    return slot(slot_of(method)).ask(method, 0, request, check);
  }

 private:
  static Slot slot_of(stage::Method method);
  // With the joints of a group.
  MessageColumns request(stage::Method method, const kernel::Environment& environment,
                         const kernel::ConstraintGroup& group) const;

  const kernel::EnvironmentDescription description_;
  std::array<std::unique_ptr<AskedSlot>, 6> slots_;  // by Slot
};

// World bounds of a body, wider by `margin` on all sides.
Bounds bounds_of(const kernel::Environment& environment, std::uint32_t body, double margin = 0.0);
Pose pose_of(const kernel::Environment& environment, std::uint32_t body);
// Of its geometry's frame.
Pose placed(const kernel::Environment& environment, std::uint32_t body);
// Of a contact request's reply: rows that are none, out of order or twice.
AskedSlot::Check contact_check(const MessageColumns& request);

}  // namespace gravitas::survey
