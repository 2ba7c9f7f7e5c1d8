// Who answers in an edited scene: as before, and with the swaps that were made, which may be taken back there, too.
#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "plugin_sdk/slots.h"
#include "plugin_sdk/stand_in.h"
#include "services/edit/edited_scene.h"
#include "services/recorder/decision.h"
#include "services/run/kernel_names.h"

namespace gravitas {
namespace {

// Rows of who answers, in the slots of an edited scene; who served what is gone goes, too.
void translate_decisions(const kernel::EnvironmentDescription& before, const kernel::EnvironmentDescription& next,
                         std::vector<recorder::v1::Decision>* decisions) {
  std::erase_if(*decisions, [&](recorder::v1::Decision& decision) {
    const std::uint32_t target = row_after(before, next, *find_slot(decision.slot()), decision.target());
    decision.set_target(target);
    if (decision.has_before()) decision.mutable_before()->set_target(target);
    return target == kNone;
  });
}

// Types that an edit has added may be none of those that who answered before a swap serves.
void require_stand_ins(const kernel::EnvironmentDescription& scene, const kernel::EnvironmentDescription& begun,
                       const std::vector<recorder::v1::Decision>& decisions) {
  const auto require = [&](Slot slot, const auto& elements) {
    std::vector<std::string> types;
    for (const auto& one : elements) types.push_back(one.type);
    for (std::size_t row = 0; row < scene.slot(slot).plugins.size(); ++row) {
      const auto is_of_row = [&](const recorder::v1::Decision& one) {
        return is_swap(one) && one.slot() == slot_name(slot) && one.target() == row;
      };
      if (std::ranges::none_of(decisions, is_of_row)) continue;
      const PluginDeclaration& before = begun.slot(slot).plugins[row].declaration;
      const std::string why = why_no_stand_in(scene.slot(slot).plugins[row].declaration, before, types);
      if (!why.empty()) throw std::runtime_error(before.name + ": " + why);
    }
  };
  require(Slot::kForce, scene.forces);
  require(Slot::kConstraint, scene.constraints);
  require(Slot::kCollision, scene.shapes);
}

}  // namespace

EditedScene::Successor EditedScene::succeed_with_swaps(const kernel::Environment& now,
                                                       const kernel::EnvironmentDescription& answering,
                                                       const Catalog& catalog, const kernel::HostStarter& starter,
                                                       std::vector<recorder::v1::Decision>* decisions) const {
  kernel::EnvironmentDescription begun = answering;
  take_back_swaps(*decisions, catalog, description_, &begun);
  require_stand_ins(description_, begun, *decisions);
  const std::vector<kernel::SwapOrder> swaps = past_swaps(*decisions, catalog, answering);
  // else those of before may let their host go
  begun.asks_forces = std::ranges::find(swaps, Slot::kForce, &kernel::SwapOrder::slot) != swaps.end();
  Successor next{start(begun, starter), {}, {}};
  const std::vector<kernel::PlannedSlot> slots = next.environment->plan().slots;
  const auto is_left_out = [&](Slot slot) {
    return std::ranges::find(slots, slot, &kernel::PlannedSlot::slot) == slots.end();
  };
  for (const kernel::SwapOrder& order : swaps)
    if (!is_left_out(order.slot)) next.environment->order_swap(order);
  for (recorder::v1::Decision& decision : *decisions)
    if (is_left_out(*find_slot(decision.slot()))) settle(&decision);
  next.parted = hand_over(now, next.environment.get());
  for (const kernel::SwapRecord& swap : next.environment->swaps())
    if (swap.state == kernel::SwapState::kRefused || swap.state == kernel::SwapState::kRolledBack)
      throw std::runtime_error(swap.to + ": " + swap.reason);
  return next;
}

EditedScene::Successor EditedScene::succeed(const kernel::Environment& now,
                                            const kernel::EnvironmentDescription& answering, const Catalog& catalog,
                                            const kernel::HostStarter& starter,
                                            std::vector<recorder::v1::Decision>* decisions) {
  const std::vector<recorder::v1::Decision> known_before = *decisions;
  translate_decisions(before_, description_, decisions);
  Successor next;
  std::string why = "its slot has other plugins in the edited scene, or none";
  const auto go_on = [&] {
    next = {start(answering, starter), {}, {}};
    next.parted = hand_over(now, next.environment.get());
  };
  if (std::ranges::none_of(*decisions, is_swap)) {
    go_on();
  } else {
    try {
      next = succeed_with_swaps(now, answering, catalog, starter, decisions);
    } catch (const std::exception& problem) {
      for (recorder::v1::Decision& decision : *decisions) settle(&decision);
      go_on();
      why = fmt::format("who answered before cannot be had in the edited scene: {}", problem.what());
      warnings_.push_back(fmt::format("edit before step {}: after it no swap is taken back: {}", edit_.step(), why));
    }
  }
  const std::vector<kernel::SwapRecord> known = next.environment->swaps();
  for (kernel::SwapRecord& swap : now.swaps()) {
    const bool goes_on = std::ranges::any_of(known, [&](const kernel::SwapRecord& one) {
      return one.slot == swap.slot && one.step == swap.step && plugin_of(one.to) == plugin_of(swap.to);
    });
    // what took over in a step of the journal is none
    const bool was_swap = std::ranges::any_of(known_before, [&](const recorder::v1::Decision& one) {
      return is_swap(one) && one.slot() == slot_name(swap.slot) && one.step() == swap.step;
    });
    if (goes_on || !was_swap || swap.state != kernel::SwapState::kProbation) continue;
    swap.state = kernel::SwapState::kCommitted;
    swap.reason = fmt::format("the edit before step {} ended its probation: {}", edit_.step(), why);
    next.settled.push_back(std::move(swap));
  }
  return next;
}

void keep_who_answers(const kernel::EnvironmentDescription& before, const kernel::EnvironmentDescription& active,
                      kernel::EnvironmentDescription* next) {
  for (const Slot slot : kSlots) {
    const std::vector<kernel::PluginChoice>& scenes = before.slot(slot).plugins;
    for (kernel::PluginChoice& plugin : next->slot(slot).plugins) {
      const auto same = std::ranges::find_if(
          scenes, [&](const kernel::PluginChoice& one) { return one.declaration.name == plugin.declaration.name; });
      if (same == scenes.end()) continue;
      const auto fallback = plugin.fallback;
      plugin = active.slot(slot).plugins.at(static_cast<std::size_t>(same - scenes.begin()));
      // who took over has none
      if (plugin.fallback) plugin.fallback = fallback;
    }
    if (!scenes.empty()) next->slot(slot).hosting = active.slot(slot).hosting;
  }
}

std::uint32_t row_after(const kernel::EnvironmentDescription& before, const kernel::EnvironmentDescription& next,
                        Slot slot, std::uint32_t row) {
  const std::string& name = before.slot(slot).plugins.at(row).declaration.name;
  const std::vector<kernel::PluginChoice>& plugins = next.slot(slot).plugins;
  for (std::uint32_t i = 0; i < plugins.size(); ++i)
    if (plugins[i].declaration.name == name) return i;
  return kNone;
}

}  // namespace gravitas
