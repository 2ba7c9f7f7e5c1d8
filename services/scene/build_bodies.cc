#include "services/scene/build_bodies.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "plugin_sdk/geometry/mass_properties.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/motion_curve.h"

namespace gravitas::scene {
namespace {

using v1::Body;
using v1::KineticProperties;

constexpr double kUnspecifiedDensity = 1000.0;  // kg/m^3

Vector3 vector_of(const google::protobuf::RepeatedField<double>& numbers) {
  return {numbers[0], numbers[1], numbers[2]};
}

Quaternion quaternion_of(const google::protobuf::RepeatedField<double>& numbers) {
  return {numbers[0], numbers[1], numbers[2], numbers[3]};
}

bool is_identity(const Pose& pose) {
  return pose.position == Vector3::Zero() && pose.orientation.coeffs() == Quaternion::Identity().coeffs();
}

// Mass, moments and the pose X_GB of the centre of mass with principal axes in the geometry's
// frame.
struct Inertia {
  double mass = 0.0;
  Vector3 moments = Vector3::Zero();
  Pose X_GB;
};

class BodyBuilder {
 public:
  BodyBuilder(const Body& body, const BodyReferences& references, BuildContext* context)
      : body_(body), references_(references), context_(*context), diagnostics_(*context->diagnostics) {}

  void build(kernel::BodyDescription* description) {
    description->id = body_.id();
    if (!find_geometry(description) || !find_kind(description)) return;
    const std::optional<Inertia> inertia = is_movable_ ? movable_inertia() : frame_alone();
    if (!inertia.has_value()) return;
    description->mass = inertia->mass;
    description->inertia = inertia->moments;
    set_pose(inertia->X_GB, description);
    set_motion(description);
    set_surface(description);
    set_bound(description);
    set_material(description);
    set_forces(description);
    check_visual();
  }

 private:
  std::string what() const { return "Body \"" + body_.id() + '"'; }
  TextPosition place(int field) const { return place_of(body_, field); }
  bool written(int field) const { return is_written(body_, field); }

  bool find_geometry(kernel::BodyDescription* description) {
    if (body_.geometry_id().empty()) return true;
    description->shape = references_.geometries.find(body_.geometry_id(), "GeometryId",
                                                     place(Body::kGeometryIdFieldNumber), &diagnostics_);
    if (description->shape == kNone) return false;
    solid_ = &references_.solids[description->shape];
    description->flags |= kHasShape;
    // a geometry with errors was reported where it stands
    return solid_->is_good;
  }

  // Movable, kinematic or immovable, and what contradicts itself.
  bool find_kind(kernel::BodyDescription* description) {
    const bool is_unbounded = solid_ != nullptr && solid_->is_unbounded();
    const bool is_immovable = body_.has_immovable() ? body_.immovable() : is_unbounded && !body_.kinematic();
    if (is_immovable && body_.kinematic()) {
      diagnostics_.error(place(Body::kImmovableFieldNumber),
                         what() + " is Immovable and Kinematic; allowed: one of them");
      return false;
    }
    is_movable_ = !is_immovable && !body_.kinematic();
    if (is_movable_ && is_unbounded) {
      diagnostics_.error(place(Body::kImmovableFieldNumber),
                         what() +
                             " has an unbounded geometry and is movable; allowed: Immovable = "
                             "true, or Kinematic = true");
      return false;
    }
    description->flags &= ~static_cast<std::uint32_t>(kMovable);
    if (is_movable_) description->flags |= kMovable;
    if (body_.kinematic()) description->flags |= kKinematic;
    if (is_unbounded) description->flags |= kUnbounded;
    if (is_movable_ && body_.kinetic_properties().can_sleep()) description->flags |= kCanSleep;
    return true;
  }

  // ---- mass
  // --------------------------------------------------------------------------------------------------

  std::nullopt_t refuse(int field, const std::string& text) {
    diagnostics_.error(place(field), what() + ' ' + text);
    return std::nullopt;
  }

