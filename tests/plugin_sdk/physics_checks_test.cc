// Laws of physics in answers: known answers pass, the same made wrong in one place do not, and the place is named.
#include "plugin_sdk/physics_checks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/solver.h"

namespace gravitas {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kH = 0.01;

// The columns of a request; those that are not set are empty.
template <typename Request>
class Columns {
 public:
  std::vector<double>& f64(typename Request::Column column) { return f64_[column]; }
  std::vector<std::uint32_t>& u32(typename Request::Column column) { return u32_[column]; }
  std::vector<std::uint64_t>& u64(typename Request::Column column) { return u64_[column]; }

  // Valid until a column changes.
  Request view() {
    for (std::size_t i = 0; i < Request::kColumnCount; ++i) {
      columns_[i] = {f64_[i].data(), f64_[i].size()};
      if (!u32_[i].empty()) columns_[i] = {u32_[i].data(), u32_[i].size()};
      if (!u64_[i].empty()) columns_[i] = {u64_[i].data(), u64_[i].size()};
    }
    return Request(columns_.data());
  }

 private:
  std::array<std::vector<double>, Request::kColumnCount> f64_;
  std::array<std::vector<std::uint32_t>, Request::kColumnCount> u32_;
  std::array<std::vector<std::uint64_t>, Request::kColumnCount> u64_;
  std::array<gravitas_column, Request::kColumnCount> columns_{};
};

void put(std::vector<double>* column, const Vector3& v) { column->insert(column->end(), {v.x(), v.y(), v.z()}); }
void put(std::vector<double>* column, const Quaternion& q) {
  column->insert(column->end(), {q.w(), q.x(), q.y(), q.z()});
}

// ---- integrator ----------------------------------------------------------------------------------------------------

// Body 0: a ball in free fall. Body 1: a long box that turns and is pushed. Body 2: kinematic. Body 3: the ground.
struct Integration {
  using Request = stage::IntegratorIntegrateRequest;
  Columns<Request> request;
  std::vector<double> position, orientation, linear, angular;

  Integration() {
    request.f64(Request::kTime) = {0.0};
    request.f64(Request::kTimeStep) = {kH};
    request.u32(Request::kWrenchIsConstant) = {1};
    add(kMovable, 2.0, Vector3::Constant(0.5), {Vector3(0, 1, 0), Quaternion::Identity()},
        {Vector3(1, 2, 3), Vector3(0, 5, 0)}, {Vector3(0, -20, 0), Vector3::Zero()});
    add(kMovable, 1.0, Vector3(0.2, 1.0, 1.1), {Vector3(5, 5, 5), exp_rotation(Vector3(0.3, 0.2, -0.1))},
        {Vector3(-1, 0, 2), Vector3(1, 2, -1)}, {Vector3(3, 0, 0), Vector3(0.5, 0, 1)});
    add(kKinematic, 0.0, Vector3::Zero(), {Vector3(-3, 0, 0), Quaternion::Identity()},
        {Vector3(0, 1, 0), Vector3(0, 0, 2)}, {});
    add(0, 0.0, Vector3::Zero(), {}, {}, {});
  }

  void add(std::uint32_t flags, double mass, const Vector3& inertia, const Pose& pose, const Twist& twist,
           const Wrench& wrench) {
    request.u32(Request::kFlags).push_back(flags);
    request.f64(Request::kInverseMass).push_back(mass > 0.0 ? 1.0 / mass : 0.0);
    put(&request.f64(Request::kInertia), inertia);
    put(&request.f64(Request::kInverseInertia), mass > 0.0 ? Vector3(inertia.cwiseInverse()) : Vector3::Zero());
    request.f64(Request::kDamping).push_back(0.0);
    put(&request.f64(Request::kWrench), wrench.force);
    put(&request.f64(Request::kWrench), wrench.torque);
    put(&request.f64(Request::kPosition), pose.position);
    put(&request.f64(Request::kOrientation), pose.orientation);
    put(&request.f64(Request::kLinearVelocity), twist.linear);
    put(&request.f64(Request::kAngularVelocity), twist.angular);
  }

