// A run that is controlled while it goes on: one thread makes the steps, paced by the wall clock, and carries out
// orders between them. Functions may be called from any other thread; each waits for the step that is being made.
//
//   run = ServedRun(options)      starts the workers; paused if so asked, else it steps
//   paused --resume--> running --pause--> paused --step(n)--> running --n steps--> paused
//   running --last step--> finished, running --fault that nobody survives--> faulted, any --reset--> paused or running
//
// One that goes on from a checkpoint begins with the last step that the journal beside it knows; a reset begins the scene.
//
// What can never be throws BadInput, what cannot be now NotNow; both say what is allowed.
#pragma once

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "gravitas/control_api/v1/control_api.pb.h"
#include "kernel/environment.h"
#include "services/capsule/recording_host.h"
#include "services/catalog/catalog.h"
#include "services/control/remote_listener.h"
#include "services/control/subscription.h"
#include "services/events/event_source.h"
#include "services/recorder/event_log.h"
#include "services/recorder/reaction_log.h"
#include "services/recorder/recorder.h"
#include "services/run/figures.h"
#include "services/run/handed_hosts.h"
#include "services/run/interruptible_host.h"
#include "services/run/report.h"
#include "services/run/resumption.h"
#include "services/run/session.h"
#include "services/survey/instrumentation.h"

namespace gravitas::control {

namespace api = control_api::v1;

struct ServeOptions {
  // The scene and its overrides; what is compared all along; of files the checkpoints alone, to go on from and to keep.
  RunOptions run;
  double speed = 1.0;  // simulated seconds per second of wall time; 0: as fast as possible
  bool is_paused = false;
  std::vector<std::string> hosting_words = {};  // of the command line, for the one that goes on from a checkpoint
};

class NotNow : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class ServedRun final : private kernel::CommitListener {
 public:
  explicit ServedRun(const ServeOptions& options);
  // Ends after the step that is being made.
  ~ServedRun() override;
  ServedRun(const ServedRun&) = delete;
  ServedRun& operator=(const ServedRun&) = delete;

  const std::string& scene() const { return scene_name_; }
  // Of the reader, for whoever started it.
  const std::vector<std::string>& scene_warnings() const { return scene_warnings_; }

  // Gives up the step in hand, and makes no other one; what was committed can still be asked for. From any thread.
  void interrupt() { is_ending_ = true; }

  struct Saved {
    std::uint32_t step;    // that the checkpoint holds
    std::string go_on_by;  // a command; empty if there is none
  };
  // Brings the checkpoint that options ask for to the last commit, if they do. Throws std::system_error.
  std::optional<Saved> save_checkpoint();

  // Of a step that takes long, as it was when that began.
  api::Status status();
  // As it is when the step has ended.
  api::Status status_between_steps();
  void pause();
  void resume();
  void reset();
  // Begins so many steps. The future is ready when they are made, or the run stands for another reason.
  std::future<void> step(std::uint32_t steps);

  api::SwapOrdered swap(const api::SwapRequest& request);
  api::ServedSwap call_off(const api::CallOffRequest& request);
  api::SwapOrdered set_property(const api::SetPropertyRequest& request);
  api::EditMade edit(const api::EditRequest& request);
  void wake(const api::WakeRequest& request);
  api::InjectOrdered inject(const api::InjectRequest& request);
  // Begins to keep calls. The future is ready when the steps are made, or end_capture() has ended it.
  std::future<api::Captured> capture(const api::CaptureRequest& request);
  void end_capture();

  // Events from now on, for as long as somebody holds it; a reset does not end it.
  std::shared_ptr<Subscription> subscribe(const api::EventsRequest& request);

  // It decides about pairs, until it is dismissed or end_listening() is called. What was decided holds up to a reset.
  void listen(std::shared_ptr<RemoteListener> listener, double deadline);
  void end_listening(const std::shared_ptr<RemoteListener>& listener);

