// Stage messages as what gRPC's generic streams carry. For programs that link gRPC.
#pragma once

#include <google/protobuf/message_lite.h>
#include <grpcpp/support/byte_buffer.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstring>
#include <memory>
#include <span>
#include <vector>

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

// Memory of the messages of a stream, which is used again: the pages of a new piece cost more than what is copied there.
class MessageRooms {
 public:
  grpc::ByteBuffer write(const MessageParts& parts) {
    const std::size_t header_size = parts.header->ByteSizeLong();
    const std::size_t derivative_size = columns_size(parts.derivative_infos, parts.derivative);
    const bool has_derivative = !parts.derivative.empty();
    std::size_t size =
        columns_size(parts.infos, parts.columns) + submessage_head_size(kHeader, header_size) + header_size;
    if (has_derivative) size += submessage_head_size(kDerivative, derivative_size) + derivative_size;

    const grpc::Slice slice = room_for(size);
    std::uint8_t* out = write_columns(parts.infos, parts.columns, const_cast<std::uint8_t*>(slice.begin()));
    out = write_submessage_head(kHeader, header_size, out);
    out = parts.header->SerializeWithCachedSizesToArray(out);
    if (has_derivative) {
      out = write_submessage_head(kDerivative, derivative_size, out);
      write_columns(parts.derivative_infos, parts.derivative, out);
    }
    return {&slice, 1};
  }

  // The bytes of a received message in one piece, valid until the next one is read.
  std::span<const std::byte> read(const grpc::ByteBuffer& message) {
    received_.clear();
    static_cast<void>(message.Dump(&received_));
    if (received_.size() == 1) return std::as_bytes(std::span(received_[0].begin(), received_[0].size()));
    const std::size_t size = message.Length();
    if (flat_.size() < size) flat_.resize(size);
    std::byte* end = flat_.data();
    for (const grpc::Slice& part : received_) {
      std::memcpy(end, part.begin(), part.size());
      end += part.size();
    }
    received_.clear();
    return {flat_.data(), size};
  }

 private:
  // A piece is gRPC's until it has been sent, on whatever thread.
  struct Room {
    std::vector<std::uint8_t> bytes;
    std::atomic<bool> is_lent{false};
  };
  // What malloc itself would keep.
  static constexpr std::size_t kSmall = 65536;

  grpc::Slice room_for(std::size_t size) {
    if (size < kSmall) return grpc::Slice(grpc_slice_malloc(size), grpc::Slice::STEAL_REF);
    const auto is_free = [](const std::shared_ptr<Room>& one) { return !one->is_lent.load(std::memory_order_acquire); };
    auto room = std::ranges::find_if(rooms_, is_free);
    if (room == rooms_.end()) room = rooms_.insert(room, std::make_shared<Room>());
    if ((*room)->bytes.size() < size) (*room)->bytes.resize(size);
    (*room)->is_lent.store(true, std::memory_order_relaxed);
    const auto give_back = [](void* lent) {
      const std::unique_ptr<std::shared_ptr<Room>> owner(static_cast<std::shared_ptr<Room>*>(lent));
      (*owner)->is_lent.store(false, std::memory_order_release);
    };
    return {(*room)->bytes.data(), size, give_back, new std::shared_ptr<Room>(*room)};
  }

  std::vector<std::shared_ptr<Room>> rooms_;
  std::vector<grpc::Slice> received_;
  std::vector<std::byte> flat_;
};

}  // namespace gravitas::wire
