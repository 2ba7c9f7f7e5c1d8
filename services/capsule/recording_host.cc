#include "services/capsule/recording_host.h"

#include <utility>
#include <vector>

#include "kernel/fault.h"

namespace gravitas::capsule {

namespace v1 = recorder::v1;

namespace {

class RecordingHost final : public kernel::Carrier {
 public:
  RecordingHost(std::unique_ptr<kernel::Carrier> host, const std::vector<kernel::PluginChoice>& plugins,
                const Selection& selection, std::shared_ptr<Writer> writer,
                std::shared_ptr<const std::atomic<std::uint32_t>> step)
      : host_(std::move(host)), selection_(selection), writer_(std::move(writer)), step_(std::move(step)) {
    for (const kernel::PluginChoice& plugin : plugins) rows_.push_back(writer_->add_plugin(plugin));
  }

  kernel::CallResult call(const kernel::StageCall& call, kernel::Arena* arena,
                          kernel::DerivativeSource* derivatives) override;
  void drain() override { host_->drain(); }
  void kill() override { host_->kill(); }
  bool is_alive() const override { return host_->is_alive(); }
  int process_id() const override { return host_->process_id(); }
  kernel::Hosting hosting() const override { return host_->hosting(); }
  std::vector<std::string> take_complaints() override { return host_->take_complaints(); }
  std::vector<std::string> sandbox() const override { return host_->sandbox(); }

 private:
  std::unique_ptr<kernel::Carrier> host_;
  const Selection selection_;
  std::shared_ptr<Writer> writer_;
  std::shared_ptr<const std::atomic<std::uint32_t>> step_;
  std::vector<std::uint32_t> rows_;  // of the plugins in the capsule
};

// Writes down what is asked during a call.
class RecordedDerivatives final : public kernel::DerivativeSource {
 public:
  RecordedDerivatives(kernel::DerivativeSource* source, const kernel::Arena& arena, v1::CapsuleCall* record)
      : source_(source), arena_(arena), record_(record) {}
  void begin_attempt(bool counts) override { source_->begin_attempt(counts); }
  std::span<const kernel::ColumnId> trial_columns() const override { return source_->trial_columns(); }
  kernel::ColumnId wrench_column() const override { return source_->wrench_column(); }
  void evaluate() override {
    const stage::MethodInfo& method = stage::method_info(stage::Method::kIntegratorDerivative);
    v1::CapsuleDerivative* one = record_->add_derivatives();
    copy_columns(arena_, trial_columns(), method.request, one->mutable_trial());
    source_->evaluate();
    const kernel::ColumnId answer = wrench_column();
    copy_columns(arena_, {&answer, 1}, method.reply, one->mutable_answer());
  }

 private:
  kernel::DerivativeSource* source_;
  const kernel::Arena& arena_;
  v1::CapsuleCall* record_;
};

kernel::CallResult RecordingHost::call(const kernel::StageCall& call, kernel::Arena* arena,
                                       kernel::DerivativeSource* derivatives) {
  const std::uint32_t step = step_->load();
  if (step < selection_.first_step || writer_->calls() >= selection_.most_calls)
    return host_->call(call, arena, derivatives);
  v1::CapsuleCall record = begin_call(call, *arena);
  record.set_plugin(rows_[call.target]);
  record.set_step(step);
  RecordedDerivatives recorded(derivatives, *arena, &record);
  try {
    kernel::CallResult result = host_->call(call, arena, derivatives != nullptr ? &recorded : nullptr);
    // it is asked again, with more room
    if (result.status == GRAVITAS_NEEDS_CAPACITY) return result;
    record.set_status(result.status);
    record.set_text(result.text);
    if (result.status == GRAVITAS_OK) copy_columns(*arena, call.reply, call.info().reply, record.mutable_reply());
    writer_->add_call(record);
    return result;
  } catch (const kernel::StageFault& fault) {
    record.set_fault(fault.text);
    writer_->add_call(record);
    throw;
  }
}

}  // namespace

kernel::HostStarter recording(const Selection& selection, std::shared_ptr<Writer> writer,
                              std::shared_ptr<const std::atomic<std::uint32_t>> step) {
  return [=](const kernel::SlotDescription& slot, std::uint32_t threads,
             std::stop_token stop) -> std::unique_ptr<kernel::Carrier> {
    std::unique_ptr<kernel::Carrier> host = kernel::start_host(slot, threads, std::move(stop));
    if (slot.plugins[0].declaration.slot != selection.slot) return host;
    return std::make_unique<RecordingHost>(std::move(host), slot.plugins, selection, writer, step);
  };
}

}  // namespace gravitas::capsule
