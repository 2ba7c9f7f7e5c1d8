// A worker and its mailboxes in shared memory, into which frames are written as they are given, well-formed or not.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "kernel/carrier/worker_link.h"
#include "plugin_sdk/channel/mailboxes.h"
#include "plugin_sdk/channel/segment.h"
#include "plugin_sdk/conformance/conformance.h"
#include "services/check/carrier_subject.h"

namespace gravitas::check {

// A frame as it stands in the kernel's mailbox.
struct Frame {
  gravitas_frame_header header{};
  std::vector<gravitas_frame_column> columns, rooms;

  // Makes the digest fit again.
  void seal() { header.digest = channel::frame_digest(header, columns, {}, nullptr); }
};

class MailboxTalk {
 public:
  // Starts a worker and hands over segments with room for `elements` numbers in each column. Throws
  // kernel::StageFault.
  MailboxTalk(const Examinee& examinee, const Patience& patience, std::uint64_t elements);
  ~MailboxTalk() { link_.kill(); }
  MailboxTalk(const MailboxTalk&) = delete;
  MailboxTalk& operator=(const MailboxTalk&) = delete;

  // Writes the request into the state segment and makes its frame, with the next sequence number.
  Frame frame(stage::Method method, const MessageColumns& request);

  void post(const Frame& frame);
  // The same message once more: the signal is counted up and nothing is written.
  void post_again() { channel::post(boxes_.mine, boxes_.theirs); }

  // The reply with that sequence number, after answering what derivatives are asked for; nothing within `seconds`:
  // no value. Throws kernel::StageFault if the process ends.
  std::optional<conformance::Answer> receive(const conformance::Question& question, const Frame& frame, double seconds);

  // Posts a good request and returns its answer. Throws std::runtime_error if there is none within the deadline.
  conformance::Answer ask(const conformance::Question& question);

  double deadline() const { return deadline_; }
  bool has_ended() const { return link_.has_ended(); }
  std::uint64_t state_size() const { return state_.size(); }
  std::uint64_t response_size() const { return response_.size(); }

 private:
  gravitas_frame_column place(std::size_t column, std::uint64_t count) const;
  void answer_derivative(const conformance::Question& question, const Frame& frame);

  double deadline_;
  std::uint64_t elements_;
  channel::Segment state_, response_;
  channel::Mailboxes boxes_;
  kernel::WorkerLink link_;
  std::uint64_t sequence_ = 0;
  std::uint32_t seen_ = boxes_.theirs->signal;
};

}  // namespace gravitas::check
