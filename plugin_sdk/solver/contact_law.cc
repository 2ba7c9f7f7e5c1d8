#include "plugin_sdk/solver/contact_law.h"

#include <algorithm>
#include <cmath>

#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/solver.h"
#include "plugin_sdk/solver/arrival.h"
#include "plugin_sdk/solver/surface_perturbation.h"

namespace gravitas {
namespace {

Matrix3 frame_of(const Vector3& normal) {
  const auto [first, second] = orthonormal_basis(normal);
  Matrix3 frame;
  frame << normal, first, second;
  return frame;
}

}  // namespace

ContactLaw contact_law(const stage::SolverSolveRequest& request, std::size_t i, const SolverBody& one,
                       const SolverBody& two) {
  const double* material = &request.contact_material()[kMaterialColumns * i];
  ContactLaw law;
  law.dynamic_friction = material[kDynamicFriction];
  law.static_friction = std::max(law.dynamic_friction, material[kStaticFriction]);
  law.rolling_friction = material[kRollingFriction];
  law.spinning_friction = material[kSpinningFriction];

  const Vector3 normal = vector_at(request.contact_normal(), i);
  const Vector3 point = vector_at(request.contact_point(), i);
  const auto through = ConstraintDirection::through(point, normal, one, two);
  const double gap_at_trial = -request.contact_depth()[i];
  // a contact that counts as closed though S* leaves a gap arrives no faster than S* says
  const double way = gap_before(gap_at_trial, through, one, two) - std::max(0.0, gap_at_trial);
  const double start = through.along(one.start_velocity, two.start_velocity);
  const double trial = through.along(one.trial_velocity, two.trial_velocity);
  const double speed = arrival_speed(start, trial, way, request.time_step());
  const double restitution = material[kRestitution];
  law.frame = frame_of(normal);
  law.arrival = speed, law.target = restitution * speed;

  const double epsilon = material[kSurfacePerturbation];
  if (!(speed > 0.0) || !(epsilon > 0.0)) return law;
  const Vector3 tilted = perturbed_normal(normal, epsilon, request.contact_key()[i]);
  const auto across = ConstraintDirection::through(point, tilted, one, two);
  const double tilted_start = across.along(one.start_velocity, two.start_velocity);
  const double tilted_trial = across.along(one.trial_velocity, two.trial_velocity);
  const double tilted_speed = arrival_speed(tilted_start, tilted_trial, way, request.time_step());
  const bool keeps_signs = tilted_trial < 0.0 && (tilted_start < 0.0) == (start < 0.0);
  if (!keeps_signs || !(tilted_speed > 0.0) || !(tilted.dot(normal) > 0.0)) return law;
  law.frame = frame_of(tilted);
  law.arrival = tilted_speed, law.target = restitution * tilted_speed;
  return law;
}

void DisplacingFriction::add(std::size_t contact) {
  has_pressed_ = has_pressed_ || !vector_at(request_.contact_warm_impulse(), contact).isZero(0.0);
  if (has_pressed_) return;
  const ContactLaw law = contact_law(request_, contact, one_, two_);
  const auto through = ConstraintDirection::through(vector_at(request_.contact_point(), contact),
                                                    vector_at(request_.contact_normal(), contact), one_, two_);
  arrival_ = std::max(arrival_, law.arrival);
  overlap_ += std::max(0.0, request_.contact_depth()[contact]);
  change_ += law.target + std::max(0.0, -through.along(one_.trial_velocity, two_.trial_velocity));
}

double DisplacingFriction::share() const {
  const auto gained = [](const SolverBody& body) {
    return (body.trial_velocity.linear - body.start_velocity.linear).norm();
  };
  if (has_pressed_ || !(arrival_ > std::max(gained(one_), gained(two_)))) return 1.0;
  const double way = request_.theta() * request_.time_step() * change_;
  return overlap_ < way ? overlap_ / way : 1.0;
}

bool SharedRestitution::goes_on(bool gains, double work) {
  if (!gains) best_ = std::max(best_, share_);
  switch (tried_) {
    case Tried::kNought:
      if (gains) return false;
      at_nought_ = work;
      tried_ = Tried::kHalf, share_ = 0.5;
      return true;
    case Tried::kHalf:
      tried_ = Tried::kRoot, share_ = root(work);
      return true;
    case Tried::kRoot:
      if (!gains) return false;
      tried_ = Tried::kBest, share_ = best_;
      return true;
    case Tried::kBest:
      break;
  }
  return false;
}

// Of the parabola through the three, between nought and one, and a little below.
double SharedRestitution::root(double at_half) const {
  constexpr double kSafely = 1.0 - 1e-10;
  const double c = std::min(0.0, at_nought_);
  const double b = 4.0 * at_half - 3.0 * c - at_one_, a = at_one_ - b - c;
  const double discriminant = std::sqrt(std::max(0.0, b * b - 4.0 * a * c));
  // without cancellation: c <= 0 < a + b + c
  const double root = b >= 0.0 ? -2.0 * c / (b + discriminant) : (discriminant - b) / (2.0 * a);
  return root > 0.0 && root < 1.0 ? kSafely * root : best_;
}

}  // namespace gravitas