  // The pose moves with a velocity between the old (0) and the new one (1).
  void solve(double theta) {
    position.clear(), orientation.clear(), linear.clear(), angular.clear();
    const Request r = request.view();
    for (std::size_t i = 0; i < r.flags().size(); ++i) {
      const Pose from{vector_at(r.position(), i), quaternion_at(r.orientation(), i)};
      const Twist start{vector_at(r.linear_velocity(), i), vector_at(r.angular_velocity(), i)};
      Twist end = start;
      if ((r.flags()[i] & kMovable) != 0) {
        end.linear += kH * r.inverse_mass()[i] * vector_at(r.wrench(), 2 * i);
        end.angular += kH * angular_acceleration(from.orientation, start.angular, vector_at(r.inertia(), i),
                                                 vector_at(r.inverse_inertia(), i), vector_at(r.wrench(), 2 * i + 1));
      }
      const Pose to = displaced(from, kH * ((1 - theta) * start.linear + theta * end.linear),
                                kH * ((1 - theta) * start.angular + theta * end.angular));
      put(&position, to.position), put(&orientation, to.orientation);
      put(&linear, end.linear), put(&angular, end.angular);
    }
  }

  std::string check(const WrenchRange& wrenches = {}) {
    return check_integration(request.view(), {position, orientation, linear, angular}, wrenches);
  }
};

TEST(CheckIntegration, PassesMethodsOfEveryTheta) {
  Integration step;
  for (const double theta : {0.0, 0.5, 1.0}) {
    step.solve(theta);
    EXPECT_THAT(step.check(), IsEmpty()) << theta;
  }
}

TEST(CheckIntegration, PassesExactDamping) {
  Integration step;
  step.request.f64(Integration::Request::kDamping) = {20.0, 20.0, 0.0, 0.0};
  step.solve(0.0);
  for (std::size_t i = 0; i < 6; ++i) step.linear[i] *= std::exp(-0.2), step.angular[i] *= std::exp(-0.2);
  EXPECT_THAT(step.check(), IsEmpty());
  for (std::size_t i = 0; i < 6; ++i) step.linear[i] *= 0.5;
  EXPECT_THAT(step.check(), HasSubstr("linear_velocity of body 0"));
}

TEST(CheckIntegration, FindsEveryRowThatIsFlippedScaledOrZero) {
  const std::function<double(double)> faults[] = {[](double x) { return -x; }, [](double x) { return 1000 * x; },
                                                  [](double x) { return 1.1 * x; }, [](double) { return 0.0; }};
  Integration step;
  const auto expect_found = [&](std::vector<double>* column, std::size_t components, std::size_t rows,
                                const std::string& name) {
    for (std::size_t row = 0; row < rows; ++row) {
      for (const auto& fault : faults) {
        const std::vector<double> right = *column;
        for (std::size_t k = 0; k < components; ++k)
          (*column)[components * row + k] = fault(right[components * row + k]);
        EXPECT_THAT(step.check(), HasSubstr(name + " of body " + std::to_string(row))) << name << row;
        *column = right;
      }
    }
  };
  step.solve(1.0);
  expect_found(&step.position, 3, 3, "position");
  expect_found(&step.linear, 3, 3, "linear_velocity");
  step.angular[7] = 1e-3;  // of the kinematic body
  EXPECT_THAT(step.check(), HasSubstr("angular_velocity of body 2"));
  step.solve(1.0);
  expect_found(&step.angular, 3, 2, "angular_velocity");
  for (std::size_t i = 4; i < 8; ++i) step.orientation[i] = -step.orientation[i];
  EXPECT_THAT(step.check(), HasSubstr("orientation of body 1"));
}

TEST(CheckIntegration, AllowsForWrenchesThatChange) {
  Integration step;
  step.request.u32(Integration::Request::kWrenchIsConstant) = {0};
  step.solve(0.0);
  EXPECT_THAT(step.check(), IsEmpty());
  WrenchRange told;
  std::vector<double> wrench = step.request.f64(Integration::Request::kWrench);
  told.add(wrench);
  EXPECT_THAT(step.check(told), IsEmpty());
  step.linear[3] += 1.0;
  EXPECT_THAT(step.check(), IsEmpty()) << "nothing is known of the forces";
  EXPECT_THAT(step.check(told), HasSubstr("linear_velocity of body 1"));
  wrench[6] += 100.0;  // 100 m/s^2 for 0.01 s
  told.add(wrench);
  EXPECT_EQ(told.force_spread(1), 100.0);
  EXPECT_EQ(told.torque_spread(1), 0.0);
  EXPECT_THAT(step.check(told), IsEmpty());
  step.linear[3] += 3.0;
  EXPECT_THAT(step.check(told), HasSubstr("linear_velocity of body 1"));
}

// ---- space ---------------------------------------------------------------------------------------------------------

struct PairSearch {
  using Request = stage::SpacePairsRequest;
  Columns<Request> request;
  PairCheck pairs;

