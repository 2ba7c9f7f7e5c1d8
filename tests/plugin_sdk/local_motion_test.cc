// The equations of an inner step, their Jacobian, and systems with it, against differences and dense matrices.
#include "plugin_sdk/local_motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <limits>
#include <vector>

#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/interaction_groups.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/shifted_jacobian.h"
#include "tests/plugin_sdk/integrator_call.h"

namespace gravitas {
namespace {

using conformance::Draw;
using test::Source;
using test::Step;

constexpr Eigen::Index kNumbers = LocalMotion::kNumbers;
const Vector3 kArm(0.3, -0.2, 0.5);  // of the spring, in the bodies' axes

// A spring with a damper between points of the first two bodies; the third one is alone, in air.
std::vector<double> wrenches_in(const TrialColumns& trial) {
  std::vector<Wrench> acts(3);
  Vector3 point[2], speed[2], arm[2];
  for (std::size_t i = 0; i < 2; ++i) {
    const BodyState body = trial.at(i);
    arm[i] = body.pose.orientation * kArm;
    point[i] = body.pose.position + arm[i];
    speed[i] = body.twist.linear + body.twist.angular.cross(arm[i]);
  }
  const Vector3 apart = point[1] - point[0], along = apart.normalized();
  const Vector3 force = (40.0 * (apart.norm() - 1.0) + 3.0 * along.dot(speed[1] - speed[0])) * along;
  acts[0] = {force, arm[0].cross(force)};
  acts[1] = {-force, -arm[1].cross(force)};
  const Twist alone = trial.at(2).twist;
  acts[2] = {-0.7 * alone.linear.norm() * alone.linear, -0.4 * alone.angular};
  std::vector<double> numbers;
  for (const Wrench& wrench : acts) {
    numbers.insert(numbers.end(), wrench.force.begin(), wrench.force.end());
    numbers.insert(numbers.end(), wrench.torque.begin(), wrench.torque.end());
  }
  return numbers;
}

BodyState moved(const BodyState& body, const Eigen::Matrix<double, kNumbers, 1>& by) {
  return {displaced(body.pose, by.segment<3>(0), by.segment<3>(3)),
          {body.twist.linear + by.segment<3>(6), body.twist.angular + by.segment<3>(9)}};
}

// d(wrench of `body`)/d(state of `by`), by central differences.
JacobianBlock slope(const TrialColumns& trial, std::size_t body, std::size_t by) {
  constexpr double kMoved = 1e-5;
  JacobianBlock block;
  for (Eigen::Index k = 0; k < kNumbers; ++k) {
    std::vector<double> at[2];
    for (const int side : {0, 1}) {
      TrialColumns there = trial;
      there.set(by, moved(trial.at(by), (side == 0 ? -kMoved : kMoved) * Eigen::Matrix<double, kNumbers, 1>::Unit(k)));
      at[side] = wrenches_in(there);
    }
    for (Eigen::Index i = 0; i < 6; ++i) {
      const std::size_t number = 6 * body + static_cast<std::size_t>(i);
      block(i, k) = (at[1][number] - at[0][number]) / (2.0 * kMoved);
    }
  }
  return block;
}

// The three bodies in the hands of an integrator; its forces have a Jacobian or not.
class Mechanism {
 public:
  explicit Mechanism(bool has_jacobian, double damping = 0.0, double position = 0.0)
      : step_({kMovable, kMovable, kMovable}),
        source_([this](const gravitas_column* columns, gravitas_reply_column* to) {
          return answer(stage::IntegratorDerivativeRequest(columns), stage::IntegratorDerivativeReply(to));
        }) {
    step_.constant[0] = 0;
    step_.jacobian_blocks[0] = has_jacobian ? 5 : 0;
    step_.damping.assign(3, damping);
    for (std::size_t i = 0; i < 3; ++i) step_.state.position[3 * i] += position;
    fix_eigen_blocks();
    motion.begin(request_, &derivatives_);
  }

