// What a served run goes on from, and what it leaves.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "plugin_sdk/channel/private_folder.h"
#include "plugin_sdk/slots.h"
#include "services/control/served_run.h"
#include "services/edit/edited_scene.h"
#include "services/recorder/decision.h"
#include "services/run/exchange_spec.h"
#include "services/run/file_names.h"
#include "services/run/resume_command.h"

namespace gravitas::control {

// With the steps, edits and swaps that the journal beside the checkpoint knows, made again.
Resumption ServedRun::last_known(const RunOptions& options, const kernel::EnvironmentDescription& description,
                                 std::vector<std::string>* warnings) {
  Resumption found = read_resumption(options, description, warnings);
  std::uint32_t last = found.journal.last_step;
  for (const edit::v1::Edit& one : found.journal.edits) last = std::max(last, one.step());
  // the checkpoint has those for a step that was not made
  for (const recorder::v1::Decision& one : found.journal.decisions)
    if (std::ranges::find(found.checkpoint.decisions(), one.step(), &recorder::v1::Decision::step) ==
        found.checkpoint.decisions().end())
      last = std::max(last, one.step());
  last = std::min(last, description.steps);
  // nothing is kept of a shortened last step
  if (last == description.steps && description.last_time_step != description.time_step) {
    --last;
    warnings->push_back("the last step is shorter than the others: what was ordered for it is to be ordered again");
  }
  if (last <= found.checkpoint.step()) return found;
  const channel::PrivateFolder folder;
  RunOptions again = options;
  again.checkpoint = folder.path() + "/checkpoint";
  again.checkpoint_every = 0;
  again.duration.reset();
  again.steps = last;
  again.comparisons.clear();
  const RunResult result = run(
      again, [] { return false; }, [](const Progress&) {});
  if (result.outcome != RunOutcome::kCompleted)
    throw BadInput(
        fmt::format("checkpoint '{}': steps {} to {}, which its journal knows, cannot be made again: {}; `gravitas run "
                    "--resume` pauses there",
                    options.resume, found.checkpoint.step() + 1, last, result.fault));
  std::vector<std::string> known;  // was told above
  again.resume = again.checkpoint;
  Resumption caught_up = read_resumption(again, description, &known);
  caught_up.journal = std::move(found.journal);
  return caught_up;
}

// Its edits are made, and whoever answered when it was written answers.
ServedRun::Beginning ServedRun::restored(const Resumption& from) {
  Beginning begins{first_scene_, first_description_, {}, {}, {}};
  for (edit::v1::Edit one : from.checkpoint.edits()) {
    const EditedScene edited(options_, begins.scene, begins.description, &catalog_, &one, nullptr);
    scene::v1::Scene scene = edited.scene();
    kernel::EnvironmentDescription description = edited.description();
    begins.scene = std::move(scene);
    begins.description = std::move(description);
  }
  recorder::v1::Checkpoint checkpoint = from.checkpoint;
  from_checkpoint(options_.resume, [&] {
    Answering answering = answering_at(checkpoint, begins.description, catalog_);
    for (auto* one : {&answering.now, &answering.begun}) apply_hosting(options_.hosting, one);
    begins.environment = start(answering.begun, starter(), &begins.scene);
    const std::vector<recorder::v1::Decision> decisions(checkpoint.decisions().begin(), checkpoint.decisions().end());
    begins.swaps = past_swaps(decisions, catalog_, answering.now);
    restore(&checkpoint, answering.now, catalog_, begins.environment.get());
    for (const Slot slot : kSlots) begins.active.slot(slot) = answering.now.slot(slot);
  });
  return begins;
}

void ServedRun::order_again(const Resumption& from) {
  std::vector<std::string> warnings;
  for (LiveOrder& one : orders_to_come(from, catalog_, &warnings)) {
    const std::uint32_t step = one.swap.step;
    if (step <= environment_->step_count() || step > environment_->total_steps()) continue;
    try {
      order(std::move(one.swap), one.known.why() == kOrderOfSetting ? OrderKind::kSetting : OrderKind::kSwap);
    } catch (const BadInput& problem) {
      warnings.push_back(
          fmt::format("the swap that was ordered for step {} is not ordered again: {}", step, problem.what()));
    }
  }
  for (const std::string& warning : warnings) add_warning(warning);
}

// Begins it; a reset begins it anew.
void ServedRun::keep_checkpoint(JournalReading known) {
  // that of another file begins with what is still to come
  if (!goes_on_in_its_checkpoint(options_)) {
    known = {};
    for (const Order& one : pending_orders())
      if (!one.compares()) known.orders.push_back(order_message(one));
  }
  try {
    const std::string path = checkpoint_target(options_.checkpoint);
    recorder_->keep(std::filesystem::absolute(path), options_.checkpoint_every, known, *environment_);
  } catch (const std::runtime_error& problem) {
    throw BadInput(problem.what());
  }
}

std::optional<ServedRun::Saved> ServedRun::save_checkpoint() {
  return between_steps([this]() -> std::optional<Saved> {
    if (!recorder_->keeps()) return {};
    // also over one of this step: who answers, and whom to wake, may have changed since
    recorder_->save_last(*environment_);
    checkpoint_ = recorder_->path();
    resume_command_ = command_to_resume();
    return Saved{recorder_->saved_step().value(), resume_command_};
  });
}

// As a run does that pauses: what was computed is not lost with the server.
void ServedRun::keep_faulted_state() {
  stand(State::kFaulted);
  with_subscriptions([&](Subscription* one) { one->source().tell_incidents(*environment_); });
  try {
    const bool keeps = recorder_->keeps();
    const std::string path =
        keeps ? recorder_->path() : std::filesystem::absolute(paused_checkpoint(options_)).string();
    // also where one of this step is kept: an edit may have come since, which its journal did not take
    if (keeps) {
      recorder_->save_last(*environment_);
    } else {
      recorder_->save_to(path, *environment_);
      remove_other_journal(options_, path);
    }
    checkpoint_ = path;
    resume_command_ = command_to_resume();
  } catch (const std::exception& problem) {
    if (!recorder_->keeps() || !recorder_->saved_step()) {
      fault_ += fmt::format("; no checkpoint could be written: {}", problem.what());
      return;
    }
    // the one before
    fault_ += fmt::format("; the checkpoint is that of step {}: {}", *recorder_->saved_step(), problem.what());
    checkpoint_ = recorder_->path();
    resume_command_ = command_to_resume();
  }
}

// From wherever it is typed; empty: nobody can know what a listener would decide.
std::string ServedRun::command_to_resume() {
  if (recorder_->has_listened()) return {};
  RunOptions options = options_;
  for (std::string& scene : options.scenes) scene = std::filesystem::absolute(scene);
  // libraries that took over, which a checkpoint alone lets nobody load
  const auto name_library = [&](const recorder::v1::Decision& one) {
    if (one.library().empty() || catalog_.knows_library(one.library())) return;
    options.swaps.push_back(fmt::format("{}={}@step={}", one.slot(), one.library(), one.step()));
  };
  for (const recorder::v1::Decision& one : recorder_->decisions()) {
    if (one.has_before()) name_library(one.before());
    name_library(one);
  }
  // what was ordered for later, and what is compared still
  options.comparisons.clear();
  for (const Order& one : pending_orders()) {
    const auto& [slot, plugin, hosting, step, has_taken_over] = one.swap;
    if (one.kind == OrderKind::kSetting) {
      if (recorder_->keeps()) continue;  // the journal has it
      add_warning(fmt::format("what was set of {} for step {} is not part of the command that goes on",
                              plugin.declaration.name, step));
      continue;
    }
    const InstalledPlugin* known = catalog_.find_plugin(slot, plugin.declaration.name);
    const bool has_name = known != nullptr && known->library == plugin.library;
    std::string word = fmt::format("{}={}", slot_name(slot), has_name ? plugin.declaration.name : plugin.library);
    if (one.kind == OrderKind::kSwap) word += fmt::format("@step={}", step);
    if (hosting) word += fmt::format(",hosting={}", kernel::hosting_name(*hosting));
    (one.kind == OrderKind::kSwap ? options.swaps : options.comparisons).push_back(word);
    const std::vector<kernel::PluginChoice>& own = description_.slot(slot).plugins;
    const auto same = std::ranges::find(own, plugin.declaration.name,
                                        [](const kernel::PluginChoice& choice) { return choice.declaration.name; });
    if (same != own.end() && !recorder_->keeps() && !have_same_settings(*same, plugin))
      add_warning(fmt::format("settings of {} for step {} are not part of the command that goes on: it has the scene's",
                              plugin.declaration.name, step));
  }
  return resume_command(options, hosting_words_, checkpoint_);
}

}  // namespace gravitas::control
