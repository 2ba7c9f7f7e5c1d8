// Solver `MyName`: joints and contacts by projected Gauss-Seidel, row by row (the rows and the sweeps: my_name.h).
//
//   pose change   delta = M^-1 J^T mu + theta h M^-1 J^T lambda_v     what is open at S*, the trial state, is closed
//   velocity      v' = v* + M^-1 J^T lambda                           laws of joints, restitution and friction
//
// lambda_v are the multipliers of rows on velocity alone: friction, drives, springs. Contacts and limits count in the velocity
// where the pose change closes them; since lambda_v moves the pose, both are solved in turn until that settles.
//
// Directions and arms are those at S*: of first order in what the step turns. Simplified beside the shipped solvers: one
// coefficient of friction, the dynamic one; stops of joints give back of the speed at S_n. Known failures: slow on long chains,
// high piles and large mass ratios, where sweeps run out (stop_reason says so); impacts with friction and restitution at
// several contacts may gain energy (Kane's paradox), which this does not look for.
//
// A plugin is a class derived from the base of its slot. It declares itself once, receives a request as columns, and fills
// the columns of the reply. The answer depends on the request and the settings alone: the same request gives the same
// bytes, so keep nothing between calls but caches that can be made again. The warm start comes with the request.
#include "plugin_sdk/plugin.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <vector>

#include "my_name.h"
#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/solver/bodies.h"
#include "plugin_sdk/solver/contact_law.h"
#include "plugin_sdk/solver/joint_bounce.h"
#include "plugin_sdk/solver/joint_laws.h"
#include "plugin_sdk/solver/reply.h"
#include "plugin_sdk/solver/request_check.h"

