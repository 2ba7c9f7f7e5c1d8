#include "services/run/session.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <filesystem>
#include <system_error>

#include "plugin_sdk/counted.h"
#include "plugin_sdk/slots.h"
#include "services/capsule/capsule.h"
#include "services/catalog/catalog.h"
#include "services/edit/edit_schedule.h"
#include "services/edit/edited_scene.h"
#include "services/events/event_source.h"
#include "services/recorder/checkpoint.h"
#include "services/recorder/decision.h"
#include "services/recorder/durable_file.h"
#include "services/recorder/event_log.h"
#include "services/recorder/identity.h"
#include "services/recorder/json.h"
#include "services/recorder/output_file.h"
#include "services/recorder/reaction_log.h"
#include "services/recorder/recorder.h"
#include "services/recorder/trajectory.h"
#include "services/run/counting_host.h"
#include "services/run/edit_spec.h"
#include "services/run/exchange_spec.h"
#include "services/run/fault_desk.h"
#include "services/run/fault_spec.h"
#include "services/run/figures.h"
#include "services/run/file_names.h"
#include "services/run/handed_hosts.h"
#include "services/run/interruptible_host.h"
#include "services/run/machine_limits.h"
#include "services/run/report.h"
#include "services/run/resumption.h"
#include "services/run/summary.h"
#include "services/survey/survey_files.h"

namespace gravitas {

std::string paused_checkpoint(const RunOptions& options) {
  return checkpoint_target(std::filesystem::path(options.scenes[0]).stem().string() + ".paused.checkpoint");
}

namespace {

using Clock = std::chrono::steady_clock;

const char* outcome_name(RunOutcome outcome) {
  switch (outcome) {
    case RunOutcome::kCompleted:
      return "completed";
    case RunOutcome::kInterrupted:
      return "interrupted";
    case RunOutcome::kPaused:
      return "paused";
    case RunOutcome::kFailed:
      break;
  }
  return "failed";
}

// A run in its phases. What fails on the way ends the stepping and is kept; the phases after it still do what they can.
class Run final : private kernel::CommitListener {
 public:
  Run(const RunOptions& options, const std::function<bool()>& interrupted)
      : options_(options),
        interrupted_(interrupted),
        description_(load(options, &warnings_, &catalog_, &scene_)),
        identity_(identity_of(description_)) {}

  // Starts the environment and brings it to the state where the run begins.
  void prepare() {
    std::optional<Resumption> resumed;
    if (!options_.resume.empty()) resumed = read_resumption(options_, description_, &warnings_);
    if (!options_.checkpoint.empty()) checkpoint_path_ = checkpoint_target(options_.checkpoint);
    read_edits(resumed ? &*resumed : nullptr);
    read_orders();
    edits_.rehearse(options_, scene_, description_, &catalog_);
    read_kinds();
    Answering answering{description_, description_};
    if (resumed) apply_decisions(*resumed, &answering);
    edits_.require_slots({swaps_, comparisons_, faults_});
    require_workers(answering.now);
    environment_ = start(answering.begun, starter(), &scene_);
    if (!options_.instrumentation.empty() || !options_.joints.empty()) survey_.emplace(answering.now, options_.starter);
    if (options_.listener) begin_listening();
    figures_ = std::make_unique<Figures>(description_);
    // decisions of the start are told after a restore, as of the step that follows it
    if (!resumed) attend();
    guard([&] { figures_->follow(environment_.get()); });
    if (resumed) resume(&*resumed, answering.now);
    for (const RerunSpec& rerun : reruns_) require_rerun(rerun, *environment_);
    give_orders(description_, &*environment_);
    warn_of_orders_beyond_the_end();
  }

