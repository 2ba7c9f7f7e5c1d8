#include "services/recorder/decision.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <stdexcept>

#include "plugin_sdk/channel/address.h"
#include "plugin_sdk/property_value.h"
#include "plugin_sdk/slots.h"

namespace gravitas {
namespace {

std::optional<kernel::Hosting> find_hosting(const std::string& name) {
  for (const auto hosting : {kernel::Hosting::kDirect, kernel::Hosting::kSharedMemory, kernel::Hosting::kGrpc})
    if (name == kernel::hosting_name(hosting)) return hosting;
  return std::nullopt;
}

}  // namespace

recorder::v1::Decision message_of(const kernel::Decision& decision) {
  recorder::v1::Decision message =
      message_of({decision.slot, *decision.plugin, decision.host->hosting, decision.step}, decision.why);
  message.set_target(decision.target);
  return message;
}

recorder::v1::Decision message_of(const kernel::SwapOrder& order, const std::string& why) {
  recorder::v1::Decision message;
  message.set_step(order.step);
  message.set_slot(slot_name(order.slot));
  message.set_why(why);
  message.set_plugin(order.plugin.declaration.name);
  message.set_library(order.plugin.library);
  message.set_command(order.plugin.command);
  message.set_address(order.plugin.address);
  message.mutable_settings()->Add(order.plugin.settings.begin(), order.plugin.settings.end());
  if (order.hosting) message.set_hosting(kernel::hosting_name(*order.hosting));
  return message;
}

bool is_swap(const recorder::v1::Decision& decision) { return decision.why() == "swap"; }

bool settle(recorder::v1::Decision* decision) {
  decision->clear_before();
  const bool was_swap = is_swap(*decision);
  if (was_swap) decision->set_why("settled swap");
  return was_swap;
}

void put_in_force(const recorder::v1::Decision& decision, std::vector<recorder::v1::Decision>* in_force) {
  recorder::v1::Decision kept = decision;
  std::erase_if(*in_force, [&](recorder::v1::Decision& one) {
    if (one.slot() != decision.slot() || one.target() != decision.target()) return false;
    if (!is_swap(decision)) return true;
    // what is made again, in a step that was broken off, goes back to who was there before it
    const bool is_again = is_swap(one) && one.step() == decision.step() && one.plugin() == decision.plugin() &&
                          one.library() == decision.library();
    if (is_again && !one.has_before()) return true;
    *kept.mutable_before() = is_again ? one.before() : one;
    kept.mutable_before()->clear_before();
    return true;
  });
  in_force->push_back(std::move(kept));
}

kernel::SwapOrder order_of(const recorder::v1::Decision& decision, const Catalog& catalog) {
  const auto fail = [&](const std::string& why) {
    throw std::runtime_error(fmt::format("from step {} on plugin '{}' answered in slot '{}': {}", decision.step(),
                                         decision.plugin(), decision.slot(), why));
  };
  const std::optional<Slot> slot = find_slot(decision.slot());
  const std::optional<kernel::Hosting> hosting = find_hosting(decision.hosting());
  if (!slot) fail("there is no such slot");
  if (!hosting) fail(fmt::format("there is no hosting '{}'", decision.hosting()));
  if (!decision.address().empty() && !channel::is_local_address(decision.address()))
    fail(fmt::format("'{}' is no address of this machine", decision.address()));
  const auto plugin = std::ranges::find_if(catalog.plugins(), [&](const InstalledPlugin& one) {
    return one.library == decision.library() && one.command == decision.command();
  });
  if (plugin == catalog.plugins().end())
    fail(fmt::format("'{}' is neither installed nor named by the scene or the command line",
                     decision.command().empty() ? decision.library() : decision.command()));
  if (plugin->declaration.name != decision.plugin())
    fail(fmt::format("'{}' is now plugin '{}'", decision.library(), plugin->declaration.name));
  kernel::SwapOrder order;
  order.slot = *slot;
  order.hosting = hosting;
  order.step = decision.step();
  order.plugin = {plugin->declaration, plugin->library, {}, plugin->command, decision.address()};
  order.plugin.settings.assign(decision.settings().begin(), decision.settings().end());
  const std::string problem = check_flattened(plugin->declaration.properties, order.plugin.settings);
  if (!problem.empty()) fail(problem);
  return order;
}

kernel::SwapOrder ordered_swap(recorder::v1::Decision order, const Catalog& catalog) {
  const bool stays = order.hosting().empty();
  if (stays) order.set_hosting(kernel::hosting_name(kernel::Hosting::kDirect));
  kernel::SwapOrder swap = order_of(order, catalog);
  if (stays) swap.hosting.reset();
  return swap;
}

void put_in_place(std::span<const recorder::v1::Decision> decisions, const Catalog& catalog,
                  kernel::EnvironmentDescription* begun) {
  for (const recorder::v1::Decision& decision : decisions) {
    const kernel::SwapOrder order = order_of(decision, catalog);
    kernel::SlotDescription& slot = begun->slot(order.slot);
    if (decision.target() >= slot.plugins.size()) throw std::runtime_error("it names a plugin that the slot lacks");
    kernel::PluginChoice& plugin = slot.plugins[decision.target()];
    const auto fallback = plugin.fallback;
    plugin = order.plugin;
    // none follows the one that took over
    if (fallback && !is_same_plugin(*fallback, plugin)) plugin.fallback = fallback;
    if (slot.is_hosted_as(plugin)) slot.hosting = *order.hosting;
  }
}

void take_back_swaps(std::span<const recorder::v1::Decision> decisions, const Catalog& catalog,
                     const kernel::EnvironmentDescription& scene, kernel::EnvironmentDescription* begun) {
  for (const recorder::v1::Decision& decision : decisions) {
    if (!is_swap(decision)) continue;
    const Slot slot = *find_slot(decision.slot());
    begun->slot(slot).plugins[decision.target()] = scene.slot(slot).plugins[decision.target()];
    begun->slot(slot).hosting = scene.slot(slot).hosting;
    if (decision.has_before()) put_in_place(std::span(&decision.before(), 1), catalog, begun);
  }
}

std::vector<kernel::SwapOrder> past_swaps(std::span<const recorder::v1::Decision> decisions, const Catalog& catalog,
                                          const kernel::EnvironmentDescription& answering) {
  std::vector<kernel::SwapOrder> orders;
  for (const recorder::v1::Decision& decision : decisions) {
    if (!is_swap(decision)) continue;
    orders.push_back(order_of(decision, catalog));
    if (!orders.back().plugin.is_elsewhere()) orders.back().hosting = answering.slot(orders.back().slot).hosting;
  }
  return orders;
}

}  // namespace gravitas
