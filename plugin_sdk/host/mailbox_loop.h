// The data loop of a worker process: waits for calls in the kernel's mailbox, runs a plugin, answers.
//
//   request frame -> columns (pointers into the state segment, read-only) -> plugin -> reply columns
//   (in the response segment) -> digest -> reply frame
//
// The loop runs in the process's first thread and nothing else does: a mark of progress can then come from the
// plugin's own code only, and a plugin that hangs is seen to hang.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "plugin_sdk/channel/mailbox.h"
#include "plugin_sdk/channel/segment.h"
#include "plugin_sdk/host/hosted_plugins.h"

namespace gravitas::host {

class MailboxLoop {
 public:
  MailboxLoop(HostedPlugins* plugins, int descriptor_socket)
      : plugins_(plugins), descriptor_socket_(descriptor_socket) {
    take_reserve();
  }

  // Serves calls until a stop frame comes, `stopping` is set, or the kernel is gone. Returns the exit code.
  // `complain` takes what the kernel should hear of besides the answers.
  int serve(std::uint64_t epoch, const std::atomic<bool>& stopping, std::atomic<std::uint64_t>* calls,
            const std::function<void(std::string)>& complain);

 private:
  struct OpenCall;

  // Of the calls that are open: the first, and one inside it, while the plugin waits for derivatives.
  struct Responses {
    channel::Segment segment;
    std::uint64_t generation = 0;
  };

  bool receive_segments();
  void take_reserve();
  // False if a segment that it announces did not come.
  bool take_request(const gravitas_frame_header& header);
  bool map_announced_segments(const gravitas_frame_header& header);
  void answer(const gravitas_frame_header& request);
  std::string read_request(const gravitas_frame_header& request, OpenCall* call);
  std::string read_order(OpenCall* call) const;
  void write_reply(const OpenCall& call, std::int32_t status, const char* text, std::uint64_t compute_ns);
  void post(const gravitas_frame_header& header);
  std::int32_t ask_derivative(OpenCall* call, const gravitas_column* request, gravitas_reply_column* reply);
  void leave_crowded_core();

  HostedPlugins* plugins_;
  int descriptor_socket_;
  int reserve_ = -1;  // a descriptor given up for the next segment's: plugins may take all others
  std::uint64_t epoch_ = 0;

  channel::Segment kernel_segment_, worker_segment_, state_;
  std::vector<channel::Segment> former_states_;  // which the open call still looks at
  std::uint64_t state_generation_ = 0;
  std::array<Responses, 2> responses_;
  std::size_t depth_ = 0;  // calls that wait for derivatives
  const channel::Mailbox* kernel_ = nullptr;
  channel::Mailbox* mine_ = nullptr;
  std::uint32_t seen_ = 0;
  std::uint32_t collisions_ = 0;
};

// Makes fatal signals wake the kernel at once, before the process dies of them, and so any other end of the process, whose
// first thread calls this. Starts a thread that does nothing and never ends; the mailboxes must stay. Without `kernel`
// nobody says whether it sleeps.
void install_crash_reporter(channel::Mailbox* mine, const channel::Mailbox* kernel, std::uint64_t epoch);

// A fatal signal has been reported; the process dies of it, and of nothing else, within a millisecond.
bool is_crashing();

}  // namespace gravitas::host
