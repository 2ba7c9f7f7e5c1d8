// Others in a slot of a running environment: what may take whose place, and what that means for the state.
#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "kernel/environment.h"
#include "plugin_sdk/stand_in.h"

namespace gravitas::kernel {
namespace {

// Types of the scene that the slot's plugins serve.
std::vector<std::string> types_in_use(const EnvironmentDescription& description, Slot slot) {
  std::vector<std::string> types;
  const auto add = [&](const auto& items) {
    for (const auto& item : items) types.push_back(item.type);
  };
  if (slot == Slot::kForce) add(description.forces);
  if (slot == Slot::kConstraint) add(description.constraints);
  if (slot == Slot::kCollision) add(description.shapes);
  return types;
}

}  // namespace

StageSlot& Environment::slot_of(Slot slot) { return **std::ranges::find(slots_, slot, &StageSlot::which); }

Plan Environment::plan() const {
  Plan plan = plan_;
  plan.slots.clear();
  for (const PlannedSlot& planned : plan_.slots)
    for (const StageSlot* slot : slots_)
      if (slot->which() == planned.slot) std::ranges::move(slot->hosts(), std::back_inserter(plan.slots));
  return plan;
}

std::string Environment::why_left_out(Slot slot) const {
  const auto reason = std::ranges::find(plan_.left_out, slot_name(slot), &LeftOut::what);
  return "the plan leaves the slot out" + (reason == plan_.left_out.end() ? "" : ": " + reason->why);
}

// Row of the plugin whose place is taken, or that it is compared with.
std::uint32_t Environment::place_of(const SwapOrder& order, bool compares) {
  const auto impossible = [&](const std::string& why) {
    return std::invalid_argument(std::string(compares ? "compare " : "swap ") + slot_name(order.slot) + "=" +
                                 order.plugin.declaration.name + ": " + why);
  };
  const StageSlot& slot = slot_of(order.slot);
  if (order.plugin.declaration.slot != order.slot)
    throw impossible(std::string("it is a plugin of slot ") + slot_name(order.plugin.declaration.slot));
  if (!slot.is_running()) throw impossible(why_left_out(order.slot));
  if (order.hosting == Hosting::kDirect && !slot.description().process.empty())
    throw impossible("its worker process is shared (Process = \"" + slot.description().process +
                     "\"), and what is hosted direct shares none");
  const std::vector<PluginChoice>& plugins = slot.description().plugins;
  const std::vector<std::string> in_use = types_in_use(description_, order.slot);
  std::string why;
  for (std::uint32_t row = 0; row < plugins.size(); ++row) {
    std::string misfit_here = why_no_stand_in(plugins[row].declaration, order.plugin.declaration, in_use);
    if (misfit_here.empty()) misfit_here = why_unfit(order.plugin.declaration);
    if (misfit_here.empty()) return row;
    if (why.empty()) why = misfit_here;
  }
  throw impossible(why);
}

// What the simulator needs of the plugins of a slot; null: nothing.
const char* Environment::needed_capability(Slot slot) const {
  if (knows_reactions()) return slot == Slot::kSolver ? "reactions" : nullptr;
  return description_.simulator == Simulator::kContinuous && slot == Slot::kCollision ? "times_of_impact" : nullptr;
}

// Why a plugin cannot serve the simulator; empty if it can.
std::string Environment::why_unfit(const PluginDeclaration& plugin) const {
  const char* capability = needed_capability(plugin.slot);
  if (capability == nullptr || has_capability(plugin, capability)) return {};
  return std::string("the simulator ") + (knows_reactions() ? "Smooth" : "Continuous") +
         " needs a plugin with the capability '" + capability + "' in slot " + slot_name(plugin.slot) + ", and " +
         plugin.name + " has it not";
}

void Environment::check_fallbacks() const {
  for (const StageSlot* slot : slots_)
    for (std::uint32_t row = 0; row < slot->description().plugins.size(); ++row) {
      const PluginChoice& plugin = slot->description().plugins[row];
      if (const std::string why = why_unfit(plugin.declaration); !why.empty())
        throw UnfitPlugin(why, needed_capability(slot->which()));
      if (!plugin.fallback) continue;
      const PluginDeclaration& fallback = plugin.fallback->declaration;
      std::string why = why_no_stand_in(plugin.declaration, fallback, types_in_use(description_, slot->which()));
      if (why.empty()) why = why_unfit(fallback);
      if (why.empty()) why = slot->why_no_fallback(row);
      if (!why.empty())
        throw std::invalid_argument("fallback " + fallback.name + " of " + plugin.declaration.name + ": " + why);
    }
}

void Environment::order_swap(const SwapOrder& order, bool compares) {
  const std::uint32_t row = place_of(order, compares);
  slot_of(order.slot).order_swap(order, row, compares);
}

std::vector<SwapRecord> Environment::swaps() const {
  std::vector<SwapRecord> all;
  for (const StageSlot* slot : slots_) std::ranges::move(slot->swaps(), std::back_inserter(all));
  std::ranges::stable_sort(all, {}, &SwapRecord::step);
  return all;
}

void Environment::inject(FaultInjection fault) {
  StageSlot& slot = slot_of(fault.slot);
  const auto refuse = [&](const std::string& why) {
    throw std::invalid_argument("fault " + fault.order + " in slot " + slot_name(fault.slot) + ": " + why);
  };
  if (!slot.is_running()) refuse(why_left_out(fault.slot));
  if (slot.description().hosting == Hosting::kDirect)
    refuse("it is hosted in the kernel's own process (direct), which the fault would hit");
  slot.inject(std::move(fault));
}

// What only the plugin before understands is dropped; another build or instance of it goes on with it, and so does a space.
void Environment::on_plugin_change(const StageSlot& slot, std::uint32_t target, const PluginChoice& before) {
  const PluginDeclaration& now = slot.description().plugins[target].declaration;
  for (const ConstraintGroup& group : model_.constraint_groups)
    if (slot.which() == Slot::kConstraint && group.target == target) bind(group);
  must_restart_ = has_newcomer_ = true;
  has_new_forces_ |= slot.which() == Slot::kForce;
  count_jacobian_blocks();
  if (now.name == before.declaration.name || slot.which() == Slot::kSpace) return;
  // all wake with this step, also for who goes on from S_n elsewhere
  wake_orders_.clear();
  for (std::uint32_t i = 0; i < model_.body_count; ++i)
    if (is_asleep(i)) wake_orders_.push_back(i);
  find_sleepers();
  if (slot.which() == Slot::kIntegrator) {
    data_.theta[0] = now.theta;
    for (const State& state : states_) {
      state.plugin_state.resize(0);
      std::ranges::fill(state.state_changed.span(), 1U);
    }
  }
  if (slot.which() == Slot::kCollision) {
    // its features have other numbers
    for (const State& state : states_)
      state.visit_columns([](const char*, StateRows rows, std::uint32_t, const auto& column) {
        if (rows == StateRows::kContact) column.resize(0);
      });
  }
}

void Environment::set_commit_listener(CommitListener* listener) {
  commit_listener_ = listener;
  if (listener == nullptr) return;
  for (const auto& [decision, host] : std::exchange(untold_, {}))
    on_decision({decision.slot, decision.target, decision.step, decision.why, &host, decision.plugin});
}

void Environment::on_decision(const Decision& decision) {
  Decision one = decision;
  // what was asked between two steps changes the next
  one.step = std::max(one.step, step_count_ + 1);
  std::erase_if(budgets_, [&](const SavedBudget& saved) { return saved.slot == one.slot; });
  if (commit_listener_ != nullptr) return commit_listener_->on_decision(*this, one);
  if (one.why != "swap") untold_.emplace_back(one, *one.host);
}

void Environment::on_poison(const StageCall& call, const PluginChoice& plugin, const StageFault& fault) {
  if (commit_listener_ != nullptr) commit_listener_->on_poison(*this, {call, arena_, plugin, fault});
}

}  // namespace gravitas::kernel
