// A worker process with its data in shared memory.
//
// Control (handshake, heartbeat, drain) is gRPC over an inherited socket pair; calls go through the mailboxes of
// plugin_sdk/channel/mailbox.h. Columns of a request are offsets into the arena's segment, which the worker maps
// read-only; the answer comes in a response segment that belongs to this incarnation of the worker and is copied
// out before it is looked at. A segment that must be replaced is sent over a second inherited socket pair.
#include <algorithm>
#include <array>
#include <cstring>

#include "kernel/carrier/carrier.h"
#include "kernel/carrier/worker_link.h"
#include "plugin_sdk/channel/mailboxes.h"
#include "plugin_sdk/channel/reply_frame.h"

namespace gravitas::kernel {
namespace {

using channel::Mailbox;
using channel::Segment;
using channel::SegmentRole;

// A waiting kernel looks at the worker's marks of progress this often.
constexpr std::uint64_t kLookNs = 50'000'000;

class SharedMemoryCarrier final : public Carrier {
 public:
  SharedMemoryCarrier(const SlotDescription& slot, std::uint32_t threads, std::stop_token stop);
  ~SharedMemoryCarrier() override;

  CallResult call(const StageCall& call, Arena* arena, DerivativeSource* derivatives) override;
  void drain() override;
  void kill() override { link_->kill(); }
  bool is_alive() const override { return link_->is_alive(); }
  int process_id() const override { return link_->process_id(); }
  Hosting hosting() const override { return Hosting::kSharedMemory; }
  std::vector<std::string> take_complaints() override { return link_->take_complaints(); }
  std::vector<std::string> sandbox() const override { return link_->sandbox(); }

 private:
  void make_rooms(const StageCall& call, const Arena& arena, const DerivativeSource* derivatives);
  void send_new_segments(const Arena& arena);
  void post_frame(gravitas_frame_header header, std::span<const ColumnId> columns, const Arena& arena);
  gravitas_frame_header wait_for_message(std::uint64_t start, std::uint64_t* spent_ns);
  [[noreturn]] void report_death() { link_->report_death(marks() == open_->asked_at_mark, true); }
  std::uint64_t marks() const { return boxes_->theirs->progress.load(std::memory_order_relaxed); }
  void take_columns(const gravitas_frame_header& header, std::span<const stage::ColumnInfo> infos,
                    std::span<const ColumnId> targets, std::size_t first_room, Arena* arena);
  void answer_callback(const gravitas_frame_header& header, std::size_t first_room, Arena* arena,
                       DerivativeSource* derivatives);

  // What belongs to a call, and to those after it at the same depth: while an integrator asks, the kernel may call the
  // same worker for another slot.
  struct OpenCall {
    std::uint64_t deadline_ns = 0;
    std::uint64_t sequence = 0;
    std::uint64_t asked_at_mark = 0;  // the worker's progress when the request was posted
    Segment response;
    std::uint64_t response_generation = 0, sent_response = 0;
    std::array<channel::Room, GRAVITAS_MAX_COLUMNS> rooms{};
    std::size_t room_count = 0;
  };

