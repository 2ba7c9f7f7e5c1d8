// An environment: bodies, the plugins that move them, and the truth about their state. Several can live in one
// process; they share nothing.
//
//   Environment world(description);         // starts what the plan needs; throws StageFault, std::invalid_argument
//   while (world.step() == StepOutcome::kCommitted && world.step_count() < world.total_steps()) …
//
// step() is a transaction: it works on scratch columns and the second of two states, and swaps the states at the end. A
// stage that fails is asked again elsewhere (slot_host.h); where that ends, nothing has happened: the outcome is
// kPaused, fault() says why, and the state is that of the last commit. An environment is used by one thread at a time.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "kernel/arena.h"
#include "kernel/description.h"
#include "kernel/fault.h"
#include "kernel/model.h"
#include "kernel/pair_arbiter.h"
#include "kernel/plan.h"
#include "kernel/saved_state.h"
#include "kernel/slot.h"
#include "kernel/stage.h"
#include "kernel/state.h"
#include "kernel/step_data.h"
#include "kernel/swap.h"
#include "kernel/validate.h"
#include "plugin_sdk/derivative_question.h"
#include "plugin_sdk/duration_histogram.h"
#include "plugin_sdk/event_location.h"
#include "plugin_sdk/extrapolation.h"
#include "plugin_sdk/lap_clock.h"
#include "plugin_sdk/merged_rows.h"
#include "plugin_sdk/stop_location.h"
#include "plugin_sdk/trajectory_hash.h"

namespace gravitas::kernel {

enum class StepOutcome { kCommitted, kPaused };

// The committed state, body by body. Spans are valid until the next step.
struct StateView {
  std::span<const double> position, orientation, linear_velocity, angular_velocity;
};

class Environment;

// A request that nobody may be asked again, as it was made.
struct PoisonedCall {
  const StageCall& call;
  const Arena& arena;  // with the columns of the call
  const PluginChoice& plugin;
  const StageFault& fault;
};

// A part of a step, whose end has become a state.
struct InnerStep {
  std::uint32_t number;             // in its step
  const StepData& data;             // what was worked out for it
  const State& before;              // where it began
  const State& after;               // where it ended
  double end;                       // s
  std::span<const double> weights;  // of the attempts at an extrapolated part that it ends: Extrapolation::weights()
  // How deep a contact's bodies overlapped in `before`, m; 0 where they did not or, `surely`, may not have.
  double start_overlap(std::size_t contact, const LocalBound& one, const LocalBound& two, bool surely) const;
};

// Hears of what a recorder keeps, and of what happens.
class CommitListener {
 public:
  virtual ~CommitListener() = default;
  // Others answer from now on; told before the commit that uses them.
  virtual void on_decision(const Environment&, const Decision&) {}
  virtual void on_poison(const Environment&, const PoisonedCall&) {}
  // An inner step ends. With number 0 those before count no longer: the step has been begun again.
  virtual void on_inner_step(const Environment&, const InnerStep&) {}
  // Before the inner steps of such a part: one of an attempt in so many, which come in order. One in 1 is of another part.
  virtual void on_attempt(const StepData&, std::uint32_t) {}
  // At the end of a step, when S_{n+1} is committed. What it throws comes out of step(); the commit stands.
  virtual void on_commit(const Environment& environment) = 0;
};

// A plugin lacks what the simulator needs of its slot.
struct UnfitPlugin : std::invalid_argument {
  UnfitPlugin(const std::string& why, std::string needed) : invalid_argument(why), capability(std::move(needed)) {}
  std::string capability;
};

class Environment : private DerivativeSource, private SlotObserver {
 public:
  // `starter` makes the hosts; tests and simulated campaigns bring their own.
  explicit Environment(EnvironmentDescription description, const HostStarter& starter = start_host);
  ~Environment() override;
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

  // One step of time, or the reason why not.
  StepOutcome step();

