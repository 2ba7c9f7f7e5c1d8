// What answers the second question (reactions.h) for one mechanism: the rows of its joints in a state, their factors and
// multipliers. It knows of no other, so that none shows in what is decided here.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/plugin.h"
#include "plugin_sdk/solver/bodies.h"
#include "plugin_sdk/solver/equal_springs.h"
#include "plugin_sdk/solver/islands.h"
#include "plugin_sdk/solver/profile_ldlt.h"
#include "plugin_sdk/wrench_jacobian.h"

namespace gravitas {

// True where an axis of a discrepancy is held at all times by whatever force it takes.
bool holds_always(const Discrepancy& discrepancy, int axis);
// True for one that holds in some states, by a force that it may not have in others: limits, drives with a bound, friction.
bool may_hold(const Discrepancy& discrepancy, int axis);

class ReactionSolver {
 public:
  // Before solve(), and where other bodies meet. `places`: of each body of the request among those of its mechanism. Must live
  // as long as questions are asked, but for the request.
  void set_mechanism(const stage::SolverReactionsRequest& request, const Island& mechanism,
                     std::span<const std::uint32_t> places);
  // Returns what the rows are missed by. The request must live until the last differentiate().
  double solve(const stage::SolverReactionsRequest& request);
  // Into places of the whole request, which are zero.
  void write(std::vector<Wrench>* reactions, std::vector<double>* forces) const;

  // Once for each solve(), before differentiate().
  void start_differentiating();
  // How the reactions change with the state of a body, one of the mechanism's or not: columns of blocks, by the row of the body
  // that feels them. `forced` are blocks of the request, those by that body.
  void differentiate(std::uint32_t by, std::span<const std::uint32_t> forced, std::vector<JacobianBlock>* blocks);

 private:
  struct Body {
    std::uint32_t row = kNone;  // of the request; none: the world
    double inverse_mass = 0.0;
    Matrix3 inverse_inertia = Matrix3::Zero();
    Pose asked, pose;  // as the question has it, and where the body is now
    Twist velocity, acceleration;

    bool is_pushed() const { return inverse_mass > 0.0 || !inverse_inertia.isZero(0.0); }
    Vector3 velocity_at(const Vector3& arm) const { return velocity.linear + velocity.angular.cross(arm); }
    Vector3 centripetal(const Vector3& arm) const { return velocity.angular.cross(velocity.angular.cross(arm)); }
  };

  // How an axis holds, that is no spring.
  struct Holding {
    bool holds = false;
    bool is_velocity = false;  // of a drive or friction, whatever the error
    // That the error is at; none: it is at 0.
    Vector3 Discrepancy::*limit = nullptr;
    double least = 0.0, most = 0.0;  // of its force on body 2, N or N m
    double push = 0.0;               // that force where it does not hold: of a drive or friction that slips
    double missing = 0.0;            // m/s or rad/s that S_n was short of its velocity by
    bool is_released = false;        // asked for more than it bears
    int returns = 0;                 // since

    // Of the error, m or rad.
    double target(const Discrepancy& d, int axis) const { return limit == nullptr ? 0.0 : (d.*limit)[axis]; }
  };

  struct Joint {
    std::size_t place = 0;  // of its first axis among the multipliers
    std::uint32_t body1 = 0, body2 = 0;
    Discrepancy discrepancy, at_start;  // at_start: where the request tells S_n's
    bool is_only_point = false;         // joint_laws.h
    std::size_t first_row = 0;          // of those that hold
    std::array<Holding, 3> holdings = {};
  };

  struct Row {
    std::uint32_t body1, body2;
    std::size_t place;  // among the multipliers
    ConstraintDirection direction;
    double error;           // m or rad
    double velocity_error;  // m/s or rad/s
    double gamma;
    double scale;  // root of the diagonal
    double reach;  // m, the longer arm, or a rod's length; of an angular row 0
    Holding* holding = nullptr;
  };

  // What the rows of a discrepancy's points share.
  struct Arms {
    Vector3 arm1, arm2;  // of body 1 to where x2 is but for what the held axes are off by
    Vector3 bend;        // what velocities alone do to the distance of those two, seen from axes that turn with body 1
    double reach;
  };

  // What gives way, in the state as it was asked.
  struct Spring {
    Row row;
    double force;  // on body 2
  };

