// Requests that nobody may be asked again are kept as capsules.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <stdexcept>

#include "plugin_sdk/shell_word.h"
#include "plugin_sdk/slots.h"
#include "services/capsule/capsule.h"
#include "services/run/session.h"

namespace gravitas {

recorder::v1::CapsuleHeader capsule_header(const RunOptions& options, Slot slot) {
  recorder::v1::CapsuleHeader header;
  header.set_build(GRAVITAS_BUILD_ID);
  header.set_scene(fmt::format("{}", fmt::join(options.scenes, " ")));
  header.set_slot(slot_name(slot));
  header.set_threads(options.threads);
  return header;
}

std::string keep_poisoned_call(const RunOptions& options, std::uint32_t step, const kernel::PoisonedCall& poisoned) {
  recorder::v1::CapsuleHeader header = capsule_header(options, poisoned.plugin.declaration.slot);
  header.set_poison(true);
  recorder::v1::CapsuleCall call = capsule::begin_call(poisoned.call, poisoned.arena);
  call.set_step(step);
  call.set_fault(poisoned.fault.text());
  call.set_breaks_law(poisoned.fault.kind == kernel::FaultKind::kBadPhysics);
  const std::string path = fmt::format("{}.{}.step{}.capsule", std::filesystem::path(options.scenes[0]).stem().string(),
                                       header.slot(), step);
  try {
    capsule::Writer writer(path, header);
    writer.add_plugin(poisoned.plugin);
    writer.add_call(call);
    writer.close();
    return fmt::format(
        "slot {}, plugin {}: the request that it fails at in step {} is kept; to ask it alone: gravitas replay {}",
        header.slot(), poisoned.plugin.declaration.name, step, shell_word(path));
  } catch (const std::runtime_error& problem) {
    return fmt::format("the request that plugin {} fails at in step {} could not be kept: {}",
                       poisoned.plugin.declaration.name, step, problem.what());
  }
}

}  // namespace gravitas