  const std::string& id() const { return description_.id; }
  std::uint32_t step_count() const { return step_count_; }
  std::uint32_t total_steps() const { return description_.steps; }
  double time_step() const { return description_.time_step; }
  // s, of the last inner step that was made; 0 before the first, also after a restore.
  double inner_step_length() const { return data_.time_step[0]; }
  // Time of the committed state, s: n * time step as a product.
  double time() const { return time_of(step_count_); }

  StateView state() const;
  const Model& model() const { return model_; }
  const CommitFigures& figures() const { return figures_; }
  // True while the joint holds.
  bool is_intact(std::uint32_t constraint) const { return front().intact[constraint] != 0; }

  // False where all said at the start that they are constant.
  bool asks_forces() const { return !wrench_is_constant_; }
  // What the forces report as potential energy in the committed state, J.
  double potential_energy();

  Hash state_hash() const { return state_hash_; }
  Hash chain_hash() const { return chain_hash_; }

  // With the processes of now.
  Plan plan() const;
  // The failed call that paused this environment.
  const std::optional<FaultRecord>& fault() const { return fault_; }
  // All failed calls, survived or not, in the order in which they were noticed.
  const std::vector<FaultRecord>& faults() const { return faults_; }

  // Exchanges a plugin, its settings or its hosting; see swap.h. Throws std::invalid_argument with the reason where that
  // is impossible: the plan leaves the slot out, or the plugin does not serve what the scene needs of it.
  // To compare is to ask both for the rest of the run; swap records show how the answers differ.
  void order_swap(const SwapOrder& order, bool compares = false);
  // See StageSlot::call_off_swap().
  bool call_off_swap(Slot slot, std::uint32_t step, std::uint32_t rank) {
    return slot_of(slot).call_off_swap(step, rank);
  }
  std::vector<SwapRecord> swaps() const;
  // Throws std::invalid_argument if the slot is left out or hosted in this process.
  void inject(FaultInjection fault);
  // See StageSlot::set_rerun_every().
  void set_rerun_every(Slot slot, std::uint32_t steps) { slot_of(slot).set_rerun_every(steps); }
  std::string why_left_out(Slot slot) const;  // by the plan
  // What is worth a line in the report and no fault: complaints of workers, direct calls beyond their deadline.
  std::vector<std::string> warnings();
  const DurationHistogram& stage_time(Stage stage) const { return profile_[static_cast<std::size_t>(stage)]; }
  // Time of the stage that was not spent in the plugin.
  const DurationHistogram& transport_time(Stage stage) const { return transport_[static_cast<std::size_t>(stage)]; }
  // Time in which the answers of the stage were checked: wire, structure, numbers.
  const DurationHistogram& validation_time(Stage stage) const { return validation_[static_cast<std::size_t>(stage)]; }
  const DurationHistogram& step_time() const { return step_profile_; }

  // With the next step the island of a body is awake, if it sleeps.
  void wake(std::uint32_t body) { wake_orders_.push_back(body); }
  std::span<const std::uint32_t> wake_orders() const { return wake_orders_; }
  bool is_asleep(std::uint32_t body) const { return can_sleep() && front().rested[body] == kAsleep; }

  // At most one; null: nobody. It is told at once of decisions that were made when there was none, but for swaps.
  void set_commit_listener(CommitListener* listener);
  // At most one; null: the scene's own rules hold. What it decides is part of what determines the trajectory.
  void set_pair_arbiter(PairArbiter* arbiter) { arbiter_ = arbiter; }
  const PairArbiter* pair_arbiter() const { return arbiter_; }

  // The committed state with everything that the next steps depend on; its columns are valid until the next step.
  SavedState saved_state() const;

  // Goes on from a saved state of the same description: the steps that follow are those that followed it, bit for bit.
  // Joints stay bound, and potentials measured, from the initial state. Possible before the first step alone. Takes
  // any bytes: returns the first thing that cannot be (empty if restored), and then no state has changed. Swaps that
  // are ordered for steps up to the state's have been made then, and may have been refused.
  std::string restore(const SavedState& saved);

