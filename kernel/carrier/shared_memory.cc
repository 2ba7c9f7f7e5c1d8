// A worker process with its data in shared memory.
//
// Control (handshake, heartbeat, drain) is gRPC over an inherited socket pair; calls go through the mailboxes of
// plugin_sdk/channel/mailbox.h. Columns of a request are offsets into the arena's segment, which the worker maps
// read-only; the answer comes in a response segment that belongs to this incarnation of the worker and is copied
// out before it is looked at. A segment that must be replaced is sent over a second inherited socket pair.
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <system_error>

#include "kernel/carrier/carrier.h"
#include "kernel/control_session.h"
#include "kernel/fault.h"
#include "kernel/supervisor.h"
#include "plugin_sdk/channel/mailbox.h"

namespace gravitas::kernel {
namespace {

using channel::Mailbox;
using channel::Segment;
using channel::SegmentRole;

constexpr std::chrono::seconds kStartLimit{10};
// How long a worker that was asked to end may take.
constexpr int kDrainMilliseconds = 1000;
// A call ends at this many deadlines, whatever its marks of progress.
constexpr std::uint64_t kDeadlineCap = 10;
// A waiting kernel looks at the worker's marks of progress this often.
constexpr std::uint64_t kLookNs = 50'000'000;

constexpr std::uint64_t kPage = 4096;
constexpr std::uint64_t aligned(std::uint64_t bytes, std::uint64_t unit) { return (bytes + unit - 1) / unit * unit; }

std::string program = [] {
  char path[4096];
  const ssize_t size = readlink("/proc/self/exe", path, sizeof path);
  std::string self(path, size > 0 ? static_cast<std::size_t>(size) : 0);
  return self.substr(0, self.rfind('/') + 1) + "gravitas-worker";
}();

// Epochs are unique in this process, so an answer of another incarnation can never be taken for one of ours.
std::uint64_t next_epoch() {
  static std::atomic<std::uint64_t> epoch{0};
  return ++epoch;
}

class SharedMemoryCarrier final : public Carrier {
 public:
  SharedMemoryCarrier(const std::vector<PluginChoice>& plugins, std::uint32_t threads, double deadline);
  ~SharedMemoryCarrier() override;

  // Waits for the handshake and hands over the mailboxes.
  void finish();
  CallResult call(const StageCall& call, Arena* arena, DerivativeSource* derivatives) override;
  void drain() override;
  int process_id() const override { return connection_->process->process_id(); }
  Hosting hosting() const override { return Hosting::kSharedMemory; }
  std::vector<std::string> take_complaints() override { return connection_->control->take_faults(); }

 private:
  // What outlives this object until the process has been reaped: the mailbox that the watcher wakes.
  struct Connection {
    Segment kernel_segment, worker_segment;
    Mailbox* mine = nullptr;
    Mailbox* theirs = nullptr;
    std::shared_ptr<WorkerProcess> process;
    std::unique_ptr<ControlSession> control;
  };

  void make_rooms(const StageCall& call, const Arena& arena, const DerivativeSource* derivatives);
  void send_new_segments(const Arena& arena);
  void post_frame(gravitas_frame_header header, std::span<const ColumnId> columns, const Arena& arena);
  gravitas_frame_header wait_for_message(std::uint64_t* spent_ns);
  void take_columns(const gravitas_frame_header& header, std::span<const stage::ColumnInfo> infos,
                    std::span<const ColumnId> targets, std::size_t first_room, Arena* arena);
  void answer_callback(const gravitas_frame_header& header, std::size_t first_room, Arena* arena,
                       DerivativeSource* derivatives);
  [[noreturn]] void report_death();
  [[noreturn]] void report_bad_frame(const std::string& what);

  std::vector<PluginChoice> plugins_;
  std::uint64_t deadline_ns_;
  std::uint64_t epoch_ = next_epoch();
  std::uint64_t sequence_ = 0;
  std::uint32_t seen_ = 0;
  int descriptor_socket_ = -1;
  std::shared_ptr<Connection> connection_ = std::make_shared<Connection>();

