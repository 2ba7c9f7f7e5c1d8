#include "plugin_sdk/host/stream_loop.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <optional>
#include <utility>

#include "plugin_sdk/answer_checks.h"
#include "plugin_sdk/channel/mailbox.h"
#include "plugin_sdk/checks.h"
#include "plugin_sdk/counted.h"
#include "plugin_sdk/host/fault_injection.h"
#include "schemas/wire/byte_buffer.h"

namespace gravitas::host {

using stage::ColumnInfo;
using stage::MethodInfo;
using stage::v1::Call;
using stage::v1::Outcome;

namespace {

// How long a wait lasts before the loop looks at its flag again.
constexpr int kIdleMilliseconds = 100;
// Marks of progress closer together than this go out as one.
constexpr std::uint64_t kMarkNs = 20'000'000;
// Room for the elements of a reply column before a plugin has said how much it takes.
constexpr std::uint64_t kFirstRoom = 64;

const MethodInfo& kDerivative = stage::method_info(stage::Method::kIntegratorDerivative);

}  // namespace

// What a completion belongs to.
struct StreamLoop::Operation {
  enum Kind { kAccept, kRead, kWrite, kFinish } kind;
  Stream* stream;
};

struct StreamLoop::Stream {
  grpc::GenericServerContext context;
  grpc::GenericServerAsyncReaderWriter io{&context};
  Operation accept{Operation::kAccept, this}, read{Operation::kRead, this}, write{Operation::kWrite, this},
      finish{Operation::kFinish, this};
  stage::Method method{};
  grpc::ByteBuffer incoming;
  bool writing = false, arrived = false, open = true, finished = false;

  std::array<Room, GRAVITAS_MAX_COLUMNS> request_rooms, reply_rooms;
  std::array<gravitas_column, GRAVITAS_MAX_COLUMNS> columns{};
  std::array<gravitas_reply_column, GRAVITAS_MAX_COLUMNS> reply{};
};

void* StreamLoop::Room::reserve(std::uint64_t elements) {
  if (elements > capacity || bytes.empty()) {
    capacity = std::max({elements, 2 * capacity, std::uint64_t{1}});
    bytes.resize(capacity * 8);
  }
  return bytes.data();
}

// What the plugin reaches of the stream while its call is open.
struct StreamLoop::OpenCall final : CallServices {
  OpenCall(StreamLoop* owner, Stream* on, const Call& asked) : loop(owner), stream(on), call(asked) {}

  void mark_progress() override {
    const std::uint64_t now = channel::now_ns();
    const std::lock_guard lock(loop->io_);
    ++marks;
    if (now - last_mark < kMarkNs) return;
    last_mark = now;
    Outcome outcome = head();
    outcome.set_marks(marks);
    loop->write(stream, wire::to_byte_buffer({{}, {}, &outcome}));
  }

  // Whoever dies of the request from here on has read it: so it must be out before anything can happen.
  void say_taken() {
    const std::lock_guard lock(loop->io_);
    Outcome outcome = head();
    outcome.set_marks(++marks);
    loop->write(stream, wire::to_byte_buffer({{}, {}, &outcome}), grpc::WriteOptions().set_write_through());
    while (stream->open && stream->writing) loop->pump(kIdleMilliseconds);
  }

