// What `--resume` names: a checkpoint and the journal beside it, read and held against the scene.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "gravitas/recorder/v1/checkpoint.pb.h"
#include "kernel/environment.h"
#include "services/catalog/catalog.h"
#include "services/recorder/journal.h"
#include "services/run/session.h"

namespace gravitas {

struct Resumption {
  recorder::v1::Checkpoint checkpoint;
  JournalReading journal;  // of what came after the checkpoint
};

// What options.resume names. Throws BadInput if the file cannot be read, is no checkpoint, is one of another build or scene,
// or lies beyond the end of the run. A torn end of the journal is a warning. One that is damaged, or missing though the run
// went on, loses edits, swaps and steps: BadInput, or with options.despite_journal a warning.
Resumption read_resumption(const RunOptions& options, const kernel::EnvironmentDescription& description,
                           std::vector<std::string>* warnings);

// Also of a step that was not made.
bool has_made(const recorder::v1::Checkpoint& checkpoint, const kernel::SwapOrder& swap);

// A swap that was ordered while the run was served, and is still to come.
struct LiveOrder {
  kernel::SwapOrder swap;
  recorder::v1::Decision known;  // as the journal has it
};
// Those that the journal knows for steps that it does not know. One whose plugin is not to be had is warned of.
std::vector<LiveOrder> orders_to_come(const Resumption& resumed, const Catalog& catalog,
                                      std::vector<std::string>* warnings);

// Who answers where a run goes on, and who begins, so that swaps that were made are made again (recorder/decision.h).
struct Answering {
  kernel::EnvironmentDescription now, begun;
};
// Of the description with the checkpoint's edits. Throws std::runtime_error where a plugin is not to be had.
Answering answering_at(const recorder::v1::Checkpoint& checkpoint, const kernel::EnvironmentDescription& description,
                       const Catalog& catalog);

// Swaps of steps to come: those that the command line names, and those that the journal knows, once each. A swap that both know
// has the settings that the journal knows. Who took over in a step that the journal knows takes over there by an order, which
// is told as no swap. Throws std::runtime_error where a plugin is not to be had.
std::vector<kernel::SwapOrder> swaps_to_come(const Resumption& resumed, std::vector<kernel::SwapOrder> named,
                                             std::span<const LiveOrder> live, const Catalog& catalog,
                                             std::vector<recorder::v1::Decision>* taken_over,
                                             std::vector<std::string>* warnings);

// Says of swaps that were ordered for steps up to the checkpoint's that it knows of none there.
void warn_of_unknown_swaps(std::span<const kernel::SwapOrder> orders, const recorder::v1::Checkpoint& checkpoint,
                           std::vector<std::string>* warnings);

// With the reason of the first time.
kernel::Decision as_first_decided(kernel::Decision decision, std::span<const recorder::v1::Decision> taken_over);

// Makes the swaps again in an environment that has begun so, and restores its state. Throws std::runtime_error.
void restore(recorder::v1::Checkpoint* checkpoint, const kernel::EnvironmentDescription& now, const Catalog& catalog,
             kernel::Environment* environment);

// Whatever `action` throws is what the checkpoint asks for and cannot be had: BadInput that names it.
template <typename Action>
void from_checkpoint(const std::string& path, Action&& action) {
  try {
    action();
  } catch (const std::exception& problem) {
    throw BadInput("checkpoint '" + path + "': " + problem.what());
  }
}

// Where a run that keeps no checkpoint has left one: a journal beside it is that of another run, unless this one goes on from
// there, and is removed.
void remove_other_journal(const RunOptions& options, const std::string& checkpoint);

// Where the symbolic links of a name lead, of which the last may lead to nothing yet.
std::filesystem::path end_of_links(std::filesystem::path path);

// The file itself where `path` is a symbolic link to one, or to one that is to be. Throws BadInput if there is something
// else than an ordinary file, which a checkpoint must not replace.
std::string checkpoint_target(const std::string& path);

}  // namespace gravitas