  Segment response_;
  std::uint64_t response_generation_ = 0;
  std::uint64_t sent_state_ = 0, sent_response_ = 0;
  std::array<std::uint64_t, GRAVITAS_MAX_COLUMNS> room_offset_{};
  std::array<std::uint64_t, GRAVITAS_MAX_COLUMNS> room_capacity_{};
  std::size_t rooms_ = 0;
};

SharedMemoryCarrier::SharedMemoryCarrier(const std::vector<PluginChoice>& plugins, std::uint32_t threads,
                                         double deadline)
    : plugins_(plugins), deadline_ns_(static_cast<std::uint64_t>(deadline * 1e9)) {
  int control[2], descriptors[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, control) != 0 ||
      socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, descriptors) != 0)
    throw StageFault(FaultKind::kHandshake, "handshake", std::string("no sockets: ") + std::strerror(errno));
  descriptor_socket_ = descriptors[0];

  Connection& connection = *connection_;
  connection.kernel_segment =
      Segment::create("gravitas kernel mailbox", aligned(sizeof(Mailbox), kPage), channel::Sharing::kReadersOnly);
  connection.worker_segment =
      Segment::create("gravitas worker mailbox", aligned(sizeof(Mailbox), kPage), channel::Sharing::kWriters);
  connection.mine = reinterpret_cast<Mailbox*>(connection.kernel_segment.data());
  connection.theirs = reinterpret_cast<Mailbox*>(connection.worker_segment.data());
  connection.theirs->cpu = ~0U;

  std::vector<std::string> arguments = {program, "--control-fd", "3", "--descriptor-fd", "4"};
  control::v1::Hello hello = hello_of_this_kernel();
  hello.set_epoch(epoch_);
  hello.set_nonce(channel::now_ns() ^ (static_cast<std::uint64_t>(getpid()) << 32));
  hello.set_threads(threads);
  for (const PluginChoice& plugin : plugins_) {
    arguments.push_back(plugin.library);
    control::v1::PluginSettings* settings = hello.add_plugins();
    settings->set_plugin(plugin.declaration.name);
    for (const double number : plugin.settings) settings->add_numbers(number);
  }
  try {
    connection.process = Supervisor::instance().spawn(arguments, {control[1], descriptors[1]}, [shared = connection_] {
      // a dead process posts nothing any more: its word is ours to count up, and the sleeper ours to wake
      shared->theirs->signal.fetch_add(1, std::memory_order_seq_cst);
      channel::wake(shared->theirs);
    });
  } catch (const std::system_error& error) {
    for (const int descriptor : {control[0], control[1], descriptors[1]}) close(descriptor);
    throw StageFault(FaultKind::kHandshake, "handshake",
                     std::string("cannot start '") + program + "': " + error.what());
  }
  close(control[1]);
  close(descriptors[1]);
  connection.control = std::make_unique<ControlSession>(control[0], std::move(hello));
}

void SharedMemoryCarrier::finish() {
  const std::string problem = connection_->control->wait_until_ready(kStartLimit);
  if (!problem.empty()) throw StageFault(FaultKind::kHandshake, "handshake", problem);
  if (connection_->control->welcome().plugins_size() != static_cast<int>(plugins_.size()))
    throw StageFault(FaultKind::kHandshake, "handshake", "it serves another number of plugins than asked for");
  const auto send = [&](SegmentRole role, const Segment& segment) {
    return channel::send_segment(descriptor_socket_, {role, 0, 0, segment.size()}, segment.descriptor());
  };
  if (!send(SegmentRole::kKernelMailbox, connection_->kernel_segment) ||
      !send(SegmentRole::kWorkerMailbox, connection_->worker_segment))
    report_death();
}

