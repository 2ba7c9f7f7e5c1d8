#include "plugin_sdk/host/mailbox_loop.h"

#include <fcntl.h>
#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>

#include "plugin_sdk/answer_checks.h"
#include "plugin_sdk/host/fault_injection.h"

namespace gravitas::host {

using channel::SegmentRole;

struct MailboxLoop::OpenCall final : CallServices {
  explicit OpenCall(MailboxLoop* owner) : worker(owner) {}
  void mark_progress() override { worker->mine_->progress.fetch_add(1, std::memory_order_relaxed); }
  std::int32_t derivative(const gravitas_column* asked, gravitas_reply_column* answer) override {
    return worker->ask_derivative(this, asked, answer);
  }

  MailboxLoop* worker;
  gravitas_frame_header request{};
  std::size_t reply_columns = 0;
  std::array<gravitas_column, GRAVITAS_MAX_COLUMNS> columns{};
  std::array<gravitas_reply_column, GRAVITAS_MAX_COLUMNS> reply{};
  // Offsets of the rooms in the response segment: the reply's, then those for a derivative request.
  std::array<std::uint64_t, GRAVITAS_MAX_COLUMNS> room{};
  // What the request orders to go wrong.
  std::optional<FaultInjection> fault;
};

namespace {

// How long a wait lasts before the loop looks at its flags again.
constexpr std::uint64_t kIdleNs = 100'000'000;
// Messages in a row found on the kernel's own core before the worker moves.
constexpr std::uint32_t kPatience = 4;

std::size_t bytes_of(const stage::ColumnInfo& column, std::uint64_t count) {
  return static_cast<std::size_t>(count) * stage::element_size(column.type);
}

// Whatever the counts are: their bytes are not counted before they are known to be few.
bool fits(const channel::Segment& segment, std::uint64_t offset, std::uint64_t count, std::size_t element_size) {
  return offset % GRAVITAS_COLUMN_ALIGNMENT == 0 && count <= segment.size() / element_size &&
         offset <= segment.size() - count * element_size;
}

}  // namespace

void MailboxLoop::take_reserve() { reserve_ = fcntl(descriptor_socket_, F_DUPFD_CLOEXEC, 0); }

bool MailboxLoop::receive_segments() {
  channel::SegmentMessage message{};
  if (reserve_ >= 0) close(reserve_);
  const int descriptor = channel::receive_segment(descriptor_socket_, &message);
  if (descriptor < 0) return false;
  const bool read_only = message.role == SegmentRole::kKernelMailbox || message.role == SegmentRole::kState;
  channel::Segment segment = channel::Segment::map(
      descriptor, message.size, read_only ? channel::Access::kReadOnly : channel::Access::kReadWrite);
  take_reserve();
  switch (message.role) {
    case SegmentRole::kKernelMailbox:
      kernel_segment_ = std::move(segment);
      kernel_ = reinterpret_cast<const channel::Mailbox*>(kernel_segment_.data());
      break;
    case SegmentRole::kWorkerMailbox:
      worker_segment_ = std::move(segment);
      mine_ = reinterpret_cast<channel::Mailbox*>(worker_segment_.data());
      break;
    case SegmentRole::kState:
      // a call that is open reads it
      former_states_.push_back(std::move(state_));
      state_ = std::move(segment);
      state_generation_ = message.generation;
      break;
    case SegmentRole::kResponse:
      responses_[depth_] = {std::move(segment), message.generation};
      break;
    default:
      return false;
  }
  return true;
}

bool MailboxLoop::map_announced_segments(const gravitas_frame_header& header) {
  while (state_generation_ != header.state_generation || responses_[depth_].generation != header.response_generation)
    if (!receive_segments()) return false;
  return true;
}

int MailboxLoop::serve(std::uint64_t epoch, const std::atomic<bool>& stopping, std::atomic<std::uint64_t>* calls,
                       const std::function<void(std::string)>& complain) {
  epoch_ = epoch;
  while (kernel_ == nullptr || mine_ == nullptr)
    if (!receive_segments()) return 1;
  install_crash_reporter(mine_, kernel_, epoch_);

  while (!stopping.load()) {
    if (channel::wait(mine_, kernel_, seen_, channel::now_ns() + kIdleNs) == channel::Waited::kTimeout) continue;
    seen_ = kernel_->signal.load(std::memory_order_acquire);
    gravitas_frame_header header;
    std::memcpy(&header, &kernel_->header, sizeof header);
    if (header.kind == GRAVITAS_FRAME_STOP) return 0;
    if (header.kind != GRAVITAS_FRAME_REQUEST || header.epoch != epoch_) {
      complain("dropped a frame of kind " + std::to_string(header.kind) + " and epoch " + std::to_string(header.epoch));
      continue;
    }
    leave_crowded_core();
    if (!take_request(header)) return 1;
    former_states_.clear();
    calls->fetch_add(1);
  }
  return 0;
}

bool MailboxLoop::take_request(const gravitas_frame_header& header) {
  mine_->progress.fetch_add(1, std::memory_order_relaxed);
  if (!map_announced_segments(header)) return false;
  answer(header);
  return true;
}

std::string MailboxLoop::read_request(const gravitas_frame_header& request, OpenCall* call) {
  call->request = request;
  if (request.magic != GRAVITAS_MAGIC || request.schema_hash != stage::kSchemaHash) return "a frame of another schema";
  if (request.method >= stage::kMethodCount) return "an unknown method";
  if (request.target >= plugins_->count()) return "no such plugin in this worker";
  const stage::MethodInfo& method = stage::kMethods[request.method];
  call->reply_columns = method.reply.size();
  if (request.column_count != method.request.size() || request.reply_count < method.reply.size() ||
      request.reply_count > GRAVITAS_MAX_COLUMNS)
    return "a frame with the wrong number of columns";
  if (channel::frame_digest(request, std::span(kernel_->columns).first(method.request.size()), {}, nullptr) !=
      request.digest)
    return "a frame whose digest does not fit";
  for (std::size_t i = 0; i < method.request.size(); ++i) {
    const gravitas_frame_column& column = kernel_->columns[i];
    if (!fits(state_, column.offset, column.count, stage::element_size(method.request[i].type)))
      return std::string("column ") + method.request[i].name + " lies outside the state segment";
    call->columns[i] = {state_.data() + column.offset, column.count};
  }
  for (std::size_t i = 0; i < request.reply_count; ++i) {
    const gravitas_frame_column& room = kernel_->reply[i];
    const channel::Segment& response = responses_[depth_].segment;
    if (!fits(response, room.offset, room.capacity, 8)) return "room for a reply outside the response segment";
    call->room[i] = room.offset;
    call->reply[i] = {response.data() + room.offset, room.capacity, 0};
  }
  return {};
}

// Empty, or why the order cannot be obeyed.
std::string MailboxLoop::read_order(OpenCall* call) const {
  std::string problem;
  std::array<char, sizeof channel::Mailbox::text> order;
  std::memcpy(order.data(), kernel_->text, order.size());
  order.back() = '\0';
  if (std::optional<FaultOrder> parsed = parse_fault_order(order.data(), &problem); parsed)
    call->fault.emplace(std::move(*parsed));
  return problem;
}

void MailboxLoop::answer(const gravitas_frame_header& request) {
  OpenCall call(this);
  std::string problem = read_request(request, &call);
  if (problem.empty() && request.fault != 0) problem = read_order(&call);
  if (!problem.empty()) {
    call.request.method = std::min(request.method, stage::kMethodCount - 1);
    write_reply(call, GRAVITAS_FAILED, problem.c_str(), 0);
    return;
  }
  FaultInjection* fault = call.fault ? &*call.fault : nullptr;
  if (fault != nullptr) fault->pass(Moment::kRead);
  const CallEnd end = plugins_->call(request.target, static_cast<stage::Method>(request.method), call.columns.data(),
                                     call.reply.data(), &call, fault);
  if (end.status != GRAVITAS_OK) call.fault.reset();
  write_reply(call, end.status, end.text.c_str(), end.compute_ns);
}

void MailboxLoop::write_reply(const OpenCall& call, std::int32_t status, const char* text, std::uint64_t compute_ns) {
  gravitas_frame_header header = call.request;
  header.kind = GRAVITAS_FRAME_REPLY;
  header.status = status;
  header.column_count = static_cast<std::uint32_t>(call.reply_columns);
  header.reply_count = 0;
  if (call.fault) {
    header.epoch = call.fault->epoch(header.epoch);
    header.sequence = call.fault->sequence(header.sequence);
  }
  for (std::size_t i = 0; i < call.reply_columns; ++i)
    mine_->columns[i] = {call.room[i], call.reply[i].count, call.reply[i].capacity};
  std::array<const void*, GRAVITAS_MAX_COLUMNS> data{};
  for (std::size_t i = 0; i < call.reply_columns; ++i) data[i] = call.reply[i].data;
  const std::span<const stage::ColumnInfo> infos = stage::kMethods[header.method].reply;
  // what is longer than its room is not there to be read; the kernel refuses it by its count
  const bool has_data = status == GRAVITAS_OK && overfull_column(infos, call.reply.data()).empty();
  header.digest = channel::frame_digest(header, std::span(mine_->columns).first(call.reply_columns), infos,
                                        has_data ? data.data() : nullptr);
  const std::size_t length = strnlen(text, sizeof mine_->text - 1);
  std::memcpy(mine_->text, text, length);
  mine_->text[length] = '\0';
  mine_->compute_ns = compute_ns;
  if (!call.fault) return post(header);
  call.fault->spoil_frame(&header, std::span(mine_->columns).first(call.reply_columns),
                          stage::kMethods[call.request.method].reply, call.reply.data());
  call.fault->pass(Moment::kWrite);
  for (int i = 0; i < call.fault->copies(); ++i) post(header);
  call.fault->pass(Moment::kReply);
}

void MailboxLoop::post(const gravitas_frame_header& header) {
  std::memcpy(&mine_->header, &header, sizeof header);
  channel::post(mine_, kernel_);
}

// The trial state goes to the rooms behind the reply's; the answer comes in the state segment.
std::int32_t MailboxLoop::ask_derivative(OpenCall* call, const gravitas_column* request, gravitas_reply_column* reply) {
  const stage::MethodInfo& method = stage::method_info(stage::Method::kIntegratorDerivative);
  const std::size_t columns = method.request.size();
  if (call->request.reply_count < call->reply_columns + columns) return GRAVITAS_CALLBACK_FAILED;

  gravitas_frame_header header = call->request;
  header.kind = GRAVITAS_FRAME_CALLBACK;
  header.method = static_cast<std::uint32_t>(stage::Method::kIntegratorDerivative);
  header.column_count = static_cast<std::uint32_t>(columns);
  std::array<const void*, GRAVITAS_MAX_COLUMNS> data{};
  for (std::size_t i = 0; i < columns; ++i) {
    const std::size_t room = call->reply_columns + i;
    if (request[i].count > call->reply[room].capacity) return GRAVITAS_CALLBACK_FAILED;
    data[i] = call->reply[room].data;
    std::memcpy(call->reply[room].data, request[i].data, bytes_of(method.request[i], request[i].count));
    mine_->columns[i] = {call->room[room], request[i].count, call->reply[room].capacity};
  }
  header.digest = channel::frame_digest(header, std::span(mine_->columns).first(columns), method.request, data.data());
  post(header);

  // the kernel answers, or kills this process; for its answer it may ask another plugin here
  gravitas_frame_header answer;
  for (bool is_asked = true; is_asked;) {
    while (channel::wait(mine_, kernel_, seen_, channel::now_ns() + kIdleNs) == channel::Waited::kTimeout) {
    }
    seen_ = kernel_->signal.load(std::memory_order_acquire);
    std::memcpy(&answer, &kernel_->header, sizeof answer);
    is_asked = answer.kind == GRAVITAS_FRAME_REQUEST && answer.epoch == epoch_ && depth_ + 1 < responses_.size();
    if (!is_asked) break;
    ++depth_;
    const bool was_mapped = take_request(answer);
    --depth_;
    if (!was_mapped) return GRAVITAS_CALLBACK_FAILED;
  }
  if (!map_announced_segments(answer)) return GRAVITAS_CALLBACK_FAILED;
  const std::span<const gravitas_frame_column> came = std::span(kernel_->columns).first(method.reply.size());
  if (answer.kind != GRAVITAS_FRAME_ANSWER || answer.status != GRAVITAS_OK || answer.column_count != came.size() ||
      channel::frame_digest(answer, came, {}, nullptr) != answer.digest)
    return GRAVITAS_CALLBACK_FAILED;
  for (std::size_t i = 0; i < came.size(); ++i) {
    const gravitas_frame_column column = came[i];
    reply[i].count = column.count;
    if (column.count > reply[i].capacity ||
        !fits(state_, column.offset, column.count, stage::element_size(method.reply[i].type)))
      return GRAVITAS_CALLBACK_FAILED;
    if (column.count > 0)
      std::memcpy(reply[i].data, state_.data() + column.offset, bytes_of(method.reply[i], column.count));
  }
  return GRAVITAS_OK;
}

// Two sides on one core cannot spin: after a few such meetings the worker lets itself be moved.
void MailboxLoop::leave_crowded_core() {
  const int here = sched_getcpu();
  if (here < 0 || kernel_->cpu.load(std::memory_order_relaxed) != static_cast<std::uint32_t>(here)) {
    collisions_ = 0;
    return;
  }
  if (++collisions_ < kPatience) return;
  collisions_ = 0;
  cpu_set_t allowed, others;
  if (sched_getaffinity(0, sizeof allowed, &allowed) != 0 || CPU_COUNT(&allowed) < 2) return;
  others = allowed;
  CPU_CLR(here, &others);
  if (sched_setaffinity(0, sizeof others, &others) == 0) sched_setaffinity(0, sizeof allowed, &allowed);
}

}  // namespace gravitas::host
