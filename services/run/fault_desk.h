// Faults that workers are ordered to commit, where these cannot, or do not know how: who is no gravitas-worker ignores the
// order, so it is killed or stopped from outside; and what could not be committed is told.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "gravitas/recorder/v1/checkpoint.pb.h"
#include "gravitas/report/v1/report.pb.h"
#include "kernel/environment.h"

namespace gravitas {

// Hosts of `starter` for *world, the environment that steps. A worker that commits no orders itself is killed (kill) before
// it has the request, or stopped (hang, stop), if it was started here; all else that was not committed is told in the
// warnings, and the call goes on undisturbed. `world` must live as long as they do.
kernel::HostStarter with_fault_desk(kernel::HostStarter starter, const std::unique_ptr<kernel::Environment>* world);

// Orders a fault. `description`: who answers; with the swaps that are to come. Throws BadInput for what nobody in the slot
// can be made to commit, and what kernel::Environment::inject() throws.
void order_fault(const kernel::FaultInjection& fault, const kernel::EnvironmentDescription& description,
                 std::span<const kernel::SwapOrder> swaps, kernel::Environment* world);

// Leaves out the orders of steps in which somebody else took over in their slot's process, as a journal has it: they were
// committed before, and who answers there from the beginning of the step is not meant.
void leave_out_committed(std::span<const recorder::v1::Decision> taken_over,
                         const kernel::EnvironmentDescription& description,
                         std::vector<kernel::FaultInjection>* orders);

// As --fault has it.
std::string fault_text(const kernel::FaultInjection& fault);

// Says of the report's faults which orders they come from, be it that a worker died between two calls; and warns of orders
// that should have shown in a failed call of the steps made, or in the first of the next if there is one, and did not. What
// the report says was not injected is left at that.
struct StepsMade {
  std::uint32_t checkpoint;  // the run went on from that step; 0: from the start
  std::uint32_t last;
};
void name_orders(std::span<const kernel::FaultInjection> orders, const kernel::EnvironmentDescription& description,
                 StepsMade steps, bool is_over, report::v1::Report* report);

}  // namespace gravitas