// Said on both ways: the data loop sleeps on its mailbox, not on the stream.
void SharedMemoryCarrier::drain() {
  connection_->control->drain();
  gravitas_frame_header stop{};
  stop.kind = GRAVITAS_FRAME_STOP;
  stop.epoch = epoch_;
  std::memcpy(&connection_->mine->header, &stop, sizeof stop);
  channel::post(connection_->mine, connection_->theirs);
}

SharedMemoryCarrier::~SharedMemoryCarrier() {
  drain();
  close(descriptor_socket_);
  if (!connection_->process->wait(kDrainMilliseconds)) {
    connection_->process->kill();
    connection_->process->wait(kDrainMilliseconds);
  }
  connection_->control.reset();
}

// Room in the response segment for the reply's columns, as much as the arena has, and behind it for the trial
// states of derivative requests.
void SharedMemoryCarrier::make_rooms(const StageCall& call, const Arena& arena, const DerivativeSource* derivatives) {
  std::uint64_t offset = 0;
  rooms_ = 0;
  const auto add = [&](std::uint64_t capacity) {
    room_offset_[rooms_] = offset;
    room_capacity_[rooms_++] = capacity;
    offset += aligned(capacity * 8, GRAVITAS_COLUMN_ALIGNMENT);
  };
  for (const ColumnId column : call.reply) add(arena.capacity(column));
  if (derivatives != nullptr)
    for (const ColumnId column : derivatives->trial_columns()) add(arena.count(column));
  if (offset <= response_.size()) return;
  response_ = Segment::create("gravitas response", aligned(std::max(offset, 2 * response_.size()), kPage),
                              channel::Sharing::kWriters);
  ++response_generation_;
}

void SharedMemoryCarrier::send_new_segments(const Arena& arena) {
  bool sent = true;
  if (sent_response_ != response_generation_) {
    sent =
        channel::send_segment(descriptor_socket_, {SegmentRole::kResponse, 0, response_generation_, response_.size()},
                              response_.descriptor());
    sent_response_ = response_generation_;
  }
  if (sent && sent_state_ != arena.generation()) {
    sent =
        channel::send_segment(descriptor_socket_, {SegmentRole::kState, 0, arena.generation(), arena.segment().size()},
                              arena.segment().descriptor());
    sent_state_ = arena.generation();
  }
  if (!sent) report_death();
}

void SharedMemoryCarrier::post_frame(gravitas_frame_header header, std::span<const ColumnId> columns,
                                     const Arena& arena) {
  Mailbox* mine = connection_->mine;
  header.magic = GRAVITAS_MAGIC;
  header.schema_hash = stage::kSchemaHash;
  header.epoch = epoch_;
  header.sequence = sequence_;
  header.column_count = static_cast<std::uint32_t>(columns.size());
  header.state_generation = arena.generation();
  header.response_generation = response_generation_;
  for (std::size_t i = 0; i < columns.size(); ++i)
    mine->columns[i] = {arena.offset(columns[i]), arena.count(columns[i]), arena.capacity(columns[i])};
  header.digest = channel::frame_digest(header, std::span(mine->columns).first(columns.size()), {}, nullptr);
  std::memcpy(&mine->header, &header, sizeof header);
  channel::post(mine, connection_->theirs);
}

