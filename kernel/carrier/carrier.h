// A carrier takes stage calls to the plugins of one host and brings their answers back. Carriers differ in where
// the host is (this process, another one); the contract, and every bit of the answer, is the same.
#pragma once

#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "kernel/arena.h"
#include "kernel/description.h"
#include "schemas/stage_frames.h"

namespace gravitas::kernel {

// One question to one plugin. All columns are of one arena; the answer is staged in the reply columns, whose
// counts are set from the answer. Nothing in them may be used before validation.
struct StageCall {
  stage::Method method;
  std::uint32_t target;  // which of the host's plugins
  std::span<const ColumnId> request;
  std::span<const ColumnId> reply;
  // A fault that the worker is to commit in this very call ("slow,factor=10": plugin_sdk/host/fault_kinds.h); not
  // longer than a mailbox's text. Direct hosting ignores it.
  std::string_view fault = {};
  // Instead of the slot's; 0: the slot's.
  std::uint64_t deadline_ns = 0;
  // Of this request; from the second on a death counts only if the worker is known to have read it.
  std::uint32_t attempt = 0;
  // The answer is held against another one, and not used.
  bool is_compared = false;
  bool may_be_refused = false;  // by who is well: less will be asked for

  const stage::MethodInfo& info() const { return stage::method_info(method); }
};

struct CallResult {
  std::int32_t status = GRAVITAS_OK;  // GRAVITAS_OK, _NEEDS_CAPACITY (counts say how much), _REFUSED, _FAILED …
  std::string text;                   // why it was refused or failed; what came of an ordered fault, if it was answered
  std::uint64_t compute_ns = 0;       // time the plugin worked, if the carrier knows it apart
  std::uint64_t check_ns = 0;         // time the frame of the answer was checked
};

// Answers Integrator.Derivative while an Integrate call is open, from and to columns of the arena.
class DerivativeSource {
 public:
  virtual ~DerivativeSource() = default;
  // Before each attempt at a call; `counts` is false if its answer is only compared.
  virtual void begin_attempt(bool /*counts*/) {}
  // Columns that the request, the trial state, is to be copied to, and those of the reply.
  virtual std::span<const ColumnId> trial_columns() const = 0;
  virtual std::span<const ColumnId> answer_columns() const = 0;
  // Evaluates what is asked of the state in the trial columns. Throws StageFault.
  virtual void evaluate() = 0;
};

// gravitas_host::derivative of plugins in this process. What is thrown meanwhile is kept in `nested`.
std::int32_t answer_derivative(DerivativeSource* source, Arena* arena, const gravitas_column* request,
                               gravitas_reply_column* reply, std::exception_ptr* nested);

class Carrier {
 public:
  virtual ~Carrier() = default;

  // One attempt. Throws StageFault if the host dies, does not answer in time or answers with a bad frame.
  virtual CallResult call(const StageCall& call, Arena* arena, DerivativeSource* derivatives) = 0;

  // Asks the host to end; the destructor waits for it. Several hosts then end side by side.
  virtual void drain() {}

  // Ends the host at once; the destructor waits for it.
  virtual void kill() {}

  // False once the host's process has ended, or has not answered a heartbeat for long.
  virtual bool is_alive() const { return true; }

  // Process that hosts the plugins.
  virtual int process_id() const = 0;
  virtual Hosting hosting() const = 0;

  // What the host said went wrong besides its answers, and what a worker process wrote ("stdout: …"); taken out.
  virtual std::vector<std::string> take_complaints() { return {}; }

  // What keeps the host's process from harm, as it is enforced ("seccomp", "memory 4096 MiB"), and what could not be
  // ("no landlock: …"). Empty: nothing does.
  virtual std::vector<std::string> sandbox() const { return {}; }
};

// Loads the plugins into this process.
std::unique_ptr<Carrier> make_direct_carrier(const std::vector<PluginChoice>& plugins, std::uint32_t threads);

// Start a worker and wait until it serves. The plugins of the slot go to one worker: library plugins, or one command,
// or those of one address. A stop that is asked for meanwhile ends the waiting. Throw StageFault.
std::unique_ptr<Carrier> start_shared_memory_carrier(const SlotDescription& slot, std::uint32_t threads,
                                                     std::stop_token stop = {});
std::unique_ptr<Carrier> start_grpc_carrier(const SlotDescription& slot, std::uint32_t threads,
                                            std::stop_token stop = {});

// How an environment gets its hosts; called from several threads.
using HostStarter = std::function<std::unique_ptr<Carrier>(const SlotDescription&, std::uint32_t, std::stop_token)>;
// By the slot's hosting, one of the three above.
std::unique_ptr<Carrier> start_host(const SlotDescription& slot, std::uint32_t threads, std::stop_token stop);

// Program that hosts plugins in a process of its own: `gravitas-worker` beside the running program, unless set.
void set_worker_program(std::string path);
const std::string& worker_program();

// Whether worker processes that are started from now on restrict themselves (on unless set): off for debuggers.
void set_worker_sandbox(bool on);

}  // namespace gravitas::kernel