 private:
  // simulators/: what a step is made of, and the order of the stages.
  void make_inner_steps();
  void make_part(double begin, double length);
  // What is left of a length until a force jumps; sets the times between which forces are asked there.
  double length_to_switch(double begin, double length);
  // Inner steps begin some time after S_n, in front() what the one before has made of it.
  void begin_inner_step(double begin, double length);
  // Basic's, in back(); false, and nothing, where somebody asleep is woken or loads turn far: the step starts again.
  bool make_next_state();
  std::optional<Trusted<Solution>> react(const Trusted<TrialState>& trial, bool has_found_contacts = false);
  Trusted<Pairs> bound_and_pair(const Trusted<TrialState>& trial);
  bool locates_events() const { return has_contacts() && description_.simulator >= Simulator::kBisection; }
  void locate_events(double begin, double length);
  // extrapolated.cc, jumps.cc, breakaways.cc
  void extrapolate_parts(double begin, double length);
  std::uint32_t pieces_to_accuracy(double begin, double length, bool is_before_impact, bool ends_with_impact);
  bool make_piece(double begin, double length, std::uint32_t i, std::uint32_t pieces);
  std::span<const double> take_extrapolated();
  void find_changes(std::vector<double>* changes);
  bool lets_go() const;
  bool breaks_away(double end, double length, std::uint32_t pieces);
  bool hides_jump(double begin, double length, std::uint32_t first, std::uint32_t pieces, double error);
  // The inner step that ends at the next event, of at most `length`, for which S* is in place.
  NextStop first_impact(const Trusted<TrialState>& trial, double begin, double length);
  double bisect(const Trusted<TrialState>& trial, double begin, double length, bool* is_near);
  double shorten_turns(Trusted<TrialState>* trial, double begin, double length, bool* has_found_contacts);  // turns.cc
  double first_limit(double begin, double length, bool* passes);                                            // limits.cc
  void prepare_contacts();                                                                                  // limits.cc
  // loads.cc: by what loads turn a jointed body in the inner step, rad, and which; true where the step starts again, finer.
  std::pair<double, std::uint32_t> largest_turn_by_loads() const;
  bool makes_step_finer();
  std::string why_turned_far(double turn, std::uint32_t body) const;
  // sleep.cc, wake.cc: who is left out of a step, who is woken, and who falls asleep with it.
  bool can_sleep() const { return description_.sleep.energy > 0.0; }
  void remember_wrenches();
  void find_sleepers();
  void let_sleep(std::uint32_t body, bool sleeps);
  bool does_anything_move() const;
  bool is_awake(std::uint32_t body) const { return body != kNone && (data_.flags[body] & kMovable) != 0; }
  bool sleeps(std::uint32_t joint) const;
  bool is_carrying(std::uint32_t body) const;
  void leave_out_sleepers();
  void look_for_pushes();
  bool wakes_sleepers();
  void wake_island(std::uint32_t body);
  Connections connections();
  void settle();
  std::optional<Trusted<Solution>> react_until_a_slide_ends(Trusted<TrialState> trial, double begin, double* length,
                                                            bool has_found_contacts);
  // smooth.cc: derivatives that agree with the joints.
  bool knows_reactions() const { return description_.simulator == Simulator::kSmooth && model_.constraint_count > 0; }
  void ask_reactions();
  bool ask_start_joints();
  void find_joint_impulses();
  bool find_wanted_moves(const DiscrepancyAnswer& joints);
  void find_start_velocities();
  void join_start_velocities();
  void add_start_impulses();
  bool lets_go_of_limits();
  void note_what_joints_take();
  static std::string why_joints_took(double share, std::uint32_t step);
  static std::string why_shortened(std::uint32_t times, std::uint32_t step);  // flights.cc
  void meet_stops(double begin, double length);  // stops.cc: inner steps that end where stops are met
  double next_stop(const Trusted<TrialState>& trial, double begin, double length, double* crossing);
  void find_stops(bool of_trial, std::vector<StopGap>* stops) const;
  void note_what_joints_bear();                                         // openings.cc
  Trusted<TrialState> integrate_shorter(double begin, double* length);  // flights.cc
  bool end_where_joints_let_go(double begin, double* length, Trusted<TrialState>* trial);
  std::optional<Trusted<Solution>> react_holding_limits(const Trusted<TrialState>& trial);
  double length_of_flight(double begin, double length);  // of a stop that opens and is pressed again
  // Joints connect all movable bodies, at most. 0: the solver cannot say how reactions change.
  std::uint64_t most_reaction_blocks() const;

