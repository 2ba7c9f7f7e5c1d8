// The Sequential solver: joints and contacts by relaxation, after § 2.6.7.1 and § 2.7.6 with what
// they get wrong put right. A pure function of the request and the settings.
//
//   S_n, S*, discrepancies, contacts
//     -> pose change      delta  = M^-1 J^T mu      joint_laws.h, contact_gaps.h
//     -> closed contacts  gaps and limits that S* (+) delta leaves at zero
//     -> velocity         v_{n+1} = v* + M^-1 J^T lambda      joint_laws.h, contact_impulses.h; joints' J at S* (+) delta
//     -> pose change again, if friction or drives act on the velocity alone
//
// Notation: h time step, * what the integrator made without joints and contacts, J Jacobian rows
// with arms and world inertia at S* (velocities of joints: inertia at S* (+) delta), M masses,
// lambda impulses (N s), mu position multipliers (kg m), (+) composition of a pose with a translation and a
// rotation vector (world). delta is not h (v_{n+1} - v*): the multipliers are its own.
//
// Method (§ 2.7.6, corrected). Projected block Gauss-Seidel: joints, then contacts, each block
// solved for what is missing of it now, with accumulated multipliers that are clamped as a whole,
// until a sweep changes no row by more than 128 units of rounding of the velocities that meet (pose
// change: of the displacements, or a quarter unit of rounding of the coordinates), or `Iterations`
// sweeps are done. The seed solves 1/k of each error in each of k sweeps, which leaves e^-beta of
// it (35 % at beta = 1), finds impulses once from the velocities before, and clamps nothing. Sweeps
// start from last step's multipliers; where nothing is missing without any, the multipliers are
// zero and no sweep is done. Velocities are summed up anew from the final multipliers, so that a
// body without an impulse keeps v* and delta = 0 bit for bit.
//
// Rows on velocity alone (friction, rolling, drives): mu = theta h lambda. Scheme: pose
// change without them, closed set, velocities; then pose change again on top of theta h M^-1 J^T
// lambda. If that closes a contact or a limit more, velocities are solved for the larger set and
// the pose change once more, and the set is not looked at again. A contact that this opens stays in
// the set: it did close within the step, and let go it would be closed again without its impulse. Beside joints the pose change on
// top of theta h M^-1 J^T lambda starts from mu = theta h lambda, where that misses less than what was found without.
//
// Impacts (§ 2.6.2, corrected). Normal law and friction of a contact are solved together
// (contact_impulses.h); with (2.64) and (2.69) in turn friction breaks the normal law in every
// oblique impact. Restitution with friction in coupled impacts can create energy all the same
// (Kane's paradox). Bound: the work of a contact's impulse is lambda.(u_before + u_after)/2. These works (with those of the
// locks and limits) sum to the change of kinetic energy from what the joints alone make of v* (but for stops that bounce,
// joint_bounce.h) to v_{n+1}; where it is positive for a connected set of bodies, e s is lowered of its contacts and stops that
// arrive and whose own work is, or of all where none is, to the largest share with which the set does not gain
// (contact_law.h). With that no solution gains; sweeps that ran out can, and then all impulses of the set are scaled back
// to the largest share that does not.
// SequentialSummary counts all three. Drives and springs are left out of the sum, and a set that
// they act on is never scaled: theirs is real work. A kinematic body's work is seen from the body.
//
// What rows at S* leave of joints is of second order in the step's turn. Where that is more than a thousandth of the bodies' radius
// of gyration, steps of Newton's method follow: rows where the bodies are by then, for what is missing there, relaxed again,
// until a millionth is left or a step does not halve it. Where tension h^2 over mass and length is more than half, as of light links
// between heavy ends, rows at S* drive a swing of the links from step to step, however well they are solved: there the steps follow in
// any case, with what a turn adds to the corrections' moments (geometric stiffness; a rod's across it), which is left out again in the
// end unless sweeps ran out and it would open joints. Friction and drives may displace a light body by many times its
// size, which joints are to take back: where that leaves joints open by more than twice what they were and a hundredth (a millionth
// where sweeps ran out), the pose change is that without friction's part, or that without any. Sweeps that ran out where joints end
// wider open than S* has them: the largest share (1/2, 1/4, 1/8, none) of their correction that does not open them.
//
// Joints' velocities are made right where the pose change leaves the bodies. Made right at S*, the spin of a wheel is left
// across its hinge by what that turned, and where it turns by more than a radian in a step, this grows from step to step. Those
// of bodies that also touch each other, and of all where drives yield, are made right at S* all the same, where contacts' are.
//
// Order: S_{n+1} is of first order in h at joints and contacts (pose change and normals at S*), exact for constant
// loads on resting, sticking, rolling and bouncing bodies. Joint error after the step is of second order in
// the step's turn, up to what is closed.
//
// A stack, in which every body rests on one other and no joint acts, starts layer by layer from what nothing pushes
// (shock_propagation.h), which is its solution at any height and ratio of mass.
//
// Sweeps are accelerated (nesterov_acceleration.h): each begins where the ones before were going.
//
// Ways of relaxing, each off unless asked for: the order of a sweep's blocks (relaxation_order.h); over-relaxation, in
// which locks and contacts go `relaxation_factor` times the way to where they are right and are projected (without
// acceleration it takes rows of bodies from n^2 sweeps to some n; sliding contacts may not converge with it); and a start by
// layers of all that rests, used where it leaves smaller errors than last step's multipliers (pyramids and heaps may do
// better without). They change the way, not what is asked for: what converges obeys the same laws.
//
// Joints that contradict each other: where sweeps ran out, rows that hold always are asked whether they depend on each
// other (cone_problem.h); those that no motion can meet together get the nearest targets that it can (least squares), and
// the sweeps begin anew. `stop_reason` says so.
//
// Drives without a bound whose velocity is missed by a tenth, or what is in their way, ask for what joints, limits and contacts let
// them reach (end_of_step.h, found by cone_problem.h), and velocities are solved anew.
//
// Joints that hold the same freedoms share their load as equal springs would (equal_springs.h): where bodies are held in loops or
// by several joints, and by more rows than they have freedoms.
//
// Islands are solved each by itself (sequential_islands.h).
//
// One joint, one contact, or one patch of contacts that rests or sticks is exact in one sweep; n bodies in a row take of
// the order of n sweeps, times the root of the mass ratio where the heavy end hangs or lies on the light one; a box that
// slides or tips takes some tens. Without acceleration it is n^2, and the ratio itself.
// Known failures: a chain of 20 links under 1000 times its mass takes thousands of sweeps. Much friction at long arms
// (Painlevé; mu > 4/3 at a slender rod, less where several contacts drive each other) may have no solution or several, and
// then the sweeps run round in circles. `stop_reason` and `residual` say so; a small residual in a slow case is a small
// change, not a small error. Newton and Direct exist for these scenes.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "plugin_sdk/solver/elimination_order.h"
#include "plugin_sdk/solver/end_of_step_rows.h"
#include "plugin_sdk/solver/equal_springs.h"
#include "plugin_sdk/solver/reply.h"
#include "plugin_sdk/solver/stalled_drives.h"
#include "workers/solver/sequential/contact_gaps.h"
#include "workers/solver/sequential/contact_impulses.h"
#include "workers/solver/sequential/relaxation_joints.h"
#include "workers/solver/sequential/relaxation_order.h"
#include "workers/solver/sequential/rows_in_loops.h"