  // Cubes of edge 1 in a row, each reaching into the next, above a ground without bounds.
  explicit PairSearch(std::uint32_t count) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    for (std::uint32_t i = 0; i <= count; ++i) {
      const bool is_ground = i == count;
      request.u32(Request::kFlags).push_back(kHasShape | (is_ground ? kUnbounded : kMovable));
      put(&request.f64(Request::kLower), is_ground ? Vector3::Constant(-kInfinity) : Vector3(0.9 * i, 0, 0));
      put(&request.f64(Request::kUpper), is_ground ? Vector3(kInfinity, 0.1, kInfinity) : Vector3(0.9 * i + 1, 1, 1));
      request.u64(Request::kFilterGroup).push_back(1);
      request.u64(Request::kFilterMask).push_back(1);
    }
  }
  std::string check(const std::vector<std::uint32_t>& pair) { return pairs.check(request.view(), pair); }
};

TEST(CheckPairs, PassesAllOfThemAndNothingElse) {
  PairSearch search(3);
  EXPECT_THAT(search.check({0, 1, 0, 3, 1, 2, 1, 3, 2, 3}), IsEmpty());
  EXPECT_THAT(search.check({0, 1, 0, 3, 1, 3, 2, 3}), HasSubstr("4 pairs are there, 5 have overlapping bounds"));
  EXPECT_THAT(search.check({}), HasSubstr("0 pairs are there, 5"));
  EXPECT_THAT(search.check({0, 1, 0, 2, 0, 3, 1, 2, 1, 3, 2, 3}), HasSubstr("pair (0, 2) is there"));
  search.request.u64(PairSearch::Request::kFilterMask)[1] = 2;
  EXPECT_THAT(search.check({0, 3, 2, 3}), IsEmpty());
  EXPECT_THAT(search.check({0, 1, 0, 3}), HasSubstr("pair (0, 1) is there"));
}

// ---- collision -----------------------------------------------------------------------------------------------------

struct Manifolds {
  using Request = stage::CollisionManifoldsRequest;
  Columns<Request> request;
  std::vector<std::uint32_t> pair;
  std::vector<double> normal, point, depth, relative;