  // What a joint is in a state of its bodies.
  struct JointState {
    std::array<Row, 3> rows;  // of the axes that hold
    Wrench one, two;          // of the springs, and of what slips
  };

  // How a body's state changes with a number.
  struct Change {
    Twist way, rate;  // of its pose, of its velocities
  };

  // Share of a diagonal: rows with such a pivot are nearly dependent.
  static constexpr double kNearlyDependent = 0.1;
  // Turns (rad) by which a state is off the joints: that are none, may be rounding, or small enough to go by.
  static constexpr double kOnJoints = 1e-15, kRounding = 1e-13, kNearEnough = 1e-5;
  // Of a diagonal: a row with a lesser pivot, at a state that agrees with the joints, says nothing but rounding.
  static constexpr double kSingular = 1e-10;
  // Of a turn that no step takes away: what such a state is off by is the square of how far it is from where rows are dependent.
  static constexpr double kStuck = 100.0;
  // What an error leaves of the pivots of dependent rows, in its squares.
  static constexpr double kMargin = 100.0, kMostMargin = 1e9;

  void load_bodies();
  // In S_n.
  Pose start_of(const Body& body) const;
  Twist start_velocity_of(const Body& body) const;
  // Bodies, and joints where the request tells them. load_bodies() leads back.
  void go_to_start();
  // What forces, springs, the gyroscopic term and drag make of the bodies.
  void accelerate();
  // Of one of the mechanism's own, by its row in the request; kNone for others.
  std::uint32_t place_of(std::uint32_t row) const;
  void load_joints();
  bool tells_start() const { return !request_->start_mode().empty(); }
  // The joint's discrepancy in the state that the bodies were taken from.
  const Discrepancy& told(const Joint& joint) const { return is_at_start_ ? joint.at_start : joint.discrepancy; }
  // Which axes hold, in S_n (reaction_holdings.cc).
  void find_holdings();
  void carry_cones();
  // A twist that began at its single limit is told by the turns that lead there.
  void turn_to_limit(Joint* joint);
  // Lets go of limits that open in S_n, and of those that have opened since.
  void let_go_from_start();
  void let_go_opened();
  // Is it a limit that holds now, of those that need not?
  static bool is_closed_limit(const Joint& joint, std::size_t axis);
  // By how much the row may be off in a state that an integrator tries: the second order of what turns in the step, and
  // rounding; m or rad.
  double strayed(const Row& row) const;
  static Holding held_always(const Discrepancy& d, int axis);
  Holding holding_at_start(const Discrepancy& d, int axis, const Row& row) const;
  // The multipliers of the rows that hold. Returns what they are missed by.
  double solve_held();
  double find_multipliers();
  // Lets go of what bears more than it can; holds again what closes without; leaves to the end of the step what would go far
  // beyond its velocity in it (the simulator asks again for less of the step, stop_location.h). False where nothing is to change.
  bool change_holdings();
  bool release_overloaded();
  bool change_open();
  void load_springs();
  Spring spring_of(const Discrepancy& d, const Matrix3& axes, int axis, const Arms& arms, const Joint& joint) const;
  static void add_force(const ConstraintDirection& direction, double force, Wrench* one, Wrench* two);

  // Adds what the reactions make of the accelerations, and finds how those change with each body's own state (own_).
  void accelerate_with_reactions();
  static void accelerate(const Body& body, const Wrench& wrench, Twist* acceleration);
  // Leaves of forced_ how forces make accelerations change.
  void add_forced(std::span<const std::uint32_t> blocks);
  JointState state_of(const Joint& joint);

  // How reactions (pushes_) change with a number of a body's state; kNone: with what forces alone do.
  void differentiate_by(std::uint32_t by, int number);
  // What moves the rows and springs of all bodies as that number does: moving_, and of pushes_ and side_ what these do.
  void move_number(std::uint32_t by, int number);
  // Of joints as bodies move by a step along moving_: what springs push (pushes_), what rows do and ask (side_).
  void add_slopes(double step, const std::vector<std::size_t>& joints, bool of_springs, bool of_rows);
  void move_along(double step, bool pose_alone = false);
  // Leaves of moving_ what the rows allow, along M^-1 J^T, as agree_with_joints() does of states.
  void agree(double step);
  // Calls use(row, axis).
  template <typename Use>
  void for_rows_of(const Joint& joint, Use&& use) const;