namespace gravitas {

// Whether contacts start layer by layer: of stacks, layers are the solution (is_stack()); of others they are a start, which
// a heap pays for and may be worse for than for its last step's multipliers.
enum class ShockPropagation : std::uint8_t { kNever, kStacks, kAlways };

struct SequentialSettings {
  std::uint32_t iterations = 200;  // most sweeps of one relaxation, 1 ... 100000; of joints alone ten times as many
  double correction_factor = 1.0;  // share of an old error that a step removes, 0 ... 1
  RelaxationOrder order = RelaxationOrder::kGiven;
  double relaxation_factor = 1.0;  // of the way of locks and contacts, 0 ... 2
  ShockPropagation shock_propagation = ShockPropagation::kStacks;
  bool nesterov_acceleration = true;  // of the sweeps, where relaxation_factor is 1
};

// What a solution took. The reply carries the first three.
struct SequentialSummary {
  std::uint32_t sweeps = 0;  // of all relaxations
  double residual = 0.0;     // largest change of a velocity in the last one's last sweep, m/s
  StopReason stop_reason = StopReason::kNothingToDo;
  std::uint32_t velocity_solutions = 0;    // relaxations of the velocities
  std::uint32_t restitutions_lowered = 0;  // times an e s was lowered to the speed of arrival
  std::uint32_t restitutions_shared = 0;   // times an e s was lowered for the energy of connected bodies
  std::uint32_t groups_scaled_back = 0;    // sets of bodies whose unfinished solution gained energy