  // Shapes 0: ball of radius 0.5, 1: box of half extents (0.5, 0.25, 0.5), 2: ground.
  explicit Manifolds(const std::vector<std::pair<std::uint32_t, Vector3>>& bodies) {
    request.f64(Request::kMargin) = {0.01};
    request.u64(Request::kShapeType) = {type_id("Sphere"), type_id("Box"), type_id("Halfspace")};
    request.u32(Request::kShapeParameterBegin) = {0, 1, 4, 4};
    request.f64(Request::kShapeParameter) = {0.5, 0.5, 0.25, 0.5};
    for (const auto& [shape, position] : bodies) {
      request.u32(Request::kBodyShape).push_back(shape);
      put(&request.f64(Request::kGeometryPosition), Vector3::Zero());
      put(&request.f64(Request::kGeometryOrientation), Quaternion::Identity());
      put(&request.f64(Request::kPosition), position);
      put(&request.f64(Request::kOrientation), Quaternion::Identity());
      put(&request.f64(Request::kLinearVelocity), Vector3(0, shape == 2 ? 0.0 : -1.0, 0));
      put(&request.f64(Request::kAngularVelocity), Vector3::Zero());
    }
    request.u32(Request::kPair) = {0, 1};
  }
  void add(const Vector3& n, const Vector3& p, double d, const Vector3& v) {
    pair.push_back(0), depth.push_back(d);
    put(&normal, n), put(&point, p), put(&relative, v);
  }
  std::string check() { return check_contacts(request.view(), {pair, normal, point, depth, relative}); }
};

// A ball 0.02 m in the ground.
Manifolds ball_in_ground() {
  Manifolds m({{0, Vector3(3, 0.48, 0)}, {2, Vector3::Zero()}});
  m.add(-Vector3::UnitY(), Vector3(3, -0.01, 0), 0.02, Vector3(0, 1, 0));
  return m;
}

// A box 0.02 m in the ground, all four corners reported.
Manifolds box_in_ground() {
  Manifolds m({{1, Vector3(0, 0.23, 0)}, {2, Vector3::Zero()}});
  for (const double x : {-0.5, 0.5})
    for (const double z : {-0.5, 0.5}) m.add(-Vector3::UnitY(), Vector3(x, -0.01, z), 0.02, Vector3(0, 1, 0));
  return m;
}

TEST(CheckContacts, PassesKnownContacts) {
  EXPECT_THAT(ball_in_ground().check(), IsEmpty());
  EXPECT_THAT(box_in_ground().check(), IsEmpty());
}

TEST(CheckContacts, FindsPointsDepthsNormalsAndVelocitiesThatAreWrong) {
  for (const auto& make : {ball_in_ground, box_in_ground}) {
    Manifolds m = make();
    m.point[1] = -m.point[1];
    EXPECT_THAT(m.check(), HasSubstr("point or depth of contact 0"));
    m = make(), m.point[0] *= 1000;
    EXPECT_THAT(m.check(), HasSubstr("point or depth of contact 0"));
    m = make(), m.depth[0] = -m.depth[0];
    EXPECT_THAT(m.check(), HasSubstr("point or depth of contact 0"));
    m = make(), m.normal[1] = 1.0;
    EXPECT_THAT(m.check(), HasSubstr("contact 0"));
    m = make(), m.relative[1] = -1.0;
    EXPECT_THAT(m.check(), HasSubstr("relative_velocity of contact 0"));
  }
}

TEST(CheckContacts, FindsContactsThatAreMissing) {
  Manifolds m = ball_in_ground();
  m.pair.clear();
  EXPECT_THAT(m.check(), HasSubstr("has no contact"));
  m = box_in_ground();
  m.pair.pop_back();
  EXPECT_THAT(m.check(), HasSubstr("3 contacts where 4 corners"));
  m.pair.clear();
  EXPECT_THAT(m.check(), HasSubstr("has no contact"));
  m = box_in_ground();
  m.add(-Vector3::UnitY(), Vector3(0.5, -0.01, 0.5), 0.02, Vector3(0, 1, 0));
  EXPECT_THAT(m.check(), HasSubstr("contacts 3 and 4 of a pair are at the same point"));
  Manifolds apart({{0, Vector3(0, 0.52, 0)}, {2, Vector3::Zero()}});
  EXPECT_THAT(apart.check(), IsEmpty()) << "beyond the margin";
  Manifolds balls({{0, Vector3::Zero()}, {0, Vector3(0.9, 0, 0)}});
  EXPECT_THAT(balls.check(), HasSubstr("overlaps by 0.1 m"));
  Manifolds boxes({{1, Vector3::Zero()}, {1, Vector3(0.3, 0.4, 0.2)}});
  EXPECT_THAT(boxes.check(), HasSubstr("overlaps by 0.1 m"));
}