  // Of the state that the last step committed (services/survey/); a run that stands can be asked, too.
  query::v1::Answers query(const query::v1::Batch& batch);
  instrumentation::v1::Frame instrumentation(const api::InstrumentationRequest& request);
  api::Reactions reactions();
  api::Joints joints();

 private:
  using Clock = std::chrono::steady_clock;
  enum class State : std::uint32_t { kRunning, kPaused, kFinished, kFaulted };
  // A setting is changed by a swap of the plugin for itself.
  enum class OrderKind : std::uint32_t { kSwap, kSetting, kComparison };
  // Its number, and what to find its record by: the rank among those of the slot at that step.
  struct Order {
    kernel::SwapOrder swap;
    OrderKind kind;
    std::uint32_t number, rank;
    bool compares() const { return kind == OrderKind::kComparison; }
  };
  // Calls that are being kept.
  struct Capture {
    std::promise<api::Captured> end;
    std::uint32_t begun, steps;  // after so many commits, and for how many more
  };

  // Has the stepping thread do it between two steps, and waits.
  template <typename Action>
  auto between_steps(Action action) {
    std::packaged_task<decltype(action())()> task(std::move(action));
    auto done = task.get_future();
    boost::asio::post(loop_, std::move(task));
    return done.get();
  }

  kernel::HostStarter starter();

  // All of these in the stepping thread.
  // What the first environment runs, or one after a reset.
  struct Beginning {
    scene::v1::Scene scene;
    kernel::EnvironmentDescription description, active;
    std::unique_ptr<kernel::Environment> environment;
    std::vector<kernel::SwapOrder> swaps;  // that the checkpoint knows
  };
  // With null the scene begins.
  void begin_environment(const Resumption* from);
  Beginning restored(const Resumption& from);
  // What was ordered for steps that are still to come.
  void order_again(const Resumption& from);
  static Resumption last_known(const RunOptions& options, const kernel::EnvironmentDescription& description,
                               std::vector<std::string>* warnings);
  static kernel::EnvironmentDescription slots_of(const kernel::EnvironmentDescription& whole);
  void go();
  void stand(State state);
  void schedule();
  void on_turn();
  // It begins, or has ended.
  void note_step(std::optional<Clock::time_point> begin);
  void make_step();
  void keep_checkpoint(JournalReading known);
  void keep_faulted_state();
  void close_capture();
  Clock::time_point due() const;
  void require_steps_left(const std::string& what) const;
  std::uint32_t next_step(const std::string& what, std::uint32_t wanted) const;
  api::SwapOrdered order(kernel::SwapOrder order, OrderKind kind);
  // As a journal has it, but for comparisons.
  static recorder::v1::Decision order_message(const Order& order);
  // In the journal, but for comparisons: ordered, or called off.
  void note(const Order& order, bool is_called_off);
  const kernel::PluginChoice& choice_with(const std::string& what, Slot slot, const std::string& property,
                                          const std::vector<kernel::SwapRecord>& records) const;
  // Precondition: of this order, among records of all swaps.
  static const kernel::SwapRecord& record_of(const Order& order, const std::vector<kernel::SwapRecord>& records);
  void collect_warnings();
  void add_warning(const std::string& line);
  void attend_listener();
  void leave_aside(const std::string& why);
  // action(subscription) for those that somebody holds.
  template <typename Action>
  void with_subscriptions(Action&& action) {
    std::erase_if(subscriptions_, [](const auto& one) { return one.expired(); });
    for (const auto& one : subscriptions_)
      if (const std::shared_ptr<Subscription> held = one.lock()) action(held.get());
  }
  api::Status status_now();
  void write_plan(api::Plan* plan) const;
  std::vector<api::ServedSwap> swap_messages() const;
  // What a checkpoint keeps of the report.
  recorder::v1::Tally tally() const { return tally_of(*environment_, {}, past_, *figures_, *events_); }
  api::ServedSwap swap_message(const Order& order, const std::vector<kernel::SwapRecord>& records) const;
  // With those of before the last edit.
  std::vector<Order> pending_orders() const;
  // Of the next that is ordered there.
  static std::uint32_t rank_of(const kernel::SwapOrder& swap, const kernel::Environment& environment);
  std::string state_name() const;

