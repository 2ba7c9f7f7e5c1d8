// The kernel's side of a worker process's mailboxes (mailbox.h): they are made here and given to the worker.
#pragma once

#include <thread>

#include "plugin_sdk/channel/mailbox.h"
#include "plugin_sdk/channel/segment.h"

namespace gravitas::channel {

// Of a worker with its data in shared memory. They must stay until the process has been reaped, since its watcher says so
// here. Throws std::system_error.
struct Mailboxes {
  Mailboxes();
  // Sends both over the descriptor socket of the worker; false if it is gone.
  bool send(int socket) const;

  const Segment kernel_segment, worker_segment;
  Mailbox* const mine;
  Mailbox* const theirs;
};

// Of a worker that speaks over a socket alone: its mailbox says nothing but that it ends, and how many requests it has
// taken. Linux closes the socket of a process that ends only after it has taken down its memory; when the mailbox says so,
// this end is shut, and whoever waits at it hears of the end at once. Throws std::system_error.
class EndWatch {
 public:
  EndWatch();
  ~EndWatch();
  EndWatch(const EndWatch&) = delete;
  EndWatch& operator=(const EndWatch&) = delete;

  // What the process inherits; it stays open here.
  int descriptor() const { return segment_.descriptor(); }
  // Shuts `socket`, of which it keeps a descriptor of its own (without one, Linux alone does it), when the process ends.
  // Once.
  void shut_at_end(int socket);
  // Ends the watching; for when the process has ended, however.
  void say_ended() { channel::say_ended(theirs_); }
  bool has_ended() const { return theirs_->signal.load(std::memory_order_acquire) != kAlive; }
  std::uint64_t requests_taken() const { return theirs_->progress.load(std::memory_order_relaxed); }

 private:
  static constexpr std::uint32_t kAlive = 1;

  Segment segment_;
  Mailbox* const theirs_;
  std::thread thread_;
};

}  // namespace gravitas::channel