// The two surface points would lie on each other's body: what only the normal tells at no depth.
TEST(CheckContacts, FindsAFlippedNormalWhereNothingOverlaps) {
  Manifolds m({{1, Vector3::Zero()}, {1, Vector3(0.3, 0.5, 0.2)}});
  for (const double x : {-0.2, 0.5})
    for (const double z : {-0.3, 0.5}) m.add(Vector3::UnitY(), Vector3(x, 0.25, z), 0.0, Vector3::Zero());
  EXPECT_THAT(m.check(), IsEmpty());
  m.normal[1] = -1.0;
  EXPECT_THAT(m.check(), HasSubstr("normal of contact 0"));
}

// ---- solver --------------------------------------------------------------------------------------------------------

// A box of 2 kg on the ground, stopped at one of its corners and held there from turning, hangs on the world by a ball joint at another.
struct Solution {
  using Request = stage::SolverSolveRequest;
  Columns<Request> request;
  std::vector<double> linear{0, 0, 0, 0, 0, 0}, angular{0, 0, 0, 0, 0, 0}, change = std::vector<double>(12, 0.0);
  std::vector<double> joint_impulse{0.1, -0.2, 0.05}, joint_correction{1e-3, 2e-3, 0};
  std::vector<double> impulse{0.05, 1.0, 0.0}, correction{2e-3}, direction{0, 1, 0}, turning{0.01, -0.02, 0.015};
  StopReason reason = StopReason::kConverged;
  SolutionCheck solution_check;

  Vector3 point{0.5, 0.0, 0.2}, anchor{-0.5, 1.0, 0.0}, inertia{0.2, 0.3, 0.4};
  Twist before{Vector3(0.1, -1, 0), Vector3(0, 0, 0.1)};

  explicit Solution(double theta = 1.0) {
    request.f64(Request::kTimeStep) = {kH};
    request.f64(Request::kTheta) = {theta};
    request.u32(Request::kFlags) = {kHasShape, kHasShape | kMovable};
    request.f64(Request::kInverseMass) = {0.0, 0.5};
    request.f64(Request::kInverseInertia) = {0, 0, 0};
    put(&request.f64(Request::kInverseInertia), inertia.cwiseInverse());
    for (const auto column : {Request::kPosition, Request::kTrialPosition}) request.f64(column) = {0, 0, 0, 0, 0.5, 0};
    for (const auto column : {Request::kOrientation, Request::kTrialOrientation})
      request.f64(column) = {1, 0, 0, 0, 1, 0, 0, 0};
    for (const auto column : {Request::kLinearVelocity, Request::kTrialLinearVelocity}) {
      request.f64(column) = {0, 0, 0};
      put(&request.f64(column), before.linear);
    }
    for (const auto column : {Request::kAngularVelocity, Request::kTrialAngularVelocity}) {
      request.f64(column) = {0, 0, 0};
      put(&request.f64(column), before.angular);
    }
    request.u32(Request::kDiscrepancyBody) = {kNone, 1};
    const Discrepancy d;
    put(&request.f64(Request::kPoint1), anchor), put(&request.f64(Request::kPoint2), anchor);
    put(&request.f64(Request::kVelocity), d.velocity), put(&request.f64(Request::kAxes), d.axes);
    request.f64(Request::kCorrection) = {1.0};
    request.u32(Request::kMode) = {d.modes};
    for (const auto column : {Request::kLower, Request::kUpper, Request::kCompliance, Request::kDamping})
      request.f64(column) = {0, 0, 0};
    put(&request.f64(Request::kMaximumForce), d.maximum_force);
    request.f64(Request::kRestitution) = {0.0};
    request.u32(Request::kContactBody) = {0, 1};
    request.f64(Request::kContactNormal) = {0, 1, 0};
    put(&request.f64(Request::kContactPoint), point);
    request.f64(Request::kContactDepth) = {0.01};
    request.u64(Request::kContactKey) = {7};
    request.f64(Request::kContactMaterial) = {0.5, 0.5, 0.5, 0.05, 0.05, 0};
    request.f64(Request::kContactWarmImpulse) = {0, 1, 0};
    solve(theta);
    close_joint();
  }

