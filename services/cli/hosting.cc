#include "services/cli/hosting.h"

#include <fmt/format.h>

namespace gravitas::cli {
namespace {

constexpr Slot kSlots[] = {Slot::kSpace, Slot::kCollision, Slot::kConstraint,
                           Slot::kForce, Slot::kSolver,    Slot::kIntegrator};

kernel::Hosting parse_mode(const std::string& word, const std::string& mode) {
  if (mode == "direct") return kernel::Hosting::kDirect;
  if (mode == "shm") return kernel::Hosting::kSharedMemory;
  if (mode.starts_with("grpc"))
    throw BadInput(fmt::format("--hosting {}: 'grpc' is not supported by this version; allowed: direct, shm", word));
  throw BadInput(fmt::format("--hosting {}: unknown mode '{}'; allowed: direct, shm", word, mode));
}

}  // namespace

std::vector<HostingChoice> parse_hosting(const std::vector<std::string>& words) {
  std::vector<HostingChoice> choices;
  for (const std::string& word : words) {
    const std::size_t equals = word.find('=');
    if (equals == std::string::npos) {
      choices.push_back({std::nullopt, parse_mode(word, word)});
      continue;
    }
    const std::string name = word.substr(0, equals);
    std::optional<Slot> found;
    for (const Slot slot : kSlots)
      if (name == slot_name(slot)) found = slot;
    if (!found)
      throw BadInput(
          fmt::format("--hosting {}: unknown slot '{}'; allowed: space, collision, constraint, force, solver, "
                      "integrator",
                      word, name));
    choices.push_back({found, parse_mode(word, word.substr(equals + 1))});
  }
  return choices;
}

}  // namespace gravitas::cli
