#include "plugin_sdk/channel/mailbox.h"

#include <immintrin.h>
#include <linux/futex.h>
#include <sched.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <climits>
#include <cstring>

#include "plugin_sdk/channel/digest.h"

namespace gravitas::channel {
namespace {

// How long a side spins before it sleeps: about what a sleep and a wake cost.
constexpr std::uint64_t kSpinNs = 50'000;

void futex_wake(const std::atomic<std::uint32_t>* word) {
  syscall(SYS_futex, word, FUTEX_WAKE, INT_MAX, nullptr, nullptr, 0);
}

// Without a timeout it waits for ever.
void futex_wait(const std::atomic<std::uint32_t>* word, std::uint32_t expected, const timespec* timeout) {
  syscall(SYS_futex, word, FUTEX_WAIT, expected, timeout, nullptr, 0);
}

// Core on which the caller runs. It is written only when it is another one: the reader may spin on that cache line.
std::uint32_t say_cpu(Mailbox* mine) {
  const auto here = static_cast<std::uint32_t>(sched_getcpu());
  if (mine->cpu.load(std::memory_order_relaxed) != here) mine->cpu.store(here, std::memory_order_relaxed);
  return here;
}

}  // namespace

std::uint64_t now_ns() {
  timespec time;
  clock_gettime(CLOCK_MONOTONIC, &time);
  return static_cast<std::uint64_t>(time.tv_sec) * 1'000'000'000U + static_cast<std::uint64_t>(time.tv_nsec);
}

void post(Mailbox* mine, const Mailbox* theirs) {
  say_cpu(mine);
  const std::uint32_t next = mine->signal.load(std::memory_order_relaxed) + 1;
  mine->signal.store(next == kEnded ? next + 1 : next, std::memory_order_seq_cst);
  if (theirs == nullptr || theirs->sleeping.load(std::memory_order_seq_cst) != 0) futex_wake(&mine->signal);
}

Waited wait(Mailbox* mine, const Mailbox* theirs, std::uint32_t seen, std::uint64_t until) {
  if (theirs->cpu.load(std::memory_order_relaxed) != say_cpu(mine)) {
    // the clock is not looked at before the first round: most answers are there by then
    std::uint64_t spin_end = 0, now = 0;
    do {
      for (int i = 0; i < 32; ++i) {
        if (theirs->signal.load(std::memory_order_acquire) != seen) return Waited::kMessage;
        _mm_pause();
      }
      now = now_ns();
      if (spin_end == 0) spin_end = now + kSpinNs;
    } while (now < spin_end);
  }

  mine->sleeping.store(1, std::memory_order_seq_cst);
  Waited result = Waited::kMessage;
  while (theirs->signal.load(std::memory_order_seq_cst) == seen) {
    const std::uint64_t now = now_ns();
    if (now >= until) {
      result = Waited::kTimeout;
      break;
    }
    const timespec timeout = {static_cast<time_t>((until - now) / 1'000'000'000),
                              static_cast<long>((until - now) % 1'000'000'000)};
    futex_wait(&theirs->signal, seen, &timeout);
  }
  mine->sleeping.store(0, std::memory_order_relaxed);
  return result;
}

void wait_for_change(const Mailbox* mailbox, std::uint32_t seen) {
  while (mailbox->signal.load(std::memory_order_acquire) == seen) futex_wait(&mailbox->signal, seen, nullptr);
}

void say_ended(Mailbox* mailbox) {
  mailbox->signal = kEnded;
  wake(mailbox);
}

void wake(const Mailbox* mailbox) { futex_wake(&mailbox->signal); }

std::uint64_t frame_digest(const gravitas_frame_header& header, std::span<const gravitas_frame_column> columns,
                           std::span<const stage::ColumnInfo> infos, const void* const* data) {
  gravitas_frame_header bare = header;
  bare.digest = 0;
  Digest digest;
  digest.add(&bare, sizeof bare);
  digest.add(columns.data(), columns.size_bytes());
  for (std::size_t i = 0; data != nullptr && i < infos.size(); ++i)
    digest.add(data[i], static_cast<std::size_t>(columns[i].count) * stage::element_size(infos[i].type));
  return digest.value();
}

}  // namespace gravitas::channel
