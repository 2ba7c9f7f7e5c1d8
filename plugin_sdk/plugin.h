// What a plugin's author writes: a class derived from the base of its slot, a declaration, one macro.
//
//   class Gravity final : public gravitas::ForcePlugin {
//    public:
//     static gravitas::PluginDeclaration declaration();
//     explicit Gravity(gravitas::PropertyCursor settings);
//     void wrenches(const stage::ForceWrenchesRequest&, const stage::ForceWrenchesReply&, Host&) override;
//   };
//   GRAVITAS_PLUGIN(Gravity)
//
// The request views have a method per column, named as in schemas/gravitas/stage/v1/; the reply views too,
// and take rows by push() or as a whole by resize(). The answer must depend on the request and the settings
// alone: same request, same bytes. To refuse an impossible request throw Refusal with the reason; any other
// exception is reported as a failure of the plugin. workers/hello is the smallest example.
#pragma once

#include <algorithm>
#include <cstdint>
#include <exception>
#include <mutex>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "plugin_sdk/abi.h"
#include "plugin_sdk/property.h"
#include "schemas/stage_frames.h"

// What a library was built by: our own build says it. Nothing compares it.
#ifndef GRAVITAS_BUILD_ID
#define GRAVITAS_BUILD_ID "unknown"
#endif

namespace gravitas {

enum class Slot : std::uint32_t {
  kSpace = GRAVITAS_SLOT_SPACE,
  kCollision = GRAVITAS_SLOT_COLLISION,
  kConstraint = GRAVITAS_SLOT_CONSTRAINT,
  kForce = GRAVITAS_SLOT_FORCE,
  kSolver = GRAVITAS_SLOT_SOLVER,
  kIntegrator = GRAVITAS_SLOT_INTEGRATOR
};

// "space", "collision", …
const char* slot_name(Slot slot);

// What a joint leaves free and can tell, such as `angle` in rad: what Constraint.Coordinates answers, by its place in the list.
struct CoordinateDeclaration {
  std::string name;
  std::string unit;
  std::string meaning;
};

// A name of the scene language that the plugin serves: a force type, a joint type, a shape. A request that names another is
// refused.
struct TypeDeclaration {
  std::string name;
  std::string meaning;
  std::vector<Property> properties;  // of what the scene says of one force, joint or shape; live() means nothing here
  std::vector<CoordinateDeclaration> coordinates = {};  // of joint types
};

struct PluginDeclaration {
  std::string name;  // as in `Solver=Sequential`, and as in `gravitas describe`
  std::string version;
  Slot slot = Slot::kForce;
  std::string meaning;
  std::vector<std::string> capabilities = {};  // of those that the slot knows (declaration_check.h)
  std::vector<TypeDeclaration> types = {};     // empty for a space, solver or integrator: its name is the type
  std::vector<Property> properties = {};       // settings of the plugin itself
  // Integrators: share of a velocity-only impulse's effect that moves the pose within the step.
  // Euler 0, SemiImplicitEuler 1, methods of order two and more 1/2.
  double theta = 0.5;
};

inline bool has_capability(const PluginDeclaration& declaration, std::string_view name) {
  return std::ranges::find(declaration.capabilities, name) != declaration.capabilities.end();
}

// The request is impossible, and why.
class Refusal : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The plugin does not answer this method: what optional methods throw unless they are overridden.
class UnknownMethod : public std::exception {
 public:
  const char* what() const noexcept override { return "the plugin does not answer this method"; }
};

// What the host offers to a plugin during a call.
class Host {
 public:
  explicit Host(const gravitas_host* host) : host_(host) {}

  // Says that the plugin is alive and getting on with long work.
  void mark_progress() const { host_->mark_progress(host_->context); }

  // Calls body(begin, end) over a fixed partition of 0 … count, on the host's threads. Bodies must write to
  // places of their own; the partition is the same for every number of threads.
  // An exception of a body is thrown here once all are done: of several, that of the first part.
  template <typename Body>
  void parallel_for(std::uint64_t count, Body&& body) const {
    // no exception crosses the C interface: it waits here
    struct Parts {
      std::remove_reference_t<Body>* body;
      std::mutex mutex;
      std::uint64_t failed_part = ~std::uint64_t{0};
      std::exception_ptr failure;
    } parts{&body, {}, ~std::uint64_t{0}, nullptr};
    host_->parallel_for(
        host_->context, count,
        [](void* argument, std::uint64_t begin, std::uint64_t end) {
          Parts& shared = *static_cast<Parts*>(argument);
          try {
            (*shared.body)(begin, end);
          } catch (...) {
            const std::lock_guard lock(shared.mutex);
            if (begin < shared.failed_part) shared.failure = std::current_exception();
            shared.failed_part = std::min(shared.failed_part, begin);
          }
        },
        &parts);
    if (parts.failure) std::rethrow_exception(parts.failure);
  }