  Eigen::VectorXd rates(const Eigen::VectorXd& y, double elapsed = 0.0) {
    Eigen::VectorXd f;
    EXPECT_TRUE(motion.evaluate(elapsed, y, &f));
    return f;
  }
  void differentiate() { motion.differentiate(rates(motion.start())); }
  // df/dy in whole, by central differences.
  Eigen::MatrixXd slopes() {
    constexpr double kMoved = 1e-5;
    const Eigen::VectorXd y = motion.start();
    Eigen::MatrixXd all(y.size(), y.size());
    for (Eigen::Index k = 0; k < y.size(); ++k) {
      const Eigen::VectorXd by = kMoved * Eigen::VectorXd::Unit(y.size(), k);
      all.col(k) = (rates(y + by) - rates(y - by)) / (2.0 * kMoved);
    }
    return all;
  }
  // J in whole, of what the motion has of it.
  Eigen::MatrixXd jacobian() const {
    const Eigen::Index size = motion.start().size();
    Eigen::MatrixXd all = Eigen::MatrixXd::Zero(size, size);
    for (const LocalMotion::Group& group : motion.groups()) {
      for (std::size_t i = 0; i < group.body.size(); ++i) {
        const auto row = kNumbers * static_cast<Eigen::Index>(group.body[i]);
        all.block<3, 3>(row + 3, row + 3) = 0.5 * skew(group.spin[i]);
        all.block<6, 6>(row, row + 6).setIdentity();
        for (std::size_t j = 0; j < group.body.size(); ++j)
          all.block<6, kNumbers>(row + 6, kNumbers * static_cast<Eigen::Index>(group.body[j])) =
              group.accelerations.block<6, kNumbers>(6 * static_cast<Eigen::Index>(i),
                                                     kNumbers * static_cast<Eigen::Index>(j));
      }
    }
    return all;
  }

  LocalMotion motion;
  TrialColumns asked;  // last
  double time = 0.0;

 private:
  std::int32_t answer(const stage::IntegratorDerivativeRequest& question,
                      const stage::IntegratorDerivativeReply& reply) {
    asked.position.assign(question.position().begin(), question.position().end());
    asked.orientation.assign(question.orientation().begin(), question.orientation().end());
    asked.linear_velocity.assign(question.linear_velocity().begin(), question.linear_velocity().end());
    asked.angular_velocity.assign(question.angular_velocity().begin(), question.angular_velocity().end());
    time = question.time();
    for (const double number : wrenches_in(asked)) reply.wrench().push(number);
    if (question.question() != static_cast<std::uint32_t>(DerivativeQuestion::kWithJacobian)) return GRAVITAS_OK;
    for (const auto& [body, by] : {std::pair{0U, 0U}, {0U, 1U}, {1U, 0U}, {1U, 1U}, {2U, 2U}}) {
      reply.jacobian_body().push(body), reply.jacobian_body().push(by);
      const JacobianBlock block = slope(asked, body, by);
      for (Eigen::Index i = 0; i < block.size(); ++i) reply.jacobian().push(block.data()[i]);
    }
    return GRAVITAS_OK;
  }