  // stages.cc: a stage each.
  Trusted<TrialState> integrate(bool may_be_refused = false);
  Bounds trial_bounds(std::uint32_t body) const;
  // Kinematic bodies with a motion are where it says, whatever an integrator makes of them.
  void follow_motion(double time, const Column<double>& position, const Column<double>& orientation,
                     const Column<double>& linear_velocity, const Column<double>& angular_velocity) const;
  void bound_bodies(const Trusted<TrialState>& trial);
  void bound_motions(const Trusted<TrialState>& trial, double length);
  Trusted<Pairs> find_pairs();
  // The answer to a question about nothing.
  void leave_empty(std::span<const ColumnId> reply);
  void find_impacts(const Trusted<Pairs>& pairs);
  Encounter encounter(std::size_t impact) const;
  // At which a pair parts that a contact has pushed in the inner step before, m/s; at which its spins move its parts.
  double bounce_speed(std::span<const std::uint32_t> pair) const;
  double turning_speed(std::span<const std::uint32_t> pair) const;
  Trusted<Contacts> find_contacts(const Trusted<Pairs>& pairs);
  void look_up_contacts(const Trusted<Contacts>& contacts);
  void constrain(const Trusted<TrialState>& trial);
  void ask_discrepancies(const Column<double>& time, const Column<double>& position, const Column<double>& orientation,
                         const Column<double>& linear_velocity, const Column<double>& angular_velocity);
  void merge_discrepancies();
  Trusted<Solution> solve();

  // commit.cc
  void write_trial(const Trusted<TrialState>& trial);
  void write_solution(const Trusted<Solution>& solution);
  void complete_state();
  void remember_contacts();
  void remember_joints();
  // breaking.cc: S_{n+1}; false: the inner step is to be begun again.
  bool write_what_joints_bear(const Trusted<TrialState>& trial, std::optional<Trusted<Solution>> solution);
  void update_joints();
  bool has_broken(std::uint32_t joint) const { return std::ranges::find(broken_, joint) != broken_.end(); }
  // Gap of a contact whose two surface points move with their bodies from S* to a state.
  double gap_at(std::size_t contact, const State& state) const;
  void find_touching();
  double inner_end_time() const;
  void end_inner_step(std::span<const double> weights = {});
  void finish_step();

  // prepare.cc: what is asked once.
  void start_slots(const HostStarter& starter);
  void bind(const ConstraintGroup& group);
  void ask_constant_forces();

  // restore.cc
  double length_of_step(std::uint32_t step) const;
  std::string find_misfit(const SavedState& saved) const;

  // forces.cc
  std::span<const ColumnId> trial_columns() const override { return trial_columns_; }
  std::span<const ColumnId> answer_columns() const override { return answer_columns_; }
  const Column<double>& told_wrench() const { return knows_reactions() ? data_.wrench_with_reactions : data_.wrench; }
  void begin_attempt(bool counts) override;
  void evaluate() override;
  void find_wrenches();
  // Of S_n, until all are answered by the same plugins.
  void ask_forces();
  // At the time in data_.derivative_time.
  void ask_forces(const Column<double>& position, const Column<double>& orientation,
                  const Column<double>& linear_velocity, const Column<double>& angular_velocity);
  template <typename... State>
  auto force_request(const ForceGroup& group, const State&... state) const {
    return ids(data_.derivative_time, group.type, group.parameter_begin, group.parameter, group.application,
               model_.mass, model_.geometry_position, model_.geometry_orientation, state..., model_.body_shape,
               model_.shape_type, model_.shape_parameter_begin, model_.shape_parameter);
  }
  void sum_wrenches();
  // True for a group of forces whose wrenches never change.
  bool is_constant(std::size_t group) const;
  void count_jacobian_blocks();
  bool is_asked(DerivativeQuestion q) const { return data_.derivative_question[0] == static_cast<std::uint32_t>(q); }
  bool wants_jacobian() const { return is_asked(DerivativeQuestion::kWithJacobian) && data_.jacobian_blocks[0] != 0; }
  void ask_jacobians();
  void ask_jacobians(Stage stage, StageSlot* slot, StageCall call, std::uint64_t most);

