// An island's rows at the end of the step, and the loop that finds where that is (end_of_step.h).
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "plugin_sdk/plugin.h"
#include "plugin_sdk/solver/anderson_acceleration.h"
#include "plugin_sdk/solver/end_of_step_rows.h"
#include "plugin_sdk/solver/islands.h"
#include "plugin_sdk/solver/reply.h"
#include "plugin_sdk/solver/stalled_drives.h"

namespace gravitas {

class IslandSolver {
 public:
  IslandSolver(const stage::SolverSolveRequest& request, const SolverBodies& all, const Island& island,
               const ConeSettings& settings, ConeProblem* cone, SolverSolution* answer);

  ConeSummary solve(Host& host);

 private:
  static constexpr int kRounds = 12, kFreeRounds = 4, kRoundsOfLowering = 4, kPoseSteps = 30;
  // Corrections move a body by no more than so many times the ways to S* and what is overlapped or missed there, summed.
  static constexpr double kOfWay = 16.0, kOfOverlap = 2.0;
  // Contacts contradict each other where a solution that does not converge misses so much of the deepest, and that is so much
  // of the smallest radius of gyration.
  static constexpr double kOfDepth = 0.1, kOfSize = 0.1;
  // Contacts of bodies that a joint joins give way by so much of what they would: linear rows of two faces that a hinge holds
  // together contradict it by the square of a turn.
  static constexpr double kOfJoined = 1e-4;
  // Largest turn from which chords start, rad; what one may be of the step before it; units of rounding, of the coordinates
  // or of an angle of 1, that may be left of what joints hold.
  static constexpr double kTurnOfChords = 1e-7, kRateOfChords = 1e-2, kLeftByChords = 4.0;

  // What friction displaces may send joints and contacts to where it is another (a light link between the ground and what falls on
  // it), round by round. Where the last change was much, or left joints open, it is left out.
  void leave_out_wandering(double last_change);
  // What joints miss, m.
  double open() const;

  struct PoseChange {
    BodyMotion displacement, offset;
    std::vector<Vector3> offset_moment;
    std::vector<double> of_joints, of_contacts;  // corrections
    bool has_converged;
    double contradiction;
  };
  PoseChange pose_change() const;
  void take(const PoseChange& change);

  // ---- what does not change within the step

  void load();

  // Place of a row of the request (kNone: the world) among the island's bodies.
  std::uint32_t place_of(std::uint32_t row) const;

  BodyMotion start_motion(Twist SolverBody::*of) const;

  void load_joint(const DiscrepancyColumns& columns, std::uint32_t row);

  // Pairs whose contacts give way; none beside drives without bound, which yield less than that.
  void find_joined();

  void load_contact(std::uint32_t row);

  // ---- the first guess

  // offset_ as the impulses of the step before make it: what rests or moves steadily is found in one round.
  void guess_offset(double share);

  // True for a drive, or friction, that did all it can while the trial state was integrated, and is short of its velocity.
  bool slips(const EndJoint& joint, std::size_t k) const;

  // What a spring asks of the pose change; joint_correction is all that it pushes there, until store().
  void load_spring(std::size_t k, EndJoint* joint);

  template <class Row>
  void push_at_trial(const Row& row, const ConstraintDirection& direction, double amount, BodyMotion* x) const;

  // ---- the end of the step

  void move_to_end(BodyMotion displacement);

  // Bodies, rows and errors at S* (+) displacement_.
  void move_to_end();

  // What a turn of a body adds to the moments that the corrections mu exert on it: the arm r of a push p turns along, so
  // K = (p.r) 1 - (p r^T + r p^T)/2. Under tension this holds a light link between heavy ones more than its inertia does,
  // and without it steps that take the directions anew each time run away (T h^2/(m l) > 1).
  void stiffen();

  // As the bodies turn, with what stiffens the others left as it is.
  void place_unstiffened();

  // Newton's step for delta = offset + M^-1 J^T mu with the stiffness: x0 = delta_k + (M + K)^-1 M (offset - delta_k).
  void start_step(BodyMotion* x0) const;

  void move_to_end(EndJoint* joint) const;