  std::optional<Inertia> movable_inertia() {
    const bool has_moments = body_.principal_moments_size() > 0;
    if (body_.has_mass() && body_.mass_density() > 0.0)
      return refuse(Body::kMassFieldNumber, "has Mass and MassDensity; allowed: one of them");
    if (body_.has_mass() && body_.mass() == 0.0)
      return refuse(Body::kMassFieldNumber, "is movable and has Mass 0; allowed: a number > 0, or Immovable = true");
    if (has_moments && !body_.has_mass())
      return refuse(Body::kPrincipalMomentsFieldNumber, "has PrincipalMoments without Mass; allowed: both together");
    for (const int field : {Body::kCentreOfMassFieldNumber, Body::kPrincipalAxesFieldNumber})
      if (written(field) && !has_moments)
        return refuse(field,
                      "has CentreOfMass or PrincipalAxes without PrincipalMoments; allowed: with Mass and "
                      "PrincipalMoments");
    if (has_moments) return declared_inertia();
    if (solid_ == nullptr)
      return refuse(body_.has_mass() ? Body::kMassFieldNumber : Body::kIdFieldNumber,
                    "has no geometry to take its moments from; required: Mass and PrincipalMoments");
    if (!solid_->has_mass())
      return refuse(body_.has_mass() ? Body::kMassFieldNumber : Body::kGeometryIdFieldNumber,
                    "has a geometry whose mass is not known here; required: Mass and PrincipalMoments");
    return inertia_of_solid();
  }

  std::optional<Inertia> inertia_of_solid() {
    double density = body_.mass_density();
    if (!body_.has_mass() && density == 0.0) {
      density = kUnspecifiedDensity;
      diagnostics_.warning(place(Body::kMassDensityFieldNumber),
                           what() +
                               (body_.has_mass_density() ? " has MassDensity 0, which means unspecified"
                                                         : " has neither MassDensity nor Mass") +
                               ": it gets 1000 kg/m^3");
    }
    if (solid_->is_shell() && !body_.has_mass())
      diagnostics_.warning(place(Body::kMassDensityFieldNumber),
                           what() +
                               " has a mesh that is not closed: it counts as a shell, its MassDensity as one of area "
                               "(kg/m^2)");
    MassProperties properties = mass_properties(*solid_->shape, body_.has_mass() ? kUnspecifiedDensity : density);
    if (body_.has_mass()) properties = scaled_to_mass(properties, body_.mass());
    const int field = body_.has_mass() ? Body::kMassFieldNumber : Body::kMassDensityFieldNumber;
    return checked(properties, principal_axes(properties), field);
  }

  // Mass and PrincipalMoments as written.
  std::optional<Inertia> declared_inertia() {
    if (solid_ == nullptr && written(Body::kCentreOfMassFieldNumber) &&
        vector_of(body_.centre_of_mass()) != Vector3::Zero())
      return refuse(Body::kCentreOfMassFieldNumber,
                    "has no geometry, so its Position is the centre of mass; allowed: leave "
                    "CentreOfMass out");
    MassProperties properties;
    properties.mass = body_.mass();
    properties.centre_of_mass = centre_of_mass();
    properties.inertia = vector_of(body_.principal_moments()).asDiagonal();
    PrincipalAxes axes;
    axes.moments = vector_of(body_.principal_moments());
    if (body_.principal_axes_size() > 0) axes.orientation = quaternion_of(body_.principal_axes());
    return checked(properties, axes, Body::kPrincipalMomentsFieldNumber);
  }

