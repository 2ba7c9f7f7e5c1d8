#include "services/run/fault_desk.h"

#include <fmt/format.h>
#include <signal.h>
#include <sys/wait.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <system_error>
#include <thread>
#include <utility>

#include "plugin_sdk/host/fault_injection.h"
#include "plugin_sdk/host/fault_kinds.h"
#include "plugin_sdk/slots.h"
#include "services/capsule/forwarding_host.h"
#include "services/run/kernel_names.h"
#include "services/run/session.h"

namespace gravitas {
namespace {

using host::InjectedFault;

constexpr const char* kFromOutside =
    "the worker of a Command commits no orders itself; allowed, since they come from outside: kill, hang, stop, "
    "without "
    "arguments";
constexpr const char* kElsewhere = "the worker at an Address is none that commits orders, and was not started here";
// What a process that was killed may take to be gone, and one that was stopped to stand.
constexpr std::chrono::seconds kEndPatience{1};

// A worker that knows orders: one of ours. By its program where somebody else's could be.
bool commits_orders(const kernel::PluginChoice& plugin, int process) {
  if (plugin.command.empty() && plugin.address.empty()) return true;
  const std::string ours = std::filesystem::path(kernel::worker_program()).filename().string();
  if (plugin.command.find(ours) != std::string::npos) return true;
  std::error_code unreadable;
  const std::filesystem::path program = std::filesystem::read_symlink(fmt::format("/proc/{}/exe", process), unreadable);
  // who is not known is asked
  return unreadable || program.filename().string().starts_with(ours);
}

// All threads of a child; true of what is no child, whose state nobody tells.
bool has_stopped(int process) {
  siginfo_t what{};
  const int told = ::waitid(P_PID, static_cast<id_t>(process), &what, WSTOPPED | WEXITED | WNOWAIT | WNOHANG);
  return told != 0 || what.si_pid == process;
}

std::string not_injected(std::string_view kind, std::uint32_t step) {
  return fmt::format("fault {} of step {} was not injected", kind, step);
}

bool is_slowness(std::string_view order) {
  std::string problem;
  const std::optional<host::FaultOrder> read = host::parse_fault_order(std::string(order), &problem);
  return read && (read->fault() == InjectedFault::kSlow || read->fault() == InjectedFault::kJitter ||
                  read->fault() == InjectedFault::kDelay);
}

bool can_come_from_outside(const std::string& order) {
  std::string problem;
  const std::optional<host::FaultOrder> read = host::parse_fault_order(order, &problem);
  if (!read || order.find(',') != std::string::npos) return false;
  return read->fault() == InjectedFault::kKill || read->fault() == InjectedFault::kHang ||
         read->fault() == InjectedFault::kStop;
}

class DeskHost final : public capsule::ForwardingHost {
 public:
  DeskHost(std::unique_ptr<kernel::Carrier> host, const kernel::PluginChoice& plugin,
           const std::unique_ptr<kernel::Environment>* world)
      : ForwardingHost(std::move(host)),
        commits_(host_->hosting() == kernel::Hosting::kDirect || commits_orders(plugin, host_->process_id())),
        is_elsewhere_(!plugin.address.empty()),
        world_(*world) {}

  kernel::CallResult call(const kernel::StageCall& call, kernel::Arena* arena,
                          kernel::DerivativeSource* derivatives) override {
    if (call.fault.empty()) return host_->call(call, arena, derivatives);
    if (commits_) {
      const auto begin = Clock::now();
      kernel::CallResult result = host_->call(call, arena, derivatives);
      const std::string_view mark = host::kNotInjected;
      if (result.status == GRAVITAS_OK && result.text.starts_with(mark))
        complain(call.fault, result.text.substr(mark.size()));
      else if (result.status == GRAVITAS_OK && is_slowness(call.fault))
        tell_slow(call.fault, std::chrono::duration<double, std::milli>(Clock::now() - begin).count());
      return result;
    }
    kernel::StageCall plain = call;
    plain.fault = {};
    come_from_outside(std::string(call.fault));
    return host_->call(plain, arena, derivatives);
  }

  std::vector<std::string> take_complaints() override {
    std::vector<std::string> all = std::exchange(complaints_, {});
    for (std::string& one : host_->take_complaints()) all.push_back(std::move(one));
    return all;
  }

 private:
  using Clock = std::chrono::steady_clock;

  std::uint32_t step() const { return world_ ? world_->step_count() + 1 : 0; }

  void complain(std::string_view order, const std::string& why) {
    complaints_.push_back(fmt::format("{}: {}", not_injected(order.substr(0, order.find(',')), step()), why));
  }

  // However little it is: of what nobody ordered, 20 ms may be a busy machine's doing (plugin_sdk/slow_calls.h).
  void tell_slow(std::string_view order, double milliseconds) {
    complaints_.push_back(
        fmt::format("it was slow by fault {} of step {}: the call took {:.3g} ms", order, step(), milliseconds));
  }

  void come_from_outside(const std::string& order) {
    if (is_elsewhere_) return complain(order, kElsewhere);
    if (!can_come_from_outside(order)) return complain(order, kFromOutside);
    if (order != "kill") {
      if (!host_->is_alive()) return;
      ::kill(host_->process_id(), SIGSTOP);
      // its threads stop one after the other: until the last has, one of them may answer
      return wait_while([&] { return !has_stopped(host_->process_id()); });
    }
    host_->kill();
    // so that it never has the request, which is then not to blame
    wait_while([&] { return host_->is_alive(); });
  }

  template <class Condition>
  static void wait_while(Condition&& condition) {
    const auto until = Clock::now() + kEndPatience;
    while (condition() && Clock::now() < until) std::this_thread::sleep_for(std::chrono::microseconds(200));
  }