  // The plugin's first thread asks; the kernel's next message on this stream is the answer. On others it may ask other
  // plugins of this process before.
  std::int32_t derivative(const gravitas_column* asked, gravitas_reply_column* answer) override {
    std::unique_lock lock(loop->io_);
    const Outcome outcome = head();
    const wire::MessageParts message{{}, {}, &outcome, kDerivative.request, {asked, kDerivative.request.size()}};
    if (!loop->write(stream, wire::to_byte_buffer(message))) return GRAVITAS_CALLBACK_FAILED;
    loop->read(stream);
    while (stream->open && !stream->arrived) {
      loop->pump(kIdleMilliseconds);
      lock.unlock();
      loop->handle_arrived(stream);
      lock.lock();
    }
    if (!std::exchange(stream->arrived, false)) return GRAVITAS_CALLBACK_FAILED;

    const wire::FlatMessage message_bytes(stream->incoming);
    wire::ColumnsReader outer({});
    if (!outer.parse(message_bytes.bytes()).empty() || !outer.derivative().has) return GRAVITAS_CALLBACK_FAILED;
    wire::ColumnsReader reader(kDerivative.reply);
    if (!reader.parse(outer.derivative().bytes).empty()) return GRAVITAS_CALLBACK_FAILED;
    for (std::size_t i = 0; i < kDerivative.reply.size(); ++i) {
      answer[i].count = reader.count(i);
      if (answer[i].count > answer[i].capacity) return GRAVITAS_CALLBACK_FAILED;
      if (answer[i].count > 0) reader.copy(i, answer[i].data);
    }
    return GRAVITAS_OK;
  }

  Outcome head() const {
    Outcome outcome;
    outcome.set_epoch(call.epoch());
    outcome.set_sequence(call.sequence());
    return outcome;
  }