  const Defences defences_;
  const std::uint64_t slot_deadline_ns_;
  std::uint64_t sequence_ = 0, response_generation_ = 0, sent_state_ = 0;  // the last
  std::array<OpenCall, 2> calls_;
  OpenCall* open_ = calls_.data();
  std::shared_ptr<channel::Mailboxes> boxes_ = std::make_shared<channel::Mailboxes>();
  // Of the last message: the worker's signal, its progress (between calls nothing makes any) and the clock. What was seen
  // then is not read again: it would cost a cache line that the worker writes.
  std::uint32_t seen_ = boxes_->theirs->signal;
  std::uint64_t seen_marks_ = 0, seen_ns_ = 0;
  std::unique_ptr<WorkerLink> link_;
};

SharedMemoryCarrier::SharedMemoryCarrier(const SlotDescription& slot, std::uint32_t threads, std::stop_token stop)
    : defences_(slot.defences),
      slot_deadline_ns_(
          static_cast<std::uint64_t>((slot.defences.deadline ? slot.deadline : kAttachedDeadline) * 1e9)) {
  link_ = std::make_unique<WorkerLink>(
      slot, threads, true, [boxes = boxes_] { channel::say_ended(boxes->theirs); }, std::move(stop));
  link_->finish();
  if (!boxes_->send(link_->descriptor_socket())) link_->report_death();
}

// Said on both ways: the data loop sleeps on its mailbox, not on the stream.
void SharedMemoryCarrier::drain() {
  if (link_->is_dying()) return;
  link_->drain();
  gravitas_frame_header stop{};
  stop.kind = GRAVITAS_FRAME_STOP;
  stop.epoch = link_->epoch();
  std::memcpy(&boxes_->mine->header, &stop, sizeof stop);
  channel::post(boxes_->mine, boxes_->theirs);
}

SharedMemoryCarrier::~SharedMemoryCarrier() { drain(); }

// Room in the response segment for the reply's columns, as the arena has, and behind it for trial states of derivatives.
void SharedMemoryCarrier::make_rooms(const StageCall& call, const Arena& arena, const DerivativeSource* derivatives) {
  std::uint64_t offset = 0;
  open_->room_count = 0;
  const auto add = [&](std::uint64_t capacity) {
    open_->rooms[open_->room_count++] = {offset, capacity};
    offset += channel::round_up(capacity * 8, GRAVITAS_COLUMN_ALIGNMENT);
  };
  for (const ColumnId column : call.reply) add(arena.capacity(column));
  if (derivatives != nullptr)
    for (const ColumnId column : derivatives->trial_columns()) add(arena.count(column));
  if (offset <= open_->response.size()) return;
  open_->response =
      Segment::create("gravitas response", std::max(offset, 2 * open_->response.size()), channel::Sharing::kWriters);
  open_->response_generation = ++response_generation_;
}

void SharedMemoryCarrier::send_new_segments(const Arena& arena) {
  bool sent = true;
  if (open_->sent_response != open_->response_generation) {
    sent = channel::send_segment(link_->descriptor_socket(),
                                 {SegmentRole::kResponse, 0, open_->response_generation, open_->response.size()},
                                 open_->response.descriptor());
    open_->sent_response = open_->response_generation;
  }
  if (sent && sent_state_ != arena.generation()) {
    sent = channel::send_segment(link_->descriptor_socket(),
                                 {SegmentRole::kState, 0, arena.generation(), arena.segment().size()},
                                 arena.segment().descriptor());
    sent_state_ = arena.generation();
  }
  if (!sent) link_->report_death(true);
}

void SharedMemoryCarrier::post_frame(gravitas_frame_header header, std::span<const ColumnId> columns,
                                     const Arena& arena) {
  Mailbox* mine = boxes_->mine;
  header.magic = GRAVITAS_MAGIC;
  header.schema_hash = stage::kSchemaHash;
  header.epoch = link_->epoch();
  header.sequence = open_->sequence;
  header.column_count = static_cast<std::uint32_t>(columns.size());
  header.state_generation = arena.generation();
  header.response_generation = open_->response_generation;
  for (std::size_t i = 0; i < columns.size(); ++i)
    mine->columns[i] = {arena.offset(columns[i]), arena.count(columns[i]), arena.capacity(columns[i])};
  header.digest = channel::frame_digest(header, std::span(mine->columns).first(columns.size()), {}, nullptr);
  std::memcpy(&mine->header, &header, sizeof header);
  channel::post(mine, boxes_->theirs);
}

CallResult SharedMemoryCarrier::call(const StageCall& call, Arena* arena, DerivativeSource* derivatives) {
  if (link_->has_ended() || seen_ == channel::kEnded) link_->report_death(true, true);
  open_->deadline_ns = call.deadline_ns != 0 ? call.deadline_ns : slot_deadline_ns_;
  make_rooms(call, *arena, derivatives);
  send_new_segments(*arena);

  gravitas_frame_header request{};
  open_->sequence = ++sequence_;
  request.kind = GRAVITAS_FRAME_REQUEST;
  request.method = static_cast<std::uint32_t>(call.method);
  request.target = call.target;
  request.attempt = call.attempt;
  request.reply_count = static_cast<std::uint32_t>(open_->room_count);
  const std::uint64_t start = channel::now_ns();
  request.deadline_ns = start + open_->deadline_ns;
  for (std::size_t i = 0; i < open_->room_count; ++i)
    boxes_->mine->reply[i] = {open_->rooms[i].offset, 0, open_->rooms[i].capacity};
  if (!call.fault.empty()) {
    request.fault = 1;
    boxes_->mine->text[call.fault.copy(boxes_->mine->text, sizeof Mailbox::text - 1)] = '\0';
  }
  open_->asked_at_mark = seen_marks_;
  post_frame(request, call.request, *arena);

  std::uint64_t spent_ns = 0;
  gravitas_frame_header answer = wait_for_message(start, &spent_ns);
  while (answer.kind == GRAVITAS_FRAME_CALLBACK) {
    answer_callback(answer, call.reply.size(), arena, derivatives);
    answer = wait_for_message(channel::now_ns(), &spent_ns);
  }
  if (answer.kind != GRAVITAS_FRAME_REPLY || answer.method != request.method)
    link_->report_bad_frame("another message");

  CallResult result;
  result.status = answer.status;
  result.compute_ns = boxes_->theirs->compute_ns;
  if (answer.status != GRAVITAS_OK || !call.fault.empty()) {
    std::array<char, sizeof Mailbox::text> text;
    std::memcpy(text.data(), boxes_->theirs->text, text.size());
    text.back() = '\0';
    result.text = text.data();
  }
  take_columns(answer, call.info().reply, call.reply, 0, arena);
  result.check_ns = channel::now_ns() - seen_ns_;
  return result;
}

// Waits until the worker posts a message of this call, dies, or runs out of time.
gravitas_frame_header SharedMemoryCarrier::wait_for_message(std::uint64_t start, std::uint64_t* spent_ns) {
  Mailbox* mine = boxes_->mine;
  const Mailbox* theirs = boxes_->theirs;
  const std::uint64_t deadline_ns = open_->deadline_ns;
  const std::uint64_t cap = start + kDeadlineCap * deadline_ns - std::min(*spent_ns, kDeadlineCap * deadline_ns);
  std::uint64_t until = std::min(start + deadline_ns, cap);
  std::uint64_t last_marks = seen_marks_;
  for (std::uint64_t now = start;;) {
    // an end may have been seen together with the last message
    if (seen_ == channel::kEnded) report_death();
    const std::uint64_t look = std::min(until, now + kLookNs);
    if (channel::wait(mine, theirs, seen_, look) == channel::Waited::kMessage) {
      seen_ = theirs->signal.load(std::memory_order_acquire);
      gravitas_frame_header header;
      std::memcpy(&header, &theirs->header, sizeof header);
      if (header.kind == GRAVITAS_FRAME_CRASH && header.epoch == link_->epoch()) report_death();
      // a dead worker's last word may be a reply, but not a question, which may also be the one it asked before
      const bool is_dead_question = header.kind == GRAVITAS_FRAME_CALLBACK && seen_ == channel::kEnded;
      const bool is_late = header.epoch != link_->epoch() || header.sequence != open_->sequence;
      if (!(is_late && defences_.epoch) && header.magic == GRAVITAS_MAGIC && !is_dead_question) {
        seen_marks_ = marks();
        seen_ns_ = channel::now_ns();
        *spent_ns += seen_ns_ - start;
        // who asks without end is never waited for
        if (header.kind == GRAVITAS_FRAME_CALLBACK && seen_ns_ >= cap) link_->report_overdue(true, deadline_ns);
        return header;
      }
      // a late or foreign message is dropped
      if (seen_ != channel::kEnded && header.epoch == link_->epoch() && header.magic != GRAVITAS_MAGIC)
        link_->report_bad_frame("a header without the magic");
      if (seen_ == channel::kEnded) continue;
    }
    now = channel::now_ns();
    if (const std::uint64_t new_marks = marks(); new_marks != last_marks) {
      last_marks = new_marks;
      until = std::min(now + deadline_ns, cap);
    } else if (now >= until) {
      link_->report_overdue(now >= cap, deadline_ns);
    }
  }
}

// Copies the columns of a message out of the response segment, then checks the copy.
void SharedMemoryCarrier::take_columns(const gravitas_frame_header& header, std::span<const stage::ColumnInfo> infos,
                                       std::span<const ColumnId> targets, std::size_t first_room, Arena* arena) {
  std::array<gravitas_frame_column, GRAVITAS_MAX_COLUMNS> columns;
  std::array<std::byte*, GRAVITAS_MAX_COLUMNS> data;
  std::memcpy(columns.data(), boxes_->theirs->columns, infos.size() * sizeof columns[0]);
  for (std::size_t i = 0; i < infos.size(); ++i) data[i] = arena->data(targets[i]);
  const std::string problem =
      channel::read_reply_frame(header, columns, infos, std::span(open_->rooms).subspan(first_room),
                                open_->response.data(), std::span(data).first(infos.size()), defences_.digest);
  if (!problem.empty()) link_->report_bad_frame(problem);
  for (std::size_t i = 0; i < infos.size(); ++i)
    if (header.status == GRAVITAS_OK || header.status == GRAVITAS_NEEDS_CAPACITY)
      arena->set_count(targets[i], columns[i].count);
}

void SharedMemoryCarrier::answer_callback(const gravitas_frame_header& header, std::size_t first_room, Arena* arena,
                                          DerivativeSource* derivatives) {
  const auto method = static_cast<std::uint32_t>(stage::Method::kIntegratorDerivative);
  if (derivatives == nullptr || header.method != method) link_->report_bad_frame("a callback that was not offered");
  const std::span<const ColumnId> trial = derivatives->trial_columns();
  std::array<std::uint64_t, GRAVITAS_MAX_COLUMNS> expected;
  for (std::size_t i = 0; i < trial.size(); ++i) expected[i] = arena->count(trial[i]);
  gravitas_frame_header received = header;
  received.status = GRAVITAS_OK;
  if (header.status != GRAVITAS_OK) link_->report_bad_frame("a callback with a status");
  take_columns(received, stage::kMethods[method].request, trial, first_room, arena);
  for (std::size_t i = 0; i < trial.size(); ++i) {
    if (arena->count(trial[i]) == expected[i]) continue;
    arena->set_count(trial[i], expected[i]);
    link_->report_bad_frame("a trial state of the wrong size");
  }

  open_ = &calls_[1];
  try {
    derivatives->evaluate();
  } catch (...) {
    open_ = calls_.data();
    throw;
  }
  open_ = calls_.data();
  send_new_segments(*arena);
  gravitas_frame_header answer{};
  answer.kind = GRAVITAS_FRAME_ANSWER;
  answer.method = method;
  post_frame(answer, derivatives->answer_columns(), *arena);
}

}  // namespace

std::unique_ptr<Carrier> start_shared_memory_carrier(const SlotDescription& slot, std::uint32_t threads,
                                                     std::stop_token stop) {
  return std::make_unique<SharedMemoryCarrier>(slot, threads, std::move(stop));
}

}  // namespace gravitas::kernel
