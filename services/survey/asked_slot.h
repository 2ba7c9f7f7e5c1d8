// A slot that is asked beside a run: the same plugins in a host of their own, started with the first question. So a run
// whose workers are at work is not disturbed by questions, and a question that kills its worker harms no step. Where the
// run hosts the slot directly, so does this: there, who dies of a question takes the run along.
//
// A failed call is answered elsewhere, as in a run (kernel/slot_host.h), but without standbys. Where that ladder ends
// the question has no answer. After that, or after an answer of another plugin (a fallback's), the next question begins
// with a new host of the plugin that the run has.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "kernel/arena.h"
#include "kernel/slot.h"
#include "plugin_sdk/answer_checks.h"
#include "plugin_sdk/message_columns.h"

namespace gravitas::survey {

// Nobody could answer, or nobody is there who could, and why.
class NoAnswer : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class AskedSlot final : private kernel::SlotObserver {
 public:
  // What is wrong with an answer, beyond rows and numbers that are not finite.
  using Check = std::function<AnswerProblem(const MessageColumns& reply)>;

  AskedSlot(Slot which, kernel::SlotDescription description, std::uint32_t threads, kernel::HostStarter starter);
  ~AskedSlot() override;
  AskedSlot(const AskedSlot&) = delete;
  AskedSlot& operator=(const AskedSlot&) = delete;

  // All of its plugins declare it.
  bool has_capability(std::string_view name) const;
  bool is_empty() const { return description_.plugins.empty(); }
  const kernel::SlotDescription& description() const { return description_; }

  // Throws NoAnswer.
  MessageColumns ask(stage::Method method, std::uint32_t target, const MessageColumns& request, const Check& check);

  // Another plugin answers from now on, or the same elsewhere.
  void replace(std::uint32_t target, const kernel::PluginChoice& plugin, const kernel::SlotDescription& host);

  // The worker commits a fault at its question number `step`, counted from 1. For tests.
  void inject(const kernel::FaultInjection& fault) { faults_to_come_.push_back(fault); }
  // Failed calls, survived or not.
  const std::vector<kernel::FaultRecord>& faults() const { return faults_; }
  std::uint32_t questions() const { return questions_; }
  // 0: nobody was asked yet.
  int process_id() const;

 private:
  struct Columns {
    std::vector<kernel::ColumnId> request, reply;
  };

  void start();
  void stop();
  void copy_in(const stage::MethodInfo& method, const MessageColumns& request,
               std::span<const kernel::ColumnId> columns);
  MessageColumns copy_out(const stage::MethodInfo& method, std::span<const kernel::ColumnId> columns) const;

  void on_plugin_change(const kernel::StageSlot&, std::uint32_t, const kernel::PluginChoice&) override {}
  void on_decision(const kernel::Decision&) override { is_substituted_ = true; }
  void on_poison(const kernel::StageCall&, const kernel::PluginChoice&, const kernel::StageFault&) override {}

  const Slot which_;
  kernel::SlotDescription description_;
  std::uint32_t threads_;
  kernel::HostStarter starter_;
  kernel::Arena arena_;
  std::map<stage::Method, Columns> columns_;  // of the slot's methods
  std::optional<kernel::StageSlot> slot_;
  std::vector<kernel::FaultInjection> faults_to_come_;
  std::vector<kernel::FaultRecord> faults_;
  std::uint32_t questions_ = 0;
  bool is_substituted_ = false;  // another plugin than the description's answers
};

}  // namespace gravitas::survey