namespace {

using namespace gravitas;

// A joint's discrepancy, and a contact, as both problems need them.
struct Joint {
  std::uint32_t body1 = 0, body2 = 0;
  double beta = 1.0, slop = 0.0;
  std::array<ConstraintDirection, 3> directions;
  std::array<JointAxisState, 3> axes;
};
struct Contact {
  std::uint32_t body1 = 0, body2 = 0;
  double depth = 0.0, slop = 0.0;
  ConstraintDirection normal;                 // of the pose change
  std::array<ConstraintDirection, 6> across;  // of the velocity: along the law's frame, and about its axes
  ContactLaw law;
  Vector3 warm;                    // along the frame
  double displacing = 1.0;         // share of friction's impulse that moves the pose
  std::size_t first = 0, end = 0;  // its rows in the velocity, the normal's first; none where it is open
};

class MyNamePlugin final : public SolverPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "MyName",
            .version = "1.0",
            .slot = Slot::kSolver,
            .meaning = "Projected Gauss-Seidel, row by row.",
            .properties = {Property::integer("Iterations")
                               .at_least(1.0)
                               .at_most(100000.0)
                               .defaults_to({1000.0})
                               // `gravitas ctl set` may change it while a simulation runs
                               .live()
                               .means("Largest number of sweeps of one solution; fewer where it converges.")}};
  }

  // Settings come in the order of declaration, within their bounds.
  explicit MyNamePlugin(PropertyCursor settings) : iterations_(static_cast<std::uint32_t>(settings.integer())) {}

  // The question of the slot: velocities and pose change of all bodies, and the multipliers that make them
  // (schemas/gravitas/stage/v1/solver.proto). Impossible requests are refused with the reason.
  void solve(const stage::SolverSolveRequest& request, const stage::SolverSolveReply& reply, Host& host) override {
    check_solver_request(request);
    bodies_.load(request);
    read_joints(request);
    read_contacts(request);
    SolverSolution solution;
    set_all_unpushed(request, bodies_, &solution);
    const BodyMotion trial_velocity = solution.velocity;

    // the first round knows no friction yet; most need two or three
    constexpr int kMostRounds = 8;
    SolverOutcome outcome;
    const double theta_h = request.theta() * request.time_step();
    BodyMotion offset(bodies_.count() + 1, Twist{});
    bool is_settled = false, converged = true;
    for (int round = 0; round < kMostRounds && !is_settled; ++round) {
      solution.displacement = offset;
      const plain::Ending pose = solve_pose(request, host, &solution);
      solution.velocity = trial_velocity;
      const plain::Ending velocity = solve_velocity(request, host, &solution);
      outcome.iterations += pose.sweeps + velocity.sweeps;
      outcome.residual = velocity.change;
      converged = pose.converged && velocity.converged;
      const BodyMotion before = offset;
      offset.assign(offset.size(), Twist{});
      for (const plain::Row& row : velocity_.rows)
        if (row.displaces * row.multiplier != 0.0)
          plain::push(row, theta_h * row.displaces * row.multiplier, bodies_, &offset);
      is_settled = is_near(offset, before);
    }
    const bool has_rows = !velocity_.rows.empty() || !pose_.rows.empty();
    if (has_rows) outcome.stop_reason = converged && is_settled ? StopReason::kConverged : StopReason::kIterations;
    write(solution, outcome, reply);
  }

 private:
  void read_joints(const stage::SolverSolveRequest& request) {
    joints_.clear();
    const DiscrepancyColumns columns = columns_of(request);
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const Discrepancy d = columns.at(i);
      Joint& joint = joints_.emplace_back();
      joint.body1 = bodies_.row(request.discrepancy_body()[2 * i]);
      joint.body2 = bodies_.row(request.discrepancy_body()[2 * i + 1]);
      const SolverBody &one = bodies_[joint.body1], &two = bodies_[joint.body2];
      const Vector3 middle = 0.5 * (d.point1 + d.point2);
      const Vector3 start_error = error_in_axes_at(d, one.trial, two.trial, one.start, two.start);
      const Matrix3 axes = to_rotation_matrix(d.axes);
      joint.beta = d.correction;
      joint.slop = d.is_angular() ? 1e-9 : closing_slop(middle, one, two);
      for (int axis = 0; axis < 3; ++axis) {
        const auto k = static_cast<std::size_t>(axis);
        const Vector3 direction = axes.col(axis);
        joint.directions[k] = d.is_angular() ? ConstraintDirection::about(direction, one, two)
                                             : ConstraintDirection::through(middle, direction, one, two);
        joint.axes[k] = joint_axis_state(d, axis, direction, start_error);
      }
      set_bounces(d, one, two, request.discrepancy_warm_impulse().subspan(3 * i, 3), &joint.axes);
    }
  }

  // Each body is pushed at its own surface: one place once the gap is closed.
  void read_contacts(const stage::SolverSolveRequest& request) {
    contacts_.clear();
    for (std::size_t i = 0; i < request.contact_key().size(); ++i) {
      Contact& contact = contacts_.emplace_back();
      contact.body1 = request.contact_body()[2 * i], contact.body2 = request.contact_body()[2 * i + 1];
      const SolverBody &one = bodies_[contact.body1], &two = bodies_[contact.body2];
      const Vector3 normal = vector_at(request.contact_normal(), i), point = vector_at(request.contact_point(), i);
      contact.depth = request.contact_depth()[i];
      contact.slop = closing_slop(point, one, two);
      const Vector3 to_surface = 0.5 * contact.depth * normal;
      const Vector3 surface1 = point + to_surface, surface2 = point - to_surface;
      contact.normal = ConstraintDirection::through(surface1, surface2, normal, one, two);
      contact.law = contact_law(request, i, one, two);
      for (int axis = 0; axis < 3; ++axis) {
        const auto k = static_cast<std::size_t>(axis);
        const Vector3 direction = contact.law.frame.col(axis);
        contact.across[k] = ConstraintDirection::through(surface1, surface2, direction, one, two);
        contact.across[k + 3] = ConstraintDirection::about(direction, one, two);
      }
      contact.warm = contact.law.frame.transpose() * vector_at(request.contact_warm_impulse(), i);
    }
    // what arrives in this step rubs for a part of it alone
    std::vector<double> shares;
    find_displacing_friction(
        request, contacts_.size(), [](std::size_t i) { return i; },
        [&](std::size_t i, int end) -> const SolverBody& {
          return bodies_[end == 0 ? contacts_[i].body1 : contacts_[i].body2];
        },
        &shares);
    for (std::size_t i = 0; i < contacts_.size(); ++i) contacts_[i].displacing = shares[i];
  }

  // solution->displacement: what rows on velocity alone make of it before, the whole after.
  plain::Ending solve_pose(const stage::SolverSolveRequest& request, Host& host, SolverSolution* solution) {
    pose_.clear();
    place_.clear();
    for (std::size_t i = 0; i < 3 * joints_.size(); ++i) {
      const Joint& joint = joints_[i / 3];
      plain::Row row{joint.body1, joint.body2, joint.directions[i % 3]};
      row.law = pose_law(joint.axes[i % 3], joint.beta, request.time_step());
      row.multiplier = within(row.law, request.discrepancy_warm_correction()[i]);
      if (row.law.is_active() && pose_.add(row, bodies_)) place_.push_back(&solution->joint_correction[i]);
    }
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
      plain::Row row{contacts_[i].body1, contacts_[i].body2, contacts_[i].normal};
      row.law.has_lower = true;
      row.law.lower_target = contacts_[i].depth;
      row.multiplier = within(row.law, request.contact_warm_correction()[i]);
      if (pose_.add(row, bodies_)) place_.push_back(&solution->contact_correction[i]);
    }
    const plain::Ending ending =
        plain::solve(bodies_, iterations_, &pose_, &solution->displacement, [&] { host.mark_progress(); });
    for (std::size_t row = 0; row < place_.size(); ++row) *place_[row] = pose_.rows[row].multiplier;
    return ending;
  }

  // solution->velocity: v* before, v' after.
  plain::Ending solve_velocity(const stage::SolverSolveRequest& request, Host& host, SolverSolution* solution) {
    const BodyMotion& moved = solution->displacement;
    velocity_.clear();
    place_.clear();
    for (std::size_t i = 0; i < 3 * joints_.size(); ++i) {
      const Joint& joint = joints_[i / 3];
      solution->joint_impulse[i] = 0.0;
      plain::Row row{joint.body1, joint.body2, joint.directions[i % 3]};
      const JointAxisState& axis = joint.axes[i % 3];
      const double error = axis.error_at_trial + row.direction.along(moved[joint.body1], moved[joint.body2]);
      row.law = velocity_law(axis, error, joint.slop, request.time_step());
      row.displaces = row.law.is_velocity_only || row.law.gamma > 0.0 ? 1.0 : 0.0;
      row.multiplier = within(row.law, request.discrepancy_warm_impulse()[i]);
      if (row.law.is_active() && velocity_.add(row, bodies_)) place_.push_back(&solution->joint_impulse[i]);
    }
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
      Contact& contact = contacts_[i];
      const double gap = contact.normal.along(moved[contact.body1], moved[contact.body2]) - contact.depth;
      contact.first = velocity_.rows.size();
      // what the pose change presses together is closed, however far its sweeps came
      if (gap <= contact.slop || solution->contact_correction[i] > 0.0) add_contact(contact);
      contact.end = velocity_.rows.size();
    }
    const plain::Ending ending =
        plain::solve(bodies_, iterations_, &velocity_, &solution->velocity, [&] { host.mark_progress(); });
    for (std::size_t row = 0; row < place_.size(); ++row) *place_[row] = velocity_.rows[row].multiplier;
    for (std::size_t i = 0; i < contacts_.size(); ++i) store(contacts_[i], i, solution);
    return ending;
  }

  // The normal's row, and those of friction where there is some; none where they push nobody.
  void add_contact(const Contact& contact) {
    const std::size_t normal = velocity_.rows.size();
    plain::Row row{contact.body1, contact.body2, contact.across[0]};
    row.law.has_lower = true;
    row.law.lower_target = contact.law.target;
    row.multiplier = std::max(0.0, contact.warm.x());
    if (!velocity_.add(row, bodies_)) return;
    add_friction(contact, normal, {1, 2}, contact.law.dynamic_friction);
    add_friction(contact, normal, {3}, contact.law.spinning_friction);
    add_friction(contact, normal, {4, 5}, contact.law.rolling_friction);
  }

  void add_friction(const Contact& contact, std::size_t normal, std::initializer_list<std::size_t> across,
                    double coefficient) {
    if (!(coefficient > 0.0)) return;
    plain::Friction friction{normal, velocity_.rows.size(), 0, coefficient, 0.0};
    for (const std::size_t k : across) {
      plain::Row row{contact.body1, contact.body2, contact.across[k]};
      row.displaces = contact.displacing;
      row.multiplier = k < 3 ? contact.warm[static_cast<Eigen::Index>(k)] : 0.0;
      if (!velocity_.add(row, bodies_)) continue;
      // the sum is no less than the largest response of both together
      friction.response += velocity_.rows.back().response;
      ++friction.count;
    }
    if (friction.count > 0) velocity_.frictions.push_back(friction);
  }

  // What the rows of a contact have found, in world axes.
  void store(const Contact& contact, std::size_t i, SolverSolution* solution) const {
    Vector3 impulse = Vector3::Zero(), turning = Vector3::Zero();
    for (std::size_t r = contact.first; r < contact.end; ++r) {
      const plain::Row& row = velocity_.rows[r];
      // rows about an axis have no linear part
      impulse += row.multiplier * row.direction.linear;
      if (row.direction.linear.isZero(0.0)) turning += row.multiplier * row.direction.angular2;
    }
    set_vector(solution->contact_impulse, i, impulse);
    set_vector(solution->contact_turning, i, turning);
    if (contact.first < contact.end) set_vector(solution->contact_direction, i, contact.law.frame.col(0));
  }

  static bool is_near(const BodyMotion& a, const BodyMotion& b) {
    constexpr double kStill = 1e-10;  // of the displacement itself
    for (std::size_t i = 0; i < a.size(); ++i) {
      const double change = (a[i].linear - b[i].linear).norm() + (a[i].angular - b[i].angular).norm();
      if (!(change <= kStill * (a[i].linear.norm() + a[i].angular.norm()))) return false;
    }
    return true;
  }

  // A multiplier of the step before, as far as the law allows it.
  static double within(const JointLaw& law, double multiplier) {
    if (!law.has_lower) multiplier = std::min(multiplier, 0.0);
    if (!law.has_upper) multiplier = std::max(multiplier, 0.0);
    return std::clamp(multiplier, -law.bound, law.bound);
  }

  std::uint32_t iterations_;
  // scratch, filled anew in every call
  SolverBodies bodies_;
  std::vector<Joint> joints_;
  std::vector<Contact> contacts_;
  plain::Problem pose_, velocity_;
  std::vector<double*> place_;  // of the multipliers of the first rows
};

}  // namespace

GRAVITAS_PLUGIN(MyNamePlugin)
