#include "plugin_sdk/channel/mailboxes.h"

#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

namespace gravitas::channel {

Mailboxes::Mailboxes()
    : kernel_segment(Segment::create("gravitas kernel mailbox", sizeof(Mailbox), Sharing::kReadersOnly)),
      worker_segment(Segment::create("gravitas worker mailbox", sizeof(Mailbox), Sharing::kWriters)),
      mine(reinterpret_cast<Mailbox*>(kernel_segment.data())),
      theirs(reinterpret_cast<Mailbox*>(worker_segment.data())) {
  theirs->cpu = ~0U;
  theirs->signal = 1;
}

bool Mailboxes::send(int socket) const {
  const auto send_one = [=](SegmentRole role, const Segment& segment) {
    return send_segment(socket, {role, 0, 0, segment.size()}, segment.descriptor());
  };
  return send_one(SegmentRole::kKernelMailbox, kernel_segment) && send_one(SegmentRole::kWorkerMailbox, worker_segment);
}

EndWatch::EndWatch()
    : segment_(Segment::create("gravitas worker mailbox", sizeof(Mailbox), Sharing::kWriters)),
      theirs_(reinterpret_cast<Mailbox*>(segment_.data())) {
  theirs_->signal = kAlive;
}

EndWatch::~EndWatch() {
  say_ended();
  if (thread_.joinable()) thread_.join();
}

void EndWatch::shut_at_end(int socket) {
  const int own = fcntl(socket, F_DUPFD_CLOEXEC, 0);
  if (own < 0) return;
  try {
    thread_ = std::thread([this, own] {
      wait_for_change(theirs_, kAlive);
      shutdown(own, SHUT_RDWR);
      close(own);
    });
  } catch (...) {
    close(own);
    throw;
  }
}

}  // namespace gravitas::channel
