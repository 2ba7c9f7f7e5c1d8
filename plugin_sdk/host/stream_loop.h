// The other way of calls: typed protobuf messages on gRPC streams, one stream per method
// (schemas/gravitas/stage/v1/call.proto).
//
//   stream message -> columns (copied out) -> plugin -> reply columns -> stream message
//
// As with the mailbox, calls run in the process's first thread and nothing else does: marks of progress come from
// the plugin's own code only.
#pragma once

#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/grpcpp.h>

#include <atomic>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "gravitas/stage/v1/call.pb.h"
#include "plugin_sdk/column_vector.h"
#include "plugin_sdk/host/asset_store.h"
#include "plugin_sdk/host/hosted_plugins.h"
#include "schemas/wire/columns.h"

namespace gravitas::host {

class StreamLoop {
 public:
  // The service and the queue of a server that is being built: before BuildAndStart().
  explicit StreamLoop(grpc::ServerBuilder* builder);
  ~StreamLoop();

  // Serves the streams of one kernel until `stopping` is set. The server must have started. Counts the calls that are done
  // in `calls`, and in `taken`, unless it is null, those that are begun.
  void serve(HostedPlugins* plugins, std::uint64_t epoch, const std::atomic<bool>& stopping,
             std::atomic<std::uint64_t>* calls, std::atomic<std::uint64_t>* taken);

 private:
  struct Stream;
  struct Operation;
  struct OpenCall;
  // The elements of a message's columns, kept from call to call.
  struct Room {
    ColumnVector<std::byte> bytes;
    std::uint64_t capacity = 0;
    void* reserve(std::uint64_t elements);
  };

  void accept();
  bool pump(int milliseconds);
  void read(Stream* stream);
  bool write(Stream* stream, const grpc::ByteBuffer& message, grpc::WriteOptions options = {});
  // The messages that have come, but for those on the stream that waits for a derivative's answer.
  void handle_arrived(const Stream* asking);
  void handle(Stream* stream);
  std::string read_request(Stream* stream, const wire::ColumnsReader& reader, stage::v1::Call* call);
  void answer(Stream* stream, const stage::v1::Call& call, FaultInjection* fault);
  void write_outcome(Stream* stream, const stage::v1::Call& call, std::int32_t status, const std::string& text);
  void write_reply(Stream* stream, std::span<const stage::ColumnInfo> infos, std::span<const gravitas_column> columns,
                   stage::v1::Outcome* outcome, const FaultInjection* fault);

  HostedPlugins* plugins_ = nullptr;
  grpc::AsyncGenericService service_;
  std::unique_ptr<grpc::ServerCompletionQueue> queue_;
  std::vector<std::unique_ptr<Stream>> streams_;
  Stream* accepting_ = nullptr;
  std::deque<Stream*> readable_;
  AssetStore assets_;
  std::uint64_t epoch_ = 0;
  std::atomic<std::uint64_t>* calls_ = nullptr;
  std::atomic<std::uint64_t>* taken_ = nullptr;
  std::mutex io_;  // of a call: the plugin's threads may mark progress
};

}  // namespace gravitas::host
