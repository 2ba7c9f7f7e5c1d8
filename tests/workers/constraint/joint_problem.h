// Two bodies with one joint, for the tests of joints: bound at the start, described in any state.
#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <string_view>
#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/dynamics.h"
#include "tests/workers/plugin_fixture.h"

namespace gravitas::test {

struct JointedBody {
  Pose pose = {};
  Twist twist = {};
};

class JointProblem {
 public:
  static constexpr double kMass = 2.0, kInertia = 0.5;  // of either body
  std::vector<JointedBody> bodies = std::vector<JointedBody>(2);
  // kNone is the world.
  std::vector<std::uint32_t> ends = {0, 1};
  bool is_intact = true;
  bool is_kept = false;  // bound anew after an edit
  double time = 0.0;

  JointProblem(PluginUnderTest* plugin, std::string_view type) : plugin_(plugin), type_(type) {}

  MessageColumns bind_request(const std::vector<double>& properties) const {
    MessageColumns request = PluginUnderTest::request_of(stage::Method::kConstraintBind);
    request.u64("constraint_type") = {type_id(type_)};
    request.u32("constraint_body") = ends;
    request.u32("constraint_kept") = {is_kept ? 1U : 0U};
    request.u32("parameter_begin") = {0, static_cast<std::uint32_t>(properties.size())};
    request.f64("parameter") = properties;
    add_poses(&request);
    return request;
  }

  // Binds at the present poses.
  void bind(const std::vector<double>& properties) {
    const MessageColumns reply = plugin_->ask(stage::Method::kConstraintBind, bind_request(properties));
    bound_begin_ = reply.u32("bound_begin");
    bound_ = reply.f64("bound");
  }

  // The discrepancies in the present state.
  std::vector<Discrepancy> describe() const {
    MessageColumns request = PluginUnderTest::request_of(stage::Method::kConstraintDiscrepancies);
    request.f64("time") = {time};
    request.f64("time_step") = {0.01};
    request.f64("start_time") = {time - 0.01};
    request.u64("constraint_type") = {type_id(type_)};
    request.u32("constraint_body") = ends;
    request.u32("bound_begin") = bound_begin_;
    request.f64("bound") = bound_;
    request.u32("intact") = {is_intact ? 1U : 0U};
    add_poses(&request);
    for (const JointedBody& body : bodies) {
      append(&request.f64("linear_velocity"), body.twist.linear);
      append(&request.f64("angular_velocity"), body.twist.angular);
      append(&request.f64("start_angular_velocity"), body.twist.angular);
      request.f64("inverse_mass").push_back(1.0 / kMass);
      append(&request.f64("inverse_inertia"), Vector3::Constant(1.0 / kInertia));
    }
    const MessageColumns reply = plugin_->ask(stage::Method::kConstraintDiscrepancies, request);
    const DiscrepancyColumns columns = discrepancy_columns(reply);
    std::vector<Discrepancy> discrepancies;
    for (std::size_t i = 0; i < columns.size(); ++i) discrepancies.push_back(columns.at(i));
    return discrepancies;
  }

  // The row along an axis, for the joint's two ends.
  JacobianRow row(const Discrepancy& d, const Vector3& axis) const {
    return jacobian_row(d, axis, end(0).pose.position, end(1).pose.position);
  }
  double row_velocity(const Discrepancy& d, const Vector3& axis) const {
    return row(d, axis).velocity(end(0).twist.linear, end(0).twist.angular, end(1).twist.linear, end(1).twist.angular);
  }
  JointedBody end(std::size_t i) const { return ends[i] == kNone ? JointedBody{} : bodies[ends[i]]; }

  // All rows of the axes that are not free, stacked: twelve columns.
  Eigen::MatrixXd jacobian(const std::vector<Discrepancy>& discrepancies) const {
    Eigen::MatrixXd stacked(0, 12);
    for (const Discrepancy& d : discrepancies) {
      const Matrix3 axes = d.axes.toRotationMatrix();
      for (int k = 0; k < 3; ++k) {
        if (axis_mode(d.modes, k) == AxisMode::kFree) continue;
        const JacobianRow r = row(d, axes.col(k));
        stacked.conservativeResize(stacked.rows() + 1, Eigen::NoChange);
        stacked.bottomRows<1>() << r.linear1.transpose(), r.angular1.transpose(), r.linear2.transpose(),
            r.angular2.transpose();
      }
    }
    return stacked;
  }

 private:
  static void append(std::vector<double>* column, const Vector3& v) {
    column->insert(column->end(), {v.x(), v.y(), v.z()});
  }
  void add_poses(MessageColumns* request) const {
    for (const JointedBody& body : bodies) {
      append(&request->f64("position"), body.pose.position);
      const Quaternion& q = body.pose.orientation;
      std::vector<double>& orientation = request->f64("orientation");
      orientation.insert(orientation.end(), {q.w(), q.x(), q.y(), q.z()});
    }
  }

  PluginUnderTest* plugin_;
  std::string_view type_;
  std::vector<std::uint32_t> bound_begin_;
  std::vector<double> bound_;
};

// Rank of rows of size one to ten: what rounding leaves of a dependent row is below 1e-12 of them.
inline long rank(const Eigen::MatrixXd& rows) {
  Eigen::JacobiSVD<Eigen::MatrixXd> svd(rows);
  svd.setThreshold(1e-12);
  return svd.rank();
}

}  // namespace gravitas::test