CallResult SharedMemoryCarrier::call(const StageCall& call, Arena* arena, DerivativeSource* derivatives) {
  if (connection_->process->has_ended()) report_death();
  make_rooms(call, *arena, derivatives);
  send_new_segments(*arena);

  gravitas_frame_header request{};
  ++sequence_;
  request.kind = GRAVITAS_FRAME_REQUEST;
  request.method = static_cast<std::uint32_t>(call.method);
  request.target = call.target;
  request.reply_count = static_cast<std::uint32_t>(rooms_);
  request.deadline_ns = channel::now_ns() + deadline_ns_;
  for (std::size_t i = 0; i < rooms_; ++i) connection_->mine->reply[i] = {room_offset_[i], 0, room_capacity_[i]};
  post_frame(request, call.request, *arena);

  std::uint64_t spent_ns = 0;
  gravitas_frame_header answer = wait_for_message(&spent_ns);
  while (answer.kind == GRAVITAS_FRAME_CALLBACK) {
    answer_callback(answer, call.reply.size(), arena, derivatives);
    answer = wait_for_message(&spent_ns);
  }
  if (answer.kind != GRAVITAS_FRAME_REPLY || answer.method != request.method) report_bad_frame("another message");

  CallResult result;
  result.status = answer.status;
  result.compute_ns = connection_->theirs->compute_ns;
  if (answer.status != GRAVITAS_OK) {
    std::array<char, sizeof Mailbox::text> text;
    std::memcpy(text.data(), connection_->theirs->text, text.size());
    text.back() = '\0';
    result.text = text.data();
  }
  take_columns(answer, call.info().reply, call.reply, 0, arena);
  return result;
}

// Waits until the worker posts a message of this call, dies, or runs out of time.
gravitas_frame_header SharedMemoryCarrier::wait_for_message(std::uint64_t* spent_ns) {
  Mailbox* mine = connection_->mine;
  const Mailbox* theirs = connection_->theirs;
  const std::uint64_t start = channel::now_ns();
  const std::uint64_t cap = start + kDeadlineCap * deadline_ns_ - std::min(*spent_ns, kDeadlineCap * deadline_ns_);
  std::uint64_t until = std::min(start + deadline_ns_, cap);
  std::uint64_t marks = theirs->progress.load(std::memory_order_relaxed);
  for (;;) {
    const std::uint64_t look = std::min(until, channel::now_ns() + kLookNs);
    if (channel::wait(mine, theirs, seen_, look) == channel::Waited::kMessage) {
      seen_ = theirs->signal.load(std::memory_order_acquire);
      gravitas_frame_header header;
      std::memcpy(&header, &theirs->header, sizeof header);
      if (header.kind == GRAVITAS_FRAME_CRASH && header.epoch == epoch_) {
        connection_->process->wait(kDrainMilliseconds);
        report_death();
      }
      if (header.epoch == epoch_ && header.sequence == sequence_ && header.magic == GRAVITAS_MAGIC) {
        *spent_ns += channel::now_ns() - start;
        return header;
      }
      // a late or foreign message is dropped
      if (connection_->process->has_ended()) report_death();
      if (header.epoch == epoch_ && header.magic != GRAVITAS_MAGIC) report_bad_frame("a header without the magic");
      continue;
    }
    const std::uint64_t now = channel::now_ns();
    const std::uint64_t seen_marks = theirs->progress.load(std::memory_order_relaxed);
    if (seen_marks != marks) {
      marks = seen_marks;
      until = std::min(now + deadline_ns_, cap);
    } else if (now >= until) {
      connection_->process->kill();
      throw StageFault(FaultKind::kDeadline, "deadline",
                       now >= cap ? "the call took longer than ten times its deadline"
                                  : "no answer and no mark of progress within its deadline of " +
                                        std::to_string(deadline_ns_ / 1'000'000) + " ms");
    }
  }
}