  std::optional<Inertia> checked(const MassProperties& properties, const PrincipalAxes& axes, int field) {
    std::string why;
    if (!validate(properties, &why)) return refuse(field, "has a mass that no solid can have: " + why);
    const bool is_light = !std::isfinite(1.0 / properties.mass);
    if (is_light || !std::isfinite(1.0 / axes.moments.minCoeff()))
      return refuse(is_light && body_.has_mass() ? Body::kMassFieldNumber : field,
                    "has " +
                        (is_light ? "a mass of " + number_text(properties.mass) + " kg"
                                  : "a moment of " + number_text(axes.moments.minCoeff()) + " kg m^2") +
                        ", whose inverse overflows; allowed: from 1e-307 on");
    return Inertia{properties.mass, axes.moments, {properties.centre_of_mass, axes.orientation}};
  }

  // The one written, else that of the shape.
  Vector3 centre_of_mass() const {
    if (body_.centre_of_mass_size() > 0) return vector_of(body_.centre_of_mass());
    const bool is_known = solid_ != nullptr && solid_->has_mass();
    return is_known ? mass_properties(*solid_->shape, kUnspecifiedDensity).centre_of_mass : Vector3::Zero();
  }

  // Of a body that nothing pushes: the frame counts, the mass does not.
  std::optional<Inertia> frame_alone() const {
    Inertia inertia;
    if (solid_ != nullptr) inertia.X_GB.position = centre_of_mass();
    return inertia;
  }

  // ---- the rest
  // ----------------------------------------------------------------------------------------------

  void set_pose(const Pose& X_GB, kernel::BodyDescription* description) {
    const KineticProperties& kinetic = body_.kinetic_properties();
    const Pose X_WG{vector_of(kinetic.position()), quaternion_of(kinetic.orientation())};
    // a body whose frames coincide keeps the numbers of the scene
    const bool coincide = is_identity(X_GB);
    description->pose = coincide ? X_WG : compose(X_WG, X_GB);
    description->geometry = coincide ? Pose{} : inverse(X_GB);
    description->twist = {vector_of(kinetic.linear_velocity()), vector_of(kinetic.angular_velocity())};
    // of an immovable one it goes without saying: the seed's sample writes it
    if (is_movable_) {
      description->damping = kinetic.damping_coefficient();
    } else if (body_.kinematic() && kinetic.damping_coefficient() != 0.0) {
      diagnostics_.warning(place_of(kinetic, KineticProperties::kDampingCoefficientFieldNumber),
                           what() + " is kinematic: its DampingCoefficient does nothing and is dropped");
    }
    const bool moves = description->twist.linear != Vector3::Zero() || description->twist.angular != Vector3::Zero();
    if (is_movable_ || body_.kinematic() || !moves) return;
    description->twist = {};
    const bool is_linear = is_written(kinetic, KineticProperties::kLinearVelocityFieldNumber);
    diagnostics_.warning(place_of(kinetic, is_linear ? KineticProperties::kLinearVelocityFieldNumber
                                                     : KineticProperties::kAngularVelocityFieldNumber),
                         what() + " is immovable: its velocities are dropped (a body that keeps them is Kinematic)");
  }

  // Pose and velocities that are given beside a Motion are those that it starts with, to 1e-6.
  void demand_start(const MotionCurve::State& start, const kernel::BodyDescription& given) {
    constexpr double kSame = 1e-6;
    const KineticProperties& kinetic = body_.kinetic_properties();
    const auto demand = [&](int field, double off, double size) {
      if (!is_written(kinetic, field) || off <= kSame * (1.0 + size)) return;
      diagnostics_.error(place_of(kinetic, field), what() +
                                                       " starts where its Motion is at time 0, and as fast; allowed: "
                                                       "leave out pose and velocities, or give these");
    };
    const double turned = log_rotation(given.pose.orientation * start.pose.orientation.conjugate()).norm();
    demand(KineticProperties::kPositionFieldNumber, (given.pose.position - start.pose.position).norm(),
           start.pose.position.norm());
    demand(KineticProperties::kOrientationFieldNumber, turned, 0.0);
    demand(KineticProperties::kLinearVelocityFieldNumber, (given.twist.linear - start.twist.linear).norm(),
           start.twist.linear.norm());
    demand(KineticProperties::kAngularVelocityFieldNumber, (given.twist.angular - start.twist.angular).norm(),
           start.twist.angular.norm());
  }

