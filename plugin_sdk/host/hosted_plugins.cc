#include "plugin_sdk/host/hosted_plugins.h"

#include <array>
#include <span>

#include "plugin_sdk/channel/mailbox.h"
#include "plugin_sdk/checks.h"
#include "plugin_sdk/floating_point.h"

namespace gravitas::host {
namespace {

// A plugin reads its columns by rows: what does not fit together never reaches it.
std::string uneven_rows(stage::Method method, const gravitas_column* request) {
  const stage::MethodInfo& info = stage::method_info(method);
  std::array<std::uint64_t, GRAVITAS_MAX_COLUMNS> counts;
  for (std::size_t i = 0; i < info.request.size(); ++i) counts[i] = request[i].count;
  return check_rows(info, std::span(counts).first(info.request.size()), {});
}

}  // namespace

HostedPlugins::~HostedPlugins() {
  for (std::size_t i = 0; i < instances_.size(); ++i) destroy_instance(libraries_[i], instances_[i]);
}

std::string HostedPlugins::create(const std::vector<std::vector<double>>& settings, std::uint32_t threads) {
  threads_ = std::make_unique<ThreadPool>(threads);
  for (std::size_t i = 0; i < libraries_.size(); ++i) {
    void* instance = nullptr;
    const std::string problem = create_instance(libraries_[i], settings[i], &instance);
    if (!problem.empty()) return libraries_[i].declaration.name + ": " + problem;
    instances_.push_back(instance);
  }
  return {};
}

CallEnd HostedPlugins::call(std::uint32_t target, stage::Method method, const gravitas_column* request,
                            gravitas_reply_column* reply, CallServices* services, FaultInjection* fault) {
  struct Context {
    CallServices* services;
    ThreadPool* threads;
  } context{services, threads_.get()};
  gravitas_host host{};
  host.context = &context;
  host.mark_progress = [](void* c) { static_cast<Context*>(c)->services->mark_progress(); };
  host.parallel_for = [](void* c, std::uint64_t count, void (*body)(void*, std::uint64_t, std::uint64_t),
                         void* argument) { static_cast<Context*>(c)->threads->parallel_for(count, body, argument); };
  if (method == stage::Method::kIntegratorIntegrate) {
    host.derivative = [](void* c, const gravitas_column* columns, gravitas_reply_column* answer) {
      return static_cast<Context*>(c)->services->derivative(columns, answer);
    };
  }

  CallEnd end;
  end.text = uneven_rows(method, request);
  if (!end.text.empty()) {
    end.status = GRAVITAS_REFUSED;
    return end;
  }
  const std::uint32_t control = floating_point_control();
  gravitas_error error{};
  const std::uint64_t start = channel::now_ns();
  end.status = call_instance(libraries_[target], instances_[target], static_cast<std::uint32_t>(method), request, reply,
                             &host, &error);
  end.compute_ns = channel::now_ns() - start;
  if (fault != nullptr && end.status != GRAVITAS_NEEDS_CAPACITY) {
    end.status = fault->after_plugin(stage::method_info(method), request, reply, end.status, end.compute_ns, &error);
    end.compute_ns = channel::now_ns() - start;
    end.text = fault->note();
  }
  if (restore_floating_point_control(control)) {
    end.status = GRAVITAS_FAILED;
    end.text = "the plugin changed the floating-point environment";
  } else if (end.status != GRAVITAS_OK) {
    end.text = error_text(error);
  }
  return end;
}

}  // namespace gravitas::host
