#include "plugin_sdk/plugin.h"

#include <cstring>
#include <deque>

#include "plugin_sdk/property_value.h"

namespace gravitas {

const char* slot_name(Slot slot) {
  switch (slot) {
    case Slot::kSpace:
      return "space";
    case Slot::kCollision:
      return "collision";
    case Slot::kConstraint:
      return "constraint";
    case Slot::kForce:
      return "force";
    case Slot::kSolver:
      return "solver";
    case Slot::kIntegrator:
      return "integrator";
  }
  return "unknown";
}

bool SpacePlugin::dispatch(stage::Method method, const gravitas_column* request, gravitas_reply_column* reply,
                           Host& host) {
  switch (method) {
    case stage::Method::kSpacePairs:
      pairs(stage::SpacePairsRequest(request), stage::SpacePairsReply(reply), host);
      return true;
    case stage::Method::kSpaceRays:
      rays(stage::SpaceRaysRequest(request), stage::SpaceRaysReply(reply), host);
      return true;
    case stage::Method::kSpaceDebugGeometry:
      debug_geometry(stage::SpacePairsRequest(request), stage::SpaceDebugGeometryReply(reply), host);
      return true;
    default:
      return false;
  }
}

void SpacePlugin::rays(const stage::SpaceRaysRequest&, const stage::SpaceRaysReply&, Host&) { throw UnknownMethod(); }

void SpacePlugin::debug_geometry(const stage::SpacePairsRequest&, const stage::SpaceDebugGeometryReply&, Host&) {
  throw UnknownMethod();
}

bool CollisionPlugin::dispatch(stage::Method method, const gravitas_column* request, gravitas_reply_column* reply,
                               Host& host) {
  switch (method) {
    case stage::Method::kCollisionManifolds:
      manifolds(stage::CollisionManifoldsRequest(request), stage::CollisionManifoldsReply(reply), host);
      return true;
    case stage::Method::kCollisionTimesOfImpact:
      times_of_impact(stage::CollisionTimesOfImpactRequest(request), stage::CollisionTimesOfImpactReply(reply), host);
      return true;
    case stage::Method::kCollisionRays:
      rays(stage::CollisionRaysRequest(request), stage::CollisionRaysReply(reply), host);
      return true;
    case stage::Method::kCollisionDebugGeometry:
      debug_geometry(stage::CollisionDebugGeometryRequest(request), stage::CollisionDebugGeometryReply(reply), host);
      return true;
    default:
      return false;
  }
}

void CollisionPlugin::times_of_impact(const stage::CollisionTimesOfImpactRequest&,
                                      const stage::CollisionTimesOfImpactReply&, Host&) {
  throw UnknownMethod();
}

void CollisionPlugin::rays(const stage::CollisionRaysRequest&, const stage::CollisionRaysReply&, Host&) {
  throw UnknownMethod();
}

void CollisionPlugin::debug_geometry(const stage::CollisionDebugGeometryRequest&,
                                     const stage::CollisionDebugGeometryReply&, Host&) {
  throw UnknownMethod();
}

bool ConstraintPlugin::dispatch(stage::Method method, const gravitas_column* request, gravitas_reply_column* reply,
                                Host& host) {
  if (method == stage::Method::kConstraintBind) {
    bind(stage::ConstraintBindRequest(request), stage::ConstraintBindReply(reply), host);
    return true;
  }
  if (method == stage::Method::kConstraintCoordinates) {
    coordinates(stage::ConstraintDiscrepanciesRequest(request), stage::ConstraintCoordinatesReply(reply), host);
    return true;
  }
  if (method != stage::Method::kConstraintDiscrepancies) return false;
  discrepancies(stage::ConstraintDiscrepanciesRequest(request), stage::ConstraintDiscrepanciesReply(reply), host);
  return true;
}

void ConstraintPlugin::coordinates(const stage::ConstraintDiscrepanciesRequest&,
                                   const stage::ConstraintCoordinatesReply&, Host&) {
  throw UnknownMethod();
}

bool ForcePlugin::dispatch(stage::Method method, const gravitas_column* request, gravitas_reply_column* reply,
                           Host& host) {
  if (method == stage::Method::kForceJacobians) {
    jacobians(stage::ForceWrenchesRequest(request), stage::ForceJacobiansReply(reply), host);
    return true;
  }
  if (method != stage::Method::kForceWrenches) return false;
  wrenches(stage::ForceWrenchesRequest(request), stage::ForceWrenchesReply(reply), host);
  return true;
}

void ForcePlugin::jacobians(const stage::ForceWrenchesRequest&, const stage::ForceJacobiansReply&, Host&) {
  throw UnknownMethod();
}

bool SolverPlugin::dispatch(stage::Method method, const gravitas_column* request, gravitas_reply_column* reply,
                            Host& host) {
  if (method == stage::Method::kSolverReactions) {
    reactions(stage::SolverReactionsRequest(request), stage::SolverReactionsReply(reply), host);
    return true;
  }
  if (method == stage::Method::kSolverReactionJacobians) {
    reaction_jacobians(stage::SolverReactionsRequest(request), stage::SolverReactionJacobiansReply(reply), host);
    return true;
  }
  if (method != stage::Method::kSolverSolve) return false;
  solve(stage::SolverSolveRequest(request), stage::SolverSolveReply(reply), host);
  return true;
}

void SolverPlugin::reactions(const stage::SolverReactionsRequest&, const stage::SolverReactionsReply&, Host&) {
  throw UnknownMethod();
}

void SolverPlugin::reaction_jacobians(const stage::SolverReactionsRequest&, const stage::SolverReactionJacobiansReply&,
                                      Host&) {
  throw UnknownMethod();
}

bool IntegratorPlugin::dispatch(stage::Method method, const gravitas_column* request, gravitas_reply_column* reply,
                                Host& host) {
  if (method != stage::Method::kIntegratorIntegrate) return false;
  integrate(stage::IntegratorIntegrateRequest(request), stage::IntegratorIntegrateReply(reply), host);
  return true;
}

namespace detail {
namespace {

// Owns the declaration and the plain structures that point into it.
struct PlainDescription {
  PluginDeclaration declaration;
  std::deque<std::vector<gravitas_property>> properties;
  std::deque<std::vector<gravitas_coordinate>> coordinates;
  std::deque<std::vector<const char*>> texts;
  std::vector<gravitas_type> types;
  gravitas_description description{};
};

const char* const* plain_texts(PlainDescription& owner, const std::vector<std::string>& source) {
  std::vector<const char*>& texts = owner.texts.emplace_back();
  for (const std::string& text : source) texts.push_back(text.c_str());
  return texts.data();
}

const gravitas_property* plain_properties(PlainDescription& owner, const std::vector<Property>& source) {
  std::vector<gravitas_property>& properties = owner.properties.emplace_back();
  for (const Property& p : source) {
    gravitas_property plain{};
    plain.name = p.name.c_str();
    plain.unit = p.unit.c_str();
    plain.frame = p.frame.c_str();
    plain.meaning = p.meaning.c_str();
    plain.default_numbers = p.default_numbers.data();
    plain.default_count = static_cast<std::uint32_t>(p.default_numbers.size());
    plain.choices = plain_texts(owner, p.choices);
    plain.choice_count = static_cast<std::uint32_t>(p.choices.size());
    plain.minimum = p.minimum;
    plain.maximum = p.maximum;
    plain.kind = static_cast<std::uint32_t>(p.kind);
    plain.columns = p.columns;
    plain.exclusive_minimum = p.exclusive_minimum ? 1 : 0;
    plain.required = p.is_required ? 1 : 0;
    plain.live = p.is_live ? 1 : 0;
    properties.push_back(plain);
  }
  return properties.data();
}

}  // namespace

const gravitas_description* plain_description(PluginDeclaration declaration) {
  // never freed: the library is never unloaded
  auto& owner = *new PlainDescription{std::move(declaration), {}, {}, {}, {}, {}};
  const PluginDeclaration& source = owner.declaration;
  for (const TypeDeclaration& type : source.types) {
    std::vector<gravitas_coordinate>& coordinates = owner.coordinates.emplace_back();
    for (const CoordinateDeclaration& c : type.coordinates)
      coordinates.push_back({c.name.c_str(), c.unit.c_str(), c.meaning.c_str()});
    owner.types.push_back({type.name.c_str(), type.meaning.c_str(), plain_properties(owner, type.properties),
                           coordinates.data(), type.properties.size(), coordinates.size()});
  }
  owner.description.name = source.name.c_str();
  owner.description.version = source.version.c_str();
  owner.description.meaning = source.meaning.c_str();
  owner.description.capabilities = plain_texts(owner, source.capabilities);
  owner.description.capability_count = source.capabilities.size();
  owner.description.types = owner.types.data();
  owner.description.type_count = owner.types.size();
  owner.description.properties = plain_properties(owner, source.properties);
  owner.description.property_count = source.properties.size();
  owner.description.theta = source.theta;
  owner.description.slot = static_cast<std::uint32_t>(source.slot);
  return &owner.description;
}

void demand_settings(const PluginDeclaration& declaration, const double* settings, std::uint64_t count) {
  const std::string problem = check_flattened(declaration.properties, {settings, count});
  if (!problem.empty()) throw Refusal("settings of " + declaration.name + ": " + problem);
}

void set_error(gravitas_error* error, const char* text) {
  std::size_t size = strnlen(text, sizeof error->text);
  if (size == sizeof error->text) {
    // cut before a whole character: bytes 10xxxxxx continue one
    --size;
    while (size > 0 && (static_cast<unsigned char>(text[size]) & 0xC0U) == 0x80U) --size;
  }
  std::memcpy(error->text, text, size);
  error->text[size] = '\0';
}

bool needs_capacity(stage::Method method, const gravitas_reply_column* reply) {
  const std::size_t columns = stage::method_info(method).reply.size();
  for (std::size_t i = 0; i < columns; ++i)
    if (reply[i].count > reply[i].capacity) return true;
  return false;
}

}  // namespace detail
}  // namespace gravitas
