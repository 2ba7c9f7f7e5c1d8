// Listens to an environment's commits and keeps what a later process needs to go on: a checkpoint every so many steps,
// and a journal of all of them. After a resume it holds the new steps against the old journal.
//
//   commit n -> as the old journal has it? -> FILE.journal (buffered) -> every N steps: FILE (replaced as a whole)
//
// A shortened last step is in neither file, since a longer run takes another step there.
// A write that fails throws std::system_error out of Environment::step(): the step is committed, the last checkpoint
// is untouched.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "gravitas/recorder/v1/checkpoint.pb.h"
#include "kernel/environment.h"
#include "services/recorder/journal.h"

namespace gravitas {

std::string journal_of(const std::string& checkpoint);

// A step that was made again came out differently.
class NotRepeatable : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class Recorder final : public kernel::CommitListener {
 public:
  // `tally` says what the report has counted so far.
  Recorder(recorder::v1::Identity identity, std::function<recorder::v1::Tally()> tally);

  // Who answers instead of the scene's own plugins, when the run begins.
  void set_decisions(std::vector<recorder::v1::Decision> decisions) { decisions_ = std::move(decisions); }
  const std::vector<recorder::v1::Decision>& decisions() const { return decisions_; }

  // Edits made before the run begins here, and one that has been made: written to the journal at once.
  void set_edits(std::vector<edit::v1::Edit> edits) { edits_ = std::move(edits); }
  void note_edit(const edit::v1::Edit& edit);
  // A swap was ordered, or called off: for the journal alone, at once.
  void note_order(const recorder::v1::Decision& order);

  // A listener decides about pairs: nobody goes on from what is kept from now on.
  void note_listener(bool decided = true) { listener_decided_ = decided; }
  bool has_listened() const { return listener_decided_; }

  // The next steps must have the chain hashes of this journal.
  void expect(const std::string& journal, std::vector<JournalEntry> commits);

  // Keeps a checkpoint in the file, now and at save(), which is due after every `every` steps counted from t = 0 (never if 0);
  // and the journal beside it, which goes on behind `known`. Throws as JournalWriter and replace_file() do.
  void keep(const std::string& path, std::uint32_t every, const JournalReading& known,
            const kernel::Environment& environment);

  // Throws NotRepeatable, std::system_error.
  void on_commit(const kernel::Environment& environment) override;
  void on_decision(const kernel::Environment& environment, const kernel::Decision& decision) override;

  bool is_due(const kernel::Environment& environment) const {
    return keeps() && every_ != 0 && environment.step_count() % every_ == 0 && saved_step_ != environment.step_count();
  }
  // Brings file and journal to the committed state. Throws std::system_error.
  void save(const kernel::Environment& environment) { save(environment, true); }
  // The same where the run ends: nothing is added to the journal.
  void save_last(const kernel::Environment& environment) {
    save(environment, journal_->goes_beyond(environment.step_count()));
  }

  // Writes the committed state to a file of its own.
  void save_to(const std::string& path, const kernel::Environment& environment) const;

  bool keeps() const { return journal_.has_value(); }
  // What went wrong and ended nothing; empty: nothing.
  std::string warning() const;
  const std::string& path() const { return path_; }
  // Step of the last checkpoint that was put into path().
  std::optional<std::uint32_t> saved_step() const { return saved_step_; }

 private:
  void check(const JournalEntry& commit);
  void save(const kernel::Environment& environment, bool goes_on);
  void write(const std::string& path, const kernel::Environment& environment, bool goes_on) const;

  recorder::v1::Identity identity_;
  std::function<recorder::v1::Tally()> tally_;

  std::vector<recorder::v1::Decision> decisions_;  // the last for each plugin of a slot
  std::vector<edit::v1::Edit> edits_;
  bool listener_decided_ = false;
  std::string expected_journal_;
  std::vector<JournalEntry> expected_;
  std::size_t next_expected_ = 0;

  std::string path_;
  std::uint32_t every_ = 0;
  std::optional<std::uint32_t> saved_step_;
  std::optional<JournalWriter> journal_;
};

}  // namespace gravitas
