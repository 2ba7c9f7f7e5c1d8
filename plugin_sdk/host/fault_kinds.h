// The faults that a worker commits when a call orders it to, so that whoever calls it can be tested: one table for the
// worker, for the readers of orders and for help texts.
//
//   order = KIND [,ARGUMENT=VALUE]...          "kill"   "slow,factor=10"   "nan,column=position,row=3"
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace gravitas::host {

enum class InjectedFault : std::uint8_t {
  // the process ends
  kKill,
  kSegv,
  kAbort,
  kFpe,
  kStack,
  kThrow,
  kExit,
  // it takes long, or for ever
  kHang,
  kDeadlock,
  kStop,
  kSlow,
  kJitter,
  // it uses up what it shares with others
  kLeak,
  kDescriptors,
  kFlood,
  kMemory,
  // the reply is damaged on its way
  kDrop,
  kDelay,
  kDuplicate,
  kTruncate,
  kOversize,
  kFlip,
  kStale,
  kSequence,
  kScribble,
  // the reply is wrong, and its digest right
  kNan,
  kInf,
  kDenormal,
  kSign,
  kScale,
  kUlp,
  kZero,
  kPermute,
  kDouble,
  kMissing,
  kPhantom,
  // it tries what a worker has no business with, and answers rightly
  kOpen,
  kConnect,
  kFork,
  kExec,
  kPtrace,
  kSignal,
  kMap,
  // it leaves the floating-point environment changed
  kRounding
};

// When in a call the process ends.
enum class Moment : std::uint8_t {
  kRead,     // the request has been read, nothing is done
  kCompute,  // the plugin's answer is there, and has not been looked at
  kWrite,    // shm: the columns of the reply are written, its header is not. gRPC: the message is ready and nothing
             // of it is sent, since a part of a message cannot be
  kReply     // the reply has just been sent
};

struct FaultArgument {
  std::string_view name;
  std::string_view meaning;   // with its unit, and what it is where it is not given
  std::string_view standard;  // the value where it is not given; empty: `meaning` says it
  // Either one of these words, or a number from `minimum` to `maximum`, or, with neither, the name of a column.
  std::span<const std::string_view> words = {};
  double minimum = 0.0, maximum = 0.0;
  bool is_whole = false;

  bool is_number() const { return minimum < maximum; }
};

struct FaultInfo {
  InjectedFault fault;
  std::string_view name;
  std::string_view group;  // "process", "hang", "resources", "wire", "values", "sandbox", "rounding"
  std::string_view meaning;
  std::span<const FaultArgument> arguments;
};

// Of every InjectedFault, in its order.
std::span<const FaultInfo> fault_kinds();

// An order that has been understood.
class FaultOrder {
 public:
  explicit FaultOrder(const FaultInfo& info) : info_(&info) {}

  const FaultInfo& info() const { return *info_; }
  InjectedFault fault() const { return info_->fault; }
  // Whether the order gives the argument.
  bool gives(std::string_view argument) const;
  // What it gives, else what holds by default. Precondition of number(): there is one.
  std::string_view word(std::string_view argument) const;
  double number(std::string_view argument) const;
  // kCompute for a kind that has no such argument.
  Moment moment() const;

 private:
  friend std::optional<FaultOrder> parse_fault_order(std::string_view, std::string*);

  const FaultInfo* info_;
  std::vector<std::pair<std::string_view, std::string>> given_;
};

// Longest text of an order: what a mailbox has room for.
inline constexpr std::size_t kLongestFaultOrder = 511;

// Reads an order; none, with a sentence that names what is wrong and what is allowed, if it is no order.
std::optional<FaultOrder> parse_fault_order(std::string_view text, std::string* problem);

}  // namespace gravitas::host
