// Rows of joints and contacts of one island as one problem, solved to rounding.
//
//   y = q + (J M^-1 J^T + Gamma) lambda,     q = J x0 + start,   x = x0 + M^-1 J^T lambda
//
//   scalar rows (joint_laws.h):  equal, at least, at most, or between, with a largest |lambda|
//   contacts:  0 <= lambda_N  _|_  y_N - e s >= 0,   |lambda_T| <= mu lambda_N against y_T,
//              |tau_N| <= mu_sp lambda_N about the normal,  |tau_T| <= mu_r lambda_N across it
//
// All laws in one form: lambda = P(lambda - (y - target)/W_ii), P the projection to what each lambda may be, of friction
// with the radius that the projected normal impulse gives (Alart and Curnier 1991). The residual of that equation, times
// W_ii, is a velocity (in the pose problem a length); it is zero at solutions of Coulomb's law and only there, as that of
// PROBLEMS' FCLIB measure.
//
// Method.
//  1. The rows that hold always (equalities without bound) are eliminated: W_EE = L D L^T by ProfileLdlt in an order of its own, dependent rows
//     left out, contradicting ones at their least-squares compromise; of the multipliers that move alike the shortest are told,
//     so that four rods bear a plate alike. What the other rows then feel of each other is
//     W' = W_OO - W_OE W_EE^-1 W_EO: a joint with its whole chain behind it is as good as a body.
//     Where that leaves a contact or a limit less than 1e-5 of what moving all bodies together would, it gets the difference
//     as a compliance: what joints hold by themselves, but for rounding and turns, would be pushed without end.
//  2. Without such rows, and while nothing slides: steps among the motions of the bodies, near the first guess (held_step.h).
//  3. The others, dense:
//     kNewton       semi-smooth Newton on the equation above. A row is held, free, or slides; with the states known the
//                   equations are linear but for the direction of a slide, so that steps end at the solution itself once
//                   states stay. Rows that depend on each other (four contacts under a box) are borne by 1e-7 to 1e-10
//                   added to the diagonal of the step's matrix, not of the equation: the answer is one of those that are
//                   right. Where seven steps do not halve the residual, some follow from the best place that are kept only
//                   where they shorten it, with up to 0.1 on the diagonal (Levenberg 1944, Marquardt 1963); then all start
//                   anew, from the guesses of cone_path.h, and every third time from sweeps, until three guesses near the
//                   tolerance have not halved the residual: up to 8 times of it then counts as rounding. More than 192 rows
//                   are swept before the first step, as long as 256 sweeps will do. With friction in more than 96 rows
//                   sweeps come first and every other time, in more than 368 alone: there guesses end at 1e-3 to 1e-5 m/s,
//                   sweeps in a tenth of their time at 1e-6 to 1e-8.
//     kGaussSeidel  as long as nothing slides, the same steps; then projected block Gauss-Seidel, each contact solved exactly
//                   (coulomb_contact.h). Where the residual shrinks too slowly for the sweeps that are left, or they ran
//                   out, kNewton goes on from the best of them. All sweeps are accelerated (nesterov_acceleration.h).
//     Of the solutions around the one found the least is taken where something slides, after steps in up to 96 rows alone: steps
//     on y + 1e-8 lambda for what holds, from nought, not from where it is, then some that end at a solution again. Not after
//     steps if other rows hold or slide there. Four corners of a box then bear alike whatever the order of the rows.
//  4. Static and dynamic friction: all stick within mu_s first, but for what is known to slide; what slips then slides
//     with mu_d.
//
// Measured: heaps of two to five bodies with four contacts a face that slide and turn, at ratios of mass of 1e-3, 1, 1e2 and
// 1e4, are all solved (400 of each), with rolling and spinning friction at ratios up to 1e4 1599 of 1600; at 1e6 395 of 400,
// the others to what rounding leaves of the loads.
//
// Scaled: every row by the root of its W_ii, a contact's three by one number, so that cones stay cones. More than kDenseRows
// other rows: sweeps on all rows, the held ones factorised in between; the answer says if that did not do.
#pragma once

#include <cstdint>
#include <vector>

