// Counts events, writes them as JSON lines, and remembers who met whom first.
#pragma once

#include <exception>
#include <set>
#include <string>
#include <vector>

#include "gravitas/recorder/v1/checkpoint.pb.h"
#include "gravitas/report/v1/report.pb.h"
#include "services/events/event.h"
#include "services/recorder/output_file.h"

namespace gravitas {

class EventLog final : public EventListener {
 public:
  // The first time a movable body met an immovable one.
  struct Meeting {
    std::string body, with;
    double time;   // s
    double speed;  // m/s, of arrival
  };

  // The description is that of the moment when an event is told. No file if `path` is empty. Throws std::system_error if it
  // cannot be made.
  EventLog(const std::string& path, const kernel::EnvironmentDescription& description);

  // Empties the file, which writing does, too. Throws std::system_error.
  void begin() { file_.begin(); }
  // Writes out what was told so far; throws as close().
  void flush() { file_.flush(); }

  // A file that cannot be written is said by close(): events come in the middle of a commit.
  void on_event(const Event& event) override;

  const report::v1::EventCounts& counts() const { return counts_; }
  const std::vector<Meeting>& meetings() const { return meetings_; }
  // Counts and meetings, into a checkpoint and out of it; the file is not part of it.
  void write(recorder::v1::Tally* tally) const;
  void resume(const recorder::v1::Tally& tally);
  // Writes out everything; throws std::system_error if that fails.
  void close();

 private:
  void remember_meeting(const Event& event);

  const kernel::EnvironmentDescription& description_;
  OutputFile file_;
  std::exception_ptr failure_;
  report::v1::EventCounts counts_;
  std::vector<Meeting> meetings_;
  std::set<std::string> has_met_;
};

}  // namespace gravitas
