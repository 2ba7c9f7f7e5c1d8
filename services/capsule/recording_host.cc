#include "services/capsule/recording_host.h"

#include <system_error>
#include <utility>
#include <vector>

#include "kernel/fault.h"
#include "services/capsule/forwarding_host.h"

namespace gravitas::capsule {

namespace v1 = recorder::v1;

namespace {

class RecordingHost final : public ForwardingHost {
 public:
  RecordingHost(std::unique_ptr<kernel::Carrier> host, std::vector<kernel::PluginChoice> plugins,
                std::shared_ptr<Tape> tape)
      : ForwardingHost(std::move(host)), plugins_(std::move(plugins)), tape_(std::move(tape)) {}

  kernel::CallResult call(const kernel::StageCall& call, kernel::Arena* arena,
                          kernel::DerivativeSource* derivatives) override;

 private:
  bool is_kept(std::uint32_t target) const {
    return tape_->writer && plugins_[target].declaration.slot == tape_->slot && tape_->step >= tape_->first_step &&
           tape_->writer->calls() < tape_->most_calls;
  }
  void keep(v1::CapsuleCall* record, std::uint32_t target);

  const std::vector<kernel::PluginChoice> plugins_;
  const std::shared_ptr<Tape> tape_;
  std::shared_ptr<Writer> known_to_;  // the writer whose capsule has the plugins, in these rows
  std::vector<std::uint32_t> rows_;
};

// Writes down what is asked during a call.
class RecordedDerivatives final : public kernel::DerivativeSource {
 public:
  RecordedDerivatives(kernel::DerivativeSource* source, const kernel::Arena& arena, v1::CapsuleCall* record)
      : source_(source), arena_(arena), record_(record) {}
  void begin_attempt(bool counts) override { source_->begin_attempt(counts); }
  std::span<const kernel::ColumnId> trial_columns() const override { return source_->trial_columns(); }
  std::span<const kernel::ColumnId> answer_columns() const override { return source_->answer_columns(); }
  void evaluate() override {
    const stage::MethodInfo& method = stage::method_info(stage::Method::kIntegratorDerivative);
    // one that is not answered is none: what reads it wants both
    v1::CapsuleDerivative one;
    copy_columns(arena_, trial_columns(), method.request, one.mutable_trial());
    source_->evaluate();
    copy_columns(arena_, answer_columns(), method.reply, one.mutable_answer());
    *record_->add_derivatives() = std::move(one);
  }

 private:
  kernel::DerivativeSource* source_;
  const kernel::Arena& arena_;
  v1::CapsuleCall* record_;
};

void RecordingHost::keep(v1::CapsuleCall* record, std::uint32_t target) {
  try {
    if (known_to_ != tape_->writer) {
      known_to_ = tape_->writer;
      rows_.clear();
      // the others share the process alone
      for (const kernel::PluginChoice& plugin : plugins_)
        rows_.push_back(plugin.declaration.slot == tape_->slot ? known_to_->add_plugin(plugin) : 0);
    }
    record->set_plugin(rows_[target]);
    known_to_->add_call(*record);
  } catch (const std::system_error& problem) {
    tape_->problem = problem.what();
    tape_->writer.reset();
  }
}

kernel::CallResult RecordingHost::call(const kernel::StageCall& call, kernel::Arena* arena,
                                       kernel::DerivativeSource* derivatives) {
  if (call.is_compared || !is_kept(call.target)) return host_->call(call, arena, derivatives);
  v1::CapsuleCall record = begin_call(call, *arena);
  record.set_step(tape_->step);
  RecordedDerivatives recorded(derivatives, *arena, &record);
  try {
    kernel::CallResult result = host_->call(call, arena, derivatives != nullptr ? &recorded : nullptr);
    // it is asked again, with more room
    if (result.status == GRAVITAS_NEEDS_CAPACITY) return result;
    record.set_status(result.status);
    record.set_text(result.text);
    record.set_may_be_refused(call.may_be_refused);
    if (result.status == GRAVITAS_OK) copy_columns(*arena, call.reply, call.info().reply, record.mutable_reply());
    keep(&record, call.target);
    return result;
  } catch (const kernel::StageFault& fault) {
    record.set_fault(fault.text());
    keep(&record, call.target);
    throw;
  }
}

}  // namespace

kernel::HostStarter recording(std::shared_ptr<Tape> tape) {
  return [tape = std::move(tape)](const kernel::SlotDescription& slot, std::uint32_t threads,
                                  std::stop_token stop) -> std::unique_ptr<kernel::Carrier> {
    return std::make_unique<RecordingHost>(kernel::start_host(slot, threads, std::move(stop)), slot.plugins, tape);
  };
}

}  // namespace gravitas::capsule