#include "plugin_sdk/math/dense_lu.h"
#include "plugin_sdk/solver/bodies.h"
#include "plugin_sdk/solver/cone_path.h"
#include "plugin_sdk/solver/elimination_order.h"
#include "plugin_sdk/solver/equal_springs.h"
#include "plugin_sdk/solver/held_step.h"
#include "plugin_sdk/solver/joint_laws.h"
#include "plugin_sdk/solver/nesterov_acceleration.h"
#include "plugin_sdk/solver/profile_ldlt.h"

namespace gravitas {

class Host;

struct ConeRow {
  std::uint32_t body1 = 0, body2 = 0;
  ConstraintDirection direction;
  double start = 0.0;       // y - J x at lambda = 0
  double length = 1.0;      // m per unit of y: an arm for rows about an axis
  JointLaw law = {};        // scalar rows
  double multiplier = 0.0;  // first guess, then the answer
  double softness = 0.0;    // of a contact's normal: compliance as a share of the row's response
};

// Rows first ... of a contact: normal, two tangents if it has friction, then normal and two tangents of turning if it rolls
// or spins with friction.
struct ConeContact {
  std::uint32_t first = 0;
  bool has_friction = false, has_turning = false;
  double target = 0.0;
  double static_friction = 0.0, dynamic_friction = 0.0;
  double rolling_friction = 0.0, spinning_friction = 0.0;  // m
  bool slides = false;                                     // is known to, then: does, with dynamic_friction

  std::uint32_t count() const { return 1U + (has_friction ? 2U : 0U) + (has_turning ? 3U : 0U); }
};

enum class ConeMethod : std::uint8_t { kNewton, kGaussSeidel };

struct ConeSettings {
  ConeMethod method = ConeMethod::kNewton;
  double tolerance = 1e-12;  // of the largest velocity (length) that meets in a row
  // steps, or sweeps: steps that go on where these do not do are the 500 in any case; of more than 368 rows steps are fewer,
  // by the cube of their number, down to a fifth
  std::uint32_t iterations = 500;
  double proximal = 1e-7;  // added to the diagonal of the first steps
  bool may_rest = false;   // the first guess is kept where it is wrong by what rounding moves a body at rest
  bool gives_up = false;   // at once where what holds always leaves a row no motion, and it is missed
  bool is_rough = false;   // rows that hold always are left as a first solution leaves them; refine() is to come
};

struct ConeSummary {
  std::uint32_t iterations = 0;  // steps of Newton's method and of paths, or sweeps
  double residual = 0.0;         // m/s, or m for poses
  bool has_converged = true;
  double contradiction = 0.0;  // of rows that hold always, m/s: what no motion can meet
};

class ConeProblem {
 public:
  static constexpr std::size_t kDenseRows = 900;

  // Scalar rows first, then those of the contacts in turn.
  std::vector<ConeRow> rows;
  std::vector<ConeContact> contacts;

  // Forgets the problems of another island or step: those to come are alike among themselves. The host is told of progress
  // in long work, as long as they last.
  void start(const Host* host);

  // Sets the multipliers. `smallest` is what counts as nothing in any case (m/s, m).
  ConeSummary solve(const SolverBodies& bodies, const BodyMotion& x0, double smallest, const ConeSettings& settings);

  // Takes away what rounding left of the rows that hold always, in the problem that was solved last in steps > 0.
  void refine(const SolverBodies& bodies, const BodyMotion& x0, double smallest, const ConeSettings& settings,
              ConeSummary* summary);

  // True if all rows that push anything hold always, in the problem that was solved last.
  bool holds_all() const { return other_.empty(); }

  // Of the rows that hold always, as a share of its diagonal, in the problem that was solved last in steps > 0.
  double least_pivot() const { return factor_.least_pivot(); }

  // True if the problem that was solved last had too many rows for steps of Newton's.
  bool is_large() const { return other_.size() > kDenseRows; }

  // One step towards what rows ask for that differ little from those which were solved last, with their factors. Returns
  // by how much they contradict each other, as reconcile(). Precondition: holds_all().
  double correct(const SolverBodies& bodies, const BodyMotion& x0, double smallest);

  // Gives rows that hold always and contradict each other the nearest targets that some motion meets (least squares of the
  // scaled rows). Returns by how much they were off (m/s, m), 0 if by no more than `smallest` or rounding, or if they are so
  // many that they are not looked at.
  double reconcile(const SolverBodies& bodies, const BodyMotion& x0, double smallest);

