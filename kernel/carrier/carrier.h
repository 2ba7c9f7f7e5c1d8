// A carrier takes stage calls to the plugins of one host and brings their answers back. Carriers differ in where
// the host is (this process, another one); the contract, and every bit of the answer, is the same.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
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

  const stage::MethodInfo& info() const { return stage::method_info(method); }
};

struct CallResult {
  std::int32_t status = GRAVITAS_OK;  // GRAVITAS_OK, _NEEDS_CAPACITY (counts say how much), _REFUSED, _FAILED …
  std::string text;                   // why it was refused or failed
  std::uint64_t compute_ns = 0;       // time the plugin worked, if the carrier knows it apart
  std::uint64_t check_ns = 0;         // time the frame of the answer was checked
};

// Answers Integrator.Derivative while an Integrate call is open. `request` names arena columns that hold the
// trial state; the answer is in the arena column `wrench`.
class DerivativeSource {
 public:
  virtual ~DerivativeSource() = default;
  // Columns that the trial state is to be copied to (kColumnCount of the request).
  virtual std::span<const ColumnId> trial_columns() const = 0;
  virtual ColumnId wrench_column() const = 0;
  // Evaluates the wrenches of the state in the trial columns. Throws StageFault.
  virtual void evaluate() = 0;
};

class Carrier {
 public:
  virtual ~Carrier() = default;

  // One attempt. Throws StageFault if the host dies, does not answer in time or answers with a bad frame.
  virtual CallResult call(const StageCall& call, Arena* arena, DerivativeSource* derivatives) = 0;

  // Asks the host to end; the destructor waits for it. Several hosts then end side by side.
  virtual void drain() {}

  // Process that hosts the plugins.
  virtual int process_id() const = 0;
  virtual Hosting hosting() const = 0;

  // What the host said went wrong besides its answers; taken out.
  virtual std::vector<std::string> take_complaints() { return {}; }
};

// Loads the plugins into this process.
std::unique_ptr<Carrier> make_direct_carrier(const std::vector<PluginChoice>& plugins, std::uint32_t threads);

// A worker process that is being started; finish() waits for it, so that several can start at once.
class PendingCarrier {
 public:
  virtual ~PendingCarrier() = default;
  virtual std::unique_ptr<Carrier> finish() = 0;
};
// The plugins of the slot go to one worker: library plugins, or one command, or those of one address.
std::unique_ptr<PendingCarrier> start_shared_memory_carrier(const SlotDescription& slot, std::uint32_t threads);
std::unique_ptr<PendingCarrier> start_grpc_carrier(const SlotDescription& slot, std::uint32_t threads);

// Program that hosts plugins in a process of its own: `gravitas-worker` beside the running program, unless set.
void set_worker_program(std::string path);
const std::string& worker_program();

}  // namespace gravitas::kernel