  // What stands in the files stays until all that was asked for can be had.
  void open_files() {
    try {
      events_ = std::make_unique<EventLog>(options_.events, description_);
      const double interval = options_.sample_every.value_or(0.0);
      if (!options_.trajectory.empty())
        trajectory_ = std::make_unique<TrajectoryWriter>(options_.trajectory, description_, interval);
      if (survey_) survey_->open(options_.instrumentation, kinds_, options_.joints, interval);
      if (!options_.reactions.empty())
        reactions_ = std::make_unique<ReactionLog>(options_.reactions, description_, interval);
      // opened now, so that nothing is simulated for a report that cannot be written
      if (!options_.report.empty()) report_.emplace("report", options_.report);
    } catch (const std::runtime_error& error) {
      throw BadInput(error.what());
    }
    events_->resume(resumed_tally_);
    if (!event_kinds_.is_empty())
      event_source_.emplace(events_.get(), event_kinds_, options_.ongoing_rate.value_or(kOngoingRate));
    if (event_source_ && !options_.resume.empty()) event_source_->leave_out_swaps(*environment_);
    if (result_.outcome == RunOutcome::kCompleted) guard([&] { start_recorder(); });
    guard([&] {
      for_outputs([](auto& output) { output.begin(); });
      if (report_) report_->begin();
    });
  }

  void go(const std::function<void(const Progress&)>& progress) {
    const Clock::time_point begin = Clock::now();
    guard([&] {
      offer_sample(is_done());
      while (result_.outcome == RunOutcome::kCompleted && !is_done()) {
        if (interrupted_()) {
          result_.outcome = RunOutcome::kInterrupted;
        } else if (!make_due_edits()) {
          break;
        } else if (make_step()) {
          figures_->follow(environment_.get());
          offer_sample(is_done());
          if (recorder_ && recorder_->is_due(*environment_)) save();
          progress({environment_->time(), environment_->time_step() * description_.steps, environment_->step_count(),
                    environment_->total_steps()});
        }
      }
    });
    is_stepping_ = false;  // whatever threw
    wall_seconds_ = std::chrono::duration<double>(Clock::now() - begin).count();
  }

  // False if it ended the run.
  bool make_step() {
    is_stepping_ = true;
    try {
      if (environment_->step() == kernel::StepOutcome::kPaused) pause(*environment_->fault());
    } catch (const StepInterrupted&) {
      result_.outcome = RunOutcome::kInterrupted;
    }
    is_stepping_ = false;
    return result_.outcome == RunOutcome::kCompleted;
  }

  kernel::HostStarter starter() {
    return interruptible(counting(with_fault_desk(hosts_.for_environment(), &environment_),
                                  [this] {
                                    if (is_stepping_) figures_->count_call();
                                  }),
                         [this] { return is_stepping_ && interrupted_(); });
  }

  // Whatever ended the run: the last commit is kept where a checkpoint is wanted or needed.
  void keep_last_state() {
    const bool keeps = recorder_ && recorder_->keeps();
    guard([&] {
      if (is_unrepeatable_) return;
      try {
        if (!keeps && result_.outcome == RunOutcome::kPaused) keep_paused_state();
      } catch (const std::runtime_error& problem) {
        result_.fault += fmt::format("; no checkpoint could be written: {}", problem.what());
      }
      // also over one of this step: in the step that pauses a run others may have taken over
      if (keeps) recorder_->save_last(*environment_);
    });
    // after a failure the one before
    if (!keeps || !recorder_->saved_step()) return;
    result_.checkpoint = recorder_->path();
    result_.checkpoint_step = *recorder_->saved_step();
  }

  void finish() {
    guard([&] {
      if (result_.outcome != RunOutcome::kFailed) offer_sample(true);
    });
    if (event_source_) event_source_->tell_incidents(*environment_);
    for_outputs([&](auto& output) { guard([&] { output.close(); }); });
    if (survey_)
      for (const std::string& warning : survey_->warnings()) warnings_.push_back(warning);
    write_report();
    guard([&] {
      if (!report_) return;
      report_->write(to_json(result_.report, JsonForm::kPage));
      report_->close();
    });
    result_.summary = summarize(result_.report, events_->meetings());
  }

  RunResult take_result() { return std::move(result_); }

 private:
  void read_kinds() {
    try {
      if (options_.event_kinds) event_kinds_ = parse_event_kinds(*options_.event_kinds);
    } catch (const std::invalid_argument& problem) {
      throw BadInput(fmt::format("--event-kinds: {}", problem.what()));
    }
    try {
      for (const std::string& name : options_.instrumentation_kinds) kinds_.push_back(survey::find_kind(name));
    } catch (const std::invalid_argument& problem) {
      throw BadInput(fmt::format("--instrumentation-kinds: {}", problem.what()));
    }
    if (kinds_.empty()) kinds_ = survey::all_kinds();
  }

