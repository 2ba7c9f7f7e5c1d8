// Stage messages as what gRPC's generic streams carry. For programs that link gRPC.
#pragma once

#include <google/protobuf/message_lite.h>
#include <grpcpp/support/byte_buffer.h>

#include <span>

#include "schemas/wire/columns.h"

namespace gravitas::wire {

// A message of columns, the message beside them (Call or Outcome), and a derivative's columns where it asks or answers
// one.
struct MessageParts {
  std::span<const stage::ColumnInfo> infos;
  std::span<const gravitas_column> columns;
  const google::protobuf::MessageLite* header = nullptr;
  std::span<const stage::ColumnInfo> derivative_infos = {};
  std::span<const gravitas_column> derivative = {};
};

inline grpc::ByteBuffer to_byte_buffer(const MessageParts& parts) {
  const std::size_t header_size = parts.header->ByteSizeLong();
  const std::size_t derivative_size = columns_size(parts.derivative_infos, parts.derivative);
  const bool has_derivative = !parts.derivative.empty();
  std::size_t size =
      columns_size(parts.infos, parts.columns) + submessage_head_size(kHeader, header_size) + header_size;
  if (has_derivative) size += submessage_head_size(kDerivative, derivative_size) + derivative_size;

  grpc_slice raw = grpc_slice_malloc(size);
  std::uint8_t* out = write_columns(parts.infos, parts.columns, GRPC_SLICE_START_PTR(raw));
  out = write_submessage_head(kHeader, header_size, out);
  out = parts.header->SerializeWithCachedSizesToArray(out);
  if (has_derivative) {
    out = write_submessage_head(kDerivative, derivative_size, out);
    write_columns(parts.derivative_infos, parts.derivative, out);
  }
  const grpc::Slice slice(raw, grpc::Slice::STEAL_REF);
  return {&slice, 1};
}

// The bytes of a received message in one piece.
class FlatMessage {
 public:
  explicit FlatMessage(const grpc::ByteBuffer& message) { static_cast<void>(message.DumpToSingleSlice(&slice_)); }
  std::span<const std::byte> bytes() const { return std::as_bytes(std::span(slice_.begin(), slice_.size())); }

 private:
  grpc::Slice slice_;
};

}  // namespace gravitas::wire