  SolverOutcome outcome() const { return {sweeps, residual, stop_reason}; }
};

class SequentialSolver {
 public:
  explicit SequentialSolver(const SequentialSettings& settings)
      : settings_(settings), sweep_(settings.order, settings.relaxation_factor) {
    sweep_.set_accelerated(settings.nesterov_acceleration);
  }

  void set(const SequentialSettings& settings) {
    settings_ = settings;
    sweep_.set(settings.order, settings.relaxation_factor);
    sweep_.set_accelerated(settings.nesterov_acceleration);
  }

  // Who is told of progress in long work; nobody at first. It outlives the solutions.
  void report_to(const Host* host) { host_ = host; }

  // Answers the request. Throws Refusal for an impossible one (request_check.h), and where
  // the answer is not finite because the numbers overflow. What is kept between calls is room for
  // rows, nothing else.
  SequentialSummary solve(const stage::SolverSolveRequest& request, const stage::SolverSolveReply& reply);

  // The same for a request that has been checked, with the answer in solution().
  SequentialSummary solve(const stage::SolverSolveRequest& request);
  const SolverSolution& solution() const { return solution_; }

 private:
  // Joints that are open by a larger share of what their bodies measure are closed further; steps of that; rounding of many.
  static constexpr double kOpen = 1e-3, kClosed = 1e-6, kFarOpen = 1e-2, kRounded = 1e-12;
  static constexpr int kPoseSteps = 6, kStiffSteps = 12;
  // Corrections that stiffen a body by a larger share of its inertia send steps without that away from where rows hold.
  static constexpr double kStiff = 0.5;
  // What springs miss counts a thousandfold: energy goes by it.
  static constexpr double kOfSprings = 1e3;

  struct PoseChange {
    BodyMotion displacement;
    RelaxationJoints joints;
    ContactGaps gaps;
    std::vector<JointEnd> ends;
    double open = 0.0, unsprung = 0.0;
    bool is_at_end = false, has_stiff_gaps = false, has_converged = true;
  };

  void load(const stage::SolverSolveRequest& request);
  JointLaw pose_law_of(const RelaxationDiscrepancy& d, std::size_t axis, double theta) const;
  template <class Use>
  void for_springs(Use&& use) const;
  void begin(const stage::SolverSolveRequest& request);
  void solve_rows(const stage::SolverSolveRequest& request);
  bool reconcile();
  double reconcile(const std::vector<RelaxationDiscrepancy>& discrepancies, const RelaxationJoints::Laws& laws,
                   const BodyMotion& start, double smallest, std::vector<double>* shift) const;
  static ConeRow row_of(const RelaxationDiscrepancy& d, std::size_t axis, const JointLaw& law);
  void solve_pose(const stage::SolverSolveRequest& request);
  bool relax_pose();
  void close_at_end(const stage::SolverSolveRequest& request);
  void find_ends(const stage::SolverSolveRequest& request);
  double measure_stiffness();
  void stiffen(const stage::SolverSolveRequest& request);
  double largest_change(const BodyMotion& from) const;
  void build_at_end(const stage::SolverSolveRequest& request, bool is_stiff);
  void add_turns_of_rod(std::size_t row);
  void add_turn_of_swing(std::size_t row);
  void add_turn(std::size_t row, std::size_t axis, const ConstraintDirection& direction, double compliance);
  TurnOfSwing turn_of_swing(std::size_t row) const;
  double pull_of_rod(std::size_t row) const;
  void end_unstiffened(const stage::SolverSolveRequest& request);
  void shorten_pose(const stage::SolverSolveRequest& request);
  double open_at_trial() const;
  double share_of_miss(const RelaxationDiscrepancy& d, std::size_t axis, const JointLaw& law, double missed) const;
  double size_of(const RelaxationDiscrepancy& d) const;
  void keep_pose(PoseChange* kept) const;
  void take_pose(const PoseChange& kept);
  void solve_pose_with_offset(const stage::SolverSolveRequest& request, double factor);
  void guess_pose(const stage::SolverSolveRequest& request, double factor);
  double error_of_pose();
  void pose_at_trial(const stage::SolverSolveRequest& request);
  void build_gaps(const SolverBodies& bodies, const stage::SolverSolveRequest& request);
  static std::pair<std::uint32_t, std::uint32_t> pair_of(std::uint32_t body1, std::uint32_t body2) {
    return std::minmax(body1, body2);
  }
  bool touches(const RelaxationDiscrepancy& joint) const;
  bool stands(const RelaxationDiscrepancy& joint) const;
  double error_at_end(std::size_t row, std::size_t axis) const;
  bool find_closed();
  void turn_trial_velocity();
  void build_velocity(const stage::SolverSolveRequest& request);
  void take_directions(bool drives_yield);
  void solve_velocity();
  void share_out();
  void relax_velocity();
  bool let_drives_yield(const stage::SolverSolveRequest& request);
  bool find_reach();
  template <typename Contacts>
  bool begins_by_layers(const RelaxationJoints& joints, const Contacts& contacts) const;
  template <typename Contacts>
  double choose_start(const BodyMotion& base, double tolerance, Contacts* contacts, BodyMotion* x);
  bool sweep_velocity(double tolerance);
  void count_sweep();
  // Frames and mechanisms need more sweeps than what lies on each other, which is given up before.
  std::uint32_t most_sweeps(bool has_joints_alone) const { return (has_joints_alone ? 10 : 1) * settings_.iterations; }
  void bound_energy();
  void share_restitution(const BodyMotion& before);
  void group_bodies();
  BodyMotion velocity_of_joints();
  void add_up_gains(const BodyMotion& before, const BodyMotion& after);
  void scale_back();
  void sum_velocity();
  bool acts_on_velocity_alone() const;
  void set_offset(const stage::SolverSolveRequest& request, double factor, bool with_friction);
  void turn_offset(const SolverBodies& bodies);

