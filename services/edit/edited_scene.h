// What an edit makes of the scene of a run, and how the run goes on in it: another environment, with processes of its own,
// takes over the state at a step boundary.
//
//   EditedScene next(options, scene, before, catalog, &edit, &now);      throws BadInput, and nothing has changed
//   Successor successor = next.succeed(now, …);                          new processes; throws BadInput. The state, its hash
//                                                                        chain with the edit in it, and swaps that were made
//
// A body, joint, force … that keeps its id goes on: a body where it is and as fast as it is, also where its centre of mass
// or principal axes become others, but for what the edit sets of Position, Orientation (of its geometry's frame),
// LinearVelocity (of its centre of mass) and AngularVelocity; a joint bound as it was, and broken if it was. Who is
// added is as the scene's text says, a joint bound where the bodies are now, a force as of now; one that was removed and
// added again is new. Forces that act once act at t = 0: they cannot be added later. An edit wakes whom it disturbs
// (disturbance.h), lets integrators begin their histories again, and keeps the memory of contacts between bodies that
// were not moved and have the same shapes. All other collisions end with it.
//
// The chain goes on as hash(hash(chain, digest of the changes), next state): a run that makes the same edits before the same
// steps has the same chain, in any hosting, resumed or not.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "gravitas/edit/v1/edit.pb.h"
#include "gravitas/recorder/v1/checkpoint.pb.h"
#include "gravitas/scene/v1/scene.pb.h"
#include "kernel/environment.h"
#include "services/run/session.h"
#include "services/scene/change.h"

namespace gravitas {

class EditedScene {
 public:
  // `before` is the description of `scene`, with all earlier edits. Where bodies are is `now`'s to say, and is written into
  // the edit; with null it stands there since the edit was first made (and where it does not, as for a rehearsal, bodies
  // are where the scene has them).
  EditedScene(const RunOptions& options, const scene::v1::Scene& scene, const kernel::EnvironmentDescription& before,
              Catalog* catalog, edit::v1::Edit* edit, const kernel::Environment* now);

  const scene::v1::Scene& scene() const { return scene_; }
  const kernel::EnvironmentDescription& description() const { return description_; }
  // Of scene and builder; of who answers before (`active`) and after (`begun`), once the state is handed over.
  const std::vector<std::string>& warnings() const { return warnings_; }
  void look_at_limits(const kernel::EnvironmentDescription& active, const kernel::Environment& now,
                      const kernel::EnvironmentDescription& begun, const kernel::Environment& next);

  struct Successor {
    std::unique_ptr<kernel::Environment> environment;
    std::vector<std::array<std::uint32_t, 2>> parted;  // bodies (rows of before) whose collision ends with the edit
    std::vector<kernel::SwapRecord> settled;           // swaps whose probation ends with it, and why
  };
  // The environment in which `now` goes on. `answering`: who answers in it. Swaps among the `decisions` in force, which become
  // those of description(), are made again there, as where a run is resumed: it knows then what a failure goes back to.
  // Where they cannot be, they are settled, and warned of. Throws BadInput that names the edit; std::logic_error if the
  // state is not taken.
  Successor succeed(const kernel::Environment& now, const kernel::EnvironmentDescription& answering,
                    const Catalog& catalog, const kernel::HostStarter& starter,
                    std::vector<recorder::v1::Decision>* decisions);

  // Bodies that slept in `now` and are awake in `next`, which has the state.
  std::vector<std::uint32_t> woken(const kernel::Environment& now, const kernel::Environment& next) const;

 private:
  std::string named(const std::string& problem) const;
  std::unique_ptr<kernel::Environment> start(const kernel::EnvironmentDescription& begun,
                                             const kernel::HostStarter& starter) const;
  // With the swaps made again.
  Successor succeed_with_swaps(const kernel::Environment& now, const kernel::EnvironmentDescription& answering,
                               const Catalog& catalog, const kernel::HostStarter& starter,
                               std::vector<recorder::v1::Decision>* decisions) const;
  // Returns the pairs that part.
  std::vector<std::array<std::uint32_t, 2>> hand_over(const kernel::Environment& now, kernel::Environment* next) const;
  void read_changes(const RunOptions& options, Catalog* catalog);
  void find_kept();
  void keep_stopped();
  // Of a body that went on in this pose: the pose of the centre of mass and principal axes that it has after the edit, while
  // its geometry stays.
  Pose recentred(const Pose& pose, std::uint32_t body) const;
  // And where the edit has it.
  Pose moved(Pose pose, std::uint32_t body) const;
  void find_motions(const kernel::Environment& now);
  void write_places();
  // In which pose a joint that stays is bound to its body 1 or 2 (`end` 0 or 1).
  Pose kept_binding(std::size_t joint, std::size_t end) const;
  void place();
  void refuse_late_impulses() const;
  void warn_of_broken(const kernel::Environment& now);
  bool has_stopped(std::uint32_t body) const;
  // By row after: it was there before, and the edit lets it rest.
  std::vector<bool> resting_on(const kernel::SavedState& before) const;
  void keep_rest(const kernel::SavedState& before, std::span<std::uint32_t> rested, std::span<double> wrench) const;

  const scene::v1::Scene& first_;  // before the edit
  const kernel::EnvironmentDescription& before_;
  edit::v1::Edit& edit_;
  scene::v1::Scene scene_;
  kernel::EnvironmentDescription description_;
  std::vector<std::string> warnings_;
  scene::ChangeLog log_;
  std::vector<std::uint32_t> old_body_, old_joint_;  // row before, or kNone
  std::vector<Pose> pose_;                           // of the bodies as the run goes on
  std::vector<Twist> twist_;
};

// The slots of `next` get who answers now (`active`, whose rows are those of `before`) for the scene's own plugins.
void keep_who_answers(const kernel::EnvironmentDescription& before, const kernel::EnvironmentDescription& active,
                      kernel::EnvironmentDescription* next);

// Row of a slot's plugin after an edit, by its name; kNone if it is gone.
std::uint32_t row_after(const kernel::EnvironmentDescription& before, const kernel::EnvironmentDescription& next,
                        Slot slot, std::uint32_t row);

}  // namespace gravitas