  void offer_sample(bool last) {
    if (trajectory_) trajectory_->offer(*environment_, last);
    if (reactions_) reactions_->offer(*environment_, last);
    if (survey_) survey_->offer(*environment_, last);
  }

  void for_outputs(auto use) {
    if (trajectory_) use(*trajectory_);
    if (survey_) survey_->for_each(use);
    if (reactions_) use(*reactions_);
    use(*events_);
  }

  // Outputs first: who goes on from the checkpoint has what came before it.
  void save() {
    for_outputs([](auto& output) { output.flush(); });
    recorder_->save(*environment_);
  }

  void begin_listening() {
    if (!options_.resume.empty()) throw BadInput("a run in which a listener decides about pairs is not resumed");
    pair_decisions_.emplace([this](const std::string& why) {
      warnings_.push_back(why);
      tell({EventKind::kListener, environment_->step_count() + 1, environment_->time()}, why);
    });
    pair_decisions_->listen(options_.listener, options_.listener_deadline);
  }

  void resume(Resumption* from, const kernel::EnvironmentDescription& answering) {
    from_checkpoint(options_.resume, [&] { restore(&from->checkpoint, answering, catalog_, environment_.get()); });
    resumed_tally_ = from->checkpoint.tally();
    *result_.report.mutable_swaps() = resumed_tally_.swaps();
    resumed_step_ = from->checkpoint.step();
    journal_ = std::move(from->journal);
    figures_->resume(resumed_tally_, from->checkpoint.edits_size() > 0);
    attend();
    // else nobody is left to ask
    if (result_.outcome == RunOutcome::kCompleted) guard([&] { figures_->follow(environment_.get()); });
  }

  // Faults, swaps and comparisons of the command line, with the plugins they name.
  void read_orders() {
    for (const std::string& text : options_.swaps)
      swaps_.push_back(resolve_swap(parse_swap(text), description_, &catalog_));
    for (const std::string& text : options_.comparisons)
      comparisons_.push_back(resolve_swap(parse_compare("--compare", text), description_, &catalog_));
    for (const std::string& text : options_.faults) faults_.push_back(parse_fault(text));
    for (const kernel::FaultInjection& fault : faults_) require_worker(fault, swaps_);
    for (const std::string& text : options_.reruns) reruns_.push_back(parse_rerun(text));
  }

  // Whoever answered when the checkpoint was made answers again; what the journal knows of later steps is ordered for
  // them. Swaps of the command line up to the checkpoint are done, or were refused.
  void apply_decisions(const Resumption& resumed, Answering* answering) {
    warn_of_unknown_swaps(swaps_, resumed.checkpoint, &warnings_);
    from_checkpoint(options_.resume, [&] {
      decisions_.assign(resumed.checkpoint.decisions().begin(), resumed.checkpoint.decisions().end());
      *answering = answering_at(resumed.checkpoint, description_, catalog_);
      const std::vector<LiveOrder> live = orders_to_come(resumed, catalog_, &warnings_);
      for (const LiveOrder& one : live) live_orders_.push_back(one.known);
      swaps_ = swaps_to_come(resumed, std::move(swaps_), live, catalog_, &taken_over_, &warnings_);
    });
    leave_out_committed(taken_over_, description_, &faults_);
    // how far hosting may differ is for the command line to say
    for (auto* one : {&answering->now, &answering->begun}) apply_hosting(options_.hosting, one);
  }

  // Edits of the checkpoint have been made; those of the journal and the command line are to come.
  void read_edits(const Resumption* resumed) {
    edits_.plan(parse_edits(options_.edits));
    require_separate_files(options_, scene_, edits_.to_come());
    if (resumed != nullptr) {
      for (edit::v1::Edit one : resumed->checkpoint.edits()) {
        take(EditedScene(options_, scene_, description_, &catalog_, &one, nullptr));
        edits_.note(one);
        note_edit(one, &result_.report);
      }
      edits_.leave_out_past(resumed->checkpoint.step(), resumed->journal.edits);
    }
  }

  void take(const EditedScene& edited) {
    scene_ = edited.scene();
    description_ = edited.description();
  }

