#include "plugin_sdk/force_jacobians.h"

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/column_vector.h"

namespace gravitas {
namespace {

constexpr double kStep = 1e-6;

ColumnVector<double> numbers_of(std::span<const double> column) { return {column.begin(), column.end()}; }

template <typename T>
gravitas_reply_column room_of(ColumnVector<T>& numbers) {
  return {numbers.data(), numbers.size(), 0};
}

struct Wrenches {
  ColumnVector<double> wrench, impulse, potential;
  ColumnVector<std::uint32_t> flags;
};

// The bodies of a request, moved.
class MovedBodies {
 public:
  explicit MovedBodies(const stage::ForceWrenchesRequest& request)
      : request_(request),
        position_(numbers_of(request.position())),
        orientation_(numbers_of(request.orientation())),
        linear_velocity_(numbers_of(request.linear_velocity())),
        angular_velocity_(numbers_of(request.angular_velocity())) {}

  // Moves number `k` of each body's twelve by its step times `sign`; one number at a time.
  void move(std::size_t k, double sign) {
    for (std::size_t i = 0; i < request_.mass().size(); ++i) {
      if (is_turn(k)) {
        const Quaternion q = quaternion_at(request_.orientation(), i);
        const Vector3 turn = sign * kStep * Vector3::Unit(static_cast<Eigen::Index>(k % 3));
        set_quaternion(orientation_, i, displaced({Vector3::Zero(), q}, Vector3::Zero(), turn).orientation);
      } else {
        const std::size_t at = 3 * i + k % 3;
        moved(k)[at] = start(k)[at] + sign * step(k, i);
      }
    }
  }
  void put_back(std::size_t k) { std::ranges::copy(start(k), moved(k).begin()); }
  // Of a body's number: the difference of the two moved states, as it is in rounded numbers.
  double width(std::size_t k, std::size_t body) const {
    if (is_turn(k)) return 2.0 * kStep;
    const double at = start(k)[3 * body + k % 3], by = step(k, body);
    return (at + by) - (at - by);
  }

  Wrenches wrenches(ForcePlugin& force, Host& host) const {
    using Request = stage::ForceWrenchesRequest;
    std::array<gravitas_column, Request::kColumnCount> columns;
    std::copy_n(request_.plain(), columns.size(), columns.begin());
    columns[Request::kPosition].data = position_.data(), columns[Request::kOrientation].data = orientation_.data();
    columns[Request::kLinearVelocity].data = linear_velocity_.data();
    columns[Request::kAngularVelocity].data = angular_velocity_.data();
    const std::size_t rows = request_.application().size() / 2;
    Wrenches answer;
    answer.wrench.resize(6 * rows), answer.impulse.resize(6 * rows);
    answer.potential.resize(rows), answer.flags.resize(rows);
    std::array<gravitas_reply_column, stage::ForceWrenchesReply::kColumnCount> rooms = {
        room_of(answer.wrench), room_of(answer.impulse), room_of(answer.potential), room_of(answer.flags)};
    force.wrenches(Request(columns.data()), stage::ForceWrenchesReply(rooms.data()), host);
    return answer;
  }

 private:
  static bool is_turn(std::size_t k) { return k / 3 == 1; }
  std::span<const double> start(std::size_t k) const {
    const std::span<const double> all[] = {request_.position(), request_.orientation(), request_.linear_velocity(),
                                           request_.angular_velocity()};
    return all[k / 3];
  }
  ColumnVector<double>& moved(std::size_t k) {
    ColumnVector<double>* const all[] = {&position_, &orientation_, &linear_velocity_, &angular_velocity_};
    return *all[k / 3];
  }
  double step(std::size_t k, std::size_t body) const {
    const double size = vector_at(start(k), body).norm();
    return kStep * (k < 3 ? 1.0 + 1e-3 * size : std::max(1.0, size));
  }

  const stage::ForceWrenchesRequest& request_;
  ColumnVector<double> position_, orientation_, linear_velocity_, angular_velocity_;
};

}  // namespace

void push_block(const stage::ForceJacobiansReply& reply, std::uint32_t body, std::uint32_t by,
                const JacobianBlock& block) {
  if (!block.allFinite())
    throw Refusal("the Jacobian of the wrench on body " + std::to_string(body) +
                  " is not finite: the force's properties or a body's mass or state are not, or too large");
  reply.block_body().push(body, by);
  for (Eigen::Index row = 0; row < block.rows(); ++row)
    for (Eigen::Index column = 0; column < block.cols(); ++column) reply.block().push(block(row, column));
}

void difference_own_states(ForcePlugin& force, const stage::ForceWrenchesRequest& request,
                           const stage::ForceJacobiansReply& reply, Host& host) {
  MovedBodies bodies(request);
  const ColumnVector<std::uint32_t> flags = bodies.wrenches(force, host).flags;
  std::vector<JacobianBlock> blocks(flags.size(), JacobianBlock::Zero());
  for (std::size_t k = 0; k < 12; ++k) {
    bodies.move(k, 1.0);
    const Wrenches after = bodies.wrenches(force, host);
    bodies.move(k, -1.0);
    const Wrenches before = bodies.wrenches(force, host);
    bodies.put_back(k);
    for (std::size_t i = 0; i < blocks.size(); ++i)
      for (std::size_t row = 0; row < 6; ++row)
        blocks[i](static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(k)) =
            (after.wrench[6 * i + row] - before.wrench[6 * i + row]) /
            bodies.width(k, request.application()[2 * i + 1]);
  }
  for (std::size_t i = 0; i < blocks.size(); ++i)
    if ((flags[i] & kConstantWrench) == 0)
      push_block(reply, request.application()[2 * i + 1], request.application()[2 * i + 1], blocks[i]);
}

}  // namespace gravitas
