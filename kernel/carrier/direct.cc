// Direct hosting: the plugins are libraries of this process and columns are pointers into the arena.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <exception>
#include <string>

#include "kernel/carrier/carrier.h"
#include "kernel/fault.h"
#include "plugin_sdk/answer_checks.h"
#include "plugin_sdk/floating_point.h"
#include "plugin_sdk/library.h"
#include "plugin_sdk/thread_pool.h"

namespace gravitas::kernel {
namespace {

class DirectCarrier final : public Carrier {
 public:
  // Without plugins: so that those that are there are let go when the next one refuses.
  explicit DirectCarrier(std::uint32_t threads) : threads_(threads) {}
  DirectCarrier(const std::vector<PluginChoice>& plugins, std::uint32_t threads);
  ~DirectCarrier() override;

  CallResult call(const StageCall& call, Arena* arena, DerivativeSource* derivatives) override;
  int process_id() const override { return getpid(); }
  Hosting hosting() const override { return Hosting::kDirect; }

 private:
  // What the host functions of one call need.
  struct OpenCall {
    ThreadPool* threads;
    Arena* arena;
    DerivativeSource* derivatives;
    std::exception_ptr nested_fault;
  };

  std::vector<PluginLibrary> libraries_;
  std::vector<void*> instances_;
  ThreadPool threads_;
};

DirectCarrier::DirectCarrier(const std::vector<PluginChoice>& plugins, std::uint32_t threads) : DirectCarrier(threads) {
  for (const PluginChoice& plugin : plugins) {
    std::string problem;
    PluginLibrary library = load_plugin_library(plugin.library, &problem);
    if (library.table == nullptr) throw StageFault(FaultKind::kHandshake, "handshake", problem);
    void* instance = nullptr;
    problem = create_instance(library, plugin.settings, &instance);
    if (!problem.empty())
      throw StageFault(FaultKind::kHandshake, "handshake", plugin.declaration.name + ": " + problem);
    instances_.push_back(instance);
    libraries_.push_back(std::move(library));
  }
}

DirectCarrier::~DirectCarrier() {
  for (std::size_t i = 0; i < instances_.size(); ++i) destroy_instance(libraries_[i], instances_[i]);
}

CallResult DirectCarrier::call(const StageCall& call, Arena* arena, DerivativeSource* derivatives) {
  const auto request = plain_columns(*arena, call.request);
  std::array<gravitas_reply_column, GRAVITAS_MAX_COLUMNS> reply;
  for (std::size_t i = 0; i < call.reply.size(); ++i)
    reply[i] = {arena->data(call.reply[i]), arena->capacity(call.reply[i]), 0};

  OpenCall open{&threads_, arena, derivatives, nullptr};
  gravitas_host host{};
  host.context = &open;
  host.mark_progress = [](void*) {};
  host.parallel_for = [](void* context, std::uint64_t count, void (*body)(void*, std::uint64_t, std::uint64_t),
                         void* argument) {
    static_cast<OpenCall*>(context)->threads->parallel_for(count, body, argument);
  };
  if (derivatives != nullptr)
    host.derivative = [](void* context, const gravitas_column* asked, gravitas_reply_column* answer) {
      OpenCall& one = *static_cast<OpenCall*>(context);
      return answer_derivative(one.derivatives, one.arena, asked, answer, &one.nested_fault);
    };

  const std::uint32_t control = floating_point_control();
  gravitas_error error;
  error.text[0] = '\0';
  CallResult result;
  const std::uint64_t generation = arena->generation();
  arena->hold();
  result.status = call_instance(libraries_[call.target], instances_[call.target],
                                static_cast<std::uint32_t>(call.method), request.data(), reply.data(), &host, &error);
  for (std::size_t i = 0; i < call.reply.size() && arena->generation() != generation; ++i)
    std::memcpy(arena->data(call.reply[i]), reply[i].data,
                std::min(reply[i].count, reply[i].capacity) * stage::element_size(call.info().reply[i].type));
  arena->let_go();
  if (open.nested_fault) std::rethrow_exception(open.nested_fault);
  if (restore_floating_point_control(control)) {
    result.status = GRAVITAS_FAILED;
    result.text = "the plugin changed the floating-point environment";
    return result;
  }
  if (result.status != GRAVITAS_OK) result.text = error_text(error);
  const std::string overfull = overfull_column(call.info().reply, reply.data());
  if (!overfull.empty() && result.status == GRAVITAS_OK)
    throw StageFault(FaultKind::kBadFrame, "wire", "its answer is wrong: " + overfull);
  for (std::size_t i = 0; i < call.reply.size(); ++i) {
    const bool fits = reply[i].count <= reply[i].capacity;
    if (fits || result.status == GRAVITAS_NEEDS_CAPACITY) arena->set_count(call.reply[i], reply[i].count);
  }
  return result;
}

}  // namespace

// The plugin's trial state is copied into the arena, where the force slot can see it wherever it is hosted.
std::int32_t answer_derivative(DerivativeSource* source, Arena* arena, const gravitas_column* request,
                               gravitas_reply_column* reply, std::exception_ptr* nested) {
  const stage::MethodInfo& method = stage::method_info(stage::Method::kIntegratorDerivative);
  const std::span<const ColumnId> trial = source->trial_columns(), answer = source->answer_columns();
  for (std::size_t i = 0; i < trial.size(); ++i) {
    if (request[i].count != arena->count(trial[i])) return GRAVITAS_CALLBACK_FAILED;
    std::memcpy(arena->data(trial[i]), request[i].data, request[i].count * element_size(method.request[i].type));
  }
  try {
    source->evaluate();
  } catch (...) {
    *nested = std::current_exception();
    return GRAVITAS_CALLBACK_FAILED;
  }
  for (std::size_t i = 0; i < answer.size(); ++i) {
    reply[i].count = arena->count(answer[i]);
    if (reply[i].count > reply[i].capacity) return GRAVITAS_CALLBACK_FAILED;
    if (reply[i].count > 0)
      std::memcpy(reply[i].data, arena->data(answer[i]), reply[i].count * element_size(method.reply[i].type));
  }
  return GRAVITAS_OK;
}

std::unique_ptr<Carrier> make_direct_carrier(const std::vector<PluginChoice>& plugins, std::uint32_t threads) {
  return std::make_unique<DirectCarrier>(plugins, threads);
}

}  // namespace gravitas::kernel