  // The body starts where its Motion has it, with the velocities there.
  void set_motion(kernel::BodyDescription* description) {
    const int field = Body::kMotionFieldNumber;
    if (!written(field)) return;
    if (!body_.kinematic()) {
      refuse(field, "has a Motion and is not kinematic; required: Kinematic = true");
      return;
    }
    std::vector<PropertyProblem> problems;
    const bool is_table = flatten_motion(from_message(body_.motion()), &description->motion.rows, &problems);
    diagnostics_.add(problems, place(field), what() + ": ");
    if (!is_table) return;
    const std::string problem = MotionCurve::find_problem(description->motion);
    if (!problem.empty()) {
      refuse(field, "has a Motion that cannot be followed: " + problem);
      return;
    }
    const MotionCurve::State start = MotionCurve(description->motion, description->geometry).at(0.0);
    demand_start(start, *description);
    description->pose = start.pose;
    description->twist = start.twist;
  }

  // What runs along the surface is a velocity that the pose does not follow: that of a Motion, if only one that stays.
  void set_surface(kernel::BodyDescription* description) {
    const Vector3 velocity = vector_of(body_.surface_velocity());
    if (velocity.isZero(0.0)) return;
    const int field = Body::kSurfaceVelocityFieldNumber;
    if (solid_ == nullptr) {
      refuse(field, "has a SurfaceVelocity and no surface; required: GeometryId");
      return;
    }
    if (is_movable_ || (body_.kinematic() && !written(Body::kMotionFieldNumber))) {
      refuse(field, "has a SurfaceVelocity and moves by itself; required: Immovable = true, or a Motion");
      return;
    }
    kernel::BodyDescription& body = *description;
    if (body.motion.empty()) {
      const Pose X_WG = compose(body.pose, body.geometry);
      const Vector3& x = X_WG.position;
      const Quaternion& q = X_WG.orientation;
      body.motion.rows = {0.0, x.x(), x.y(), x.z(), q.w(), q.x(), q.y(), q.z()};
      body.flags |= kKinematic;
    }
    body.motion.surface = velocity;
    body.twist = MotionCurve(body.motion, body.geometry).at(0.0).twist;
  }

  static bool flatten_motion(const PropertyValue& given, std::vector<double>* out,
                             std::vector<PropertyProblem>* problems) {
    using Kind = PropertyValue::Kind;
    const auto refuse = [&](const PropertyValue& value, const std::string& what) {
      problems->push_back({value.position, what + " is " + shown(value) +
                                               "; allowed: {{t, {px, py, pz}, {qw, qx, qy, qz}}, …} with ascending t"});
      return false;
    };
    if (given.kind != Kind::kList || given.list.empty()) return refuse(given, "Motion");
    for (std::size_t i = 0; i < given.list.size(); ++i) {
      const PropertyValue& row = given.list[i];
      const std::string which = "row " + std::to_string(i) + " of Motion";
      if (row.kind != Kind::kList || row.list.size() != 3) return refuse(row, which);
      if (!flatten_value(Property::number("the time of " + which, "s"), row.list[0], out, problems) ||
          !flatten_value(Property::vector("the position of " + which, "m", "world").at_least(-1e15).at_most(1e15),
                         row.list[1], out, problems) ||
          !flatten_value(Property::quaternion("the orientation of " + which, "world"), row.list[2], out, problems))
        return false;
      const std::size_t end = out->size(), columns = MotionTable::kColumns;
      if (i > 0 && !((*out)[end - columns] > (*out)[end - 2 * columns]))
        return refuse(row.list[0], "the time of " + which);
    }
    return true;
  }

