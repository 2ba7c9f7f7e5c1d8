// How a served run steps, and what is done between its steps. What it tells about itself: served_run_status.cc; who
// decides about pairs: served_run_listener.cc.
#include "services/control/served_run.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <system_error>

#include "plugin_sdk/near_miss.h"
#include "plugin_sdk/property_value.h"
#include "plugin_sdk/slots.h"
#include "services/recorder/identity.h"
#include "services/run/counting_host.h"
#include "services/run/exchange_spec.h"
#include "services/run/fault_desk.h"
#include "services/run/fault_spec.h"
#include "services/run/file_names.h"
#include "services/run/report.h"
#include "services/scene/parser.h"
#include "services/survey/queries.h"

namespace gravitas::control {
namespace {

// A run that is later than this gives up what it lost, instead of hurrying after it.
constexpr std::chrono::milliseconds kLatest{250};
constexpr std::chrono::milliseconds kRateWindow{500};

double seconds(std::chrono::steady_clock::duration duration) { return std::chrono::duration<double>(duration).count(); }

}  // namespace

kernel::EnvironmentDescription ServedRun::slots_of(const kernel::EnvironmentDescription& whole) {
  kernel::EnvironmentDescription slots;
  for (const Slot slot : kSlots) slots.slot(slot) = whole.slot(slot);
  return slots;
}

ServedRun::ServedRun(const ServeOptions& options)
    : options_(options.run),
      hosting_words_(options.hosting_words),
      speed_(options.speed),
      first_description_(load(options.run, &scene_warnings_, &catalog_, &first_scene_)),
      timer_(loop_) {
  for (const std::string& path : options.run.scenes) scene_name_ += (scene_name_.empty() ? "" : " ") + path;
  require_separate_files(options_, first_scene_, {});
  // whom only these name, the command that goes on must name, too
  Catalog named = catalog_;
  for (const std::string& text : options_.comparisons)
    comparisons_.push_back(resolve_swap(parse_compare("--compare", text), first_description_, &named));
  if (options_.resume.empty()) {
    begin_environment(nullptr);
  } else {
    const Resumption resumed = last_known(options_, first_description_, &scene_warnings_);
    begin_environment(&resumed);
  }
  if (!options.is_paused && state_ == State::kPaused) go();
  thread_ = std::jthread([this] {
    const auto work = boost::asio::make_work_guard(loop_);
    loop_.run();
  });
}

ServedRun::~ServedRun() {
  interrupt();
  loop_.stop();
}

kernel::HostStarter ServedRun::starter() {
  return interruptible(counting(with_fault_desk(hosts_.for_environment(), &environment_),
                                [this] {
                                  if (is_stepping_) figures_->count_call();
                                }),
                       [this] { return is_ending_.load(); });
}

void ServedRun::begin_environment(const Resumption* from) {
  // where the new one cannot be made the old one stays
  Beginning begins{first_scene_, first_description_, slots_of(first_description_), {}, {}};
  if (from != nullptr) {
    begins = restored(*from);
  } else {
    begins.environment = start(first_description_, starter(), &first_scene_);
  }
  close_capture();
  survey_.reset();
  environment_ = std::move(begins.environment);
  scene_ = std::move(begins.scene);
  description_ = std::move(begins.description);
  active_ = std::move(begins.active);
  past_.Clear();
  past_swaps_.clear();
  events_ = std::make_unique<EventLog>("", description_);
  figures_ = std::make_unique<Figures>(description_);
  recorder_ = std::make_unique<Recorder>(identity_of(first_description_), [this] { return tally(); });
  if (from != nullptr) {
    const recorder::v1::Checkpoint& kept = from->checkpoint;
    recorder_->set_edits({kept.edits().begin(), kept.edits().end()});
    recorder_->set_decisions({kept.decisions().begin(), kept.decisions().end()});
    for (const edit::v1::Edit& one : kept.edits()) note_edit(one, &past_);
    *past_.mutable_swaps() = kept.tally().swaps();
    events_->resume(kept.tally());
    figures_->resume(kept.tally(), kept.edits_size() > 0);
    figures_->follow(environment_.get());
  }
  event_source_.emplace(events_.get());
  reactions_.emplace("", description_, 0.0);
  with_subscriptions([&](Subscription* one) { one->source().begin_again(*environment_); });
  environment_->set_commit_listener(this);
  pair_decisions_.forget();
  if (listener_) attend_listener();
  orders_.clear();
  for (kernel::SwapOrder& one : begins.swaps) {
    // one of a step that was not made is still to come, and goes by who answers
    if (one.step > environment_->step_count()) continue;
    const auto rank = static_cast<std::uint32_t>(std::ranges::count_if(
        orders_, [&](const Order& made) { return made.swap.slot == one.slot && made.swap.step == one.step; }));
    orders_.push_back({std::move(one), OrderKind::kSwap, ++last_order_, rank});
  }
  warnings_ = scene_warnings_;
  dear_step_.clear();
  fault_.clear();
  checkpoint_.clear();
  resume_command_.clear();
  injected_.clear();
  poisoned_step_ = 0;
  next_collection_ = {};
  stand(environment_->step_count() >= environment_->total_steps() ? State::kFinished : State::kPaused);
  if (state_ != State::kFinished) {
    for (kernel::SwapOrder one : comparisons_) {
      one.step = environment_->step_count() + 1;
      order(std::move(one), OrderKind::kComparison);
    }
    if (from != nullptr) order_again(*from);
  }
  status_now();
  if (!options_.checkpoint.empty()) keep_checkpoint(from != nullptr ? from->journal : JournalReading{});
}

// ---- the steps

void ServedRun::go() {
  state_ = State::kRunning;
  anchor_ = rate_begin_ = Clock::now();
  anchor_step_ = rate_step_ = environment_->step_count();
  rate_ = 0.0;
  schedule();
}

void ServedRun::stand(State state) {
  state_ = state;
  timer_.cancel();
  if (state == State::kFinished || state == State::kFaulted) close_capture();
  if (!steps_left_) return;
  steps_left_.reset();
  step_order_.set_value();
}

ServedRun::Clock::time_point ServedRun::due() const {
  const double steps = environment_->step_count() + 1 - anchor_step_;
  return anchor_ + std::chrono::duration_cast<Clock::duration>(
                       std::chrono::duration<double>(steps * environment_->time_step() / speed_));
}

void ServedRun::schedule() {
  if (is_scheduled_) return;
  is_scheduled_ = true;
  // orders that wait in the loop come before the next step
  if (speed_ == 0.0 || steps_left_) {
    boost::asio::post(loop_, [this] { on_turn(); });
  } else {
    timer_.expires_at(due());
    timer_.async_wait([this](const boost::system::error_code&) { on_turn(); });
  }
}

void ServedRun::on_turn() {
  is_scheduled_ = false;
  if (state_ != State::kRunning || is_ending_) return;
  const bool is_paced = speed_ > 0.0 && !steps_left_;
  const Clock::time_point now = Clock::now();
  // a timer that was cancelled comes early
  if (!is_paced || now >= due()) {
    note_step(now);
    make_step();
    is_stepping_ = false;  // whatever threw
    note_step({});
  }
  if (state_ != State::kRunning) return;
  if (is_paced && now > due() + kLatest) {
    anchor_ = now;
    anchor_step_ = environment_->step_count();
  }
  schedule();
}

void ServedRun::note_step(std::optional<Clock::time_point> begin) {
  const std::lock_guard lock(known_mutex_);
  step_begin_ = begin;
  known_.set_step(environment_->step_count());
  known_.set_time(environment_->time());
  known_.set_state(state_name());
}

void ServedRun::make_step() {
  tape_->step = environment_->step_count() + 1;
  try {
    // the initial state, too
    if (environment_->step_count() == 0) figures_->follow(environment_.get());
    const bool wakes = !environment_->wake_orders().empty();  // which no journal knows
    is_stepping_ = true;
    const kernel::StepOutcome outcome = environment_->step();
    is_stepping_ = false;
    if (outcome == kernel::StepOutcome::kPaused) {
      const kernel::FaultRecord& record = *environment_->fault();
      fault_ = pause_text(description_, record, poisoned_step_ >= record.step);
      return keep_faulted_state();
    }
    figures_->follow(environment_.get());
    const bool is_last = environment_->step_count() >= environment_->total_steps();
    if (is_last && recorder_->keeps()) {
      recorder_->save_last(*environment_);
    } else if (recorder_->is_due(*environment_) || (wakes && recorder_->keeps())) {
      recorder_->save(*environment_);
    }
  } catch (const StepInterrupted&) {
    return;
  } catch (const std::exception& problem) {
    fault_ = problem.what();
    return keep_faulted_state();
  }
  if (capture_ && environment_->step_count() >= capture_->begun + capture_->steps) close_capture();
  const Clock::time_point now = Clock::now();
  if (now - rate_begin_ >= kRateWindow) {
    rate_ = (environment_->step_count() - rate_step_) / seconds(now - rate_begin_);
    rate_begin_ = now;
    rate_step_ = environment_->step_count();
  }
  if (environment_->step_count() >= environment_->total_steps()) return stand(State::kFinished);
  if (steps_left_ && --*steps_left_ == 0) stand(State::kPaused);
}

// ---- orders

void ServedRun::require_steps_left(const std::string& what) const {
  if (state_ == State::kFinished) throw NotNow(what + ": the run has made its last step; reset begins it again");
  if (state_ == State::kFaulted)
    throw NotNow(what + ": the run stands by a fault (" + fault_ + "); reset begins it again");
}

// The step that is meant by `wanted`, 0 being the next.
std::uint32_t ServedRun::next_step(const std::string& what, std::uint32_t wanted) const {
  require_steps_left(what);
  const std::uint32_t next = environment_->step_count() + 1;
  if (wanted == 0) return next;
  if (wanted < next || wanted > environment_->total_steps())
    throw BadInput(fmt::format("{}: there is no step {} to come; allowed: {} (the next) to {}", what, wanted, next,
                               environment_->total_steps()));
  return wanted;
}

void ServedRun::pause() {
  between_steps([this] {
    if (state_ == State::kRunning) stand(State::kPaused);
  });
}

void ServedRun::resume() {
  between_steps([this] {
    require_steps_left("resume");
    if (state_ == State::kRunning && steps_left_) throw NotNow("resume: steps are being made; pause ends them");
    if (state_ != State::kRunning) go();
  });
}

void ServedRun::reset() {
  between_steps([this] {
    const bool goes_on = state_ == State::kRunning && !steps_left_;
    begin_environment(nullptr);
    if (goes_on && state_ == State::kPaused) go();
  });
}

std::future<void> ServedRun::step(std::uint32_t steps) {
  return between_steps([this, steps] {
    if (steps == 0) throw BadInput("step 0: allowed: a number of steps from 1");
    require_steps_left("step");
    if (state_ == State::kRunning) throw NotNow("step: the run goes on; pause it first");
    step_order_ = {};
    steps_left_ = steps;
    go();
    return step_order_.get_future();
  });
}

api::InjectOrdered ServedRun::inject(const api::InjectRequest& request) {
  return between_steps([&] {
    const std::string what = "inject " + request.fault();
    kernel::FaultInjection fault = parse_inject(request.fault());
    fault.step = next_step(what, fault.step);
    api::InjectOrdered ordered;
    ordered.set_step(fault.step);
    try {
      order_fault(fault, active_, {}, &*environment_);
    } catch (const std::invalid_argument& problem) {
      throw BadInput(problem.what());
    }
    injected_.push_back(std::move(fault));
    return ordered;
  });
}

void ServedRun::on_poison(const kernel::Environment& environment, const kernel::PoisonedCall& poisoned) {
  poisoned_step_ = environment.step_count() + 1;
  warnings_.push_back(keep_poisoned_call(options_, poisoned_step_, poisoned));
}

std::future<api::Captured> ServedRun::capture(const api::CaptureRequest& request) {
  const std::string what = fmt::format("capture {}", request.slot());
  const Slot slot = parse_slot("capture", request.slot(), request.slot());
  if (request.steps() == 0) throw BadInput(what + ": allowed: a number of steps from 1");
  if (!request.path().starts_with('/')) throw BadInput(what + ": allowed: an absolute path for the capsule");
  return between_steps([&] {
    RunOptions files = options_;
    files.capsule = request.path();
    for (const scene::v1::Scene* scene : {&first_scene_, &scene_}) require_separate_files(files, *scene, {});
    require_steps_left("capture");
    if (capture_) throw NotNow(what + ": another capture is being made");
    for (const kernel::LeftOut& left_out : environment_->plan().left_out)
      if (left_out.what == slot_name(slot)) throw BadInput(what + ": the plan leaves the slot out: " + left_out.why);
    try {
      tape_->writer = std::make_shared<capsule::Writer>(request.path(), capsule_header(options_, slot),
                                                        OutputFile::Allowed::kOrdinary);
    } catch (const std::runtime_error& problem) {
      throw BadInput(fmt::format("{}: {}", what, problem.what()));
    }
    tape_->slot = slot;
    tape_->problem.clear();
    capture_ = Capture{{}, environment_->step_count(), request.steps()};
    return capture_->end.get_future();
  });
}

void ServedRun::end_capture() {
  between_steps([this] { close_capture(); });
}

void ServedRun::close_capture() {
  if (!capture_) return;
  Capture capture = std::move(*capture_);
  capture_.reset();
  const std::shared_ptr<capsule::Writer> writer = std::exchange(tape_->writer, nullptr);
  try {
    if (!tape_->problem.empty()) throw std::runtime_error(tape_->problem);
    writer->close();
    api::Captured captured;
    captured.set_calls(writer->calls());
    captured.set_first_step(capture.begun + 1);
    captured.set_steps(environment_->step_count() - capture.begun);
    capture.end.set_value(std::move(captured));
  } catch (...) {
    capture.end.set_exception(std::current_exception());
  }
}

survey::Surveyor& ServedRun::surveyor() {
  if (!survey_) {
    // those who answer now
    kernel::EnvironmentDescription description = description_;
    for (const Slot slot : kSlots) description.slot(slot) = active_.slot(slot);
    survey_.reset(new Survey{survey::Surveyor(description)});
  }
  return survey_->surveyor;
}

query::v1::Answers ServedRun::query(const query::v1::Batch& batch) {
  return between_steps([&] {
    try {
      return survey::answer(&surveyor(), *environment_, batch);
    } catch (const survey::BadQuestion& problem) {
      throw BadInput(fmt::format("query: {}", problem.what()));
    } catch (const survey::NoAnswer& problem) {
      throw NotNow(fmt::format("query: {}", problem.what()));
    }
  });
}

instrumentation::v1::Frame ServedRun::instrumentation(const api::InstrumentationRequest& request) {
  std::vector<survey::Kind> kinds;
  try {
    for (const std::string& name : request.kinds()) kinds.push_back(survey::find_kind(name));
  } catch (const std::invalid_argument& problem) {
    throw BadInput(problem.what());
  }
  if (kinds.empty()) kinds = survey::all_kinds();
  return between_steps([&] {
    surveyor();
    return survey_->instrumentation.frame(*environment_, kinds);
  });
}

api::Joints ServedRun::joints() {
  return between_steps([&] {
    api::Joints joints;
    joints.set_time(environment_->time());
    std::vector<std::string> missing;
    for (const survey::JointCoordinate& one : surveyor().coordinates(*environment_, &missing)) {
      api::JointCoordinate* told = joints.add_coordinates();
      told->set_joint(surveyor().description().constraints[one.joint].id);
      told->set_name(one.name);
      told->set_value(one.value);
      told->set_rate(one.rate);
    }
    joints.mutable_missing()->Assign(missing.begin(), missing.end());
    return joints;
  });
}

api::Reactions ServedRun::reactions() {
  return between_steps([&] {
    api::Reactions reactions;
    for (report::v1::Reaction& one : reactions_->last(*environment_)) *reactions.add_reactions() = std::move(one);
    return reactions;
  });
}

std::shared_ptr<Subscription> ServedRun::subscribe(const api::EventsRequest& request) {
  const std::vector<std::string> names(request.kinds().begin(), request.kinds().end());
  const double rate = request.ongoing_rate() == 0.0 ? kOngoingRate : request.ongoing_rate();
  if (!std::isfinite(rate) || rate < 0.0)
    throw BadInput(fmt::format("events: a rate of {:g} Hz; allowed: a finite number > 0", rate));
  EventKinds kinds = default_event_kinds();
  try {
    if (!names.empty()) kinds = parse_event_kinds(names);
  } catch (const std::invalid_argument& problem) {
    throw BadInput(fmt::format("events: {}", problem.what()));
  }
  return between_steps([&] {
    auto subscription = std::make_shared<Subscription>(description_, kinds, rate);
    subscription->source().leave_out_past(*environment_);
    subscriptions_.push_back(subscription);
    return subscription;
  });
}

void ServedRun::on_inner_step(const kernel::Environment& environment, const kernel::InnerStep& inner) {
  reactions_->add(environment, inner);
  figures_->look_at(inner);
  event_source_->on_inner_step(environment, inner);
  with_subscriptions([&](Subscription* one) { one->source().on_inner_step(environment, inner); });
}

void ServedRun::on_commit(const kernel::Environment& environment) {
  event_source_->on_commit(environment);
  with_subscriptions([&](Subscription* one) { one->source().on_commit(environment); });
  // last: it throws where a disk is full
  recorder_->on_commit(environment);
}

void ServedRun::on_decision(const kernel::Environment& environment, const kernel::Decision& decision) {
  kernel::SlotDescription& slot = active_.slot(decision.slot);
  slot.plugins.at(decision.target) = *decision.plugin;
  if (slot.is_hosted_as(*decision.plugin)) slot.hosting = decision.host->hosting;
  if (survey_) survey_->surveyor.follow(decision);
  // last: it throws where a disk is full
  recorder_->on_decision(environment, decision);
}

}  // namespace gravitas::control
