// Replies that are wrong: the columns changed before a digest is made of them, and what was made of them damaged.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "plugin_sdk/host/fault_kinds.h"
#include "schemas/frame/column.h"

namespace gravitas::host {

// Whether the fault is one of those that change_reply() knows.
bool changes_reply(InjectedFault fault);

// Changes the columns of a reply as one of the kinds "values" says. A row that is added where there is no room for it
// is only counted, as a plugin does. Empty, or why there is nothing in this reply that the order could be carried out
// on.
std::string change_reply(const FaultOrder& order, const stage::MethodInfo& method, const gravitas_column* request,
                         gravitas_reply_column* reply);

// Number of bits in the elements of all columns.
std::uint64_t payload_bits(std::span<const stage::ColumnInfo> infos, const gravitas_reply_column* reply);

// Turns one of those bits.
void flip_payload(std::uint64_t bit, std::span<const stage::ColumnInfo> infos, const gravitas_reply_column* reply);

// Turns a bit of a run of bytes. Precondition: it is one of them.
void flip_bit(void* bytes, std::uint64_t bit);

// Numbers that depend on the seed alone (SplitMix64).
class RandomNumbers {
 public:
  explicit RandomNumbers(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next();

 private:
  std::uint64_t state_;
};

}  // namespace gravitas::host
