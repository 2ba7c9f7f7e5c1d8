// The plugins of a worker process and how one call is made to them, whichever way the call came.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "plugin_sdk/host/fault_injection.h"
#include "plugin_sdk/library.h"
#include "plugin_sdk/thread_pool.h"

namespace gravitas::host {

// What a way of calling offers to a plugin during a call.
class CallServices {
 public:
  virtual ~CallServices() = default;
  // Any thread of the call.
  virtual void mark_progress() = 0;
  // GRAVITAS_OK or GRAVITAS_CALLBACK_FAILED. Asked during Integrate only.
  virtual std::int32_t derivative(const gravitas_column* request, gravitas_reply_column* reply) = 0;
};

struct CallEnd {
  std::int32_t status = GRAVITAS_OK;
  std::string text;  // why it is not GRAVITAS_OK; else what came of an ordered fault
  std::uint64_t compute_ns = 0;
};

class HostedPlugins {
 public:
  explicit HostedPlugins(std::vector<PluginLibrary> libraries) : libraries_(std::move(libraries)) {}
  ~HostedPlugins();
  HostedPlugins(const HostedPlugins&) = delete;
  HostedPlugins& operator=(const HostedPlugins&) = delete;

  // Creates the instances; `settings` has the numbers of each. Empty, or why there is none of a plugin.
  std::string create(const std::vector<std::vector<double>>& settings, std::uint32_t threads);

  std::size_t count() const { return instances_.size(); }

  // One call to a plugin, in the caller's thread. A plugin that leaves the floating-point environment changed fails.
  // `fault` is what the call orders to go wrong, or null.
  CallEnd call(std::uint32_t target, stage::Method method, const gravitas_column* request, gravitas_reply_column* reply,
               CallServices* services, FaultInjection* fault = nullptr);

 private:
  std::vector<PluginLibrary> libraries_;
  std::vector<void*> instances_;
  std::unique_ptr<ThreadPool> threads_;
};

}  // namespace gravitas::host