  // exchange.cc: others in a slot.
  StageSlot& slot_of(Slot slot);
  std::uint32_t place_of(const SwapOrder& order, bool compares);
  void check_fallbacks() const;
  const char* needed_capability(Slot slot) const;
  std::string why_unfit(const PluginDeclaration& plugin) const;
  void on_plugin_change(const StageSlot& slot, std::uint32_t target, const PluginChoice& before) override;
  void on_decision(const Decision& decision) override;
  void on_poison(const StageCall& call, const PluginChoice& plugin, const StageFault& fault) override;

  // Books the time of a call, and of the check of its answer, which begins with that of its frame.
  void book_call(Stage stage, StageSlot* slot, std::uint64_t start, const CallTimes& times);
  void book_check(Stage stage);

  // Asks a slot and checks the answer; what the check finds is the fault of the plugin that was asked.
  template <typename Check>
  auto ask(Stage stage, StageSlot* slot, const StageCall& call, DerivativeSource* derivatives, Check&& check) {
    // the first stage begins with the step
    const std::uint64_t start = stage == Stage::kIntegrate ? lap_ns_ : lap_ns();
    return slot->ask(call, &arena_, derivatives, [&](const Untrusted<StageCall>& answer, const CallTimes* times) {
      if (times != nullptr) book_call(stage, slot, start, *times);
      auto checked =
          check_unless_off<decltype(check(answer))>(slot->description().defences, [&] { return check(answer); });
      if (times != nullptr) book_check(stage);
      return checked;
    });
  }

  template <typename Checked, typename Check>
  static Checked check_unless_off(const Defences& defences, Check&& check) {
    try {
      return check();
    } catch (const StageFault& fault) {
      const bool is_off = (fault.kind == FaultKind::kBadStructure && !defences.structure) ||
                          (fault.kind == FaultKind::kBadNumbers && !defences.numbers) ||
                          (fault.kind == FaultKind::kBadPhysics && !defences.physics);
      if (!is_off) throw;
    }
    return Validator::unchecked<Checked>();
  }

  static constexpr std::size_t kSpareState = 3;
  const State& front() const { return states_[front_]; }
  State& back() { return states_[back_]; }
  // To S_n from what inner steps have made of it.
  void return_to_start();
  double time_of(std::uint32_t step) const;
  Pose pose_of(const Column<double>& position, const Column<double>& orientation, std::uint32_t body) const;
  bool has_contacts() const { return collision_.is_running(); }
  bool has_reactions() const { return solver_.is_running(); }
  bool is_struck() const;  // by instantaneous impulses, which act at t = 0 alone
  // By those, or where joints do not allow what the scene or an edit gave bodies.
  bool may_jump_at_start() const;
  // Velocities at the start of the step, after that.
  const Column<double>& start_linear_velocity() const;
  const Column<double>& start_angular_velocity() const;

