// Listens to an environment: counts its events, writes them as JSON lines, and remembers who met whom first.
#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "gravitas/recorder/v1/checkpoint.pb.h"
#include "gravitas/report/v1/report.pb.h"
#include "kernel/environment.h"

namespace gravitas {

class EventLog final : public kernel::EventListener {
 public:
  // The first time a movable body met an immovable one.
  struct Meeting {
    std::string body, with;
    double time;   // s
    double speed;  // m/s, of arrival
  };

  // No file if `path` is empty. Throws std::system_error if it cannot be made.
  EventLog(const std::string& path, const kernel::EnvironmentDescription& description);
  ~EventLog() override;
  EventLog(const EventLog&) = delete;
  EventLog& operator=(const EventLog&) = delete;

  void on_event(const kernel::Event& event) override;

  const report::v1::EventCounts& counts() const { return counts_; }
  const std::vector<Meeting>& meetings() const { return meetings_; }
  // Counts and meetings, into a checkpoint and out of it; the file is not part of it.
  void write(recorder::v1::Tally* tally) const;
  void resume(const recorder::v1::Tally& tally);
  // Writes out everything; throws std::system_error if that fails.
  void close();

 private:
  void write(const kernel::Event& event, const char* kind);
  void remember_meeting(const kernel::Event& event);
  std::string body_id(std::uint32_t body) const;

  const kernel::EnvironmentDescription& description_;
  std::string path_;
  std::FILE* file_ = nullptr;
  bool write_failed_ = false;
  report::v1::EventCounts counts_;
  std::vector<Meeting> meetings_;
  std::vector<bool> has_met_;
};

}  // namespace gravitas