  void set_bound(kernel::BodyDescription* description) {
    if (solid_ == nullptr) return;
    const std::string& type = body_.bounding_volume_type();
    description->bound = local_bound(*solid_, type, description->geometry);
    // a mesh on which bodies stand has no thickness by which contacts could be measured, as a half-space has none; what has
    // come into an open one is pushed out to the side of its centre
    const bool is_mesh = solid_->shape && solid_->shape->kind == SceneShape::Kind::kTriangleMesh;
    if (is_mesh && !is_movable_) {
      description->bound.least_half_extent = 0.0;
      if (!solid_->shape->mesh->is_closed()) description->bound.half_thickness = 0.0;
    }
    if (!solid_->is_unbounded() || type.empty() || type == "None") return;
    diagnostics_.warning(
        place(Body::kBoundingVolumeTypeFieldNumber),
        what() + " has an unbounded geometry: BoundingVolumeType \"" + type + "\" is taken as \"None\"");
  }

  void set_material(kernel::BodyDescription* description) {
    description->material = kNone;
    if (body_.material().empty()) return;
    description->material =
        references_.materials.find(body_.material(), "Material", place(Body::kMaterialFieldNumber), &diagnostics_);
  }

  void set_forces(kernel::BodyDescription* description) {
    const TextPosition position = place(Body::kForcesFieldNumber);
    std::vector<std::uint32_t>& rows = description->forces;
    for (const std::string& id : body_.forces()) {
      rows.push_back(references_.forces.find(id, "Forces", position, &diagnostics_));
      if (rows.back() == kNone) return;
    }
    std::vector<std::uint32_t> sorted = rows;
    std::sort(sorted.begin(), sorted.end());
    const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
    if (twice != sorted.end()) {
      const std::string& id = context_.scene.forces().force(static_cast<int>(*twice)).id();
      diagnostics_.error(position, "Forces names \"" + id + "\" twice; allowed: each force once");
      return;
    }
    if (is_movable_ || description->forces.empty()) return;
    description->forces.clear();
    diagnostics_.warning(position, what() + " is " + (body_.kinematic() ? "kinematic" : "immovable") +
                                       ": its Forces do nothing and are dropped");
  }

  // Nothing of the physics, and yet no place for what nobody can read.
  void check_visual() {
    const int field = Body::kVisualTransformFieldNumber;
    if (!written(field)) return;
    const PropertyValue given = from_message(body_.visual_transform());
    const auto is_list = [](const PropertyValue& value, std::size_t length) {
      return value.kind == PropertyValue::Kind::kList && value.list.size() == length;
    };
    if (!is_list(given, 2) || !is_list(given.list[0], 3) || !is_list(given.list[1], 4)) {
      refuse(field, "has a VisualTransform that is " + shown(given) + "; allowed: {{px, py, pz}, {qw, qx, qy, qz}}");
      return;
    }
    std::vector<double> unused;
    std::vector<PropertyProblem> problems;
    flatten_value(Property::vector("the position of VisualTransform", "m", "geometry"), given.list[0], &unused,
                  &problems);
    flatten_value(Property::quaternion("the orientation of VisualTransform", "geometry"), given.list[1], &unused,
                  &problems);
    diagnostics_.add(problems, place(field), what() + ": ");
  }

  const Body& body_;
  const BodyReferences& references_;
  BuildContext& context_;
  Diagnostics& diagnostics_;
  const Solid* solid_ = nullptr;
  bool is_movable_ = true;
};

}  // namespace

void build_bodies(const BodyReferences& references, BuildContext* context) {
  const auto& bodies = context->environment.space().bodies().body();
  context->description.bodies.resize(static_cast<std::size_t>(bodies.size()));
  for (int i = 0; i < bodies.size() && !context->diagnostics->full(); ++i)
    BodyBuilder(bodies[i], references, context).build(&context->description.bodies[static_cast<std::size_t>(i)]);
}

}  // namespace gravitas::scene