  // What moves is found to rounding, as errors would add up over steps; but in the end positions and velocities must agree.
  bool may_rest() const { return summary_.iterations == 0 || round_ >= kFreeRounds; }

  // ---- pose change

  // Precondition: bodies and joints are where displacement_ ends.
  void solve_pose();
  void find_pose();

  // Near a place where rows become dependent steps lead to it no nearer than rounding lets them, and away again.
  struct NearestPose {
    double open = std::numeric_limits<double>::infinity();
    double push = 0.0;  // largest of all steps
    int idle = 0;       // steps since
    PoseChange change = {};
    bool has_change() const { return open < std::numeric_limits<double>::infinity(); }
  };
  // False where steps come no nearer.
  bool keep_nearest(NearestPose* nearest) const;

  // Where the next step begins after one to `image`: there, or beyond what steps that shrink slowly tell.
  BodyMotion accelerated(const BodyMotion& from, const BodyMotion& image, AndersonAcceleration* acceleration) const;

  // True where no motion meets all contacts, as of bodies that lie in one place and each push the next away. They give way
  // then (least squares), so that the others are met: next step's contacts are those of where that left the bodies.
  bool contradicts() const;
  void forget_corrections();
  std::vector<double> yielding() const;

  // After a step that changed ways by `before`: steps with the rows of where displacement_ ends but the factors of that step.
  // True if they end at rounding, false where they do not shrink fast.
  bool follow_chords(double before);

  // From displacement_, so that its rows are nearly those of `next`.
  bool turns_little(const BodyMotion& next) const;

  // Of joints, as the step began or left them.
  bool has_corrections() const;

  // What joints hold, where displacement_ ends, to rounding.
  bool are_closed() const;

  // Contacts that leave a body no room ask for ways without end along what is nearly flat between them. The share of the way
  // from `from` that is left.
  double shorten(const BodyMotion& from, BodyMotion* motion) const;

  // The most that corrections may move a body by, if one has moved so far.
  double most_of(double moved) const;
  // Of bodies and of where they touch, m; what drives add and springs may counts to the sum.
  template <class Use>
  void for_ways(Use&& use) const;
  double sum_of_ways() const;
  double largest_way() const;

  // True if the rows that follow a joint's own are others than in the last.
  bool build_pose();
  void build_turns_of_rod(EndJoint* joint);
  void build_turn_of_swing(EndJoint* joint);
  void add_turn(const ConstraintDirection& direction, double compliance, EndJoint* joint);

  void keep_corrections();

  // Contacts and limits that the end of the step closes, beside those that were.
  double gap_of(const EndContact& contact) const;
  void close_together(std::span<EndContact> of_pair, double time);
  bool find_closed();

  JointLaw velocity_law_of(const EndJoint& joint, std::size_t k) const;

  // ---- velocity

  void solve_velocity();
  void find_velocity(const BodyMotion& trial);
  bool has_unbounded_drive() const;
  // Not by what rounding leaves of contacts that hardly settle.
  bool misses_what_drives_ask(const BodyMotion& trial) const;
  // Where joints, limits or contacts are in the way of drives without bound, these ask for what they can reach and give way
  // a little; what they press does not bounce. False where what they reach is not known.
  bool let_drives_yield(const BodyMotion& trial);
  bool has_yielded(const JointLaw& law) const { return drives_yield_ && (law.is_unbounded_drive() || law.yields); }
  // What drives that yield bear moves them no more.
  void hold_loads_of_drives();
  // Of joints, with the law of each, its impulse and EndJoint::driven.
  // use(row, axis, joint) for the axes that have a row, in the order of rows.
  template <class Use>
  void for_active_axes(Use&& use);
  template <class Use>
  void for_velocity_rows(Use&& use);

  // v*, with turned_by_joints().
  BodyMotion turned_trial_velocity() const;
  bool arrives() const;
  bool has_bounces() const;  // of stops of joints
  // What the joints alone make of v*, where something arrives: what an impact gains is counted from there.
  BodyMotion velocity_of_joints(BodyMotion velocity);
  bool may_turn() const;

  void build_velocity(bool with_turning);

  void build_velocity_of_joints();