  void on_inner_step(const kernel::Environment& environment, const kernel::InnerStep& inner) override;
  void on_attempt(const kernel::StepData& data, std::uint32_t pieces) override {
    reactions_->add_attempt(data, pieces);
  }
  void on_commit(const kernel::Environment& environment) override;
  void on_decision(const kernel::Environment& environment, const kernel::Decision& decision) override;
  void on_poison(const kernel::Environment& environment, const kernel::PoisonedCall& poisoned) override;

  std::string command_to_resume();

  const RunOptions options_;
  const std::vector<std::string> hosting_words_;
  std::string scene_name_;
  double speed_;
  std::vector<std::string> scene_warnings_;
  Catalog catalog_;  // never changes, so any thread may read it
  // Of the files, and with the edits that were made since the run began.
  scene::v1::Scene first_scene_, scene_;
  const kernel::EnvironmentDescription first_description_;
  kernel::EnvironmentDescription description_;
  kernel::EnvironmentDescription active_;  // its slots alone: who answers, with which settings
  // Faults and swaps of environments before the last edit, and swaps of the checkpoint; the edits.
  report::v1::Report past_;
  std::vector<api::ServedSwap> past_swaps_;

  // What a checkpoint holds besides the state.
  std::unique_ptr<EventLog> events_;
  std::optional<EventSource> event_source_;
  std::optional<ReactionLog> reactions_;
  std::unique_ptr<Figures> figures_;
  bool is_stepping_ = false;
  std::unique_ptr<Recorder> recorder_;
  const std::shared_ptr<capsule::Tape> tape_ = std::make_shared<capsule::Tape>();
  const HandedHosts hosts_{capsule::recording(tape_)};
  std::optional<Capture> capture_;
  std::vector<std::weak_ptr<Subscription>> subscriptions_;
  std::shared_ptr<RemoteListener> listener_;
  PairDecisions pair_decisions_{[this](const std::string& why) { leave_aside(why); }};

  std::unique_ptr<kernel::Environment> environment_;
  // Made with the first question, and anew after a reset or an edit; trajectories are drawn from frame to frame.
  struct Survey {
    survey::Surveyor surveyor;
    survey::Instrumentation instrumentation{&surveyor};
  };
  survey::Surveyor& surveyor();
  std::unique_ptr<Survey> survey_;
  State state_ = State::kPaused;
  std::string fault_, checkpoint_, resume_command_;
  std::uint32_t poisoned_step_ = 0;  // the last
  std::vector<kernel::FaultInjection> injected_;
  std::vector<kernel::SwapOrder> comparisons_;  // of the command line
  std::vector<Order> orders_;
  std::uint32_t last_order_ = 0;       // its number
  std::vector<std::string> warnings_;  // different ones
  Clock::time_point next_collection_;
  std::string dear_step_;  // what the warnings say of one

  std::optional<std::uint32_t> steps_left_;  // of a step order
  std::promise<void> step_order_;
  Clock::time_point anchor_, rate_begin_;  // where pacing began, where counting did
  std::uint32_t anchor_step_ = 0, rate_step_ = 0;
  double rate_ = 0.0;  // 1/s

  // What is known of a run whose step does not end.
  std::mutex known_mutex_;
  api::Status known_;
  std::optional<Clock::time_point> step_begin_;

  std::atomic<bool> is_ending_ = false;
  boost::asio::io_context loop_;
  boost::asio::steady_timer timer_;
  bool is_scheduled_ = false;
  std::jthread thread_;
};

// A plugin's settings as a scene would write them.
std::vector<api::Setting> setting_messages(const kernel::PluginChoice& plugin);

}  // namespace gravitas::control