  void set(std::vector<double>* column, const Vector3& v, std::size_t row) { set_vector(*column, row, v); }

  // What the multipliers do.
  void solve(double theta) {
    const Vector3 lambda = vector_at(impulse, 0), mu = correction[0] * Vector3::UnitY();
    const Vector3 friction = theta * kH * Vector3(impulse[0], 0, impulse[2]);
    const Vector3 joint = vector_at(joint_impulse, 0), held = vector_at(joint_correction, 0);
    const Vector3 couple = vector_at(turning, 0);
    // to the body's own surface
    const Vector3 surface = point - 0.5 * request.f64(Request::kContactDepth)[0] * Vector3::UnitY();
    const Vector3 arm = surface - Vector3(0, 0.5, 0), joint_arm = anchor - Vector3(0, 0.5, 0);
    set(&linear, before.linear + 0.5 * (lambda + joint), 1);
    set(&angular, before.angular + (arm.cross(lambda) + couple + joint_arm.cross(joint)).cwiseQuotient(inertia), 1);
    set(&change, 0.5 * (mu + friction + held), 2);
    set(&change, (arm.cross(mu + friction) + theta * kH * couple + joint_arm.cross(held)).cwiseQuotient(inertia), 3);
  }

  // The joint is open in the trial state by as much as the pose change closes, and was closed when the step began.
  void close_joint() {
    const Quaternion turn = exp_rotation(vector_at(change, 3));
    const Vector3 position = Vector3(0, 0.5, 0) + vector_at(change, 2);
    set(&request.f64(Request::kPoint1), position + turn * (anchor - Vector3(0, 0.5, 0)), 0);
    set(&request.f64(Request::kPosition), position, 1);
    for (std::size_t k = 0; k < 4; ++k)
      request.f64(Request::kOrientation)[4 + k] = k == 0 ? turn.w() : turn.vec()[static_cast<Eigen::Index>(k) - 1];
  }

  std::string check() {
    return solution_check.check(request.view(), {linear, angular, change, joint_impulse, joint_correction, impulse,
                                                 correction, direction, turning, static_cast<std::uint32_t>(reason)});
  }
};

TEST(CheckSolution, PassesWhatItsMultipliersDo) {
  for (const double theta : {0.0, 0.5, 1.0}) EXPECT_THAT(Solution(theta).check(), IsEmpty()) << theta;
}

TEST(CheckSolution, FindsMomentumThatComesFromNowhere) {
  Solution s;
  s.linear[3] += 1e-3;
  EXPECT_THAT(s.check(), HasSubstr("linear_velocity of body 1"));
  s = Solution(), s.angular[4] = -s.angular[4] + 0.5;
  EXPECT_THAT(s.check(), HasSubstr("angular_velocity of body 1"));
  for (std::vector<double> Solution::*column : {&Solution::impulse, &Solution::joint_impulse}) {
    for (const double factor : {-1.0, 0.0, 1000.0}) {
      Solution wrong;
      for (double& number : wrong.*column) number *= factor;
      EXPECT_THAT(wrong.check(), HasSubstr("linear_velocity of body 1")) << factor;
    }
  }
}

