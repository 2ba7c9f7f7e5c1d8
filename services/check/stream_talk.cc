#include "services/check/stream_talk.h"

#include <fmt/format.h>

#include <chrono>
#include <stdexcept>

#include "schemas/wire/columns.h"

namespace gravitas::check {

using conformance::Question;
using stage::v1::Call;
using stage::v1::Outcome;

namespace {

const stage::MethodInfo& kDerivativeInfo = stage::method_info(stage::Method::kIntegratorDerivative);

std::string submessage(wire::Field field, const std::string& bytes) {
  std::string out(wire::submessage_head_size(field, bytes.size()), '\0');
  wire::write_submessage_head(field, bytes.size(), reinterpret_cast<std::uint8_t*>(out.data()));
  return out + bytes;
}

std::string columns_bytes(std::span<const stage::ColumnInfo> infos, const MessageColumns& columns) {
  const std::vector<gravitas_column> plain = columns.plain();
  std::string out(wire::columns_size(infos, plain), '\0');
  wire::write_columns(infos, plain, reinterpret_cast<std::uint8_t*>(out.data()));
  return out;
}

// The columns of a parsed message as numbers of our own.
MessageColumns columns_of(const wire::ColumnsReader& reader, std::span<const stage::ColumnInfo> infos) {
  MessageColumns columns(infos);
  std::vector<gravitas_reply_column> rooms = columns.rooms();
  for (std::size_t i = 0; i < infos.size(); ++i) rooms[i].count = reader.count(i);
  columns.resize(rooms);
  rooms = columns.rooms();
  for (std::size_t i = 0; i < infos.size(); ++i) reader.copy(i, rooms[i].data);
  return columns;
}

}  // namespace

std::string message_bytes(std::span<const stage::ColumnInfo> infos, const MessageColumns& columns, const Call* call) {
  std::string bytes = columns_bytes(infos, columns);
  if (call != nullptr) bytes += submessage(wire::kHeader, call->SerializeAsString());
  return bytes;
}

std::string asset_bytes(const stage::v1::AssetChunk& chunk) {
  return submessage(wire::kAsset, chunk.SerializeAsString());
}

StreamTalk::StreamTalk(const Examinee& examinee, const Patience& patience)
    : deadline_(patience.deadline), link_(examinee.slot(kernel::Hosting::kGrpc, patience.deadline), 1, false, [] {}) {
  link_.finish();
}

StreamTalk::~StreamTalk() {
  close();
  link_.kill();
  queue_.Shutdown();
  void* tag = nullptr;
  bool ok = false;
  while (queue_.Next(&tag, &ok)) {
  }
}

std::string StreamTalk::ending() {
  if (!link_.has_ended()) return {};
  try {
    link_.report_death();
  } catch (const kernel::StageFault& fault) {
    return fault.text();
  }
}

Call StreamTalk::next_call(const Question& question, const MessageColumns& request) {
  Call call;
  call.set_epoch(epoch());
  call.set_sequence(++sequence_);
  call.set_deadline_microseconds(static_cast<std::uint64_t>(deadline_ * 1e6));
  call.set_digest(wire::columns_digest(stage::method_info(question.method).request, request.plain()));
  return call;
}

// Takes the completion of the one operation under way; false when there is none within the deadline.
bool StreamTalk::wait(bool* ok) {
  const auto until =
      std::chrono::system_clock::now() + std::chrono::microseconds(static_cast<std::int64_t>(deadline_ * 1e6));
  void* tag = nullptr;
  if (queue_.AsyncNext(&tag, ok, until) != grpc::CompletionQueue::GOT_EVENT) return false;
  --pending_;
  return true;
}

void StreamTalk::close() {
  if (!io_) return;
  context_->TryCancel();
  bool ok = false;
  while (pending_ > 0 && wait(&ok)) {
  }
  io_.reset();
  context_.reset();
}

void StreamTalk::open(const std::string& path) {
  close();
  context_ = std::make_unique<grpc::ClientContext>();
  io_ = grpc::GenericStub(link_.channel()).PrepareCall(context_.get(), path, &queue_);
  ++pending_;
  io_->StartCall(this);
  bool ok = false;
  if (!wait(&ok)) throw std::runtime_error("it does not take a new stream within its deadline");
}

bool StreamTalk::send(const std::string& bytes) {
  const grpc::Slice slice(bytes);
  ++pending_;
  io_->Write(grpc::ByteBuffer(&slice, 1), this);
  bool ok = false;
  if (!wait(&ok)) throw std::runtime_error("it takes no message within its deadline");
  return ok;
}

StreamReply StreamTalk::receive(const Question& question, const Call& call) {
  const stage::MethodInfo& method = stage::method_info(question.method);
  // as in a kernel a call ends after ten deadlines, whatever it marks or asks
  const double most = 10.0 * deadline_;
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(most);
  for (;;) {
    if (std::chrono::steady_clock::now() > end)
      throw std::runtime_error(fmt::format("no reply within {:g} s, whatever it marks and asks", most));
    bool ok = false;
    ++pending_;
    io_->Read(&incoming_, this);
    if (!wait(&ok)) throw std::runtime_error(fmt::format("no reply and no end of the stream within {:g} s", deadline_));
    StreamReply reply{
        .came = ok, .status = {}, .answer = {.text = {}, .fault = {}, .columns = MessageColumns(method.reply)}};
    if (!ok) {
      ++pending_;
      io_->Finish(&status_, this);
      if (!wait(&ok)) throw std::runtime_error("its stream does not end within its deadline");
      reply.status = status_;
      return reply;
    }
    grpc::Slice slice;
    incoming_.DumpToSingleSlice(&slice);
    wire::ColumnsReader reader(method.reply);
    Outcome outcome;
    const std::string problem = reader.parse(std::as_bytes(std::span(slice.begin(), slice.size())));
    if (!problem.empty()) throw std::runtime_error("its reply cannot be read: " + problem);
    if (!reader.header().has ||
        !outcome.ParseFromArray(reader.header().bytes.data(), static_cast<int>(reader.header().bytes.size())))
      throw std::runtime_error("its reply has no outcome");
    if (outcome.marks() != 0) continue;
    if (reader.derivative().has) {
      wire::ColumnsReader trial(kDerivativeInfo.request);
      if (!question.derivative || !trial.parse(reader.derivative().bytes).empty())
        throw std::runtime_error("it asks for a derivative that cannot be answered");
      const MessageColumns columns = columns_of(trial, kDerivativeInfo.request);
      const MessageColumns answer =
          question.derivative(stage::IntegratorDerivativeRequest(columns.plain().data())).columns();
      send(submessage(wire::kHeader, call.SerializeAsString()) +
           submessage(wire::kDerivative, columns_bytes(kDerivativeInfo.reply, answer)));
      continue;
    }
    reply.epoch = outcome.epoch();
    reply.sequence = outcome.sequence();
    reply.answer.status = outcome.status();
    reply.answer.text = outcome.text();
    if (reply.answer.status == GRAVITAS_OK) reply.answer.columns = columns_of(reader, method.reply);
    return reply;
  }
}

StreamReply StreamTalk::ask(const Question& question, const MessageColumns& request) {
  const Call call = next_call(question, request);
  send(message_bytes(stage::method_info(question.method).request, request, &call));
  return receive(question, call);
}

}  // namespace gravitas::check
