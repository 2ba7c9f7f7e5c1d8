// What a served run leaves, and what goes on from it.
#include <fmt/format.h>

#include <filesystem>

#include "plugin_sdk/slots.h"
#include "services/control/served_run.h"
#include "services/run/resume_command.h"
#include "services/run/resumption.h"

namespace gravitas::control {

// Begins it; a reset begins it anew.
void ServedRun::keep_checkpoint() {
  try {
    recorder_->keep(std::filesystem::absolute(checkpoint_target(options_.checkpoint)), options_.checkpoint_every, {},
                    *environment_);
  } catch (const std::runtime_error& problem) {
    throw BadInput(problem.what());
  }
}

std::string ServedRun::save_checkpoint() {
  return between_steps([this]() -> std::string {
    if (!recorder_->keeps()) return {};
    if (recorder_->saved_step() != environment_->step_count()) recorder_->save(*environment_);
    checkpoint_ = recorder_->path();
    return resume_command_ = command_to_resume();
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
    if (keeps && recorder_->saved_step() != environment_->step_count()) recorder_->save(*environment_);
    if (!keeps) recorder_->save_to(path, *environment_);
    checkpoint_ = path;
    resume_command_ = command_to_resume();
  } catch (const std::exception& problem) {
    fault_ += fmt::format("; no checkpoint: {}", problem.what());
  }
}

// From wherever it is typed; empty: nobody can know what a listener would decide.
std::string ServedRun::command_to_resume() const {
  if (recorder_->has_listened()) return {};
  RunOptions options = options_;
  for (std::string& scene : options.scenes) scene = std::filesystem::absolute(scene);
  // what was ordered for later
  const std::vector<kernel::SwapRecord> records = environment_->swaps();
  for (const Order& one : orders_) {
    const kernel::SwapRecord& record = record_of(one, records);
    const bool is_pending = record.state == kernel::SwapState::kPreparing || record.state == kernel::SwapState::kShadow;
    if (is_pending && one.step > environment_->step_count() + 1)
      options.swaps.push_back(fmt::format("{}={}@step={}", slot_name(one.slot), one.plugin.declaration.name, one.step));
  }
  return resume_command(options, hosting_words_, checkpoint_);
}

}  // namespace gravitas::control
