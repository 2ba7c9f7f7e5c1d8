#include "services/campaign/simulated_carrier.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <exception>
#include <map>
#include <mutex>
#include <optional>
#include <thread>

#include "kernel/fault.h"
#include "plugin_sdk/channel/mailbox.h"
#include "plugin_sdk/channel/reply_frame.h"
#include "plugin_sdk/host/fault_injection.h"
#include "plugin_sdk/host/faulty_reply.h"
#include "plugin_sdk/host/hosted_plugins.h"

namespace gravitas::campaign {
namespace {

using host::InjectedFault;
using kernel::FaultKind;
using kernel::StageFault;

// Loading makes a private copy of a file, so each is loaded once.
PluginLibrary load_once(const std::string& path) {
  static std::mutex mutex;
  static std::map<std::string, PluginLibrary> loaded;
  const std::lock_guard lock(mutex);
  PluginLibrary& library = loaded[path];
  std::string problem;
  if (library.table == nullptr) library = load_plugin_library(path, &problem);
  if (library.table == nullptr) throw StageFault(FaultKind::kHandshake, "handshake", problem);
  return library;
}

std::vector<PluginLibrary> load_all(const std::vector<kernel::PluginChoice>& plugins) {
  std::vector<PluginLibrary> libraries;
  for (const kernel::PluginChoice& plugin : plugins) libraries.push_back(load_once(plugin.library));
  return libraries;
}

// What a worker process writes and the kernel reads: a segment's worth.
struct Reply {
  gravitas_frame_header header{};
  std::array<gravitas_frame_column, GRAVITAS_MAX_COLUMNS> columns{};
  std::vector<std::uint64_t> data;

  std::byte* bytes() { return reinterpret_cast<std::byte*>(data.data()); }
};

class SimulatedCarrier final : public kernel::Carrier {
 public:
  SimulatedCarrier(const kernel::SlotDescription& slot, std::uint32_t threads)
      : hosting_(slot.hosting), deadline_(slot.deadline), defences_(slot.defences), plugins_(load_all(slot.plugins)) {
    static std::atomic<std::uint64_t> epochs{0};
    epoch_ = ++epochs;
    std::vector<std::vector<double>> settings;
    for (const kernel::PluginChoice& plugin : slot.plugins) settings.push_back(plugin.settings);
    const std::string problem = plugins_.create(settings, threads);
    if (!problem.empty()) throw StageFault(FaultKind::kHandshake, "handshake", problem);
  }

  kernel::CallResult call(const kernel::StageCall& call, kernel::Arena* arena,
                          kernel::DerivativeSource* derivatives) override;
  void kill() override { dead_ = true; }
  bool is_alive() const override { return !dead_; }
  int process_id() const override { return getpid(); }
  kernel::Hosting hosting() const override { return hosting_; }

 private:
  class Derivatives;
  // Of the calls that are open: while an integrator asks, another plugin of the same host may be called.
  struct OpenCall {
    std::uint64_t sequence = 0;
    std::array<channel::Room, GRAVITAS_MAX_COLUMNS> rooms{};
    Reply reply, before;  // of this call and of the one before
  };

  [[noreturn]] void die(const char* when, bool is_unread = false) {
    dead_ = true;
    StageFault fault(FaultKind::kDeath, "pidfd", std::string("it died ") + when);
    fault.is_unread = is_unread;
    throw StageFault(fault);
  }
  [[noreturn]] void be_overdue() {
    // without a deadline whoever waits for it waits for ever
    while (!defences_.deadline) std::this_thread::sleep_for(std::chrono::hours(1));
    dead_ = true;
    throw StageFault(FaultKind::kDeadline, "deadline", "it did not answer within its deadline");
  }
  [[noreturn]] void reject(const std::string& why) {
    dead_ = true;
    throw StageFault(FaultKind::kBadFrame, "wire", "its answer has " + why);
  }
  bool is_too_slow(const host::FaultOrder& order) const;
  std::int32_t misbehave(const host::FaultOrder& order, const stage::MethodInfo& method, const gravitas_column* request,
                         gravitas_reply_column* reply, std::string* text, bool* is_void);
  kernel::CallResult call(OpenCall* open, const kernel::StageCall& call, kernel::Arena* arena,
                          kernel::DerivativeSource* derivatives);
  kernel::CallResult take(OpenCall* open, const kernel::StageCall& call, std::string text, kernel::Arena* arena);

  const kernel::Hosting hosting_;
  const double deadline_;
  const kernel::Defences defences_;
  host::HostedPlugins plugins_;
  std::uint64_t epoch_ = 0, sequence_ = 0;
  std::atomic<bool> dead_{false};
  std::array<OpenCall, 2> calls_;
  std::size_t depth_ = 0;
};

// Answers the plugin's questions as the kernel's side of a carrier does.
class SimulatedCarrier::Derivatives final : public host::CallServices {
 public:
  Derivatives(kernel::Arena* arena, kernel::DerivativeSource* source) : arena_(arena), source_(source) {}
  void mark_progress() override {}
  std::int32_t derivative(const gravitas_column* request, gravitas_reply_column* reply) override {
    if (source_ == nullptr) return GRAVITAS_CALLBACK_FAILED;
    return kernel::answer_derivative(source_, arena_, request, reply, &nested_);
  }
  void rethrow() const {
    if (nested_) std::rethrow_exception(nested_);
  }