  // Calls body(i) for 0 … count - 1 likewise: for few items, of which each is work for a thread.
  template <typename Body>
  void parallel_for_each(std::uint64_t count, Body&& body) const {
    // a part of parallel_for is of so many at least; whatever it is, each item is in one
    constexpr std::uint64_t kPart = 64;
    parallel_for(kPart * count, [&](std::uint64_t begin, std::uint64_t end) {
      for (std::uint64_t i = (begin + kPart - 1) / kPart; i * kPart < end; ++i) body(i);
    });
  }

  // Wrenches of all bodies (six numbers each) in a trial state, and the blocks of their Jacobian, or what else a
  // DerivativeQuestion asks. The columns are those of
  // Integrator.Derivative. Throws std::runtime_error when they cannot be had: let it pass.
  void derivative(const gravitas_column* request, gravitas_reply_column* reply) const {
    if (host_->derivative == nullptr || host_->derivative(host_->context, request, reply) != GRAVITAS_OK)
      throw std::runtime_error("the derivative could not be had");
  }

 private:
  const gravitas_host* host_;
};

// ---- the bases of the slots ------------------------------------------------------------------------------

class SpacePlugin {
 public:
  static constexpr Slot kSlot = Slot::kSpace;
  virtual ~SpacePlugin() = default;
  virtual void pairs(const stage::SpacePairsRequest& request, const stage::SpacePairsReply& reply, Host& host) = 0;
  // Optional: a plugin that overrides one of these declares the capability of its name, and is asked only then.
  virtual void rays(const stage::SpaceRaysRequest& request, const stage::SpaceRaysReply& reply, Host& host);
  virtual void debug_geometry(const stage::SpacePairsRequest& request, const stage::SpaceDebugGeometryReply& reply,
                              Host& host);
  bool dispatch(stage::Method method, const gravitas_column* request, gravitas_reply_column* reply, Host& host);
};

class CollisionPlugin {
 public:
  static constexpr Slot kSlot = Slot::kCollision;
  virtual ~CollisionPlugin() = default;
  virtual void manifolds(const stage::CollisionManifoldsRequest& request, const stage::CollisionManifoldsReply& reply,
                         Host& host) = 0;
  // Optional: a plugin that overrides one of these declares the capability of its name, and is asked only then.
  virtual void times_of_impact(const stage::CollisionTimesOfImpactRequest& request,
                               const stage::CollisionTimesOfImpactReply& reply, Host& host);
  virtual void rays(const stage::CollisionRaysRequest& request, const stage::CollisionRaysReply& reply, Host& host);
  virtual void debug_geometry(const stage::CollisionDebugGeometryRequest& request,
                              const stage::CollisionDebugGeometryReply& reply, Host& host);
  bool dispatch(stage::Method method, const gravitas_column* request, gravitas_reply_column* reply, Host& host);
};

// All refuse joints of types that are not declared: demand_type() of joint_rows.h.
class ConstraintPlugin {
 public:
  static constexpr Slot kSlot = Slot::kConstraint;
  virtual ~ConstraintPlugin() = default;
  virtual void bind(const stage::ConstraintBindRequest& request, const stage::ConstraintBindReply& reply,
                    Host& host) = 0;
  virtual void discrepancies(const stage::ConstraintDiscrepanciesRequest& request,
                             const stage::ConstraintDiscrepanciesReply& reply, Host& host) = 0;
  // For joints with the capability `coordinates`, whose types declare some (plugin_sdk/joint_coordinates.h helps).
  virtual void coordinates(const stage::ConstraintDiscrepanciesRequest& request,
                           const stage::ConstraintCoordinatesReply& reply, Host& host);
  bool dispatch(stage::Method method, const gravitas_column* request, gravitas_reply_column* reply, Host& host);
};

class ForcePlugin {
 public:
  static constexpr Slot kSlot = Slot::kForce;
  virtual ~ForcePlugin() = default;
  virtual void wrenches(const stage::ForceWrenchesRequest& request, const stage::ForceWrenchesReply& reply,
                        Host& host) = 0;
  // For forces with the capability `jacobians` (plugin_sdk/force_jacobians.h helps).
  virtual void jacobians(const stage::ForceWrenchesRequest& request, const stage::ForceJacobiansReply& reply,
                         Host& host);
  bool dispatch(stage::Method method, const gravitas_column* request, gravitas_reply_column* reply, Host& host);
};

class SolverPlugin {
 public:
  static constexpr Slot kSlot = Slot::kSolver;
  virtual ~SolverPlugin() = default;
  virtual void solve(const stage::SolverSolveRequest& request, const stage::SolverSolveReply& reply, Host& host) = 0;
  // For solvers with the capability `reactions` (plugin_sdk/solver/reactions.h answers it).
  virtual void reactions(const stage::SolverReactionsRequest& request, const stage::SolverReactionsReply& reply,
                         Host& host);
  // For solvers with the capability `reaction_jacobians` (the same header).
  virtual void reaction_jacobians(const stage::SolverReactionsRequest& request,
                                  const stage::SolverReactionJacobiansReply& reply, Host& host);
  bool dispatch(stage::Method method, const gravitas_column* request, gravitas_reply_column* reply, Host& host);
};

class IntegratorPlugin {
 public:
  static constexpr Slot kSlot = Slot::kIntegrator;
  virtual ~IntegratorPlugin() = default;
  // The column `damping` slows the velocities of a body by exactly exp(-c h) in a step of length h, with any method
  // (damping_factor() of integrator.h).
  virtual void integrate(const stage::IntegratorIntegrateRequest& request, const stage::IntegratorIntegrateReply& reply,
                         Host& host) = 0;
  bool dispatch(stage::Method method, const gravitas_column* request, gravitas_reply_column* reply, Host& host);
};

// ---- from the class to the C table -----------------------------------------------------------------------

namespace detail {

// The declaration as plain data that lives as long as the library.
const gravitas_description* plain_description(PluginDeclaration declaration);

// Runs `body`, turning exceptions into a status and a text.
template <typename Body>
std::int32_t guarded(gravitas_error* error, Body&& body);
void set_error(gravitas_error* error, const char* text);

// Throws Refusal if the numbers are not what the plugin's own properties take.
void demand_settings(const PluginDeclaration& declaration, const double* settings, std::uint64_t count);

// True if a reply column was asked to hold more than there is room for.
bool needs_capacity(stage::Method method, const gravitas_reply_column* reply);

template <typename Body>
std::int32_t guarded(gravitas_error* error, Body&& body) {
  try {
    return body();
  } catch (const UnknownMethod& unknown) {
    set_error(error, unknown.what());
    return GRAVITAS_UNKNOWN_METHOD;
  } catch (const Refusal& refusal) {
    set_error(error, refusal.what());
    return GRAVITAS_REFUSED;
  } catch (const std::out_of_range& range) {
    set_error(error, range.what());
    return GRAVITAS_REFUSED;
  } catch (const std::exception& failure) {
    set_error(error, failure.what());
    return GRAVITAS_FAILED;
  } catch (...) {
    set_error(error, "an exception that is no std::exception");
    return GRAVITAS_FAILED;
  }
}

// Null if the declaration throws. Then `create` does so too, and its error says why.
template <typename P>
const gravitas_description* description() noexcept {
  try {
    return plain_description(P::declaration());
  } catch (...) {
    return nullptr;
  }
}

template <typename P>
std::int32_t create(const double* settings, std::uint64_t count, void** instance, gravitas_error* error) {
  return guarded(error, [&]() -> std::int32_t {
    demand_settings(P::declaration(), settings, count);
    *instance = new P(PropertyCursor({settings, count}));
    return GRAVITAS_OK;
  });
}

template <typename P>
void destroy(void* instance) {
  delete static_cast<P*>(instance);
}

template <typename P>
std::int32_t call(void* instance, std::uint32_t method, const gravitas_column* request, gravitas_reply_column* reply,
                  const gravitas_host* host, gravitas_error* error) {
  return guarded(error, [&]() -> std::int32_t {
    Host services(host);
    const auto which = static_cast<stage::Method>(method);
    if (!static_cast<P*>(instance)->dispatch(which, request, reply, services)) return GRAVITAS_UNKNOWN_METHOD;
    return needs_capacity(which, reply) ? GRAVITAS_NEEDS_CAPACITY : GRAVITAS_OK;
  });
}

}  // namespace detail

template <typename P>
const gravitas_plugin_table* plugin_table() {
  static const gravitas_plugin_table table = {GRAVITAS_MAGIC,     GRAVITAS_ABI_VERSION, GRAVITAS_LAYOUT_VERSION,
                                              stage::kSchemaHash, GRAVITAS_BUILD_ID,    detail::description<P>(),
                                              &detail::create<P>, &detail::destroy<P>,  &detail::call<P>};
  return &table;
}

#define GRAVITAS_PLUGIN(Class)                                                                       \
  extern "C" __attribute__((visibility("default"))) const gravitas_plugin_table* gravitas_plugin() { \
    return gravitas::plugin_table<Class>();                                                          \
  }

}  // namespace gravitas