  // False if one could not be made, which ends the run.
  bool make_due_edits() {
    while (std::optional<edit::v1::Edit> edit = edits_.take_due(environment_->step_count() + 1)) {
      try {
        make(&*edit);
      } catch (const BadInput& problem) {
        fail(problem.what());
        result_.is_bad_input = true;
      }
      if (result_.outcome != RunOutcome::kCompleted) return false;
    }
    return true;
  }

  // Another environment goes on; what this one has to tell is told now.
  void make(edit::v1::Edit* edit) {
    EditedScene edited(options_, scene_, description_, &catalog_, edit, &*environment_);
    kernel::EnvironmentDescription active = description_, begun = edited.description();
    put_in_place(decisions_, catalog_, &active);
    keep_who_answers(description_, active, &begun);
    std::vector<recorder::v1::Decision> decisions = decisions_;
    EditedScene::Successor next = edited.succeed(*environment_, begun, catalog_, starter(), &decisions);
    edited.look_at_limits(active, *environment_, begun, *next.environment);
    const std::vector<std::uint32_t> woken = edited.woken(*environment_, *next.environment);
    give_orders(edited.description(), &*next.environment);
    for (const std::string& warning : edited.warnings())
      if (std::ranges::find(warnings_, warning) == warnings_.end()) warnings_.push_back(warning);
    for (const auto& [a, b] : next.parted)
      tell({EventKind::kCollisionEnd, environment_->step_count(), environment_->time(), a, b}, "");
    write_past();
    for (const kernel::SwapRecord& swap : next.settled) {
      renew_swap(swap, result_.report.mutable_swaps(), result_.report.swaps_size());
      tell(swap_event(*environment_, swap), swap.reason);
    }
    decisions_ = std::move(decisions);
    take(edited);
    if (pair_decisions_) pair_decisions_->follow(environment_->model(), next.environment->model());
    environment_ = std::move(next.environment);
    edits_.note(*edit);
    note_edit(*edit, &result_.report);
    attend();
    if (recorder_) recorder_->set_decisions(decisions_);
    // before all that may fail in the new environment; where its own disk is full, figures are of that all the same
    std::exception_ptr failure;
    try {
      if (recorder_) recorder_->note_edit(*edit);
    } catch (const std::exception&) {
      failure = std::current_exception();
    }
    if (event_source_) event_source_->begin_again(*environment_);
    if (trajectory_) trajectory_->follow(description_);
    if (reactions_) reactions_->begin_again();
    if (survey_) survey_->begin_again(begun);
    figures_->begin_again(environment_.get());
    tell({EventKind::kEdit, environment_->step_count(), environment_->time()},
         fmt::format("{} before step {}", counted(edit->changes_size(), "change"), edit->step()));
    for (const std::uint32_t body : woken)
      tell({EventKind::kWake, environment_->step_count(), environment_->time(), body}, "");
    if (failure) std::rethrow_exception(failure);
  }

  void attend() {
    environment_->set_commit_listener(this);
    if (pair_decisions_) environment_->set_pair_arbiter(&*pair_decisions_);
  }

  void tell(Event event, const std::string& text) {
    event.text = text;
    if (event_kinds_.has(event.kind)) events_->on_event(event);
  }

  void warn_of_orders_beyond_the_end() {
    const auto warn = [&](const char* option, std::uint32_t step) {
      if (step > description_.steps)
        warnings_.push_back(fmt::format("{} at step {} never comes: the run has {}", option, step,
                                        counted(description_.steps, "step")));
    };
    for (const kernel::SwapOrder& order : swaps_) warn("--swap", order.step);
    for (const kernel::FaultInjection& fault : faults_) warn("--fault", fault.step);
    for (const edit::v1::Edit& edit : edits_.to_come()) warn("--edit", edit.step());
  }

  // Those of steps up to the next edit; after it another environment gets the rest.
  void give_orders(const kernel::EnvironmentDescription& description, kernel::Environment* world) {
    const std::uint32_t made = world->step_count();
    const auto is_due = [&](std::uint32_t step) {
      return (made == 0 || step > made) && (edits_.to_come().empty() || step < edits_.to_come().front().step());
    };
    try {
      for (const kernel::SwapOrder& order : swaps_)
        if (is_due(order.step)) world->order_swap(order);
      // after an edit they are counted anew
      for (kernel::SwapOrder& order : comparisons_) {
        if (made > 0) order.step = made + 1;
        world->order_swap(order, true);
      }
      for (const kernel::FaultInjection& fault : faults_)
        if (is_due(fault.step)) order_fault(fault, description, swaps_, world);
      for (const RerunSpec& rerun : reruns_) world->set_rerun_every(rerun.slot, rerun.every);
    } catch (const std::invalid_argument& problem) {
      throw BadInput(problem.what());
    }
  }