  Step step_;
  Source source_;
  std::vector<double> room_;
  const Step::Request request_ = step_.request();
  Derivatives derivatives_{request_, source_.host(), &room_};
};

double largest(const Eigen::MatrixXd& matrix) { return matrix.cwiseAbs().maxCoeff(); }

TEST(LocalMotion, HasTheSlopesOfItsRates) {
  for (const auto& [has_jacobian, damping] : {std::pair{false, 0.0}, {true, 0.0}, {false, 20.0}, {true, 20.0}}) {
    Mechanism mechanism(has_jacobian, damping);
    // the third body feels nobody, which differences do not tell
    ASSERT_EQ(mechanism.motion.groups().size(), has_jacobian ? 2U : 1U);
    mechanism.differentiate();
    // one-sided differences of 1e-7 of forces of some 100 N
    EXPECT_LT(largest(mechanism.jacobian() - mechanism.slopes()), has_jacobian ? 1e-7 : 1e-4);
  }
}

// A second time within the step, elsewhere: the forces' Jacobian is asked for again.
TEST(LocalMotion, HasTheSlopesWhereAnInnerStepEnded) {
  Mechanism mechanism(true);
  mechanism.differentiate();
  const Eigen::MatrixXd before = mechanism.jacobian();
  const double h = 0.03;
  mechanism.motion.accept(h, mechanism.motion.start() + h * mechanism.rates(mechanism.motion.start()));
  mechanism.differentiate();
  EXPECT_LT(largest(mechanism.jacobian() - mechanism.slopes()), 1e-7);
  EXPECT_GT(largest(mechanism.jacobian() - before), 0.1);
}

// Of a mechanism that turned as a whole, J has turned with it.
TEST(LocalMotion, TurnsItsJacobianWithTheBodies) {
  Mechanism mechanism(true);
  mechanism.differentiate();
  mechanism.rates(mechanism.motion.start());
  const TrialColumns start = mechanism.asked;
  const Vector3 turn(0.4, -0.9, 0.7);
  const Quaternion by = exp_rotation(turn);
  Eigen::VectorXd y = mechanism.motion.start();
  for (std::size_t i = 0; i < 3; ++i) {
    const BodyState body = start.at(i);
    y.segment<kNumbers>(kNumbers * static_cast<Eigen::Index>(i)) << by * body.pose.position - body.pose.position, turn,
        by * body.twist.linear, by * body.twist.angular;
  }
  const Eigen::MatrixXd before = mechanism.jacobian();
  mechanism.motion.accept(0.02, y);
  mechanism.motion.turn_jacobian();
  const Eigen::MatrixXd turned = mechanism.jacobian();
  mechanism.differentiate();
  EXPECT_LT(largest(turned - mechanism.jacobian()), 1e-7);
  EXPECT_GT(largest(turned - before), 1.0);
}

// The same state at the same time, told around the start of the inner step and around its end.
TEST(LocalMotion, TellsAStateAroundTheEnd) {
  Draw draw(3);
  Mechanism mechanism(false, 4.0);
  const double h = 0.03, later = 0.02;
  const auto some = [&] {
    return Eigen::VectorXd(Eigen::VectorXd::NullaryExpr(mechanism.motion.start().size(),
                                                        [&](Eigen::Index) { return draw.uniform(-0.5, 0.5); }));
  };
  const Eigen::VectorXd end = mechanism.motion.start() + some(), y = mechanism.motion.start() + some();
  mechanism.rates(y, h + later);
  const TrialColumns from_start = mechanism.asked;
  const double time = mechanism.time;
  mechanism.motion.accept(h, end);
  mechanism.rates(mechanism.motion.around_end(later, y), later);
  EXPECT_NEAR(mechanism.time, time, 1e-15);
  for (std::size_t i = 0; i < 3; ++i) {
    const BodyState a = from_start.at(i), b = mechanism.asked.at(i);
    EXPECT_LT((a.pose.position - b.pose.position).norm(), 1e-14);
    EXPECT_LT(log_rotation(shorter_arc(a.pose.orientation * b.pose.orientation.conjugate())).norm(), 1e-14);
    EXPECT_LT((a.twist.linear - b.twist.linear).norm(), 1e-14);
    EXPECT_LT((a.twist.angular - b.twist.angular).norm(), 1e-14);
  }
}

// Told around the start, damping takes of a state what it takes of velocities, whatever else acts.
TEST(LocalMotion, KnowsWhatDampingTakes) {
  constexpr double kDamping = 50.0, kLater = 0.07;
  Mechanism mechanism(false, kDamping);
  const Eigen::VectorXd start = mechanism.motion.start();
  EXPECT_EQ(start.norm(), 0.0);
  constexpr double kMoment = 1e-6;
  Eigen::VectorXd f = mechanism.rates(start, kLater);
  const TrialColumns now = mechanism.asked;
  mechanism.rates(start, kLater + kMoment);
  for (std::size_t i = 0; i < 3; ++i) {
    // of the motion y is told around: x' = v where y' = 0
    const Vector3 speed = (mechanism.asked.at(i).pose.position - now.at(i).pose.position) / kMoment;
    EXPECT_LT((speed - now.at(i).twist.linear).norm(), 1e-3);
    EXPECT_EQ(f.segment<3>(kNumbers * static_cast<Eigen::Index>(i)).norm(), 0.0);
  }
}

TEST(LocalMotion, MeasuresChanges) {
  Mechanism mechanism(false, 0.0, 1e6);
  const LocalMotion& motion = mechanism.motion;
  for (Eigen::Index k = 0; k < motion.start().size(); ++k) {
    Eigen::VectorXd change = Eigen::VectorXd::Zero(motion.start().size());
    change[k] = -0.25;
    const Twist& twist = motion.twist_at_start(static_cast<std::size_t>(k / kNumbers));
    const double speed = k % kNumbers < 6 ? 1.0 : k % kNumbers < 9 ? twist.linear.norm() : twist.angular.norm();
    EXPECT_DOUBLE_EQ(motion.size_of(change), 0.25 / std::max(1.0, speed));
    change[k] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(motion.size_of(change), HUGE_VAL);
  }
  // places are rounded to 1e-10 m there, which makes 1e-7 m/s of a spring that answers within a millisecond
  EXPECT_EQ(motion.rounding(1e-3, 0.0), 0.0);
  EXPECT_GT(motion.rounding(1e-3, 1e3), 5e-8);
  EXPECT_LE(motion.rounding(1e-3, 1e3), 2.3e-7);
  Eigen::VectorXd y = motion.start();
  y.segment<3>(3) = motion.longest() * motion.twist_at_start(0).angular;
  EXPECT_TRUE(motion.is_in_chart(0.0, y));
  y.segment<3>(kNumbers + 3) = Vector3(0, 2.1, 0);
  EXPECT_FALSE(motion.is_in_chart(0.0, y));
}

TEST(ShiftedJacobian, SolvesWhatADenseMatrixSolves) {
  using Complex = std::complex<double>;
  Mechanism mechanism(true);
  mechanism.differentiate();
  const Eigen::MatrixXcd jacobian = mechanism.jacobian().cast<Complex>();
  const Eigen::Index size = jacobian.rows();
  Draw draw(8);
  for (const Complex shift : {Complex(30.0, 0.0), Complex(1e4, 0.0), Complex(27.0, 31.0), Complex(0.3, -2.0)}) {
    ShiftedJacobian shifted;
    shifted.factorise(mechanism.motion, shift.real(), shift.imag());
    const auto some = [&](Eigen::Index) { return draw.uniform(-1.0, 1.0); };
    Eigen::VectorXd real = Eigen::VectorXd::NullaryExpr(size, some);
    Eigen::VectorXd imaginary = Eigen::VectorXd::NullaryExpr(size, some);
    if (shift.imag() == 0.0) imaginary.setZero();
    Eigen::VectorXcd side(size);
    side.real() = real, side.imag() = imaginary;
    const Eigen::VectorXcd right =
        (shift * Eigen::MatrixXcd::Identity(size, size) - jacobian).partialPivLu().solve(side).eval();
    if (shift.imag() == 0.0) {
      shifted.solve(&real);
    } else {
      shifted.solve(&real, &imaginary);
    }
    EXPECT_LT((real - right.real()).norm(), 1e-12 * right.norm()) << shift;
    EXPECT_LT((imaginary - right.imag()).norm(), 1e-12 * right.norm()) << shift;
  }
}

}  // namespace
}  // namespace gravitas