  void build_velocity(const EndContact& contact, bool with_turning);

  void keep_impulses();

  // Are reactions of joints in S* already?
  bool has_reactions() const { return !joints_.empty() && joints_.front().discrepancy.has_forces_applied(); }

  // Next to a place where rows depend on each other the pose may end on another branch than the one that the bodies are on, along
  // which next to none of their velocities are allowed. Would it take much of them? They stand then: the next step ends elsewhere.
  bool leads_elsewhere(const BodyMotion& trial) const;

  // ---- places from which no motion leads, though velocities are allowed there

  // From S_n to S*.
  bool has_moved(std::uint32_t body) const;
  // Does the pose change take a body back by most of its way? In regular places it is of the size of the method's error.
  bool is_taken_back(std::uint32_t body) const;
  // Takes from v* what the pose change took back; returns the share of that which it was, 1/s, 0 where nothing was.
  double stop_what_is_locked(BodyMotion* trial);

  // ---- energy

  // Work of all rows: lambda (J before + J after)/2 sums to the change of kinetic energy, from what the joints allow to what
  // joints and contacts do. Lowers e s where it is positive; true if anything was, and the velocities are to be found anew.
  bool lower_restitution(const BodyMotion& before, int round);
  void share_restitution(double work, bool only_some);
  void share_restitution();
  // Of an unfinished solution that gains although nothing bounces any more: the largest share that gains nothing.
  void scale_back(const BodyMotion& trial);
  // What stops that are closed give back, by what the joints alone make of v* (velocity_of_joints(), which leaves their rows).
  void find_bounces(const BodyMotion& before);
  // Of joints' stops: with the velocities' row, axis and joint.
  template <class Use>
  void for_bounces(Use&& use);

  // ---- rows on velocity alone

  // offset_ from the present impulses. False if that changes nothing.
  bool set_offset(double share);

  // Impulses keep their moment while steps turn the inertia: else a spin that a joint takes back is left across it.
  void keep_moments_of_offset();
  void turn_offset();

  // ---- sizes, m

  // Half of what the largest coordinate's rounding moves a point by.
  double representable() const { return 0.25 * kEpsilon * coordinates_; }
  double largest_change(const BodyMotion& a, const BodyMotion& b) const;
  double largest(const BodyMotion& a) const;

  // By more than rounding, and than `known`.
  bool is_change(const BodyMotion& a, const BodyMotion& b, double known) const;

  void store();

  const stage::SolverSolveRequest& request_;
  const Island& island_;
  ConeSettings settings_;
  SolverSolution& answer_;
  ConeProblem& cone_;

  SolverBodies bodies_;                // the island's
  std::vector<std::uint32_t> rows_;    // of the request, of each; rising, the world last
  std::vector<std::uint32_t> pushed_;  // places of those that can be pushed
  std::vector<EndJoint> joints_;
  std::vector<EndContact> contacts_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> joined_;  // rising
  std::vector<EndBody> end_;
  std::vector<double> gyration_;    // radii, m
  std::vector<Matrix3> stiffness_;  // of stiffen(), by body
  double coordinates_ = 0.0, pose_contradiction_ = 0.0;
  BodyMotion velocity_, displacement_, offset_;
  std::vector<Vector3> offset_moment_;  // that turns by offset_, kg m^2; zero where that turns nothing
  BodyMotion driven_;                   // part of offset_ by drives
  ConeSummary summary_;
  int round_ = 0;
  StalledDrives stalled_;
  bool has_settled_ = true, has_pose_ = true, has_velocity_ = true;
  bool is_shortened_ = false;  // the pose change
  bool yields_ = false;        // contacts, in the pose change
  std::optional<SharedRestitution> restitution_;
  bool all_share_ = false;
  bool stops_bounce_ = false;  // of some joint
  bool drives_yield_ = false;
  double drives_contradict_ = 0.0;  // joints or each other, m/s
  std::vector<double> reach_;       // of drives that yield
  double missed_ = 0.0;             // by the pose change, m
  AndersonAcceleration offsets_;    // from round to round
  bool shrinks_slowly_ = false;     // its steps
};

}  // namespace gravitas
