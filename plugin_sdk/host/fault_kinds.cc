#include "plugin_sdk/host/fault_kinds.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <initializer_list>
#include <limits>

#include "plugin_sdk/channel/mailbox.h"
#include "plugin_sdk/near_miss.h"
#include "plugin_sdk/property_value.h"

namespace gravitas::host {
namespace {

static_assert(kLongestFaultOrder < sizeof channel::Mailbox::text);

using Words = std::string_view;

constexpr double kMostBytes = 1e13;
constexpr double kLongestSeconds = 1e6;
// Whole numbers up to here are doubles.
constexpr double kLargestWhole = 9007199254740992.0;

constexpr std::array<Words, 4> kMoments = {"read", "compute", "write", "reply"};
constexpr std::array<Words, 2> kPlaces = {"header", "payload"};
constexpr std::array<Words, 2> kFlags = {"0", "1"};

constexpr FaultArgument kAt = {"at", "when in the call", "compute", kMoments};
constexpr FaultArgument kColumn = {"column", "of the reply; the first of f64 that has elements", ""};
constexpr FaultArgument kWord = {"column", "of the reply whose rows are meant; the first that has rows", ""};
constexpr FaultArgument kRow = {"row", "of the column; a middle one", "", {}, 0, kLargestWhole, true};
constexpr FaultArgument kAll = {"all", "1: every row", "0", kFlags};
constexpr FaultArgument kSeed = {"seed", "of the random numbers", "1", {}, 0, kLargestWhole, true};
constexpr FaultArgument kBytes = {"bytes", "how many", "67108864", {}, 1, kMostBytes, true};

constexpr std::array<FaultArgument, 1> kEnds = {kAt};
constexpr std::array<FaultArgument, 2> kExits = {{{"code", "exit code", "0", {}, 0, 255, true}, kAt}};
constexpr std::array<FaultArgument, 2> kSlows = {
    {{"factor", "times as long as the plugin, and at least 1 ms each", "10", {}, 1, 1e9, false},
     {"seconds", "longer, whatever the plugin takes [s]", "", {}, 0, kLongestSeconds, false}}};
constexpr std::array<FaultArgument, 2> kJitters = {
    {{"seconds", "longest [s]", "0.02", {}, 0, kLongestSeconds, false}, kSeed}};
constexpr std::array<FaultArgument, 1> kAmount = {kBytes};
constexpr std::array<FaultArgument, 1> kDelays = {{{"seconds", "how long [s]", "1", {}, 0, kLongestSeconds, false}}};
constexpr std::array<FaultArgument, 2> kFlips = {
    {{"bit",
      "which one, counted round; a middle one of the payload, the digest's first of the header",
      "",
      {},
      0,
      kLargestWhole,
      true},
     {"where", "which part of the reply", "payload", kPlaces}}};
constexpr std::array<FaultArgument, 1> kScribbles = {kSeed};
constexpr std::array<FaultArgument, 3> kNumbers = {kColumn, kRow, kAll};
constexpr std::array<FaultArgument, 4> kScales = {
    {{"factor", "by which it is multiplied", "1000", {}, -1e300, 1e300, false}, kColumn, kRow, kAll}};
constexpr std::array<FaultArgument, 1> kRows = {kWord};

using enum InjectedFault;

constexpr FaultInfo kKinds[] = {
    {kKill, "kill", "process", "SIGKILL", kEnds},
    {kSegv, "segv", "process", "writes where nothing may be written", kEnds},
    {kAbort, "abort", "process", "abort()", kEnds},
    {kFpe, "fpe", "process", "divides by zero with the trap on", kEnds},
    {kStack, "stack", "process", "overflows its stack", kEnds},
    {kThrow, "throw", "process", "an exception in a thread that nobody catches", kEnds},
    {kExit, "exit", "process", "ends by itself", kExits},

    {kHang, "hang", "hang", "an endless loop", {}},
    {kDeadlock, "deadlock", "hang", "locks a mutex twice", {}},
    {kStop, "stop", "hang", "SIGSTOP to itself; answers when it is continued", {}},
    {kSlow, "slow", "hang", "takes longer by a factor", kSlows},
    {kJitter, "jitter", "hang", "takes longer by a random time", kJitters},

    {kLeak, "leak", "resources", "memory that is touched and never given back", kAmount},
    {kDescriptors, "descriptors", "resources", "opens files until there is no descriptor left, and keeps them", {}},
    {kFlood, "flood", "resources", "lines on standard output", kAmount},
    {kMemory, "memory", "resources", "fails for want of memory", {}},

    {kDrop, "drop", "wire", "no reply", {}},
    {kDelay, "delay", "wire", "the reply comes later", kDelays},
    {kDuplicate, "duplicate", "wire", "the reply comes twice", {}},
    {kTruncate, "truncate", "wire", "half a column (shm), half a message (gRPC)", {}},
    {kOversize, "oversize", "wire", "a column that says it is larger than anything", {}},
    {kFlip, "flip", "wire", "a bit that is turned after the digest was made", kFlips},
    {kStale, "stale", "wire", "the epoch of the incarnation before", {}},
    {kSequence, "sequence", "wire", "the number of the call before", {}},
    {kScribble, "scribble", "wire", "random bytes over what follows epoch and sequence", kScribbles},

    {kNan, "nan", "values", "not a number", kNumbers},
    {kInf, "inf", "values", "infinity", kNumbers},
    {kDenormal, "denormal", "values", "a number below the smallest normal one", kNumbers},
    {kSign, "sign", "values", "the other sign", kNumbers},
    {kScale, "scale", "values", "multiplied by a factor", kScales},
    {kUlp, "ulp", "values", "the next number away from zero", kNumbers},
    {kZero, "zero", "values", "zero", kNumbers},
    {kPermute, "permute", "values", "the rows in reverse order", kRows},
    {kDouble, "double", "values", "the last row twice", kRows},
    {kMissing, "missing", "values", "without the last row", kRows},
    {kPhantom, "phantom", "values", "one row more, a copy with another id; of pairs the first and the last body",
     kRows},

    {kOpen, "open", "sandbox", "opens a new file for writing", {}},
    {kConnect, "connect", "sandbox", "connects to an address", {}},
    {kFork, "fork", "sandbox", "starts a process", {}},
    {kExec, "exec", "sandbox", "becomes another program (one that does not exist)", {}},
    {kPtrace, "ptrace", "sandbox", "stops its parent as a debugger does, and lets it go", {}},
    {kSignal, "signal", "sandbox", "sends its parent a signal that is ignored by default", {}},
    {kMap, "map", "sandbox", "maps 1 TB", {}},

    {kRounding, "rounding", "rounding", "leaves the calling thread flushing denormal numbers to zero", {}},
};

constexpr bool in_order() {
  for (std::size_t i = 0; i < std::size(kKinds); ++i)
    if (static_cast<std::size_t>(kKinds[i].fault) != i) return false;
  return static_cast<std::size_t>(kRounding) + 1 == std::size(kKinds);
}
static_assert(in_order());

// `did you mean 'kill'? Allowed: kill, segv`: all of them, since an order is seldom typed twice.
template <typename Names>
std::string allowed(std::string_view given, const Names& all) {
  std::vector<std::string> names;
  for (const auto& one : all) names.emplace_back(one.name);
  if (names.empty()) return "it takes none";
  const std::string nearest = nearest_name(given, names);
  std::string text = nearest.empty() ? "allowed: " : "did you mean '" + nearest + "'? Allowed: ";
  for (std::size_t i = 0; i < names.size(); ++i) text += (i > 0 ? ", " : "") + names[i];
  return text;
}

std::optional<double> number_of(std::string_view text) {
  double number = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(number)) return std::nullopt;
  return number;
}

// Empty, or what the argument takes.
std::string check_value(const FaultArgument& argument, std::string_view value) {
  if (!argument.words.empty()) {
    if (std::ranges::find(argument.words, value) != argument.words.end()) return {};
    std::string all;
    for (const std::string_view word : argument.words) all += (all.empty() ? "" : ", ") + std::string(word);
    return all;
  }
  if (!argument.is_number()) return value.empty() ? "the name of a column" : "";
  const std::optional<double> number = number_of(value);
  const bool is_right = number && *number >= argument.minimum && *number <= argument.maximum &&
                        (!argument.is_whole || *number == std::floor(*number));
  if (is_right) return {};
  return std::string("a ") + (argument.is_whole ? "whole " : "") + "number from " + number_text(argument.minimum) +
         " to " + number_text(argument.maximum);
}

}  // namespace