TEST(CheckSolution, FindsFrictionOfTurningThatIsNotTold) {
  for (const double factor : {-1.0, 0.0, 1000.0}) {
    Solution wrong;
    for (double& number : wrong.turning) number *= factor;
    EXPECT_THAT(wrong.check(), HasSubstr("angular_velocity of body 1")) << factor;
  }
}

TEST(CheckSolution, FindsDisplacementsThatComeFromNowhere) {
  for (std::vector<double> Solution::*column :
       {&Solution::correction, &Solution::joint_correction, &Solution::change}) {
    for (const double factor : {-1.0, 0.0, 1000.0}) {
      Solution wrong;
      for (double& number : wrong.*column) number *= factor;
      EXPECT_THAT(wrong.check(), HasSubstr("pose_change of body 1")) << factor;
    }
  }
}

// A turn settles when what it moves at the radius of gyration, 0.37 m, does: coordinates of 1.6 m have rounding of 3e-16 m.
TEST(CheckSolution, AllowsATurnByWhatRoundingMoves) {
  Solution s;
  s.impulse = s.turning = s.joint_impulse = s.joint_correction = {0, 0, 0};
  s.correction = {0};
  s.solve(1.0);
  s.close_joint();
  s.change[11] = 1.5e-15;
  EXPECT_THAT(s.check(), IsEmpty());
  s.change[11] = 1e-13;
  EXPECT_THAT(s.check(), HasSubstr("pose_change of body 1"));
}

TEST(CheckSolution, FindsEnergyThatComesFromNowhere) {
  Solution s;
  s.impulse = {0.0, 8.0, 0.0};  // it comes with 1 m/s and would leave with 3
  s.solve(1.0);
  EXPECT_THAT(s.check(), HasSubstr("kinetic energy grows"));
  s.request.f64(Solution::Request::kVelocity) = {0.1, 0, 0};
  s.reason = StopReason::kIterations;
  EXPECT_THAT(s.check(), IsEmpty()) << "something drives";
}

TEST(CheckSolution, FindsAnImpulseThatPushesWhatIsSeparating) {
  Solution s;
  s.joint_impulse = {0, 0, 0};
  s.impulse = {0.0, 3.0, 0.0};
  s.request.f64(Solution::Request::kVelocity) = {0.1, 0, 0};  // no bound on energy
  s.request.f64(Solution::Request::kContactMaterial)[kRestitution] = 0.0;
  s.solve(1.0);
  s.close_joint();
  EXPECT_THAT(s.check(), HasSubstr("contact_impulse of row 0"));
  s.request.f64(Solution::Request::kContactMaterial)[kRestitution] = 1.0;
  s.impulse = {0.0, 1.5, 0.0};
  s.solve(1.0);
  s.close_joint();
  EXPECT_THAT(s.check(), IsEmpty());
}

