// What a command line says about exchanging plugins while the simulation runs.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "kernel/environment.h"
#include "services/catalog/catalog.h"

namespace gravitas {

// `SLOT=PLUGIN@step=N[,hosting=direct|shm|grpc]`: before step N, PLUGIN (a name, or the path of a library) takes over.
struct SwapSpec {
  std::string text;  // as it was given
  Slot slot = Slot::kSolver;
  std::string plugin;
  std::uint32_t step = 0;
  std::optional<kernel::Hosting> hosting;
};

// Throws BadInput with what is wrong and what is allowed.
SwapSpec parse_swap(const std::string& text);
// The same in an order to a run that goes on: without `@step=N` before the next step, which is 0 here.
SwapSpec parse_swap_order(const std::string& text);
// `SLOT=PLUGIN[,hosting=…]`: it is asked the same as the slot's plugin, and compared.
SwapSpec parse_compare(const std::string& option, const std::string& text);

struct RerunSpec {
  Slot slot = Slot::kSolver;
  std::uint32_t every = 1;  // steps
};
// `SLOT=N`.
RerunSpec parse_rerun(const std::string& text);
// Throws BadInput if the plan leaves the slot out.
void require_rerun(const RerunSpec& spec, const kernel::Environment& environment);

// The plugin with the settings that the scene gives it, if it is the scene's own, else with their defaults. Throws
// BadInput if there is none of that name.
kernel::SwapOrder resolve_swap(const SwapSpec& spec, const kernel::EnvironmentDescription& scene, Catalog* catalog);

// The same plugin, perhaps of another build, whose properties have the same names in the same order: settings of one are such
// of the other.
bool has_same_properties(const PluginDeclaration& one, const PluginDeclaration& other);

// Bit for bit: absent ones are NaN.
bool have_same_settings(const kernel::PluginChoice& one, const kernel::PluginChoice& other);

// "space" …; throws BadInput with `option` and `text` before it.
Slot parse_slot(const std::string& option, const std::string& text, const std::string& name);
kernel::Hosting parse_hosting_mode(const std::string& option, const std::string& text, const std::string& mode);

}  // namespace gravitas
