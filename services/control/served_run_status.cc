// What a served run tells about itself.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <system_error>

#include "plugin_sdk/counted.h"
#include "plugin_sdk/property_value.h"
#include "plugin_sdk/slots.h"
#include "services/control/served_run.h"
#include "services/run/fault_desk.h"
#include "services/run/file_names.h"
#include "services/run/kernel_names.h"
#include "services/run/report.h"

namespace gravitas::control {
namespace {

// Swaps, faults and different warnings that are kept for a status.
constexpr std::size_t kMostShown = 32, kMostWarnings = 1000;
constexpr std::chrono::seconds kCollection{5};

std::string value_text(const Property& property, std::span<const double> numbers) {
  if (property.kind == PropertyKind::kTable) return counted(static_cast<std::uint64_t>(numbers[0]), "row");
  if (std::isnan(numbers[0])) return "absent";
  if (property.kind == PropertyKind::kFlag) return numbers[0] != 0.0 ? "true" : "false";
  if (property.kind == PropertyKind::kChoice) return property.choices.at(static_cast<std::size_t>(numbers[0]));
  if (numbers.size() == 1) return number_text(numbers[0]);
  std::string text;
  for (const double number : numbers) text += (text.empty() ? "{" : ", ") + number_text(number);
  return text + "}";
}

// Of a list that may grow for ever.
template <typename Rows>
void keep_last(Rows* rows) {
  const int surplus = std::max(0, rows->size() - static_cast<int>(kMostShown));
  rows->DeleteSubrange(0, surplus);
}

}  // namespace

std::vector<api::Setting> setting_messages(const kernel::PluginChoice& plugin) {
  std::vector<api::Setting> settings;
  std::span<const double> rest = plugin.settings;
  for (const Property& property : plugin.declaration.properties) {
    const std::size_t size = flat_size_of(property, rest);
    if (size == 0) break;
    api::Setting& setting = settings.emplace_back();
    setting.set_name(property.name);
    setting.set_value(value_text(property, rest.first(size)));
    rest = rest.subspan(size);
  }
  return settings;
}

std::string ServedRun::state_name() const {
  switch (state_) {
    case State::kRunning:
      return "running";
    case State::kPaused:
      return "paused";
    case State::kFinished:
      return "finished";
    case State::kFaulted:
      break;
  }
  return "faulted";
}

// A step may wait for a worker that hangs; what hangs is what one asks for then.
api::Status ServedRun::status() {
  constexpr std::chrono::milliseconds kPatience{250};
  auto task = std::make_shared<std::packaged_task<api::Status()>>([this] { return status_now(); });
  auto done = task->get_future();
  boost::asio::post(loop_, [task] { (*task)(); });
  while (done.wait_for(kPatience) != std::future_status::ready) {
    const std::lock_guard lock(known_mutex_);
    if (!step_begin_ || Clock::now() - *step_begin_ < kPatience) continue;
    api::Status status = known_;
    status.set_waited(std::chrono::duration<double>(Clock::now() - *step_begin_).count());
    return status;
  }
  return done.get();
}

api::Status ServedRun::status_between_steps() {
  return between_steps([this] { return status_now(); });
}

api::Status ServedRun::status_now() {
  api::Status status;
  status.set_scene(scene_name_);
  std::set<std::string> files;
  for (const std::vector<NamedFile>& some : {files_of(first_scene_), files_of(scene_), checkpoints_of(options_)})
    for (const NamedFile& file : some)
      if (std::error_code none; std::filesystem::exists(file.path, none))
        files.insert(std::filesystem::absolute(file.path).string());
  status.mutable_files()->Assign(files.begin(), files.end());
  status.set_state(state_name());
  status.set_fault(fault_);
  status.set_checkpoint(checkpoint_);
  status.set_resume_command(resume_command_);
  status.set_time(environment_->time());
  status.set_time_step(environment_->time_step());
  status.set_step(environment_->step_count());
  status.set_total_steps(environment_->total_steps());
  const double counted = std::chrono::duration<double>(Clock::now() - rate_begin_).count();
  const double rate = rate_ > 0.0 ? rate_ : (environment_->step_count() - rate_step_) / std::max(counted, 1e-6);
  status.set_steps_per_second(state_ == State::kRunning ? rate : 0.0);
  status.set_speed(speed_);
  status.set_state_hash(environment_->state_hash().text());
  status.set_chain_hash(environment_->chain_hash().text());
  write_plan(status.mutable_plan());
  for (api::ServedSwap& swap : swap_messages()) *status.add_swaps() = std::move(swap);
  status.set_swap_count(static_cast<std::uint32_t>(status.swaps_size()));
  keep_last(status.mutable_swaps());
  report::v1::Report report = past_;
  write_faults(*environment_, &report);
  name_orders(injected_, description_, {0, environment_->step_count()}, state_ == State::kFinished, &report);
  for (const std::string& warning : report.warnings()) add_warning(warning);
  status.set_fault_count(static_cast<std::uint32_t>(report.faults_size()));
  status.mutable_faults()->Swap(report.mutable_faults());
  keep_last(status.mutable_faults());
  status.set_edit_count(static_cast<std::uint32_t>(report.edits_size()));
  status.mutable_edits()->Swap(report.mutable_edits());
  keep_last(status.mutable_edits());
  collect_warnings();
  if (const std::string line = recorder_->warning(); !line.empty()) add_warning(line);
  if (const std::string line = figures_->why_dear(); !line.empty() && line != dear_step_) {
    // of the dearest alone
    std::erase(warnings_, dear_step_);
    add_warning(dear_step_ = line);
  }
  status.set_warning_count(static_cast<std::uint32_t>(warnings_.size()));
  if (!warnings_.empty()) status.set_last_warning(warnings_.back());
  const std::lock_guard lock(known_mutex_);
  known_ = status;
  return status;
}

void ServedRun::write_plan(api::Plan* plan) const {
  const report::v1::Plan planned = plan_message(*environment_, description_);
  for (const report::v1::PlannedSlot& one : planned.slots()) {
    api::PlannedSlot* slot = plan->add_slots();
    slot->set_slot(one.slot());
    slot->set_plugin(one.plugin());
    slot->set_hosting(one.hosting());
    slot->set_pid(one.pid());
    for (const Slot which : kSlots)
      for (const kernel::PluginChoice& plugin : active_.slot(which).plugins)
        if (one.slot() == slot_name(which) && one.plugin() == plugin.declaration.name && slot->settings_size() == 0)
          for (api::Setting& setting : setting_messages(plugin)) *slot->add_settings() = std::move(setting);
  }
  *plan->mutable_left_out() = planned.left_out();
}

std::vector<api::ServedSwap> ServedRun::swap_messages() const {
  std::vector<api::ServedSwap> swaps = past_swaps_;
  const std::vector<kernel::SwapRecord> records = environment_->swaps();
  for (const kernel::SwapRecord& record : records)
    if (!record.only_compared) renew_swap(record, &swaps, static_cast<int>(swaps.size()));
  for (const Order& order : orders_) swaps.push_back(swap_message(order, records));
  return swaps;
}

api::ServedSwap ServedRun::swap_message(const Order& order, const std::vector<kernel::SwapRecord>& records) const {
  const kernel::SwapRecord& record = record_of(order, records);
  api::ServedSwap swap;
  swap.set_number(order.number);
  swap.set_slot(slot_name(record.slot));
  swap.set_step(std::max(record.step, record.since));
  swap.set_from(record.from);
  swap.set_to(record.to);
  swap.set_outcome(swap_state_name(record.state));
  swap.set_reason(record.reason);
  swap.set_pause_us(record.pause_us);
  swap.set_wait_us(record.wait_us);
  swap.set_compares(order.compares());
  write_comparison(record.shadow, *environment_, swap.mutable_shadow());
  return swap;
}

// Now and then: what is counted over a while is one line then.
void ServedRun::collect_warnings() {
  const Clock::time_point now = Clock::now();
  if (now < next_collection_) return;
  next_collection_ = now + kCollection;
  for (const std::string& line : environment_->warnings()) add_warning(line);
}

void ServedRun::add_warning(const std::string& line) {
  if (warnings_.size() < kMostWarnings && std::ranges::find(warnings_, line) == warnings_.end())
    warnings_.push_back(line);
}

}  // namespace gravitas::control
