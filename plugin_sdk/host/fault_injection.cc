#include "plugin_sdk/host/fault_injection.h"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstring>
#include <limits>
#include <new>
#include <thread>

#include "plugin_sdk/floating_point.h"
#include "plugin_sdk/host/fault_acts.h"
#include "plugin_sdk/host/faulty_reply.h"

namespace gravitas::host {
namespace {

// Bits of MXCSR: flush to zero, denormals are zero.
constexpr std::uint32_t kFlushing = 0x8040;
// Elements that no column has room for.
constexpr std::uint64_t kFarTooMany = std::uint64_t{1} << 40;
// The digest ends an outcome on the wire (schemas/WIRE.md).
constexpr std::size_t kDigestBytes = 8;

void sleep(double seconds) { std::this_thread::sleep_for(std::chrono::duration<double>(seconds)); }

double slowness(const FaultOrder& order, std::uint64_t compute_ns) {
  if (order.gives("seconds")) return order.number("seconds");
  const double factor = order.number("factor");
  return std::max((factor - 1.0) * 1e-9 * static_cast<double>(compute_ns), 1e-3 * factor);
}

double random_share(const FaultOrder& order) {
  return 0x1p-64 * static_cast<double>(RandomNumbers(static_cast<std::uint64_t>(order.number("seed"))).next());
}

std::string memory_failure() {
  try {
    throw std::bad_alloc();
  } catch (const std::bad_alloc& failure) {
    return failure.what();
  }
}

// Turns the words of 32 bits of which a coin says so into random ones.
void scribble_words(void* bytes, std::size_t size, RandomNumbers* numbers) {
  for (std::size_t at = 0; at + 4 <= size; at += 4) {
    const std::uint64_t drawn = numbers->next();
    if (drawn % 2 == 0) continue;
    std::memcpy(static_cast<std::byte*>(bytes) + at, reinterpret_cast<const std::byte*>(&drawn) + 4, 4);
  }
}

}  // namespace

void FaultInjection::pass(Moment moment) const {
  if (order_.info().group == "process" && order_.moment() == moment)
    end_process(order_.fault(), order_.gives("code") ? static_cast<int>(order_.number("code")) : 0);
  if (is(InjectedFault::kDelay) && moment == Moment::kWrite) sleep(order_.number("seconds"));
}

std::int32_t FaultInjection::after_plugin(const stage::MethodInfo& method, const gravitas_column* request,
                                          gravitas_reply_column* reply, std::int32_t status, std::uint64_t compute_ns,
                                          gravitas_error* error) {
  const auto fail = [error](const std::string& why) {
    error->text[why.copy(error->text, sizeof error->text - 1)] = '\0';
    return GRAVITAS_FAILED;
  };
  pass(Moment::kCompute);
  const std::string_view group = order_.info().group;
  if (group == "sandbox") note_ = try_forbidden(order_.fault());
  switch (order_.fault()) {
    case InjectedFault::kHang:
    case InjectedFault::kDeadlock:
    case InjectedFault::kStop:
      hang(order_.fault());
      break;
    case InjectedFault::kSlow:
      sleep(slowness(order_, compute_ns));
      break;
    case InjectedFault::kJitter:
      sleep(order_.number("seconds") * random_share(order_));
      break;
    case InjectedFault::kLeak:
      if (!leak(static_cast<std::size_t>(order_.number("bytes")))) return fail("there is no more memory to leak");
      break;
    case InjectedFault::kDescriptors:
      note_ = use_up_descriptors();
      break;
    case InjectedFault::kFlood:
      note_ = flood(static_cast<std::size_t>(order_.number("bytes")));
      break;
    case InjectedFault::kMemory:
      return fail(memory_failure());
    case InjectedFault::kRounding:
      set_floating_point_control(floating_point_control() | kFlushing);
      break;
    default:
      break;
  }
  // there is no answer to be changed
  if (status != GRAVITAS_OK) return status;
  if (changes_reply(order_.fault())) {
    const std::string problem = change_reply(order_, method, request, reply);
    if (!problem.empty()) note_ = kNotInjected + problem;
    for (std::size_t i = 0; i < method.reply.size(); ++i)
      if (reply[i].count > reply[i].capacity) return GRAVITAS_NEEDS_CAPACITY;
  }
  const bool needs_payload =
      is(InjectedFault::kTruncate) || (is(InjectedFault::kFlip) && order_.word("where") == "payload");
  is_void_ = needs_payload && payload_bits(method.reply, reply) == 0;
  if (is_void_) note_ = std::string(kNotInjected) + "the reply of " + method.name + " has no elements to damage";
  return status;
}

void FaultInjection::spoil_frame(gravitas_frame_header* header, std::span<gravitas_frame_column> columns,
                                 std::span<const stage::ColumnInfo> infos, const gravitas_reply_column* reply) const {
  if (is_void_) return;
  const auto largest = std::ranges::max_element(columns, {}, &gravitas_frame_column::count);
  const std::uint64_t bits = payload_bits(infos, reply);
  switch (order_.fault()) {
    case InjectedFault::kTruncate:
      largest->count /= 2;
      break;
    case InjectedFault::kOversize:
      largest->count = kFarTooMany;
      break;
    case InjectedFault::kFlip:
      if (order_.word("where") == "payload") {
        flip_payload(order_.gives("bit") ? static_cast<std::uint64_t>(order_.number("bit")) % bits : bits / 2, infos,
                     reply);
      } else {
        const std::uint64_t bit = order_.gives("bit") ? static_cast<std::uint64_t>(order_.number("bit"))
                                                      : 8 * offsetof(gravitas_frame_header, digest);
        flip_bit(header, bit % (8 * sizeof *header));
      }
      break;
    case InjectedFault::kScribble: {
      RandomNumbers numbers(static_cast<std::uint64_t>(order_.number("seed")));
      scribble_words(&header->attempt, sizeof *header - offsetof(gravitas_frame_header, attempt), &numbers);
      scribble_words(columns.data(), columns.size_bytes(), &numbers);
      // never by chance what it was
      ++header->digest;
      break;
    }
    default:
      break;
  }
}

void FaultInjection::spoil_message(std::string* message, std::size_t columns_size) const {
  if (is_void_) return;
  const std::uint64_t head_bits = 8 * (message->size() - columns_size), column_bits = 8 * columns_size;
  switch (order_.fault()) {
    case InjectedFault::kTruncate:
      message->resize(message->size() / 2);
      break;
    case InjectedFault::kOversize:
      // field 1, of 2 GB less one byte
      message->insert(0, "\x0A\xFF\xFF\xFF\xFF\x07");
      break;
    case InjectedFault::kFlip:
      if (order_.word("where") == "payload") {
        // single values of zero are left out of a message
        if (column_bits == 0) break;
        flip_bit(message->data(), order_.gives("bit") ? static_cast<std::uint64_t>(order_.number("bit")) % column_bits
                                                      : column_bits / 2);
      } else {
        flip_bit(message->data(),
                 column_bits + (order_.gives("bit") ? static_cast<std::uint64_t>(order_.number("bit")) % head_bits
                                                    : head_bits - 8 * kDigestBytes));
      }
      break;
    case InjectedFault::kScribble: {
      RandomNumbers numbers(static_cast<std::uint64_t>(order_.number("seed")));
      scribble_words(message->data(), columns_size, &numbers);
      // of a reply without elements too
      flip_bit(message->data(), 8 * (message->size() - kDigestBytes));
      break;
    }
    default:
      break;
  }
}

}  // namespace gravitas::host
