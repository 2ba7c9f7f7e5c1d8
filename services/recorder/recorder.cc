#include "services/recorder/recorder.h"

#include <fmt/format.h>

#include <cerrno>
#include <system_error>
#include <utility>

#include "services/recorder/checkpoint.h"
#include "services/recorder/decision.h"
#include "services/recorder/durable_file.h"
#include "services/recorder/identity.h"
#include "services/recorder/library_digest.h"

namespace gravitas {
namespace {

// The run's last step was shorter than the others: a longer run takes another step there, so nothing of it is kept.
bool ends_in_a_shortened_step(const kernel::Environment& environment) {
  return environment.step_count() > 0 && environment.step_count() == environment.total_steps() &&
         environment.saved_state().step_length != environment.time_step();
}

}  // namespace

std::string journal_of(const std::string& checkpoint) { return checkpoint + ".journal"; }

Recorder::Recorder(recorder::v1::Identity identity, std::function<recorder::v1::Tally()> tally)
    : identity_(std::move(identity)), tally_(std::move(tally)) {
  // here, as a run that keeps nothing need not read them
  for (recorder::v1::Library& library : *identity_.mutable_libraries())
    library.set_digest(library_digest(library.path()));
}

void Recorder::expect(const std::string& journal, std::vector<JournalEntry> commits) {
  expected_journal_ = journal;
  expected_ = std::move(commits);
  next_expected_ = 0;
}

void Recorder::keep(const std::string& path, std::uint32_t every, const JournalReading& known,
                    const kernel::Environment& environment) {
  journal_.emplace(journal_of(path), digest_of(identity_), known);
  path_ = path;
  every_ = every;
  save(environment);
}

void Recorder::on_commit(const kernel::Environment& environment) {
  if (ends_in_a_shortened_step(environment)) return;
  const JournalEntry commit{environment.step_count(), environment.chain_hash()};
  check(commit);
  if (!journal_) return;
  journal_->append(commit);
}

void Recorder::on_decision(const kernel::Environment&, const kernel::Decision& decision) {
  recorder::v1::Decision message = message_of(decision);
  if (journal_) message.set_digest(library_digest(message.library()));
  put_in_force(message, &decisions_);
  if (journal_) journal_->append(message);
}

void Recorder::note_edit(const edit::v1::Edit& edit) {
  edits_.push_back(edit);
  if (journal_) journal_->append(edit);
}

void Recorder::note_order(const recorder::v1::Decision& order) {
  if (journal_) journal_->append_order(order);
}

void Recorder::check(const JournalEntry& commit) {
  while (next_expected_ < expected_.size() && expected_[next_expected_].step < commit.step) ++next_expected_;
  if (next_expected_ == expected_.size()) return;
  const JournalEntry& before = expected_[next_expected_];
  if (before.step != commit.step || before.chain == commit.chain) return;
  throw NotRepeatable(
      fmt::format("step {} came out differently: chain hash {} now, {} in the journal '{}'; the run cannot go on as it "
                  "was, since a plugin or this machine does not give the same bits again",
                  commit.step, commit.chain.text(), before.chain.text(), expected_journal_));
}

std::string Recorder::warning() const {
  if (!journal_ || !journal_->is_lost()) return {};
  return fmt::format(
      "journal '{}' was removed or replaced while the run wrote it: whoever goes on has the checkpoint alone, without "
      "the edits and swaps after it",
      journal_of(path_));
}

void Recorder::save(const kernel::Environment& environment, bool goes_on) {
  journal_->flush();
  if (ends_in_a_shortened_step(environment)) return;
  write(path_, environment, goes_on);
  saved_step_ = environment.step_count();
}

void Recorder::save_to(const std::string& path, const kernel::Environment& environment) const {
  write(path, environment, false);
}

void Recorder::write(const std::string& path, const kernel::Environment& environment, bool goes_on) const {
  recorder::v1::Checkpoint checkpoint = make_checkpoint(environment, identity_, tally_(), decisions_);
  checkpoint.set_listener_decided(listener_decided_);
  checkpoint.set_goes_on_in_journal(goes_on);
  // of decisions that no journal took
  for (recorder::v1::Decision& one : *checkpoint.mutable_decisions())
    if (one.digest() == 0) one.set_digest(library_digest(one.library()));
  for (const edit::v1::Edit& edit : edits_) *checkpoint.add_edits() = edit;
  try {
    replace_file(path, serialize_checkpoint(checkpoint));
  } catch (const std::system_error& error) {
    throw std::system_error(error.code(), "checkpoint '" + path + "'");
  }
}

}  // namespace gravitas