  // Rows of all joints with the bodies where they are.
  void make_rows();
  // The joint's discrepancy, carried along with its bodies: exactly but for an angular error that is no swing's,
  // twist's or component's, which is to first order.
  const Discrepancy& at_pose(const Joint& joint);
  Arms arms_of(const Discrepancy& d, const Matrix3& axes, const Joint& joint) const;
  Row row_of_axis(const Discrepancy& d, const Matrix3& axes, int axis, const Arms& arms, const Joint& joint) const;
  Row axis_row(const Discrepancy& d, const Vector3& axis, const Arms& arms, const Joint& joint) const;

  // Rate of an angular row's axis.
  static Vector3 turning_of(const Discrepancy& d, const Vector3& axis, const Vector3& w1, const Vector3& w2);

  // Of a rod without length there is no direction: the first axis stands in.
  Row radial_row(const Discrepancy& d, const Arms& arms, const Joint& joint) const;
  static double longer_arm(const Body& one, const Vector3& arm1, const Body& two, const Vector3& arm2);

  // m by which a turn of 1 rad takes an error out of the row; 1 if it is one of angles.
  double reach_of(const Row& row) const;

  // Radians by which bodies turn where the largest error is taken out by turning.
  double largest_turn() const;

  // True if bodies would have to move much farther than the weakest row might be off: it is nearly dependent, and not only
  // because masses differ.
  bool is_amplifying() const;

  // A state that an integrator tries is off the joints by an error e of its own. Where rows are nearly dependent that
  // counts for more than its size: redundant ones are dependent no more (pivots of e^2, which no rounding explains), and
  // near a singular configuration, at a distance x, directions are off by e/x^2. So the question is answered for the
  // nearest state that agrees with the joints, in pose and in velocity; where there is none, for the one asked.
  //
  // Next to the place itself such a state may lie on another branch than the one that the bodies are on, whose velocities are others:
  // where much of them were taken away, it is looked for a little ahead of the state, where branches are apart.
  // Where rows contradict each other alone, velocities that joints do not allow are answered as they are asked.
  enum class Elsewhere : std::uint8_t { kIsAhead, kIsAsAsked, kGoesOn };
  void agree_with_joints(Elsewhere elsewhere);
  // Are they of a mechanism that a change takes much of its velocities from? By body.
  std::vector<std::uint8_t> led_elsewhere(const std::vector<Twist>& change) const;
  void go_ahead(double turn_off, const std::vector<std::uint8_t>& which);
  void move(const std::vector<Twist>& change);
  std::vector<double> errors(double Row::*of) const;

  // Change of pose or velocity, along M^-1 J^T, that takes errors of the rows away.
  std::vector<Twist> taken_out(std::vector<double> errors) const;

  void share_out();

  // Rows whose pivot is less than `least` of their diagonal count as dependent.
  void factorise(double least);

  const stage::SolverReactionsRequest* request_ = nullptr;
  const Island* mechanism_ = nullptr;
  std::span<const std::uint32_t> places_;
  std::vector<Body> bodies_;   // its own, and then what holds it
  std::vector<Joint> joints_;  // in an order of elimination
  double longest_ = 0.0;       // reach of a row
  bool has_moved_ = false;     // bodies, from where discrepancies are told
  bool is_at_start_ = false;   // bodies and discrepancies are S_n's
  bool may_let_go_ = false;    // an axis that holds
  Discrepancy carried_;        // of at_pose()
  std::vector<Row> rows_;
  std::vector<Spring> springs_;
  std::vector<Wrench> sprung_;  // of the springs, by body
  ProfileLdlt factor_;
  EqualSprings shares_;
  std::vector<std::size_t> first_of_body_, first_;  // row; scratch of factorise()
  std::vector<double> multipliers_;
  double size_ = 0.0;  // reach of rows and springs
  // of the Jacobian: are states made to agree with the joints? joints where the bodies are; and by body for one number
  bool agrees_ = false, contradicts_ = false;
  std::vector<JointState> states_;
  std::vector<std::size_t> all_joints_;
  std::vector<std::vector<std::size_t>> joints_of_;  // by body
  std::vector<JacobianBlock> own_, forced_;
  std::vector<Change> moving_;
  std::vector<Wrench> pushes_;
  std::vector<Twist> changes_;
  std::vector<double> side_;
};

}  // namespace gravitas