  void on_inner_step(const kernel::Environment& environment, const kernel::InnerStep& inner) override {
    figures_->look_at(inner);
    if (reactions_) reactions_->add(environment, inner);
    if (event_source_) event_source_->on_inner_step(environment, inner);
  }
  void on_attempt(const kernel::StepData& data, std::uint32_t pieces) override {
    if (reactions_) reactions_->add_attempt(data, pieces);
  }
  void on_commit(const kernel::Environment& environment) override {
    if (event_source_) event_source_->on_commit(environment);
    if (recorder_) recorder_->on_commit(environment);
  }
  void on_decision(const kernel::Environment& environment, const kernel::Decision& told) override {
    const kernel::Decision decision = as_first_decided(told, taken_over_);
    put_in_force(message_of(decision), &decisions_);
    if (survey_) survey_->follow(decision);
    if (recorder_) recorder_->on_decision(environment, decision);
  }
  void on_poison(const kernel::Environment& environment, const kernel::PoisonedCall& poisoned) override {
    poisoned_step_ = environment.step_count() + 1;
    warnings_.push_back(keep_poisoned_call(options_, poisoned_step_, poisoned));
  }

  // Where no recorder keeps a checkpoint.
  void keep_paused_state() {
    const std::string path = checkpoint_path_.empty() ? paused_checkpoint(options_) : checkpoint_path_;
    Recorder recorder(identity_, [this] { return tally(); });
    recorder.set_edits(edits_.made());
    if (options_.listener) recorder.note_listener();
    recorder.set_decisions(decisions_);
    recorder.save_to(path, *environment_);
    if (checkpoint_path_.empty()) remove_other_journal(options_, path);
    result_.checkpoint = path;
    result_.checkpoint_step = environment_->step_count();
  }

  bool is_done() const { return environment_->step_count() >= environment_->total_steps(); }

  // Errors that end a run and do not lose it.
  template <typename Action>
  void guard(Action&& action) {
    try {
      action();
    } catch (const kernel::StageFault& fault) {
      // a force that was asked for its potential failed
      pause({environment_->step_count(), fault});
    } catch (const NotRepeatable& problem) {
      is_unrepeatable_ = true;
      fail(problem.what());
    } catch (const std::system_error& error) {
      fail(error.what());
    } catch (const std::length_error& error) {
      fail(error.what());
    }
  }

  void pause(const kernel::FaultRecord& record) {
    result_.outcome = RunOutcome::kPaused;
    result_.fault = "paused at " + pause_text(description_, record, poisoned_step_ >= record.step);
  }

  // A run that has paused stays that: what fails after it is said besides.
  void fail(const std::string& why) {
    if (result_.outcome != RunOutcome::kPaused) result_.outcome = RunOutcome::kFailed;
    if (result_.fault.find(why) == std::string::npos) result_.fault += (result_.fault.empty() ? "" : "; ") + why;
  }

  // What the report counts, for a checkpoint.
  recorder::v1::Tally tally() const {
    return tally_of(*environment_, taken_over_, result_.report, *figures_, *events_);
  }

  // Listens if there is something to keep or to compare.
  void start_recorder() {
    if (checkpoint_path_.empty() && journal_.commits.empty()) return;
    recorder_.emplace(identity_, [this] { return tally(); });
    recorder_->set_edits(edits_.made());
    if (!journal_.commits.empty()) recorder_->expect(journal_of(checkpoint_target(options_.resume)), journal_.commits);
    recorder_->set_decisions(decisions_);
    if (options_.listener) recorder_->note_listener();
    if (checkpoint_path_.empty()) return;
    // that of another file begins with what is still to come
    if (!goes_on_in_its_checkpoint(options_)) journal_ = {.orders = live_orders_};
    try {
      recorder_->keep(checkpoint_path_, options_.checkpoint_every, journal_, *environment_);
    } catch (const std::system_error& error) {
      if (is_disk_error(error.code())) throw;
      throw BadInput(error.what());
    } catch (const std::runtime_error& problem) {
      throw BadInput(problem.what());
    }
  }

