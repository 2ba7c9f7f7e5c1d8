// The two mailboxes through which a kernel and a worker process talk in shared memory.
//
//      kernel                                        worker
//   posts in KernelMailbox  -- signal, futex -->  waits, reads, works
//   waits, copies, checks  <-- signal, futex --   posts in WorkerMailbox
//
// Each side writes its own mailbox only (the worker maps the kernel's read-only), so a side that dies holds
// nothing that the other needs: no mutex, no queue, no allocator is shared. A message is complete when `signal`
// has been counted up; the two sides take turns, so one message at a time is in flight each way.
//
// Waiting: spin for a short while if the other side last ran on another core, then sleep in a futex. Without
// that rule two processes on one core spin against each other for a scheduler's slice.
#pragma once

#include <atomic>
#include <cstdint>
#include <span>

#include "schemas/frame/column.h"
#include "schemas/frame/layout.h"

namespace gravitas::channel {

// The signal of a worker that has ended. Linux writes it when a thread that asked for it (set_tid_address(2)) is dying,
// before it takes the process's memory down, milliseconds before others hear of it.
inline constexpr std::uint32_t kEnded = 0;

// What the other side spins on has a cache line to itself: what else is written while it does would slow it.
struct Mailbox {
  // Counted up once a message is complete, or kEnded; the futex word of the reader.
  std::atomic<std::uint32_t> signal;
  // 1 while the owner of this mailbox sleeps: the other side must wake it.
  std::atomic<std::uint32_t> sleeping;
  // Core on which the owner ran when it last looked.
  std::atomic<std::uint32_t> cpu;

  alignas(64) gravitas_frame_header header;
  // Marks of progress of the code at work in a call, the first when it has taken the request.
  std::atomic<std::uint64_t> progress;
  // Nanoseconds the plugin worked on the call that is answered.
  std::uint64_t compute_ns;
  gravitas_frame_column columns[GRAVITAS_MAX_COLUMNS];
  gravitas_frame_column reply[GRAVITAS_MAX_COLUMNS];
  // Why a call was refused or failed.
  char text[512];
};

static_assert(std::atomic<std::uint32_t>::is_always_lock_free && std::atomic<std::uint64_t>::is_always_lock_free);

// Makes the message in `mine` visible and wakes the other side if it sleeps, or, without `theirs`, whether it does or not.
void post(Mailbox* mine, const Mailbox* theirs);

enum class Waited { kMessage, kTimeout };

// Waits until the other side's signal differs from `seen` or the clock (CLOCK_MONOTONIC, ns) passes `until`.
// May also return kTimeout early by less than a millisecond; the caller looks at the clock.
Waited wait(Mailbox* mine, const Mailbox* theirs, std::uint32_t seen, std::uint64_t until);

// Sleeps until the signal of `mailbox` differs from `seen`.
void wait_for_change(const Mailbox* mailbox, std::uint32_t seen);

// Says for its owner that it has ended: Linux does, unless that ended before it had asked for it, or posted while it ended.
void say_ended(Mailbox* mailbox);

// Wakes whoever sleeps on the signal of `mailbox`, without a message.
void wake(const Mailbox* mailbox);

// CLOCK_MONOTONIC in nanoseconds.
std::uint64_t now_ns();

// Digest of a frame: its header (without the digest itself), its columns, and the data of each. `data[i]` has
// columns[i].count elements of the type in `infos`; no data are added if `data` is null (a request: the state segment
// cannot be written by its reader).
std::uint64_t frame_digest(const gravitas_frame_header& header, std::span<const gravitas_frame_column> columns,
                           std::span<const stage::ColumnInfo> infos, const void* const* data);

}  // namespace gravitas::channel