  EnvironmentDescription description_;
  Plan plan_;
  Arena arena_;
  Model model_;
  std::vector<State> states_;  // a third one, S_n, where there are inner steps; kSpareState for attempts at them
  StepData data_;
  Validator validator_;
  std::size_t front_ = 0, back_ = 1, start_ = 2;      // start_: S_n, from the second inner step on
  std::uint32_t step_count_ = 0, inner_ = 0;          // inner steps of this step so far
  double inner_end_ = 0.0;                            // of the inner step that is being made, s after S_n
  double asked_from_ = 0.0, asked_until_ = 0.0;       // times at which forces may be asked, between two jumps
  bool must_restart_ = false;                         // another plugin came in, and it makes the whole step
  bool has_newcomer_ = false;                         // then nothing of the attempt before stays
  bool has_new_forces_ = false;                       // one for forces, and not all are answered by it
  std::uint32_t times_finer_ = 1;                     // are the inner steps of this step
  std::pair<double, std::uint32_t> turned_far_;       // in the finest ones, since warnings() told of it
  std::pair<double, std::uint32_t> taken_by_joints_;  // share of velocities, and the step, since warnings() (Smooth)
  std::pair<std::uint32_t, std::uint32_t> refused_trials_;  // how many, and the first one's step, likewise
  bool ends_at_switch_ = false;                             // a force jumps at the end of what is being made
  std::vector<std::uint32_t> broken_;    // joints, under their load in the inner step that is being made
  std::optional<Trusted<Pairs>> pairs_;  // the last
  Extrapolation extrapolation_, jumps_;
  static constexpr std::uint32_t kMostPieces = 8;                                     // of a part that is extrapolated
  std::vector<double> first_changes_[kMostPieces], trial_changes_, scales_, missed_;  // of velocities
  std::pair<std::vector<std::uint64_t>, std::vector<double>> first_impulses_, found_, guess_;  // of contacts
  std::vector<double> start_gaps_, trial_gaps_;                                                // of limits
  std::vector<StopGap> first_stops_, start_stops_, end_stops_, trial_stops_;
  std::vector<double> borne_, told_borne_, first_borne_, least_borne_, most_borne_;  // N, by joints in derivatives
  std::vector<double> start_impulse_;  // N s, of joints, where the step begins (Smooth)
  std::vector<std::array<std::uint32_t, 2>> pressed_, pressed_by_attempts_;  // pairs
  double margin_ = 0.0;

  Activity activity_;
  std::uint32_t sleepers_ = 0;                       // in this step
  bool is_idle_ = false;                             // nothing moved in the last step, and nothing has come up since
  std::vector<std::uint32_t> wake_orders_, pushed_;  // with the next step; asleep, under another force than before
  std::vector<std::uint32_t> joint_bodies_;          // scratch of connections()
  std::vector<MergedRow> merged_;                    // scratch

  StageSlot space_, collision_, constraint_, force_, solver_, integrator_;
  const std::array<StageSlot*, 6> slots_ = {&integrator_, &force_, &space_, &collision_, &constraint_, &solver_};

  const std::array<ColumnId, 6> trial_columns_;
  const std::array<ColumnId, 3> answer_columns_;
  std::vector<std::vector<ColumnId>> discrepancy_reply_;  // per constraint group

  // Known once the forces have been asked at the start.
  bool wrench_is_constant_ = true, has_impulses_ = false;
  bool is_anew_ = true;         // no step yet, or none since an edit
  double start_overlap_ = 0.0;  // m, where such a step begins
  bool start_wrench_known_ = false, attempt_counts_ = true;
  enum class LastJoints { kNone, kFresh, kHeld } last_joints_ = LastJoints::kNone;  // in discrepancies, held_joints
  std::vector<std::size_t> next_in_group_;                                          // scratch of merge_discrepancies()

  CommitFigures figures_;
  std::vector<SavedBudget> budgets_;
  Hash state_hash_, chain_hash_;
  std::optional<FaultRecord> fault_;
  std::vector<FaultRecord> faults_;
  CommitListener* commit_listener_ = nullptr;
  std::vector<std::pair<Decision, SlotDescription>> untold_;  // decisions, with the host, which may be let go
  PairArbiter* arbiter_ = nullptr;
  // Longest direct call beyond the slot's deadline, per stage: nothing can interrupt it, so it is reported.
  std::array<std::uint64_t, static_cast<std::size_t>(Stage::kCount)> overrun_ns_{};
  std::array<DurationHistogram, static_cast<std::size_t>(Stage::kCount)> profile_, transport_, validation_;
  std::uint64_t check_begin_ns_ = 0;  // of the last answer
  std::uint64_t lap_ns_ = 0;          // the last look at the clock that ended something
  std::uint64_t nested_ns_ = 0;       // of an integration so far: others answered
  DurationHistogram step_profile_;
};

}  // namespace gravitas::kernel
