// A worker with its data as typed protobuf messages (schemas/gravitas/stage/v1/call.proto): one gRPC stream per
// method over the connection that also carries the control stream. Slower than shared memory, and what a worker in
// another language, or at an address, speaks.
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <set>
#include <utility>

#include "gravitas/stage/v1/call.pb.h"
#include "kernel/carrier/carrier.h"
#include "kernel/carrier/worker_link.h"
#include "plugin_sdk/channel/mailbox.h"
#include "schemas/wire/byte_buffer.h"

namespace gravitas::kernel {
namespace {

using stage::MethodInfo;
using stage::v1::Outcome;

// A large constant column goes ahead of the calls, in parts, once per worker; a smaller one in every call.
constexpr std::uint64_t kAssetBytes = 65536;
constexpr std::uint64_t kAssetPart = 1 << 20;
// A column at least as large that has not changed since the call before is not sent again.
constexpr std::uint64_t kKeptBytes = 1024;
// A waiting kernel looks whether the worker's process lives this often.
constexpr std::uint64_t kLookAtProcessNs = 50'000'000;

const MethodInfo& kDerivative = stage::method_info(stage::Method::kIntegratorDerivative);

class GrpcCarrier final : public Carrier {
 public:
  GrpcCarrier(const SlotDescription& slot, std::uint32_t threads, std::stop_token stop)
      : slot_deadline_ns_(static_cast<std::uint64_t>(slot.call_deadline() * 1e9)),
        link_(
            slot, threads, false, [] {}, std::move(stop)) {
    link_.finish();
  }
  ~GrpcCarrier() override;

  CallResult call(const StageCall& call, Arena* arena, DerivativeSource* derivatives) override;
  void drain() override { link_.drain(); }
  void kill() override { link_.kill(); }
  bool is_alive() const override { return link_.is_alive(); }
  int process_id() const override { return link_.process_id(); }
  Hosting hosting() const override { return Hosting::kGrpc; }
  std::vector<std::string> take_complaints() override { return link_.take_complaints(); }
  std::vector<std::string> sandbox() const override { return link_.sandbox(); }

 private:
  // The stream of a method, which is the tag of its operations but for the last.
  struct Stream {
    grpc::ClientContext context;
    std::unique_ptr<grpc::GenericClientAsyncReaderWriter> io;
    std::array<std::uint64_t, GRAVITAS_MAX_COLUMNS> sent{};  // hashes of the columns of its last request
    grpc::ByteBuffer incoming;                               // of a Read, which may end after its call was given up
    grpc::Status status;                                     // at its end, of whose operation it is the tag
  };
  // Time left of a call.
  struct Patience {
    std::uint64_t deadline_ns;
    std::uint64_t until, cap;  // CLOCK_MONOTONIC, ns
    bool is_unread;            // the worker will say that it has the request, and has not yet
    std::uint64_t taken;       // requests that it had taken before
  };

  Stream& stream_of(const MethodInfo& method, Patience* patience);
  void write(Stream* stream, const grpc::ByteBuffer& message, Patience* patience);
  void wait(Stream* stream, Patience* patience);
  // Throws if no time is left.
  void check_time(const Patience& patience);
  [[noreturn]] void report_broken(Stream* stream, const Patience& patience);
  [[noreturn]] void report_death(const Patience& patience) {
    link_.report_death(patience.is_unread && link_.requests_taken() == patience.taken);
  }
  void send_asset(Stream* stream, const gravitas_column& column, std::uint64_t size, std::uint64_t hash,
                  Patience* patience);
  void leave_out_known(Stream* stream, const MethodInfo& method, std::span<gravitas_column> columns,
                       std::span<const std::uint64_t> hashes, stage::v1::Call* header, Patience* patience);
  void answer_callback(Stream* stream, const wire::ColumnsReader& reader, const stage::v1::Call& header, Arena* arena,
                       DerivativeSource* derivatives, Patience* patience);
  void take_columns(const wire::ColumnsReader& reader, const MethodInfo& method, std::span<const ColumnId> targets,
                    const Outcome& outcome, Arena* arena);