  SequentialSettings settings_;
  const Host* host_ = nullptr;
  RelaxationSweep sweep_;
  SequentialSummary summary_;
  bool velocity_converged_ = true;
  bool used_up_ = false;  // some relaxation ran out of sweeps
  bool used_up_before_velocity_ = false;
  bool drives_yield_ = false;       // something is in the way of drives without bound
  bool drives_contradict_ = false;  // joints, or each other
  double time_step_ = 0.0;
  double coordinates_ = 0.0;

  SolverBodies bodies_, turned_;                      // the latter with the inertia of the velocities' rows
  std::vector<RelaxationDiscrepancy> discrepancies_;  // at S*
  std::vector<RelaxationDiscrepancy> directed_;       // with the directions of the velocities' rows
  // Rows that hold always, and their bodies.
  std::vector<std::uint32_t> held_rows_;
  std::vector<RowEnds> held_ends_;
  RowsInLoops rows_in_loops_;
  EliminationOrder sharing_order_;
  EqualSprings equal_springs_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> touching_;  // bodies, where there are joints; rising
  std::vector<RelaxationDiscrepancy> posed_;                       // with those of the pose change's
  std::vector<JointEnd> ends_;                                     // where solution_.displacement ends
  RelaxationJoints::Laws pose_laws_, posed_laws_, velocity_laws_;
  StalledDrives stalled_;
  // of rows that contradict each other and of drives that yield: by how much their targets are moved; and the most of
  // the former, m and m/s
  std::vector<double> velocity_shift_;
  double shifted_pose_ = 0.0, shifted_velocity_ = 0.0;
  RelaxationJoints::Multipliers moved_;  // by what drives moved the pose before they yielded; empty: none has
  RelaxationJoints pose_joints_, velocity_joints_;
  // by the pose change: by joints, and at contacts
  RelaxationJoints::Multipliers pushed_;
  std::vector<double> pressed_;
  std::vector<double> displacing_friction_;  // by contact
  ContactGaps gaps_;
  ContactImpulses impulses_;
  bool pose_converged_ = true;
  bool gaps_are_stiff_ = false;  // gaps_ has rows of stiffened_
  bool posed_at_end_ = false;    // pose_joints_ has rows where the pose change ended, not at S*
  double unsprung_ = 0.0;        // the most that springs miss their laws by there, of what moves the bodies
  double open_ = 0.0;  // the most that pose laws are missed by where it ends, as a share of what the bodies measure
  PoseChange before_step_, before_offset_;  // gone back to where what followed leaves more open

  SolverSolution solution_;
  BodyMotion trial_velocity_;           // v*, as joints turn it
  BodyMotion turn_;                     // by joints
  BodyMotion base_;                     // of the pose change: offset_, or where a stiffened step begins
  std::vector<Matrix3> stiffness_;      // by which corrections hold turns, N m h^2
  SolverBodies stiffened_;              // turned_ with that
  BodyMotion offset_;                   // theta h M^-1 J^T lambda of rows on velocity alone
  std::vector<Vector3> offset_moment_;  // that turns by it, kg m^2
  std::vector<std::uint8_t> closed_, closed_now_;

  std::vector<std::uint32_t> group_;
  std::vector<Gain> gains_;
  std::vector<std::optional<SharedRestitution>> shared_;  // by group
  std::vector<double> shares_;
  std::vector<double> factor_;
};

}  // namespace gravitas