// Copies the columns of a message out of the response segment, then checks the copy.
void SharedMemoryCarrier::take_columns(const gravitas_frame_header& header, std::span<const stage::ColumnInfo> infos,
                                       std::span<const ColumnId> targets, std::size_t first_room, Arena* arena) {
  std::array<gravitas_frame_column, GRAVITAS_MAX_COLUMNS> columns;
  std::array<const void*, GRAVITAS_MAX_COLUMNS> data;
  if (header.column_count != infos.size()) report_bad_frame("the wrong number of columns");
  std::memcpy(columns.data(), connection_->theirs->columns, infos.size() * sizeof columns[0]);
  const bool complete = header.status == GRAVITAS_OK;
  for (std::size_t i = 0; i < infos.size(); ++i) {
    const std::size_t room = first_room + i;
    if (columns[i].offset != room_offset_[room] || columns[i].capacity != room_capacity_[room])
      report_bad_frame(std::string("column ") + infos[i].name + " lies outside its room");
    if (complete && columns[i].count > room_capacity_[room])
      report_bad_frame(std::string("column ") + infos[i].name + " is longer than its room");
    if (!complete) continue;
    std::memcpy(arena->data(targets[i]), response_.data() + room_offset_[room],
                columns[i].count * stage::element_size(infos[i].type));
    data[i] = arena->data(targets[i]);
  }
  if (channel::frame_digest(header, std::span(columns).first(infos.size()), infos, complete ? data.data() : nullptr) !=
      header.digest)
    report_bad_frame("a digest that does not fit its content");
  for (std::size_t i = 0; i < infos.size(); ++i)
    if (complete || header.status == GRAVITAS_NEEDS_CAPACITY) arena->set_count(targets[i], columns[i].count);
}

void SharedMemoryCarrier::answer_callback(const gravitas_frame_header& header, std::size_t first_room, Arena* arena,
                                          DerivativeSource* derivatives) {
  const auto method = static_cast<std::uint32_t>(stage::Method::kIntegratorDerivative);
  if (derivatives == nullptr || header.method != method) report_bad_frame("a callback that was not offered");
  const std::span<const ColumnId> trial = derivatives->trial_columns();
  std::array<std::uint64_t, GRAVITAS_MAX_COLUMNS> expected;
  for (std::size_t i = 0; i < trial.size(); ++i) expected[i] = arena->count(trial[i]);
  gravitas_frame_header received = header;
  received.status = GRAVITAS_OK;
  if (header.status != GRAVITAS_OK) report_bad_frame("a callback with a status");
  take_columns(received, stage::kMethods[method].request, trial, first_room, arena);
  for (std::size_t i = 0; i < trial.size(); ++i) {
    if (arena->count(trial[i]) == expected[i]) continue;
    arena->set_count(trial[i], expected[i]);
    report_bad_frame("a trial state of the wrong size");
  }

  derivatives->evaluate();
  gravitas_frame_header answer{};
  answer.kind = GRAVITAS_FRAME_ANSWER;
  answer.method = method;
  const std::array<ColumnId, 1> wrench = {derivatives->wrench_column()};
  post_frame(answer, wrench, *arena);
}

void SharedMemoryCarrier::report_death() {
  // the end may be known to the socket before it is to the watcher
  connection_->process->wait(kDrainMilliseconds);
  throw StageFault(FaultKind::kDeath, "pidfd",
                   "its worker process " + std::to_string(process_id()) + " " +
                       (connection_->process->has_ended() ? "was " + connection_->process->ending() : "is gone"));
}

void SharedMemoryCarrier::report_bad_frame(const std::string& what) {
  // whatever it would say next is not to be trusted either
  connection_->process->kill();
  throw StageFault(FaultKind::kBadFrame, "wire", "its answer has " + what);
}

class PendingWorker final : public PendingCarrier {
 public:
  explicit PendingWorker(std::unique_ptr<SharedMemoryCarrier> carrier) : carrier_(std::move(carrier)) {}
  std::unique_ptr<Carrier> finish() override {
    carrier_->finish();
    return std::move(carrier_);
  }

 private:
  std::unique_ptr<SharedMemoryCarrier> carrier_;
};

}  // namespace

std::unique_ptr<PendingCarrier> start_shared_memory_carrier(const std::vector<PluginChoice>& plugins,
                                                            std::uint32_t threads, double deadline) {
  return std::make_unique<PendingWorker>(std::make_unique<SharedMemoryCarrier>(plugins, threads, deadline));
}

void set_worker_program(std::string path) { program = std::move(path); }

const std::string& worker_program() { return program; }

}  // namespace gravitas::kernel