  // x += M^-1 J^T lambda
  void push(const SolverBodies& bodies, BodyMotion* x) const;

 private:
  // A contact slips if it does so this much faster than what counts as converged.
  static constexpr double kSlip = 1e3;
  // Of the largest terms of a row's sum, what may be left by rounding.
  static constexpr double kSumRounding = 16.0 * kEpsilon;

  // Rows that one law rules.
  struct Block {
    std::uint32_t first = 0;    // place among the other rows
    std::int32_t contact = -1;  // of contacts; -1: one scalar row
    std::uint32_t count = 1;
    // scaled: of a scalar row, of a contact's normal
    JointLaw law = {};
    double target = 0.0;
  };
  // Of a contact's scaled multipliers, as multiples of the normal one.
  struct Bounds {
    double friction = 0.0, spinning = 0.0, rolling = 0.0;
    std::uint32_t turning = 0;  // first row of turning in the block; 0: none
  };

  // What a block's rows feel of each other.
  struct OwnResponse {
    explicit OwnResponse(const Eigen::MatrixXd& own);
    Eigen::MatrixXd all;
    Matrix3 contact = Matrix3::Zero(), inverse = Matrix3::Zero();  // of a normal and friction
    bool has_inverse = false;
  };
  struct RowRange {
    Eigen::Index first, count;
  };
  // Where sweeps are, and how they go on; of too many rows for steps without y.
  struct Sweeps final : SweptState {
    explicit Sweeps(double growth) : acceleration(growth) {}

    Eigen::VectorXd lambda, y;
    NesterovAcceleration acceleration;

    void start(const Eigen::VectorXd& from, const Eigen::VectorXd& y_from);
    void read(std::vector<double>* state) const override;
    void read_responses(std::vector<double>* responses) const override;
    void write(const std::vector<double>& state) override;
  };

  struct HeldFactors {
    HeldStep step;
    std::vector<Eigen::Index> rows;  // in it, among other_; empty: there are none
  };

  // Shortens a vector of two to a radius.
  static void into_disc(double radius, double* v);

  // Empty lists that keep their room.
  template <typename List>
  static void clear_lists(std::size_t count, std::vector<List>* lists) {
    lists->resize(count);
    for (List& list : *lists) list.clear();
  }