  const bool commits_, is_elsewhere_;
  const std::unique_ptr<kernel::Environment>& world_;
  std::vector<std::string> complaints_;
};

bool share_process(const kernel::EnvironmentDescription& description, const std::string& a, const std::string& b) {
  if (a == b) return true;
  const auto process_of = [&](const std::string& name) {
    for (const Slot slot : kSlots)
      if (name == slot_name(slot)) return description.slot(slot).process;
    return std::string();
  };
  return !process_of(a).empty() && process_of(a) == process_of(b);
}

bool was_told(const report::v1::Report& report, const std::string& kind, std::uint32_t step) {
  return std::ranges::any_of(report.warnings(), [&](const std::string& warning) {
    return warning.find(not_injected(kind, step)) != std::string::npos;
  });
}

// How an order shows that was committed.
struct Trace {
  std::string kind;
  bool is_seen_later = false;  // in the next call
  bool is_sure = false;        // a call must have failed
};

Trace trace_of(const std::string& order) {
  std::string problem;
  const std::optional<host::FaultOrder> read = host::parse_fault_order(order, &problem);
  if (!read) return {};
  const bool ends = read->info().group == "process";
  const bool hangs = read->fault() == InjectedFault::kHang || read->fault() == InjectedFault::kDeadlock ||
                     read->fault() == InjectedFault::kStop;
  return {std::string(read->info().name), ends && read->moment() == host::Moment::kReply, ends || hangs};
}

}  // namespace

kernel::HostStarter with_fault_desk(kernel::HostStarter starter, const std::unique_ptr<kernel::Environment>* world) {
  return [starter = std::move(starter), world](const kernel::SlotDescription& slot, std::uint32_t threads,
                                               std::stop_token stop) -> std::unique_ptr<kernel::Carrier> {
    return std::make_unique<DeskHost>(starter(slot, threads, std::move(stop)), slot.plugins[0], world);
  };
}

void order_fault(const kernel::FaultInjection& fault, const kernel::EnvironmentDescription& description,
                 std::span<const kernel::SwapOrder> swaps, kernel::Environment* world) {
  const auto takes_place = [&](const kernel::SwapOrder& swap) {
    return swap.slot == fault.slot && swap.step <= fault.step;
  };
  bool is_foreign = false, is_elsewhere = false, is_known = std::ranges::any_of(swaps, takes_place);
  for (const kernel::PlannedSlot& host : world->plan().slots) {
    if (host.slot != fault.slot) continue;
    for (const kernel::PluginChoice& plugin : description.slot(fault.slot).plugins) {
      if (std::ranges::find(host.plugins, plugin.declaration.name) == host.plugins.end()) continue;
      const bool commits = commits_orders(plugin, host.process_id);
      is_known |= commits;
      is_foreign |= !commits;
      is_elsewhere |= !commits && !plugin.address.empty();
    }
  }
  if (is_foreign && !is_known && (is_elsewhere || !can_come_from_outside(fault.order)))
    throw BadInput(fmt::format("fault {} in slot {}: {}", fault.order, slot_name(fault.slot),
                               is_elsewhere ? kElsewhere : kFromOutside));
  world->inject(fault);
}

std::string fault_text(const kernel::FaultInjection& fault) {
  return fmt::format("{}:{}@step={}{}", slot_name(fault.slot), fault.order, fault.step,
                     fault.times > 1 ? fmt::format(",times={}", fault.times) : "");
}

void leave_out_committed(std::span<const recorder::v1::Decision> taken_over,
                         const kernel::EnvironmentDescription& description,
                         std::vector<kernel::FaultInjection>* orders) {
  std::erase_if(*orders, [&](const kernel::FaultInjection& order) {
    return std::ranges::any_of(taken_over, [&](const recorder::v1::Decision& one) {
      return one.step() == order.step && share_process(description, one.slot(), slot_name(order.slot));
    });
  });
}

void name_orders(std::span<const kernel::FaultInjection> orders, const kernel::EnvironmentDescription& description,
                 StepsMade steps, bool is_over, report::v1::Report* report) {
  for (const kernel::FaultInjection& order : orders) {
    const Trace trace = trace_of(order.order);
    std::uint32_t found = 0;
    for (report::v1::FaultRecord& fault : *report->mutable_faults()) {
      if (found == order.times || !fault.ordered().empty() || fault.kind() != trace.kind ||
          fault.slot() != slot_name(order.slot) || fault.step() != order.step)
        continue;
      fault.set_ordered(fault_text(order));
      ++found;
    }
    // whoever of its process is asked next misses it
    for (report::v1::FaultRecord& fault : *report->mutable_faults()) {
      const bool is_it = trace.is_seen_later && fault.ordered().empty() &&
                         fault.kind() == fault_kind_name(kernel::FaultKind::kDeath) &&
                         (fault.step() == order.step || fault.step() == order.step + 1) &&
                         share_process(description, fault.slot(), slot_name(order.slot));
      if (found > 0 || !is_it) continue;
      fault.set_kind(trace.kind);
      fault.set_ordered(fault_text(order));
      ++found;
    }
    if (found > 0 || !trace.is_sure || order.step + (trace.is_seen_later && !is_over ? 1 : 0) > steps.last ||
        was_told(*report, trace.kind, order.step))
      continue;
    if (order.step <= steps.checkpoint)
      report->add_warnings(fmt::format("fault {} is left out: that step lies before the checkpoint of step {}",
                                       fault_text(order), steps.checkpoint));
    else
      report->add_warnings(fmt::format("fault {} shows in no failed call: {}", fault_text(order),
                                       trace.is_seen_later ? "nobody of that process was asked anything after it"
                                                           : "its slot was not asked anything in that step"));
  }
}

}  // namespace gravitas
