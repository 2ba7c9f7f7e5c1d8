#include "services/run/figures.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "plugin_sdk/counted.h"
#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/property_value.h"
#include "plugin_sdk/solver.h"

namespace gravitas {
namespace {

// Joints that are open by more than this share of what they hold together hold it no more.
constexpr double kTorn = 0.01;
// Overlaps at the start, as a share of the smaller radius of gyration, that are worth a word.
constexpr double kOverlap = 0.02;
// Ways of a step, of what the scene measures: nobody means that.
constexpr double kRunaway = 1e6;
// Calls of plugins in a step that take seconds.
constexpr std::uint64_t kManyCalls = 100'000;

void write_change(const Vector3& initial, const Vector3& final_value, report::v1::VectorChange* change) {
  for (int k = 0; k < 3; ++k) {
    change->add_initial(initial[k]);
    change->add_final(final_value[k]);
  }
}

// Numbers of a property among the flattened ones, or nothing if the type has no such property.
std::optional<std::vector<double>> property_of(const TypeDeclaration& type, const std::vector<double>& numbers,
                                               const std::string& name) {
  std::span<const double> rest = numbers;
  for (const Property& property : type.properties) {
    const std::span<const double> own = rest.first(flat_size_of(property, rest));
    if (property.name == name) return std::vector<double>(own.begin(), own.end());
    rest = rest.subspan(own.size());
  }
  return std::nullopt;
}

}  // namespace

Figures::Figures(const kernel::EnvironmentDescription& description) : description_(description) { find_drives(); }

// A drive is a joint whose type has an angular speed and an axis of two points, as AngularMotor and Revolute do, or a rolling
// one, as Axle does, or a speed about either bar of a cross, as Universal does; or a direction and a speed, as Slider does.
void Figures::find_drives() {
  for (std::uint32_t i = 0; i < description_.constraints.size(); ++i) {
    const kernel::ConstraintDescription& joint = description_.constraints[i];
    const auto in_body = [&](std::uint32_t body, std::size_t end, const Vector3& axis) {
      const Quaternion q = joint.bound_at  ? joint.bound_at->at(end).orientation
                           : body == kNone ? Quaternion::Identity()
                                           : description_.bodies[body].pose.orientation;
      return Vector3(q.conjugate() * axis.normalized());
    };
    const auto add = [&](const Vector3& axis, double speed, bool slides) {
      drives_.push_back({i, in_body(joint.body1, 0, axis), speed, slides});
    };
    for (const TypeDeclaration& type : description_.constraint.plugins[joint.plugin].declaration.types) {
      if (type.name != joint.type) continue;
      const auto find = [&](const char* name) { return property_of(type, joint.parameters, name); };
      const auto point1 = find("BindAxisPoint1"), point2 = find("BindAxisPoint2"), angular_speed = find("AngularSpeed");
      const auto steering = find("SteeringAxis"), rolling = find("RollingAxis");
      const bool turns = angular_speed && !std::isnan((*angular_speed)[0]);
      if (turns && point1 && point2) add(vector_at(*point2, 0) - vector_at(*point1, 0), (*angular_speed)[0], false);
      if (turns && steering && rolling) {
        add(vector_at(*steering, 0), (*angular_speed)[0], false);
        drives_.back().rolling_in_body2 = in_body(joint.body2, 1, vector_at(*rolling, 0));
      }
      const auto bar1 = find("Axis1"), bar2 = find("Axis2");
      for (const bool is_first : {true, false}) {
        const auto about_bar = find(is_first ? "AngularSpeed1" : "AngularSpeed2");
        if (!bar1 || !bar2 || !about_bar || std::isnan((*about_bar)[0])) continue;
        add(vector_at(*bar1, 0), (*about_bar)[0], false);
        drives_.back().rolling_in_body2 = in_body(joint.body2, 1, vector_at(*bar2, 0));
        drives_.back().is_of_first = is_first;
      }
      const auto axis = find("Axis"), speed = find("Speed");
      if (axis && speed && !std::isnan((*speed)[0])) add(vector_at(*axis, 0), (*speed)[0], true);
    }
  }
}

double Figures::drive_speed(const Drive& drive, const kernel::StateView& state) const {
  const kernel::ConstraintDescription& joint = description_.constraints[drive.constraint];
  const std::uint32_t one = joint.body1, two = joint.body2;
  const auto of = [](std::uint32_t body, std::span<const double> column) {
    return body == kNone ? Vector3(Vector3::Zero()) : Vector3(vector_at(column, body));
  };
  const auto turned = [&](std::uint32_t body, const Vector3& axis) {
    return body == kNone ? axis : Vector3(quaternion_at(state.orientation, body) * axis);
  };
  const Vector3 axis = turned(one, drive.axis_in_body1);
  const Vector3 turning = of(two, state.angular_velocity) - of(one, state.angular_velocity);
  if (drive.rolling_in_body2) {
    // what it turns by about the other axis is none about this
    const Vector3 other = turned(two, *drive.rolling_in_body2), normal = axis.cross(other);
    return (drive.is_of_first ? other.cross(normal) : normal.cross(axis)).dot(turning) / normal.squaredNorm();
  }
  if (!drive.slides) return axis.dot(turning);
  // both turn alike, the one that is the world not at all
  const Vector3 arm = one == kNone || two == kNone ? Vector3(Vector3::Zero())
                                                   : Vector3(of(two, state.position) - of(one, state.position));
  return axis.dot(of(two, state.linear_velocity) - of(one, state.linear_velocity) -
                  of(one, state.angular_velocity).cross(arm));
}

Figures::Totals Figures::totals(kernel::Environment* environment) const {
  Totals sum;
  const kernel::StateView state = environment->state();
  const kernel::Model& model = environment->model();
  for (std::uint32_t i = 0; i < model.body_count; ++i) {
    if ((model.flags[i] & kMovable) == 0) continue;
    const Pose pose{vector_at(state.position, i), quaternion_at(state.orientation, i)};
    const Twist twist{vector_at(state.linear_velocity, i), vector_at(state.angular_velocity, i)};
    const Vector3 inertia = vector_at(model.inertia.span(), i);
    sum.kinetic += kinetic_energy(model.mass[i], inertia, pose.orientation, twist);
    if (const double speed = twist.linear.norm(); !(speed <= sum.speed)) sum.speed = speed, sum.fastest = i;
    sum.linear += model.mass[i] * twist.linear;
    sum.angular += angular_momentum(model.mass[i], inertia, pose, twist);
  }
  sum.potential = environment->potential_energy();
  return sum;
}

// Of the bodies with joints, and of all.
void Figures::measure(kernel::Environment* environment) {
  const kernel::StateView state = environment->state();
  const kernel::Model& model = environment->model();
  // from end to end of the centres, or the diameter of gyration of the largest
  struct Extent {
    Eigen::AlignedBox3d centres;
    double gyration = 0.0;
    double size() const { return centres.isEmpty() ? 0.0 : std::max(centres.diagonal().norm(), 2.0 * gyration); }
  } joined, all;
  const auto add = [&](std::uint32_t body, Extent* to) {
    if (body == kNone) return;
    to->centres.extend(vector_at(state.position, body));
    if (model.mass[body] > 0.0)
      to->gyration =
          std::max(to->gyration, std::sqrt(vector_at(model.inertia.span(), body).maxCoeff() / model.mass[body]));
  };
  for (const kernel::ConstraintDescription& joint : description_.constraints)
    for (const std::uint32_t body : {joint.body1, joint.body2}) add(body, &joined);
  for (std::uint32_t body = 0; body < model.body_count; ++body) add(body, &all);
  joined_size_ = joined.size(), scene_size_ = all.size();
}

// What contacts of the first inner step say of the poses that it begins with.
void Figures::find_overlaps(const kernel::InnerStep& inner) {
  const kernel::StepData& data = inner.data;
  const auto size = [&](std::uint32_t body) {
    const kernel::BodyDescription& of = description_.bodies[body];
    return of.mass > 0.0 ? std::sqrt(of.inertia.maxCoeff() / of.mass) : HUGE_VAL;
  };
  std::uint32_t last_one = kNone, last_two = kNone;
  std::size_t pairs = 0;
  for (std::size_t i = 0; i < data.contact_depth.size(); ++i) {
    const std::uint32_t one = data.contact_body[2 * i], two = data.contact_body[2 * i + 1];
    const double depth = inner.start_overlap(i, description_.bodies[one].bound, description_.bodies[two].bound, true);
    if (!(depth > kOverlap * std::min(size(one), size(two)))) continue;
    if (one != last_one || two != last_two) ++pairs;
    last_one = one, last_two = two;
    if (depth > overlap_.depth) overlap_ = {description_.bodies[one].id, description_.bodies[two].id, depth, 0};
  }
  overlap_.others = pairs > 0 ? pairs - 1 : 0;
}

void Figures::look_at(const kernel::InnerStep& inner) {
  if (is_at_start_ && inner.number == 0) find_overlaps(inner);
  is_at_start_ = false;
  contradicts_ = contradicts_ || tells_contradiction(static_cast<StopReason>(inner.data.stop_reason[0]));
}

Figures::Effort Figures::largest_effort() const {
  return calls_ > effort_.calls ? Effort{calls_, steps_ + 1} : effort_;
}

void Figures::follow(kernel::Environment* environment) {
  effort_ = largest_effort(), calls_ = 0;
  for (Drive& drive : drives_) drive.speed = drive_speed(drive, environment->state());
  last_.reset();
  last_ = totals(environment);
  steps_ = environment->step_count();
  is_at_start_ = steps_ == 0;
  if (!initial_) {
    reference_energy_ = (initial_ = last_)->energy();
    measure(environment);
  }
  largest_kinetic_ = std::max(largest_kinetic_, last_->kinetic);
  const double deviation = std::fabs(last_->energy() - reference_energy_);
  largest_deviation_ = std::max(largest_deviation_, std::isfinite(deviation) ? deviation : HUGE_VAL);
  penetration_ = std::max(penetration_, environment->figures().penetration);
  joint_error_ = std::max(joint_error_, environment->figures().joint_error);
  if (!opening_step_ && joined_size_ > 0.0 && joint_error_ > kTorn * joined_size_)
    opening_step_ = environment->step_count();
  if (const double way = environment->time_step() * last_->speed;
      !runaway_ && scene_size_ > 0.0 && way > kRunaway * scene_size_)
    runaway_ = Runaway{environment->step_count(), description_.bodies[last_->fastest].id, way,
                       environment->step_count() == 0 || environment->step_count() + 1 == edited_step_};
}

void Figures::begin_again(kernel::Environment* environment) {
  last_.reset();
  drives_.clear();
  find_drives();
  measure(environment);
  edited_step_ = environment->step_count() + 1;
  reference_energy_ = totals(environment).energy();
  follow(environment);
}

void Figures::write(report::v1::Report* report) const {
  const double scale = std::max(std::fabs(reference_energy_), largest_kinetic_);
  Totals unknown;
  unknown.potential = std::numeric_limits<double>::quiet_NaN();
  unknown.linear = unknown.angular = Vector3::Constant(unknown.potential);
  const Totals initial = initial_.value_or(unknown), last = last_.value_or(unknown);
  report->mutable_energy()->set_initial(initial.energy());
  report->mutable_energy()->set_final(last.energy());
  report->mutable_energy()->set_max_relative_drift(scale > 0.0 ? largest_deviation_ / scale : 0.0);
  write_change(initial.linear, last.linear, report->mutable_linear_momentum());
  write_change(initial.angular, last.angular, report->mutable_angular_momentum());
  report->set_max_penetration(penetration_);
  report->set_max_joint_error(joint_error_);
  const auto overflows = [](const std::optional<Totals>& one) { return one && !std::isfinite(one->energy()); };
  if (overflows(initial_) || overflows(last_))
    report->add_warnings("energies are not finite: speeds are so large that their squares overflow");
  if (overlap_.depth > 0.0)
    report->add_warnings(fmt::format(
        "at the start bodies \"{}\" and \"{}\" overlap by {:.3g} m{}: contacts push them apart in the first steps",
        overlap_.one, overlap_.two, overlap_.depth,
        overlap_.others == 0 ? "" : ", and " + counted(overlap_.others, "more pair")));
  if (opening_step_)
    report->add_warnings(fmt::format(
        "joints came open by up to {:.3g} m, by more than {:.0f} % of what they hold together ({:.3g} m) from step {} "
        "on: {}",
        joint_error_, 100.0 * kTorn, joined_size_, *opening_step_,
        runaway_ && !runaway_->is_given ? "a body runs away"
        : contradicts_ ? "they, or limits or drives, ask for what no motion gives, and get a compromise"
        : *opening_step_ == edited_step_
            ? "the edit before that step left apart what they hold"
            : "TimeStep is too long for this scene, or the solver leaves its joints unfinished"));
  if (runaway_)
    report->add_warnings(fmt::format(
        "body \"{}\" {} {:.3g} m in step {}, over a million times what the scene measures ({:.3g} m): {}",
        runaway_->body, runaway_->is_given ? "goes" : "went", runaway_->way,
        runaway_->step + (runaway_->is_given ? 1 : 0), scene_size_,
        runaway_->is_given ? "that is the speed which it was given"
                           : "it runs away, as where TimeStep is too long for the forces and the integrator"));
  if (const std::string why = why_dear(); !why.empty()) report->add_warnings(why);
  for (const Drive& drive : drives_) {
    const auto write_drive = [&](auto* message) {
      message->set_constraint(description_.constraints[drive.constraint].id);
      message->set_target(drive.target);
      message->set_speed(drive.speed);
    };
    if (drive.slides)
      write_drive(report->add_sliding_drives());
    else
      write_drive(report->add_drives());
  }
}

std::string Figures::why_dear() const {
  const Effort most = largest_effort();
  if (most.calls <= kManyCalls) return {};
  return fmt::format(
      "step {} {} {} calls of plugins: the scene is stiff for its integrator, impacts follow each other closely, or "
      "Accuracy is small; where springs, or light bodies between joints, are stiff, an implicit integrator (Radau, "
      "Rosenbrock) takes long steps",
      most.step, most.step > steps_ ? "was not ended after" : "took", most.calls);
}

void Figures::write(recorder::v1::Tally* tally) const {
  tally->set_largest_kinetic_energy(largest_kinetic_);
  tally->set_largest_energy_deviation(largest_deviation_);
  tally->set_penetration(penetration_);
  tally->set_joint_error(joint_error_);
  tally->set_most_calls(effort_.calls);
  tally->set_most_calls_step(effort_.step);
  if (overlap_.depth > 0.0) {
    recorder::v1::Overlap* overlap = tally->mutable_overlap();
    overlap->set_one(overlap_.one);
    overlap->set_two(overlap_.two);
    overlap->set_depth(overlap_.depth);
    overlap->set_others(static_cast<std::uint32_t>(overlap_.others));
  }
  if (!initial_) return;
  tally->set_initial_energy(initial_->energy());
  tally->clear_initial_momenta();
  for (const Vector3& momentum : {initial_->linear, initial_->angular})
    tally->mutable_initial_momenta()->Add(momentum.begin(), momentum.end());
  tally->set_reference_energy(reference_energy_);
}

void Figures::resume(const recorder::v1::Tally& tally, bool was_edited) {
  largest_kinetic_ = tally.largest_kinetic_energy();
  largest_deviation_ = tally.largest_energy_deviation();
  penetration_ = tally.penetration();
  joint_error_ = tally.joint_error();
  effort_ = {tally.most_calls(), tally.most_calls_step()};
  overlap_ = {tally.overlap().one(), tally.overlap().two(), tally.overlap().depth(), tally.overlap().others()};
  if (was_edited) {
    runaway_.reset();
    opening_step_.reset();
  }
  if (tally.initial_momenta_size() != 6) return;
  const double* momenta = tally.initial_momenta().data();
  initial_ = Totals{0.0, tally.initial_energy(), Vector3(momenta[0], momenta[1], momenta[2]),
                    Vector3(momenta[3], momenta[4], momenta[5])};
  reference_energy_ = tally.reference_energy();
}

}  // namespace gravitas
