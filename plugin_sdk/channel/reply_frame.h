// Reads what a worker wrote into its mailbox and its response segment, which is to be believed in nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "schemas/frame/column.h"

namespace gravitas::channel {

// Where the worker was told to put a column: bytes from the start of the response segment, elements.
struct Room {
  std::uint64_t offset = 0;
  std::uint64_t capacity = 0;
};

// Copies the columns of a message to `targets`, each of which has space for as many elements as its room, and then
// checks the copy. `columns` and `header` are copies of the mailbox's; `response` is the segment, which may change
// under this function. Nothing is copied where the status is not GRAVITAS_OK. Returns what is wrong with the message
// ("its answer has …"), or empty. Precondition: every room lies in `response`; as many rooms and targets as `infos`.
std::string read_reply_frame(const gravitas_frame_header& header, std::span<const gravitas_frame_column> columns,
                             std::span<const stage::ColumnInfo> infos, std::span<const Room> rooms,
                             const std::byte* response, std::span<std::byte* const> targets, bool check_digest = true);

}  // namespace gravitas::channel