// What stops to rounding beside a body that flies at 10 m/s.
TEST(CheckSolution, AllowsWhatSeparatesByRoundingOfTheFastest) {
  using Request = Solution::Request;
  Solution s;
  s.joint_impulse = s.turning = {0, 0, 0};
  s.before = {Vector3(0, -1e-9, 0), Vector3::Zero()};
  for (const auto column : {Request::kLinearVelocity, Request::kTrialLinearVelocity}) {
    std::vector<double>& v = s.request.f64(column);
    v = {0, 0, 0, 0, -1e-9, 0, 10, 0, 0};
  }
  s.impulse = {0, 1e-10, 0};
  s.request.f64(Request::kAngularVelocity) = s.request.f64(Request::kTrialAngularVelocity) =
      std::vector<double>(9, 0.0);
  s.request.f64(Request::kContactMaterial)[kRestitution] = 0.0;
  s.request.u32(Request::kFlags).push_back(kMovable);
  s.request.f64(Request::kInverseMass).push_back(1.0);
  for (const auto column : {Request::kInverseInertia, Request::kPosition, Request::kTrialPosition})
    put(&s.request.f64(column), Vector3(1, 1, 1));
  for (const auto column : {Request::kOrientation, Request::kTrialOrientation})
    put(&s.request.f64(column), Quaternion::Identity());
  s.linear = {0, 0, 0, 0, 0, 0, 10, 0, 0}, s.angular.assign(9, 0.0), s.change.assign(18, 0.0);
  const auto leaves_at = [&](double speed) {
    // the impulse that turns and lifts the corner so that it goes at this speed
    const double depth = s.request.f64(Solution::Request::kContactDepth)[0];
    const Vector3 n = Vector3::UnitY(), arm = s.point - 0.5 * depth * n - Vector3(0, 0.5, 0);
    const double response = 0.5 + n.dot(arm.cross(n).cwiseQuotient(s.inertia).cross(arm));
    s.impulse = {0, (speed + 1e-9) / response, 0};
    s.solve(1.0);
    s.close_joint();
    return s.check();
  };
  EXPECT_THAT(leaves_at(5e-12), IsEmpty());
  EXPECT_THAT(leaves_at(5e-11), HasSubstr("contact_impulse of row 0"));
}

// Its multipliers and its pose change are of one mind, and do to the joint what they should not.
TEST(CheckSolution, FindsAJointThatIsLeftOpen) {
  for (const double factor : {-1.0, 0.0, 0.5, 2.0, 1000.0}) {
    SCOPED_TRACE(factor);
    Solution s;
    // no bound on what the contact corrects, at the same surface
    s.request.f64(Solution::Request::kContactDepth) = {10.0};
    s.point.y() += 0.5 * (10.0 - 0.01);
    for (int k = 0; k < 3; ++k)
      s.request.f64(Solution::Request::kContactPoint)[static_cast<std::size_t>(k)] = s.point[k];
    for (double& number : s.joint_correction) number *= factor;
    s.solve(1.0);
    EXPECT_THAT(s.check(), HasSubstr("pose_change leaves row 0 of the joints open"));
    s.reason = StopReason::kIterations;
    EXPECT_THAT(s.check(), IsEmpty()) << "it does not say that it is done";
    s.reason = StopReason::kContradiction;
    EXPECT_THAT(s.check(), IsEmpty()) << "it says that joints cannot be closed";
  }
}

// What it was open when the step began may be left, all of it or a share.
TEST(CheckSolution, AllowsAJointToCloseSlowly) {
  for (const double open : {1e-3, -1e-3}) {
    for (const double share : {0.0, 0.5, 1.0, 1.5}) {
      Solution s;
      const Vector3 ahead(open, 0, 0);
      // the joint was open by `ahead` when the step began, and is by a share of it at its end
      const Vector3 closed = vector_at(s.request.f64(Solution::Request::kPoint1), 0);
      s.set(&s.request.f64(Solution::Request::kPoint1), closed - share * ahead, 0);
      const Vector3 position = vector_at(s.request.f64(Solution::Request::kPosition), 1);
      s.set(&s.request.f64(Solution::Request::kPosition), position + (1.0 - share) * ahead, 1);
      if (share <= 1.0) {
        EXPECT_THAT(s.check(), IsEmpty()) << open << ' ' << share;
      } else {
        EXPECT_THAT(s.check(), HasSubstr("pose_change leaves row 0")) << open;
      }
    }
  }
}

TEST(CheckSolution, FindsACorrectionBeyondTheOverlap) {
  Solution s;
  s.request.f64(Solution::Request::kContactDepth) = {1e-4};
  EXPECT_THAT(s.check(), HasSubstr("contact_correction of row 0 moves apart"));
  s.reason = StopReason::kIterations;
  EXPECT_THAT(s.check(), IsEmpty()) << "it does not say that it is done";
}

}  // namespace
}  // namespace gravitas