  void write_report();
  void write_past();

  const RunOptions& options_;
  const std::function<bool()>& interrupted_;
  const HandedHosts hosts_{options_.starter};
  bool is_stepping_ = false, is_unrepeatable_ = false;
  std::vector<std::string> warnings_;
  Catalog catalog_;
  scene::v1::Scene scene_;
  // With the edits made so far, of which those that listen hold references.
  kernel::EnvironmentDescription description_;
  const recorder::v1::Identity identity_;  // of the scene before them
  EditSchedule edits_;
  std::string checkpoint_path_;
  RunResult result_;
  std::vector<kernel::SwapOrder> swaps_, comparisons_;
  std::vector<kernel::FaultInjection> faults_;
  std::vector<RerunSpec> reruns_;
  std::vector<recorder::v1::Decision> decisions_, taken_over_;  // in force; in the journal, and no swaps
  std::vector<recorder::v1::Decision> live_orders_;             // of the journal, still to come
  std::optional<PairDecisions> pair_decisions_;
  std::unique_ptr<kernel::Environment> environment_;
  std::unique_ptr<Figures> figures_;
  recorder::v1::Tally resumed_tally_;  // of the checkpoint
  std::uint32_t resumed_step_ = 0;     // likewise
  JournalReading journal_;             // of the checkpoint
  std::unique_ptr<TrajectoryWriter> trajectory_;
  std::optional<OutputFile> report_;
  std::unique_ptr<ReactionLog> reactions_;
  std::unique_ptr<EventLog> events_;
  EventKinds event_kinds_ = default_event_kinds();
  std::optional<EventSource> event_source_;
  std::vector<survey::Kind> kinds_;
  std::optional<survey::SurveyFiles> survey_;
  std::optional<Recorder> recorder_;
  std::uint32_t poisoned_step_ = 0;  // the last
  double wall_seconds_ = 0.0;
};

// What the environment has done so far, once.
void Run::write_past() {
  for (std::string& warning : environment_->warnings()) warnings_.push_back(std::move(warning));
  write_faults(*environment_, &result_.report);
  write_swaps(*environment_, taken_over_, &result_.report);
}

void Run::write_report() {
  report::v1::Report& report = result_.report;
  for (const std::string& path : options_.scenes)
    report.set_scene(report.scene() + (report.scene().empty() ? "" : " ") + path);
  report.set_simulated_seconds(environment_->time());
  report.set_steps(environment_->step_count());
  report.set_time_step(environment_->time_step());
  report.set_bodies(environment_->model().body_count);
  report.set_wall_seconds(wall_seconds_);
  report.set_outcome(outcome_name(result_.outcome));
  report.set_state_hash(environment_->state_hash().text());
  report.set_chain_hash(environment_->chain_hash().text());
  *report.mutable_plan() = plan_message(*environment_, description_);
  *report.mutable_events() = events_->counts();
  for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(EventKind::kCount); ++i)
    if (const auto kind = static_cast<EventKind>(i); event_kinds_.has(kind))
      report.add_event_kinds(event_kind_name(kind));
  write_past();
  if (recorder_ && !recorder_->warning().empty()) warnings_.push_back(recorder_->warning());
  for (std::string& warning : warnings_) report.add_warnings(std::move(warning));
  name_orders(faults_, description_, {resumed_step_, report.steps()}, true, &report);
  if (!edits_.made().empty()) report.add_warnings("times of stages and steps are those since the last edit");
  fold_warnings(&report);
  write_stages(*environment_, &report);
  figures_->write(&report);
  if (!reactions_) return;
  for (report::v1::Reaction& reaction : reactions_->last(*environment_)) *report.add_reactions() = std::move(reaction);
}

}  // namespace

RunResult run(const RunOptions& options, const std::function<bool()>& interrupted,
              const std::function<void(const Progress&)>& progress) {
  Run one(options, interrupted);
  one.prepare();
  one.open_files();
  one.go(progress);
  one.keep_last_state();
  one.finish();
  return one.take_result();
}

}  // namespace gravitas
