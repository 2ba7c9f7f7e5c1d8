// Checkpoint and journal files. A checkpoint's checksum keeps most bytes out, so the bytes are also taken as the message
// inside, and what an environment makes of it is tried.
#include <memory>
#include <string>

#include "kernel/environment.h"
#include "services/recorder/checkpoint.h"
#include "services/recorder/journal.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/kernel/world_builder.h"

namespace gravitas::fuzz {
namespace {

kernel::EnvironmentDescription small_world() {
  harness::WorldBuilder builder(kernel::Hosting::kDirect);
  builder.steps(100, 0.01).ground().sphere(0.5, 1.0, Vector3(0, 0.5, 0)).sphere(0.5, 1.0, Vector3(3, 0.5, 0));
  return builder.gravity(Vector3(0, -10, 0)).description();
}

// An accepted state is one from which the environment can go on, or pause with a reason.
void try_to_restore(recorder::v1::Checkpoint* checkpoint) {
  static const kernel::EnvironmentDescription description = small_world();
  static std::unique_ptr<kernel::Environment> world = std::make_unique<kernel::Environment>(description);
  if (!world->restore(saved_state_of(checkpoint)).empty()) {
    require(world->step_count() == 0, "a refused state changes nothing");
    return;
  }
  if (world->step_count() < world->total_steps() && world->step() == kernel::StepOutcome::kPaused)
    require(world->fault().has_value() && !world->fault()->fault.text().empty(), "a pause has a reason");
  world = std::make_unique<kernel::Environment>(description);
}

}  // namespace

void checkpoint(std::span<const std::byte> bytes) {
  std::string problem;
  if (auto read = parse_checkpoint(bytes, &problem)) {
    require(serialize_checkpoint(*read).size() > 0, "what was read can be written");
    try_to_restore(&*read);
  } else {
    require(!problem.empty(), "a refused file has a reason");
  }
  recorder::v1::Checkpoint inside;
  if (inside.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
    static_cast<void>(find_obstacle(inside, recorder::v1::Identity()));
    try_to_restore(&inside);
  }
  const JournalReading journal = read_journal(bytes, Hash(), 0);
  require(journal.end <= bytes.size(), "a journal ends within its file");
}

}  // namespace gravitas::fuzz
