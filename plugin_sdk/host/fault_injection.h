// Commits the fault that a call orders, in that call (the kinds stand in fault_kinds.h). Both ways of calling ask it at
// the same points:
//
//   request read --> pass(kRead) --> plugin --> after_plugin() --> reply made --> epoch(), sequence()
//        --> digest --> spoil_frame() or spoil_message() --> pass(kWrite) --> sent copies() times --> pass(kReply)
//
// What follows the plugin is for an answer. One that only asks for room comes again with the same order; one that is
// refused or has failed, be it for what the order asks, is sent as it is; so is one on which it could not be carried out.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "plugin_sdk/abi.h"
#include "plugin_sdk/host/fault_kinds.h"
#include "schemas/frame/column.h"

namespace gravitas::host {

// How a note begins that says why the order was not carried out: there is nothing in the reply that it could be carried out on.
inline constexpr const char* kNotInjected = "not injected: ";

class FaultInjection {
 public:
  explicit FaultInjection(FaultOrder order) : order_(std::move(order)) {}

  // Does what is due now, if anything is: may never return.
  void pass(Moment moment) const;

  // After the plugin has ended with `status` and before anything of that is looked at. May change the reply's columns,
  // within their capacities, and the calling thread's floating-point environment. Returns the status that holds
  // instead: GRAVITAS_FAILED with the reason in `error` if the order says so, GRAVITAS_NEEDS_CAPACITY if the reply needs
  // more room. Where the reply has nothing that the order could be carried out on, it stays right, and note() says so.
  // `compute_ns` is how long the plugin took.
  std::int32_t after_plugin(const stage::MethodInfo& method, const gravitas_column* request,
                            gravitas_reply_column* reply, std::int32_t status, std::uint64_t compute_ns,
                            gravitas_error* error);

  // What came of it, for the caller to read: "opened 1019 descriptors". Empty if nothing is to be said.
  const std::string& note() const { return note_; }

  // What the reply says instead of the right ones.
  std::uint64_t epoch(std::uint64_t right) const { return right - (is(InjectedFault::kStale) ? 1 : 0); }
  std::uint64_t sequence(std::uint64_t right) const { return right - (is(InjectedFault::kSequence) ? 1 : 0); }
  int copies() const { return is(InjectedFault::kDrop) ? 0 : is(InjectedFault::kDuplicate) ? 2 : 1; }

  // Damages what was made, digest and all: a frame with its columns and their elements in the response segment; a
  // message of which the first `columns_size` bytes are the columns and the rest is the outcome.
  void spoil_frame(gravitas_frame_header* header, std::span<gravitas_frame_column> columns,
                   std::span<const stage::ColumnInfo> infos, const gravitas_reply_column* reply) const;
  void spoil_message(std::string* message, std::size_t columns_size) const;

 private:
  bool is(InjectedFault fault) const { return order_.fault() == fault; }

  FaultOrder order_;
  std::string note_;
  bool is_void_ = false;  // there is nothing to damage
};

}  // namespace gravitas::host