  double value(const BodyMotion& x, std::uint32_t r) const;
  void classify(const SolverBodies& bodies, const BodyMotion& x0);
  // Puts the held rows in the order of elimination_order.h.
  void order_held(const SolverBodies& bodies);
  void factorise(const SolverBodies& bodies);
  double size(const SolverBodies* bodies) const;
  // The side of the held rows; as reconcile().
  double make_consistent(const SolverBodies& bodies, double smallest);
  // As ProfileLdlt::make_consistent().
  double make_consistent(const SolverBodies& bodies, std::vector<double>* side);
  void reduce(const SolverBodies& bodies);
  bool is_solved_by_nothing(double smallest) const;
  // Of a scaled unit of a row, m.
  double way_of(std::uint32_t row) const { return scale_[row] * rows[row].length; }
  double least_response(const SolverBodies& bodies) const;
  bool is_out_of_reach(double least, double tolerance) const;
  void give_way(double least);
  bool is_solved_near_guess(const SolverBodies& bodies, const BodyMotion& x0, double tolerance,
                            const ConeSettings& settings, ConeSummary* summary);
  void mark_progress() const;
  void set_multipliers();
  bool take_held_step(const SolverBodies& bodies, double proximal, double corner, const Eigen::VectorXd& y,
                      HeldFactors* factors);
  double largest_sum(const SolverBodies& bodies) const;
  void find_values(const BodyMotion& x, Eigen::VectorXd* y) const;
  JointLaw scaled_law(std::uint32_t row) const;
  Bounds bounds_of(const Block& block) const;
  void confine(const Block& block, double* multipliers) const;
  static void confine_turning(const Bounds& bounds, double pressed, double* multipliers);
  // Of a block with scaled multipliers and values: where the law puts them.
  void project(const Block& block, const double* lambda, const double* y, double* projected) const;
  double residual_of(const Eigen::VectorXd& lambda, const Eigen::VectorXd& y) const;
  double largest_sum(const Eigen::VectorXd& lambda) const;
  bool linearise(const Eigen::VectorXd& lambda, const Eigen::VectorXd& y, double corner = 0.0, double drawn = 0.0);
  // With a corner, see linearise(): false, with nothing done, where a row slides.
  bool newton_step(double proximal, Eigen::VectorXd* lambda, Eigen::VectorXd* y, double corner = 0.0,
                   double drawn = 0.0);
  std::uint32_t descend(double enough, Eigen::VectorXd* lambda, Eigen::VectorXd* y);
  void solve_sliding();
  void solve_sticking();
  ConePath path() const;
  void begin_sweeps();
  void sweep(Sweeps* sweeps);
  bool slides() const;
  bool settle(double enough, bool may_differ, Eigen::VectorXd* lambda, Eigen::VectorXd* y);
  void relax(const Block& block, const OwnResponse& own, double* lambda, const double* y) const;
  bool let_slide(const Eigen::VectorXd& lambda, const Eigen::VectorXd& y, double slip);
  void into_cones(Eigen::VectorXd* lambda) const;
  void solve_dense(const ConeSettings& settings, double tolerance, ConeSummary* summary);
  void solve_large(const SolverBodies& bodies, const BodyMotion& x0, const ConeSettings& settings, double tolerance,
                   ConeSummary* summary);
  // side_ as (target - value)/scale of the held rows with their multipliers.
  void find_missing_of_held(const SolverBodies& bodies, const BodyMotion& x0);
  // Mends the held rows; returns by how much they were off (m/s, m).
  double refine_held(const SolverBodies& bodies, const BodyMotion& x0);
  // What side_ asks for.
  void add_to_held();
  void share_out(const SolverBodies& bodies);
  // Largest of what the value of a held row is summed from, m/s, m.
  double largest_held_sum();

  const Host* host_ = nullptr;

  std::vector<double> scale_;                // by row, root of W_ii; 0: pushes nothing
  std::vector<std::uint32_t> held_, other_;  // rows
  std::vector<Block> blocks_;
  std::vector<double> free_;                       // q by row
  std::vector<std::pair<double, double>> speeds_;  // |v|, |w| by body
  double motion_ = 0.0;                            // largest sum of what meets in a row, m/s

  EliminationOrder elimination_;
  ProfileLdlt factor_;
  EqualSprings shares_;   // of multipliers
  EqualSprings nearest_;  // of sides, where has_nearest_
  bool has_nearest_ = false;
  std::vector<std::vector<std::uint32_t>> held_of_body_;    // places among held_
  std::vector<std::vector<std::uint32_t>> others_of_body_;  // places among other_
  std::vector<std::size_t> first_held_;                     // where their profiles begin
  std::vector<double> side_;                                // (target - q)/scale of held rows
  std::vector<double> pushed_;                              // by body, largest scaled multiplier of held rows
  BodyMotion x_;                                            // that multipliers make
  std::vector<std::vector<std::pair<std::uint32_t, double>>> to_held_;  // W_OE, scaled
  Eigen::MatrixXd carried_;                                             // W_EE^-1 W_EO, scaled
  Eigen::MatrixXd response_;                                            // W', scaled
  Eigen::VectorXd start_others_;                                        // q', scaled
  Eigen::VectorXd lambda_;                                              // of other rows, scaled

  // of sweeps, by block
  std::vector<OwnResponse> own_;
  std::vector<std::vector<RowRange>> neighbours_;

  // of a Newton step
  enum class RowKind : std::uint8_t { kHeld, kPut, kSliding };
  std::vector<RowKind> kinds_, kinds_before_;
  Eigen::MatrixXd sliding_, core_;
  Eigen::VectorXd side_of_step_, step_;
  std::vector<double> rest_;
  DenseLu lu_;
  double proximal_ = 0.0, factored_proximal_ = 0.0;
  std::vector<Eigen::Index> coupled_, factored_;  // rows; of sticking_
  ProfileLdlt sticking_;
  HeldFactors held_factors_[2];  // of poses, of velocities
};

}  // namespace gravitas