 private:
  kernel::Arena* arena_;
  kernel::DerivativeSource* source_;
  std::exception_ptr nested_;
};

bool SimulatedCarrier::is_too_slow(const host::FaultOrder& order) const {
  switch (order.fault()) {
    case InjectedFault::kHang:
    case InjectedFault::kDeadlock:
    case InjectedFault::kStop:
    case InjectedFault::kDrop:
      return true;
    case InjectedFault::kSlow:
    case InjectedFault::kDelay:
    case InjectedFault::kJitter:
      return (order.gives("seconds") && order.number("seconds") > deadline_) ||
             (order.fault() == InjectedFault::kSlow && order.number("factor") * 1e-3 > deadline_);
    default:
      return false;
  }
}

// What a worker does between the plugin's answer and the frame of it. Returns the status that holds.
std::int32_t SimulatedCarrier::misbehave(const host::FaultOrder& order, const stage::MethodInfo& method,
                                         const gravitas_column* request, gravitas_reply_column* reply,
                                         std::string* text, bool* is_void) {
  const bool is_process = order.info().group == "process";
  if (is_process && order.moment() == host::Moment::kCompute) die("computing");
  if (is_too_slow(order)) be_overdue();
  if (order.fault() == InjectedFault::kMemory) *text = "not enough memory";
  if (order.fault() == InjectedFault::kRounding) *text = "the plugin changed the floating-point environment";
  std::string obstacle;
  if (host::changes_reply(order.fault())) obstacle = host::change_reply(order, method, request, reply);
  const bool needs_payload = order.fault() == InjectedFault::kTruncate || order.fault() == InjectedFault::kFlip;
  for (std::size_t i = 0; i < method.reply.size(); ++i)
    if (text->empty() && reply[i].count > reply[i].capacity) return GRAVITAS_NEEDS_CAPACITY;
  if (needs_payload && host::payload_bits(method.reply, reply) == 0) obstacle = "there is nothing to damage";
  *is_void = !obstacle.empty();
  return text->empty() ? GRAVITAS_OK : GRAVITAS_FAILED;
}

kernel::CallResult SimulatedCarrier::call(const kernel::StageCall& call, kernel::Arena* arena,
                                          kernel::DerivativeSource* derivatives) {
  OpenCall* open = &calls_.at(depth_++);
  try {
    kernel::CallResult result = this->call(open, call, arena, derivatives);
    --depth_;
    return result;
  } catch (...) {
    --depth_;
    throw;
  }
}

kernel::CallResult SimulatedCarrier::call(OpenCall* open, const kernel::StageCall& call, kernel::Arena* arena,
                                          kernel::DerivativeSource* derivatives) {
  if (dead_) die("between two calls", true);
  const stage::MethodInfo& method = call.info();
  std::optional<host::FaultOrder> order;
  std::string text;
  if (!call.fault.empty()) order = host::parse_fault_order(call.fault, &text);
  const bool is_process = order && order->info().group == "process";
  if (is_process && order->moment() == host::Moment::kRead) die("with the request read");
  open->sequence = ++sequence_;

  // rooms and columns, as in a response segment
  const auto request = kernel::plain_columns(*arena, call.request);
  std::array<gravitas_reply_column, GRAVITAS_MAX_COLUMNS> reply;
  std::uint64_t words = 0;
  for (std::size_t i = 0; i < call.reply.size(); ++i) {
    open->rooms[i] = {8 * words, arena->capacity(call.reply[i])};
    words += (open->rooms[i].capacity + 7) / 8 * 8;
  }
  if (!defences_.epoch) open->before = open->reply;
  if (open->reply.data.size() < words) open->reply.data.resize(words);
  for (std::size_t i = 0; i < call.reply.size(); ++i)
    reply[i] = {open->reply.bytes() + open->rooms[i].offset, open->rooms[i].capacity, 0};

  Derivatives services(arena, derivatives);
  arena->hold();
  host::CallEnd end = plugins_.call(call.target, call.method, request.data(), reply.data(), &services);
  arena->let_go();
  services.rethrow();
  if (dead_) die("while another plugin of its process was asked");
  bool is_void = false;  // there is nothing that it could be carried out on
  if (end.status == GRAVITAS_OK && order)
    end.status = misbehave(*order, method, request.data(), reply.data(), &end.text, &is_void);

  // the frame
  gravitas_frame_header& header = open->reply.header;
  header = {};
  header.magic = GRAVITAS_MAGIC;
  header.epoch = epoch_;
  header.sequence = open->sequence;
  header.kind = GRAVITAS_FRAME_REPLY;
  header.method = static_cast<std::uint32_t>(call.method);
  header.target = call.target;
  header.status = end.status;
  header.column_count = static_cast<std::uint32_t>(call.reply.size());
  const std::span columns = std::span(open->reply.columns).first(call.reply.size());
  std::array<const void*, GRAVITAS_MAX_COLUMNS> data{};
  for (std::size_t i = 0; i < columns.size(); ++i) {
    columns[i] = {open->rooms[i].offset, reply[i].count, open->rooms[i].capacity};
    data[i] = reply[i].data;
  }
  const bool is_spoilt = order && end.status == GRAVITAS_OK && !is_void;
  std::optional<host::FaultInjection> injection;
  if (is_spoilt) {
    injection.emplace(*order);
    header.epoch = injection->epoch(epoch_);
    header.sequence = injection->sequence(open->sequence);
  }
  header.digest =
      channel::frame_digest(header, columns, method.reply, end.status == GRAVITAS_OK ? data.data() : nullptr);
  if (is_spoilt) injection->spoil_frame(&header, columns, method.reply, reply.data());
  if (is_process && order->moment() == host::Moment::kWrite) die("with its reply half written");
  kernel::CallResult result = take(open, call, std::move(end.text), arena);
  // who waits for it sees the reply first
  if (is_process && end.status == GRAVITAS_OK) dead_ = true;
  return result;
}

// The kernel's side: what is late is dropped, the rest copied and checked.
kernel::CallResult SimulatedCarrier::take(OpenCall* open, const kernel::StageCall& call, std::string text,
                                          kernel::Arena* arena) {
  Reply* reply = &open->reply;
  const gravitas_frame_header& header = reply->header;
  const bool is_late = header.epoch != epoch_ || header.sequence != open->sequence;
  if (header.epoch == epoch_ && header.magic != GRAVITAS_MAGIC) reject("a header without the magic");
  if (header.magic != GRAVITAS_MAGIC || (is_late && defences_.epoch)) be_overdue();
  // an answer to the call before, taken for one to this
  Reply* taken =
      is_late && open->before.header.method == header.method && open->before.data.size() == reply->data.size()
          ? &open->before
          : reply;
  if (taken->header.kind != GRAVITAS_FRAME_REPLY || taken->header.method != static_cast<std::uint32_t>(call.method))
    reject("another message");
  std::array<std::byte*, GRAVITAS_MAX_COLUMNS> targets;
  for (std::size_t i = 0; i < call.reply.size(); ++i) targets[i] = arena->data(call.reply[i]);
  const std::string problem =
      channel::read_reply_frame(taken->header, std::span(taken->columns).first(call.reply.size()), call.info().reply,
                                std::span(open->rooms).first(call.reply.size()), taken->bytes(),
                                std::span(targets).first(call.reply.size()), defences_.digest);
  if (!problem.empty()) reject(problem);
  kernel::CallResult result;
  result.status = taken->header.status;
  if (result.status == GRAVITAS_OK || result.status == GRAVITAS_NEEDS_CAPACITY)
    for (std::size_t i = 0; i < call.reply.size(); ++i) arena->set_count(call.reply[i], taken->columns[i].count);
  result.text = std::move(text);
  return result;
}

// One slot in so many has a start that fails.
constexpr std::uint64_t kFailingSlots = 6;

}  // namespace

SimulatedHosts::SimulatedHosts(std::uint64_t seed) : starts_(std::make_shared<std::array<Starts, kSlotCount>>()) {
  host::RandomNumbers numbers(~seed);
  for (Starts& starts : *starts_) {
    if (numbers.next() % kFailingSlots == 0) starts.fails = static_cast<std::uint32_t>(2 + numbers.next() % 3);
    starts.dies = numbers.next() % 2 == 0;
  }
}

kernel::HostStarter SimulatedHosts::starter() const {
  return [starts = starts_](const kernel::SlotDescription& slot, std::uint32_t threads,
                            const std::stop_token&) -> std::unique_ptr<kernel::Carrier> {
    Starts& here = (*starts)[static_cast<std::size_t>(slot.plugins[0].declaration.slot)];
    const bool fails = ++here.made == here.fails;
    if (fails && !here.dies) throw StageFault(FaultKind::kHandshake, "handshake", "it refused to serve");
    auto carrier = std::make_unique<SimulatedCarrier>(slot, threads);
    if (fails) carrier->kill();
    return carrier;
  };
}

std::vector<SimulatedHosts::FailedStart> SimulatedHosts::failed_starts() const {
  std::vector<FailedStart> failed;
  for (std::size_t i = 1; i < kSlotCount; ++i) {
    const Starts& starts = (*starts_)[i];
    if (starts.fails > 0 && starts.made >= starts.fails) failed.push_back({static_cast<Slot>(i), starts.dies});
  }
  return failed;
}

}  // namespace gravitas::campaign
