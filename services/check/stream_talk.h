// A worker and a raw stream of one method to it: bytes go out as they are given, well-formed or not.
#pragma once

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "gravitas/stage/v1/call.pb.h"
#include "kernel/carrier/worker_link.h"
#include "plugin_sdk/conformance/conformance.h"
#include "services/check/carrier_subject.h"

namespace gravitas::check {

// A message of a stage: columns and what stands beside them.
std::string message_bytes(std::span<const stage::ColumnInfo> infos, const MessageColumns& columns,
                          const stage::v1::Call* call);
std::string asset_bytes(const stage::v1::AssetChunk& chunk);

// What came back over a stream.
struct StreamReply {
  bool came = false;  // else: the stream was ended, with this status
  grpc::Status status;
  std::uint64_t epoch = 0, sequence = 0;
  conformance::Answer answer;
};

class StreamTalk {
 public:
  // Starts a worker and waits until it is ready. Throws kernel::StageFault.
  StreamTalk(const Examinee& examinee, const Patience& patience);
  ~StreamTalk();
  StreamTalk(const StreamTalk&) = delete;
  StreamTalk& operator=(const StreamTalk&) = delete;

  std::uint64_t epoch() const { return link_.epoch(); }
  bool keeps_columns() const { return link_.keeps_columns(); }
  // Empty while it lives, else how it ended.
  std::string ending();

  // The header of the next call.
  stage::v1::Call next_call(const conformance::Question& question, const MessageColumns& request);

  // Opens a stream of the method; one that is open is dropped.
  void open(const std::string& path);
  void open(stage::Method method) { open(stage::method_info(method).path); }
  bool send(const std::string& bytes);
  // The next reply, after answering what derivatives are asked for. Throws std::runtime_error when there is nothing
  // within the deadline.
  StreamReply receive(const conformance::Question& question, const stage::v1::Call& call);

  // Sends a request as a kernel would, over the stream that is open, and returns its reply.
  StreamReply ask(const conformance::Question& question, const MessageColumns& request);

 private:
  bool wait(bool* ok);
  void close();

  double deadline_;
  kernel::WorkerLink link_;
  grpc::CompletionQueue queue_;
  std::unique_ptr<grpc::ClientContext> context_;
  std::unique_ptr<grpc::GenericClientAsyncReaderWriter> io_;
  // buffers of operations that may be under way
  grpc::ByteBuffer incoming_;
  grpc::Status status_;
  int pending_ = 0;
  std::uint64_t sequence_ = 0;
};

}  // namespace gravitas::check
