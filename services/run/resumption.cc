#include "services/run/resumption.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string_view>
#include <system_error>

#include "plugin_sdk/plugin.h"
#include "plugin_sdk/slots.h"
#include "services/recorder/checkpoint.h"
#include "services/recorder/decision.h"
#include "services/recorder/durable_file.h"
#include "services/recorder/identity.h"
#include "services/recorder/library_digest.h"
#include "services/recorder/recorder.h"
#include "services/run/exchange_spec.h"
#include "services/run/kernel_names.h"
#include "services/run/session.h"

namespace gravitas {
namespace {

namespace fs = std::filesystem;

std::vector<std::byte> read_or_refuse(const std::string& path) {
  try {
    return read_whole_file(path);
  } catch (const std::runtime_error& problem) {
    throw BadInput(fmt::format("checkpoint {}", problem.what()));
  }
}

JournalReading read_journal_beside(const std::string& path, const Hash& run, const recorder::v1::Checkpoint& checkpoint,
                                   bool despite_loss, std::vector<std::string>* warnings) {
  const std::string journal = journal_of(path);
  JournalReading reading;
  try {
    if (fs::exists(journal)) {
      reading = read_journal(read_whole_file(journal), run, checkpoint.step());
    } else if (checkpoint.goes_on_in_journal()) {
      reading.note = "it is missing, and the run went on after the checkpoint";
    }
  } catch (const std::runtime_error& problem) {
    reading.note = problem.what();
  }
  if (reading.note.empty()) return reading;
  // without a whole header nothing of it can be had
  const bool is_lost = checkpoint.goes_on_in_journal() && (reading.is_damaged || reading.end == 0);
  if (is_lost && !despite_loss) {
    const std::uint32_t last = std::max(reading.last_step, checkpoint.step());
    throw BadInput(
        fmt::format("checkpoint '{}': journal '{}': {}; what edits, swaps and steps it knew after step {} is lost. To "
                    "go on all the same, perhaps along another trajectory: --despite-journal",
                    path, journal, reading.note, last));
  }
  warnings->push_back(fmt::format("journal '{}': {}; left aside", journal, reading.note));
  return reading;
}

// A library that was built anew has its name still, and may have its version.
void warn_of_other_builds(const Resumption& resumed, std::vector<std::string>* warnings) {
  const auto look_at = [&](const std::string& plugin, const std::string& library, std::uint64_t digest) {
    const std::uint64_t now = library_digest(library);
    if (digest == 0 || now == digest) return;
    const std::string line =
        fmt::format("plugin {}: '{}' {} since the checkpoint was made, so the run may not go on as it was", plugin,
                    library, now == 0 ? "cannot be read any more" : "was built anew");
    if (std::ranges::find(*warnings, line) == warnings->end()) warnings->push_back(line);
  };
  // of a path that was swapped in again the decision tells the build
  const auto& decisions = resumed.checkpoint.decisions();
  for (const recorder::v1::Library& one : resumed.checkpoint.identity().libraries())
    if (std::ranges::find(decisions, one.path(), &recorder::v1::Decision::library) == decisions.end())
      look_at(one.plugin(), one.path(), one.digest());
  for (const recorder::v1::Decision& one : resumed.checkpoint.decisions())
    look_at(one.plugin(), one.library(), one.digest());
  for (const recorder::v1::Decision& one : resumed.journal.decisions)
    look_at(one.plugin(), one.library(), one.digest());
}

}  // namespace

Resumption read_resumption(const RunOptions& options, const kernel::EnvironmentDescription& description,
                           std::vector<std::string>* warnings) {
  const std::string& path = options.resume;
  const auto refuse = [&](const std::string& why) { throw BadInput(fmt::format("checkpoint '{}': {}", path, why)); };
  const std::vector<std::byte> bytes = read_or_refuse(path);
  std::string problem;
  std::optional<recorder::v1::Checkpoint> checkpoint = parse_checkpoint(bytes, &problem);
  if (!checkpoint) refuse(problem);
  const recorder::v1::Identity scene = identity_of(description);
  problem = find_obstacle(*checkpoint, scene);
  if (!problem.empty()) refuse(problem);
  if (checkpoint->step() > description.steps)
    refuse(
        fmt::format("it is the state after step {}, beyond the end of this run at step {}; --steps and --duration "
                    "count from t = 0",
                    checkpoint->step(), description.steps));
  JournalReading journal =
      read_journal_beside(checkpoint_target(path), digest_of(scene), *checkpoint, options.despite_journal, warnings);
  // the checkpoint has those before a step that was not made
  for (const edit::v1::Edit& made : checkpoint->edits()) {
    const auto known = std::ranges::find_if(journal.edits, [&](const auto& one) { return is_same_edit(made, one); });
    if (known != journal.edits.end()) journal.edits.erase(known);
  }
  Resumption resumed{std::move(*checkpoint), std::move(journal)};
  warn_of_other_builds(resumed, warnings);
  return resumed;
}

bool has_made(const recorder::v1::Checkpoint& checkpoint, const kernel::SwapOrder& swap) {
  return std::ranges::any_of(checkpoint.decisions(), [&](const recorder::v1::Decision& decision) {
    return decision.step() == swap.step && decision.slot() == slot_name(swap.slot) &&
           decision.plugin() == swap.plugin.declaration.name;
  });
}

std::vector<LiveOrder> orders_to_come(const Resumption& resumed, const Catalog& catalog,
                                      std::vector<std::string>* warnings) {
  std::vector<LiveOrder> orders;
  for (const recorder::v1::Decision& one : resumed.journal.orders) {
    if (one.step() <= std::max(resumed.journal.last_step, resumed.checkpoint.step())) continue;
    try {
      LiveOrder order{ordered_swap(one, catalog), one};
      if (!has_made(resumed.checkpoint, order.swap)) orders.push_back(std::move(order));
    } catch (const std::runtime_error& problem) {
      warnings->push_back(
          fmt::format("the swap that was ordered for step {} is not ordered again: {}", one.step(), problem.what()));
    }
  }
  return orders;
}

Answering answering_at(const recorder::v1::Checkpoint& checkpoint, const kernel::EnvironmentDescription& description,
                       const Catalog& catalog) {
  const std::vector<recorder::v1::Decision> decisions(checkpoint.decisions().begin(), checkpoint.decisions().end());
  Answering answering{description, {}};
  put_in_place(decisions, catalog, &answering.now);
  answering.now.asks_forces = checkpoint.asks_forces();
  answering.begun = answering.now;
  take_back_swaps(decisions, catalog, description, &answering.begun);
  return answering;
}

std::vector<kernel::SwapOrder> swaps_to_come(const Resumption& resumed, std::vector<kernel::SwapOrder> named,
                                             std::span<const LiveOrder> live, const Catalog& catalog,
                                             std::vector<recorder::v1::Decision>* taken_over,
                                             std::vector<std::string>* warnings) {
  // one of a step that was not made is in the checkpoint already
  const auto is_restored = [&](const kernel::SwapOrder& one) { return has_made(resumed.checkpoint, one); };
  std::erase_if(
      named, [&](const kernel::SwapOrder& one) { return one.step <= resumed.checkpoint.step() || is_restored(one); });
  std::vector<bool> is_known(named.size(), false);
  std::vector<kernel::SwapOrder> known;  // by the journal alone
  // false if it is ordered already, or by the command line, too
  const auto order_again = [&](kernel::SwapOrder order) {
    const auto is_it = [&](const kernel::SwapOrder& one) {
      return one.slot == order.slot && one.step == order.step &&
             one.plugin.declaration.name == order.plugin.declaration.name;
    };
    const auto is_same = [&](const kernel::SwapOrder& one) {
      return is_it(one) && have_same_settings(one.plugin, order.plugin);
    };
    if (std::ranges::any_of(known, is_same) || is_restored(order)) return false;
    for (std::size_t i = 0; i < named.size(); ++i)
      if (is_known[i] && is_same(named[i])) return false;
    for (std::size_t i = 0; i < named.size(); ++i) {
      if (is_known[i] || !is_it(named[i])) continue;
      is_known[i] = true;
      if (has_same_properties(named[i].plugin.declaration, order.plugin.declaration))
        named[i].plugin.settings = std::move(order.plugin.settings);
      return false;
    }
    known.push_back(std::move(order));
    return true;
  };
  for (const recorder::v1::Decision& decision : resumed.journal.decisions) {
    kernel::SwapOrder order = order_of(decision, catalog);
    order.has_taken_over = !is_swap(decision);
    if (!order_again(std::move(order)) || is_swap(decision)) continue;
    taken_over->push_back(decision);
    warnings->push_back(fmt::format("from step {} on slot {} is answered by {}, as the journal has it ({})",
                                    decision.step(), decision.slot(), decision.plugin(), decision.why()));
  }
  for (const LiveOrder& one : live) order_again(one.swap);
  named.insert(named.end(), known.begin(), known.end());
  return named;
}

void warn_of_unknown_swaps(std::span<const kernel::SwapOrder> orders, const recorder::v1::Checkpoint& checkpoint,
                           std::vector<std::string>* warnings) {
  for (const kernel::SwapOrder& order : orders) {
    const std::string& plugin = order.plugin.declaration.name;
    const auto is_it = [&](const auto& known, std::string_view name) {
      return known.slot() == slot_name(order.slot) && known.step() == order.step && name == plugin;
    };
    const auto is_told = [&](const report::v1::SwapRecord& swap) { return is_it(swap, plugin_of(swap.to())); };
    const auto is_decided = [&](const recorder::v1::Decision& decision) {
      return is_it(decision, decision.plugin()) || is_it(decision.before(), decision.before().plugin());
    };
    if (order.step > checkpoint.step() || std::ranges::any_of(checkpoint.tally().swaps(), is_told) ||
        std::ranges::any_of(checkpoint.decisions(), is_decided))
      continue;
    warnings->push_back(
        fmt::format("--swap {}={} at step {}: the checkpoint of step {} knows of none there: it was refused then, or "
                    "not ordered",
                    slot_name(order.slot), plugin, order.step, checkpoint.step()));
  }
}

kernel::Decision as_first_decided(kernel::Decision decision, std::span<const recorder::v1::Decision> taken_over) {
  for (const recorder::v1::Decision& one : taken_over)
    if (decision.why == "swap" && one.step() == decision.step && one.slot() == slot_name(decision.slot) &&
        one.plugin() == decision.plugin->declaration.name)
      decision.why = one.why();
  return decision;
}

void restore(recorder::v1::Checkpoint* checkpoint, const kernel::EnvironmentDescription& now, const Catalog& catalog,
             kernel::Environment* environment) {
  const std::vector<recorder::v1::Decision> decisions(checkpoint->decisions().begin(), checkpoint->decisions().end());
  for (const kernel::SwapOrder& order : past_swaps(decisions, catalog, now)) environment->order_swap(order);
  const std::string problem = environment->restore(saved_state_of(checkpoint));
  if (!problem.empty()) throw std::runtime_error(problem);
  for (const kernel::SwapRecord& swap : environment->swaps())
    if (swap.state == kernel::SwapState::kRefused)
      throw std::runtime_error(swap.to + " answered when it was made: " + swap.reason);
}

void remove_other_journal(const RunOptions& options, const std::string& checkpoint) {
  std::error_code none;
  if (options.resume.empty() || !fs::equivalent(options.resume, checkpoint, none))
    fs::remove(journal_of(checkpoint), none);
}

fs::path end_of_links(fs::path path) {
  std::error_code none;
  // as many as Linux follows
  for (int i = 0; i < 40 && fs::is_symlink(fs::symlink_status(path, none)); ++i)
    path = path.parent_path() / fs::read_symlink(path, none);
  return path;
}

std::string checkpoint_target(const std::string& path) {
  std::error_code none;
  const fs::file_status status = fs::status(path, none);
  if (!fs::exists(status)) return end_of_links(path).string();
  if (!fs::is_regular_file(status)) throw BadInput(fmt::format("checkpoint '{}': it is not an ordinary file", path));
  return fs::is_symlink(fs::symlink_status(path)) ? fs::canonical(path).string() : path;
}

}  // namespace gravitas