std::span<const FaultInfo> fault_kinds() { return kKinds; }

bool FaultOrder::gives(std::string_view argument) const {
  return std::ranges::any_of(given_, [&](const auto& one) { return one.first == argument; });
}

std::string_view FaultOrder::word(std::string_view argument) const {
  for (const auto& [name, value] : given_)
    if (name == argument) return value;
  for (const FaultArgument& one : info_->arguments)
    if (one.name == argument) return one.standard;
  return {};
}

double FaultOrder::number(std::string_view argument) const {
  return number_of(word(argument)).value_or(std::numeric_limits<double>::quiet_NaN());
}

Moment FaultOrder::moment() const {
  const auto found = std::ranges::find(kMoments, word(kAt.name));
  return found == kMoments.end() ? Moment::kCompute : static_cast<Moment>(found - kMoments.begin());
}

std::optional<FaultOrder> parse_fault_order(std::string_view text, std::string* problem) {
  const auto refuse = [problem](std::initializer_list<std::string_view> words) {
    problem->clear();
    for (const std::string_view word : words) *problem += word;
    return std::nullopt;
  };
  if (text.size() > kLongestFaultOrder)
    return refuse({"the order of a fault is longer than ", std::to_string(kLongestFaultOrder), " characters"});
  bool more = true;
  const auto next = [&] {
    const std::size_t comma = text.find(',');
    more = comma != std::string_view::npos;
    const std::string_view part = text.substr(0, comma);
    if (more) text.remove_prefix(comma + 1);
    return part;
  };
  const std::string_view name = next();
  const auto kind = std::ranges::find(kKinds, name, &FaultInfo::name);
  if (kind == std::end(kKinds)) return refuse({"there is no fault '", name, "': ", allowed(name, kKinds)});
  FaultOrder order(*kind);
  while (more) {
    const std::string_view part = next();
    const std::size_t equals = std::min(part.find('='), part.size());
    const std::string_view key = part.substr(0, equals);
    const std::string_view value = part.substr(std::min(equals + 1, part.size()));
    const auto argument = std::ranges::find(kind->arguments, key, &FaultArgument::name);
    if (argument == kind->arguments.end())
      return refuse({"fault '", name, "' has no argument '", key, "': ", allowed(key, kind->arguments)});
    if (order.gives(key)) return refuse({"fault '", name, "' has the argument '", key, "' twice"});
    if (const std::string takes = check_value(*argument, value); !takes.empty())
      return refuse({"fault '", name, "' has '", part, "': allowed for ", key, ": ", takes});
    order.given_.emplace_back(argument->name, value);
  }
  return order;
}

}  // namespace gravitas::host
