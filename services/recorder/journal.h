// The journal beside a checkpoint: what happened at each commit, appended while the run goes on. On resume the steps
// between the checkpoint and the journal's end are made again and must come out with the same chain hash.
//
//   header: magic 8 | version 4 | 0 4 | run 16 | check 8                                   little-endian
//   record: kind 1 | 0 3 | size 4 | payload | check 8
//   kinds:  1 commit: step 4, chain hash 16 (36 bytes a step in all)
//           2 decision: a message recorder.v1.Decision; who answers from its step on
//           3 edit: a message edit.v1.Edit; how the scene is from its step on
//           4 order: a message recorder.v1.Decision; a swap that was ordered for its step (why: "swap", or "setting" of a
//             changed setting), or was called off ("called off")
//
// A check is XXH3-64 of the record, seeded with the check before it, so that records can neither be changed nor
// exchanged. `run` is the digest of the scene's identity and the build. A record that is not whole (a crash tears the
// last one) ends the journal; where whole ones stand behind it the file is damaged, which no crash of the program does (a
// power failure may). Decisions, edits and orders change what a later commit is made of, and are written before it; commits may be buffered, since the journal
// only vouches for them.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "gravitas/recorder/v1/checkpoint.pb.h"
#include "plugin_sdk/trajectory_hash.h"

namespace gravitas {

// Why of an order.
inline constexpr const char *kOrderOfSwap = "swap", *kOrderOfSetting = "setting", *kCalledOff = "called off";

struct JournalEntry {
  std::uint32_t step;
  Hash chain;
};

// What could be read of a journal.
struct JournalReading {
  std::vector<JournalEntry> commits;              // beyond the step asked for, ascending
  std::vector<recorder::v1::Decision> decisions;  // for steps beyond it
  std::vector<edit::v1::Edit> edits;              // likewise
  std::vector<recorder::v1::Decision> orders;     // likewise, each once, without those that were called off
  std::uint64_t end = 0;                          // offset behind the last whole record; 0: not a journal of this run
  std::uint64_t check = 0;                        // of that record
  std::uint32_t last_step = 0;                    // of all commits
  std::string note;                               // what was left aside and why; empty: nothing
  bool is_damaged = false;                        // what was left aside is more than a torn end
};

// The same changes before the same step, wherever bodies were.
bool is_same_edit(const edit::v1::Edit& a, const edit::v1::Edit& b);

// Reads any bytes. `after`: the step that is already known.
JournalReading read_journal(std::span<const std::byte> bytes, const Hash& run, std::uint32_t after);

class JournalWriter {
 public:
  // Goes on behind what was read; a reading without an end starts a new journal, with its orders. Throws
  // std::system_error if the file cannot be made, std::runtime_error if another run is writing it.
  JournalWriter(const std::string& path, const Hash& run, const JournalReading& known);
  ~JournalWriter();
  JournalWriter(const JournalWriter&) = delete;
  JournalWriter& operator=(const JournalWriter&) = delete;

  // Steps that the journal knows are not written again. Throws std::system_error when what is buffered cannot be
  // written; it is then lost.
  void append(const JournalEntry& commit);
  // Written at once.
  void append(const recorder::v1::Decision& decision);
  // That a swap is ordered, or called off; written at once.
  void append_order(const recorder::v1::Decision& order);
  // One that the journal knows and that is made again is not written again.
  void append(const edit::v1::Edit& edit);
  void flush();
  // It holds more than the steps up to this one: of a run that came further before.
  bool goes_beyond(std::uint32_t step) const { return last_step_ > step || !known_edits_.empty(); }
  // As the last flush found: somebody removed the file, or put another into its place.
  bool is_lost() const { return is_lost_; }

 private:
  using Clock = std::chrono::steady_clock;

  void put(std::uint8_t kind, std::span<const std::byte> payload);
  void put_message(std::uint8_t kind, const google::protobuf::Message& message);

  std::string path_;
  int file_ = -1;
  bool is_lost_ = false;
  std::uint64_t check_ = 0;
  std::uint32_t last_step_;
  std::vector<edit::v1::Edit> known_edits_;  // not made again so far
  std::vector<std::byte> buffer_;
  Clock::time_point last_flush_ = Clock::now();
};

}  // namespace gravitas