  StreamLoop* loop;
  Stream* stream;
  const Call& call;
  std::uint64_t marks = 0;
  std::uint64_t last_mark = channel::now_ns();
};

StreamLoop::StreamLoop(grpc::ServerBuilder* builder) {
  builder->RegisterAsyncGenericService(&service_);
  // not the only one that polls: the control service must be served before and beside the calls
  queue_ = builder->AddCompletionQueue(false);
}

StreamLoop::~StreamLoop() {
  queue_->Shutdown();
  while (pump(-1)) {
  }
}

void StreamLoop::accept() {
  streams_.push_back(std::make_unique<Stream>());
  accepting_ = streams_.back().get();
  service_.RequestCall(&accepting_->context, &accepting_->io, queue_.get(), queue_.get(), &accepting_->accept);
}

// Takes one completion; false when there will be none any more.
bool StreamLoop::pump(int milliseconds) {
  void* tag = nullptr;
  bool ok = false;
  if (milliseconds < 0) {
    if (!queue_->Next(&tag, &ok)) return false;
  } else {
    const auto until = std::chrono::system_clock::now() + std::chrono::milliseconds(milliseconds);
    const auto got = queue_->AsyncNext(&tag, &ok, until);
    if (got != grpc::CompletionQueue::GOT_EVENT) return got == grpc::CompletionQueue::TIMEOUT;
  }
  const Operation& operation = *static_cast<Operation*>(tag);
  Stream* stream = operation.stream;
  switch (operation.kind) {
    case Operation::kAccept: {
      if (!ok) break;
      accept();
      std::uint32_t method = 0;
      while (method < stage::kMethodCount && stream->context.method() != stage::kMethods[method].path) ++method;
      if (method == stage::kMethodCount || static_cast<stage::Method>(method) == stage::Method::kIntegratorDerivative) {
        stream->open = false;
        stream->io.Finish({grpc::StatusCode::UNIMPLEMENTED, "no method of a stage: " + stream->context.method()},
                          &stream->finish);
        break;
      }
      stream->method = static_cast<stage::Method>(method);
      read(stream);
      break;
    }
    case Operation::kRead:
      if (ok) {
        stream->arrived = true;
        readable_.push_back(stream);
      } else {
        stream->open = false;
        stream->io.Finish(grpc::Status::OK, &stream->finish);
      }
      break;
    case Operation::kWrite:
      stream->writing = false;
      break;
    case Operation::kFinish:
      stream->finished = true;
      break;
  }
  return true;
}

void StreamLoop::read(Stream* stream) { stream->io.Read(&stream->incoming, &stream->read); }

// Waits until the message before has gone out; false if the stream is broken.
bool StreamLoop::write(Stream* stream, const grpc::ByteBuffer& message, grpc::WriteOptions options) {
  while (stream->open && stream->writing) pump(kIdleMilliseconds);
  if (!stream->open) return false;
  stream->writing = true;
  stream->io.Write(message, options, &stream->write);
  return true;
}

void StreamLoop::serve(HostedPlugins* plugins, std::uint64_t epoch, const std::atomic<bool>& stopping,
                       std::atomic<std::uint64_t>* calls, std::atomic<std::uint64_t>* taken) {
  plugins_ = plugins;
  epoch_ = epoch;
  calls_ = calls;
  taken_ = taken;
  // the assets of the kernel before
  assets_.clear();
  if (accepting_ == nullptr) accept();
  while (!stopping.load()) {
    if (!pump(kIdleMilliseconds)) return;
    handle_arrived(nullptr);
    std::erase_if(streams_, [&](const auto& stream) { return stream->finished && !stream->writing; });
  }
}

void StreamLoop::handle_arrived(const Stream* asking) {
  for (std::unique_lock lock(io_); !readable_.empty();) {
    Stream* stream = readable_.front();
    readable_.pop_front();
    // what a derivative's answer is, or was, taken from
    if (stream == asking || !std::exchange(stream->arrived, false)) continue;
    lock.unlock();
    handle(stream);
    calls_->fetch_add(1);
    lock.lock();
  }
}

// Copies the columns out of the message; empty, or what is wrong with it.
std::string StreamLoop::read_request(Stream* stream, const wire::ColumnsReader& reader, Call* call) {
  if (!reader.header().has ||
      !call->ParseFromArray(reader.header().bytes.data(), static_cast<int>(reader.header().bytes.size())))
    return "a request without a call";
  if (call->epoch() != epoch_) return "a request of another incarnation";
  if (call->target() >= plugins_->count()) return "no such plugin in this worker";
  const MethodInfo& method = stage::method_info(stream->method);
  for (std::size_t i = 0; i < method.request.size(); ++i) {
    if (std::ranges::find(call->kept(), i + 1) != call->kept().end()) {
      Room& room = stream->request_rooms[i];
      if (room.bytes.empty() || stream->columns[i].data != room.bytes.data() || call->digest() == 0)
        return "a column kept that was not sent before";
      continue;
    }
    void* room = stream->request_rooms[i].reserve(reader.count(i));
    reader.copy(i, room);
    stream->columns[i] = {room, reader.count(i)};
  }
  for (const stage::v1::AssetUse& use : call->assets()) {
    const ColumnVector<std::byte>* asset = assets_.find(use.hash());
    if (use.column() == 0 || use.column() > method.request.size() || asset == nullptr)
      return "a column whose asset was not sent";
    const ColumnInfo& info = method.request[use.column() - 1];
    stream->columns[use.column() - 1] = {asset->data(), asset->size() / stage::element_size(info.type)};
  }
  if (call->digest() != 0 &&
      call->digest() != wire::columns_digest(method.request, std::span(stream->columns).first(method.request.size())))
    return "a request whose digest does not fit its columns";
  return {};
}

void StreamLoop::handle(Stream* stream) {
  const wire::FlatMessage message(stream->incoming);
  wire::ColumnsReader reader(stage::method_info(stream->method).request);
  Call call;
  std::string problem = reader.parse(message.bytes());
  if (problem.empty() && reader.asset().has) {
    problem = assets_.take(reader.asset().bytes);
    if (problem.empty()) {
      read(stream);
      return;
    }
  } else if (problem.empty()) {
    problem = read_request(stream, reader, &call);
  }
  std::optional<FaultInjection> fault;
  if (problem.empty() && !call.fault().empty()) {
    if (std::optional<FaultOrder> order = parse_fault_order(call.fault(), &problem); order)
      fault.emplace(std::move(*order));
  }
  if (problem.empty()) {
    answer(stream, call, fault ? &*fault : nullptr);
  } else {
    write_outcome(stream, call, GRAVITAS_FAILED, problem);
  }
  if (stream->open) read(stream);
}

void StreamLoop::answer(Stream* stream, const Call& call, FaultInjection* fault) {
  const MethodInfo& method = stage::method_info(stream->method);
  OpenCall services(this, stream, call);
  if (taken_ != nullptr) taken_->fetch_add(1, std::memory_order_relaxed);
  if (call.attempt() > 0) services.say_taken();
  if (fault != nullptr) fault->pass(Moment::kRead);
  CallEnd end{GRAVITAS_NEEDS_CAPACITY, "", 0};
  for (int round = 0; round < kCapacityRounds && end.status == GRAVITAS_NEEDS_CAPACITY; ++round) {
    for (std::size_t i = 0; i < method.reply.size(); ++i) {
      Room& room = stream->reply_rooms[i];
      void* data = room.reserve(std::max(stream->reply[i].count, kFirstRoom));
      stream->reply[i] = {data, room.capacity, 0};
    }
    end = plugins_->call(call.target(), stream->method, stream->columns.data(), stream->reply.data(), &services, fault);
    for (std::size_t i = 0; i < method.reply.size() && end.status == GRAVITAS_NEEDS_CAPACITY; ++i) {
      if (stream->reply[i].count <= wire::kMostElements) continue;
      end.status = GRAVITAS_FAILED;
      end.text = std::string("it asks for room for ") + counted(stream->reply[i].count, "number") + " in column " +
                 method.reply[i].name;
      stream->reply[i].count = 0;
    }
  }
  if (end.status == GRAVITAS_NEEDS_CAPACITY) end = {GRAVITAS_FAILED, "it asks for more room again and again", 0};
  // what is longer than its room is not there to be sent
  if (const std::string overfull = overfull_column(method.reply, stream->reply.data());
      end.status == GRAVITAS_OK && !overfull.empty())
    end = {GRAVITAS_FAILED, "its answer is wrong: " + overfull, end.compute_ns};

  if (end.status != GRAVITAS_OK) {
    for (gravitas_reply_column& column : stream->reply) column.count = 0;
    write_outcome(stream, call, end.status, end.text);
    return;
  }
  std::array<gravitas_column, GRAVITAS_MAX_COLUMNS> columns{};
  for (std::size_t i = 0; i < method.reply.size(); ++i) columns[i] = {stream->reply[i].data, stream->reply[i].count};
  const std::span<const gravitas_column> reply = std::span(columns).first(method.reply.size());
  Outcome outcome = services.head();
  outcome.set_compute_nanoseconds(end.compute_ns);
  outcome.set_digest(wire::columns_digest(method.reply, reply));
  outcome.set_text(end.text);
  write_reply(stream, method.reply, reply, &outcome, fault);
}

void StreamLoop::write_outcome(Stream* stream, const Call& call, std::int32_t status, const std::string& text) {
  Outcome outcome;
  outcome.set_epoch(call.epoch());
  outcome.set_sequence(call.sequence());
  outcome.set_status(static_cast<Outcome::Status>(status));
  outcome.set_text(text);
  write_reply(stream, {}, {}, &outcome, nullptr);
}

void StreamLoop::write_reply(Stream* stream, std::span<const ColumnInfo> infos,
                             std::span<const gravitas_column> columns, Outcome* outcome, const FaultInjection* fault) {
  const std::lock_guard lock(io_);
  if (fault == nullptr) {
    write(stream, wire::to_byte_buffer({infos, columns, outcome}));
    return;
  }
  outcome->set_epoch(fault->epoch(outcome->epoch()));
  outcome->set_sequence(fault->sequence(outcome->sequence()));
  const grpc::ByteBuffer right = wire::to_byte_buffer({infos, columns, outcome});
  const wire::FlatMessage flat(right);
  std::string message(reinterpret_cast<const char*>(flat.bytes().data()), flat.bytes().size());
  fault->spoil_message(&message, wire::columns_size(infos, columns));
  fault->pass(Moment::kWrite);
  const grpc::Slice slice(message);
  for (int i = 0; i < fault->copies(); ++i)
    write(stream, grpc::ByteBuffer(&slice, 1), grpc::WriteOptions().set_write_through());
  // out of this process, as far as gRPC tells
  while (stream->open && stream->writing) pump(kIdleMilliseconds);
  fault->pass(Moment::kReply);
}

}  // namespace gravitas::host