  const std::uint64_t slot_deadline_ns_;
  std::uint64_t sequence_ = 0;  // of the last call, which may be one inside another
  grpc::CompletionQueue queue_;
  WorkerLink link_;
  std::array<std::unique_ptr<Stream>, stage::kMethodCount> streams_;
  std::set<std::uint64_t> sent_assets_;
};

grpc::ByteBuffer message_of(const stage::v1::AssetChunk& chunk) {
  const std::size_t chunk_size = chunk.ByteSizeLong();
  grpc_slice raw = grpc_slice_malloc(wire::submessage_head_size(wire::kAsset, chunk_size) + chunk_size);
  std::uint8_t* out = wire::write_submessage_head(wire::kAsset, chunk_size, GRPC_SLICE_START_PTR(raw));
  chunk.SerializeWithCachedSizesToArray(out);
  const grpc::Slice slice(raw, grpc::Slice::STEAL_REF);
  return grpc::ByteBuffer(&slice, 1);
}

GrpcCarrier::~GrpcCarrier() {
  for (const std::unique_ptr<Stream>& stream : streams_)
    if (stream) stream->context.TryCancel();
  queue_.Shutdown();
  void* tag = nullptr;
  bool ok = false;
  while (queue_.Next(&tag, &ok)) {
  }
}

// Says why an operation on the stream failed: its worker ended the stream with a status, or is gone.
void GrpcCarrier::report_broken(Stream* stream, const Patience& patience) {
  if (link_.has_ended()) report_death(patience);
  grpc::Status& status = stream->status;
  void* tag = nullptr;
  bool ok = false;
  stream->io->Finish(&status, &status);
  const auto until = std::chrono::system_clock::now() + std::chrono::milliseconds(kDrainMilliseconds);
  while (tag != &status && queue_.AsyncNext(&tag, &ok, until) == grpc::CompletionQueue::GOT_EVENT) continue;
  if (tag != &status || status.ok() || status.error_code() == grpc::StatusCode::UNAVAILABLE || link_.has_ended())
    report_death(patience);
  link_.kill();
  throw StageFault(FaultKind::kFailure, "stream", "it ended the stream of its method: " + status.error_message());
}

// Waits for the one operation that is under way; one of a call within this one may have been given up.
void GrpcCarrier::wait(Stream* stream, Patience* patience) {
  for (;;) {
    const std::uint64_t now = channel::now_ns();
    const std::uint64_t look = std::min({patience->until, patience->cap, now + kLookAtProcessNs});
    const auto until = std::chrono::system_clock::now() + std::chrono::nanoseconds(look - std::min(look, now));
    void* tag = nullptr;
    bool ok = false;
    if (queue_.AsyncNext(&tag, &ok, until) == grpc::CompletionQueue::GOT_EVENT) {
      if (tag != stream) continue;
      if (!ok) report_broken(stream, *patience);
      return;
    }
    if (link_.has_ended()) report_death(*patience);
    check_time(*patience);
  }
}

void GrpcCarrier::check_time(const Patience& patience) {
  const std::uint64_t now = channel::now_ns();
  if (now >= std::min(patience.until, patience.cap)) link_.report_overdue(now >= patience.cap, patience.deadline_ns);
}

GrpcCarrier::Stream& GrpcCarrier::stream_of(const MethodInfo& method, Patience* patience) {
  std::unique_ptr<Stream>& stream = streams_[static_cast<std::size_t>(&method - stage::kMethods)];
  if (!stream) {
    stream = std::make_unique<Stream>();
    stream->io = grpc::GenericStub(link_.channel()).PrepareCall(&stream->context, method.path, &queue_);
    stream->io->StartCall(stream.get());
    wait(stream.get(), patience);
  }
  return *stream;
}

void GrpcCarrier::write(Stream* stream, const grpc::ByteBuffer& message, Patience* patience) {
  stream->io->Write(message, stream);
  wait(stream, patience);
}

void GrpcCarrier::send_asset(Stream* stream, const gravitas_column& column, std::uint64_t size, std::uint64_t hash,
                             Patience* patience) {
  for (std::uint64_t offset = 0; offset < size; offset += kAssetPart) {
    stage::v1::AssetChunk chunk;
    chunk.set_hash(hash);
    chunk.set_size(size);
    chunk.set_offset(offset);
    chunk.set_data(static_cast<const char*>(column.data) + offset, std::min(kAssetPart, size - offset));
    write(stream, message_of(chunk), patience);
  }
}

// Large columns that stay the same for the run go once, by the hash of their content; others that are as in the stream's
// last request stand in the worker's memory.
void GrpcCarrier::leave_out_known(Stream* stream, const MethodInfo& method, std::span<gravitas_column> columns,
                                  std::span<const std::uint64_t> hashes, stage::v1::Call* header, Patience* patience) {
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const auto field = static_cast<std::uint32_t>(i) + 1;
    const std::uint64_t size = columns[i].count * stage::element_size(method.request[i].type);
    const std::uint64_t before = std::exchange(stream->sent[i], hashes[i]);
    if (method.request[i].asset && size >= kAssetBytes) {
      stream->sent[i] = 0;
      if (!sent_assets_.contains(hashes[i])) send_asset(stream, columns[i], size, hashes[i], patience);
      sent_assets_.insert(hashes[i]);
      stage::v1::AssetUse* use = header->add_assets();
      use->set_column(field);
      use->set_hash(hashes[i]);
    } else if (link_.keeps_columns() && size >= kKeptBytes && before == hashes[i]) {
      header->add_kept(field);
    } else {
      continue;
    }
    columns[i] = {nullptr, 0};
  }
}

CallResult GrpcCarrier::call(const StageCall& call, Arena* arena, DerivativeSource* derivatives) {
  if (link_.has_ended()) link_.report_death(true);
  const MethodInfo& method = call.info();
  auto columns = plain_columns(*arena, call.request);
  const std::span<gravitas_column> request = std::span(columns).first(call.request.size());

  const std::uint64_t deadline_ns = call.deadline_ns != 0 ? call.deadline_ns : slot_deadline_ns_;
  const std::uint64_t start = channel::now_ns();
  Patience patience{deadline_ns, start + deadline_ns, start + kDeadlineCap * deadline_ns, call.attempt > 0,
                    link_.requests_taken()};
  stage::v1::Call header;
  header.set_epoch(link_.epoch());
  header.set_sequence(++sequence_);
  header.set_attempt(call.attempt);
  header.set_target(call.target);
  header.set_deadline_microseconds(deadline_ns / 1000);
  std::array<std::uint64_t, GRAVITAS_MAX_COLUMNS> hashes;
  wire::hash_columns(method.request, request, hashes);
  header.set_digest(wire::columns_digest(request, std::span(hashes).first(request.size())));
  if (!call.fault.empty()) header.set_fault(std::string(call.fault));
  Stream& stream = stream_of(method, &patience);
  leave_out_known(&stream, method, request, hashes, &header, &patience);
  write(&stream, wire::to_byte_buffer({method.request, request, &header}), &patience);

  // also after what is no answer: who sends such things without end leaves nothing to wait for
  for (;; check_time(patience)) {
    stream.io->Read(&stream.incoming, &stream);
    wait(&stream, &patience);
    const wire::FlatMessage flat(stream.incoming);
    wire::ColumnsReader reader(method.reply);
    const std::string problem = reader.parse(flat.bytes());
    Outcome outcome;
    if (!problem.empty()) link_.report_bad_frame("a wrong message: " + problem);
    if (!reader.header().has ||
        !outcome.ParseFromArray(reader.header().bytes.data(), static_cast<int>(reader.header().bytes.size())))
      link_.report_bad_frame("no outcome");
    // a late or foreign message is dropped
    if (outcome.epoch() != link_.epoch() || outcome.sequence() != header.sequence()) continue;
    patience.is_unread = false;
    if (outcome.marks() != 0) {
      patience.until = channel::now_ns() + deadline_ns;
      continue;
    }
    if (reader.derivative().has) {
      answer_callback(&stream, reader, header, arena, derivatives, &patience);
      continue;
    }
    CallResult result;
    result.status = outcome.status();
    result.compute_ns = outcome.compute_nanoseconds();
    result.text = outcome.text();
    if (result.status == GRAVITAS_NEEDS_CAPACITY) link_.report_bad_frame("a status that does not exist here");
    const std::uint64_t check_begin = channel::now_ns();
    if (result.status == GRAVITAS_OK) take_columns(reader, method, call.reply, outcome, arena);
    result.check_ns = channel::now_ns() - check_begin;
    return result;
  }
}

// The kernel's columns grow as the answer needs; how long it may be was checked against what a message may hold.
void GrpcCarrier::take_columns(const wire::ColumnsReader& reader, const MethodInfo& method,
                               std::span<const ColumnId> targets, const Outcome& outcome, Arena* arena) {
  for (std::size_t i = 0; i < targets.size(); ++i)
    if (reader.count(i) > arena->capacity(targets[i])) arena->grow(targets[i], reader.count(i));
  std::array<gravitas_column, GRAVITAS_MAX_COLUMNS> columns;
  for (std::size_t i = 0; i < targets.size(); ++i) {
    reader.copy(i, arena->data(targets[i]));
    arena->set_count(targets[i], reader.count(i));
    columns[i] = {arena->data(targets[i]), reader.count(i)};
  }
  if (outcome.digest() != 0 &&
      outcome.digest() != wire::columns_digest(method.reply, std::span(columns).first(targets.size())))
    link_.report_bad_frame("a digest that does not fit its content");
}

void GrpcCarrier::answer_callback(Stream* stream, const wire::ColumnsReader& reader, const stage::v1::Call& header,
                                  Arena* arena, DerivativeSource* derivatives, Patience* patience) {
  if (derivatives == nullptr) link_.report_bad_frame("a callback that was not offered");
  wire::ColumnsReader trial(kDerivative.request);
  const std::string problem = trial.parse(reader.derivative().bytes);
  if (!problem.empty()) link_.report_bad_frame("a wrong callback: " + problem);
  const std::span<const ColumnId> columns = derivatives->trial_columns();
  for (std::size_t i = 0; i < columns.size(); ++i)
    if (trial.count(i) != arena->count(columns[i])) link_.report_bad_frame("a trial state of the wrong size");
  for (std::size_t i = 0; i < columns.size(); ++i) trial.copy(i, arena->data(columns[i]));

  const std::uint64_t asked = channel::now_ns();
  derivatives->evaluate();
  // the plugin's clock stood still, and it has shown that it gets on
  const std::uint64_t now = channel::now_ns();
  patience->until = now + patience->deadline_ns;
  patience->cap += now - asked;
  const auto answer = plain_columns(*arena, derivatives->answer_columns());
  write(stream, wire::to_byte_buffer({{}, {}, &header, kDerivative.reply, answer}), patience);
}

}  // namespace

std::unique_ptr<Carrier> start_grpc_carrier(const SlotDescription& slot, std::uint32_t threads, std::stop_token stop) {
  return std::make_unique<GrpcCarrier>(slot, threads, std::move(stop));
}

}  // namespace gravitas::kernel
