// ODE in double precision with its defaults: 20 sweeps of its quick step, or its direct step. Friction is the pyramid that
// holds mu times the normal force (dContactApprox1); without, mu is a force in N.
#include <ode/ode.h>

#include <cstdarg>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <vector>

#include "tests/bench/peers/engine.h"

namespace gravitas::peers {
namespace {

constexpr int kMostContacts = 8;  // of a pair

Vector3 from_ode(const dReal* v) { return {v[0], v[1], v[2]}; }

class OdeWorld final : public World {
 public:
  OdeWorld(const Scene& scene, bool is_direct) : scene_(scene), is_direct_(is_direct) {
    static std::once_flag once;
    std::call_once(once, [] {
      dInitODE2(0);
      // it tells of every problem that its direct step does not solve
      dSetMessageHandler([](int, const char*, va_list) {});
    });
    // its quick step shuffles rows: alike in every run
    dRandSetSeed(0);
    world_ = dWorldCreate();
    space_ = dHashSpaceCreate(nullptr);
    contacts_ = dJointGroupCreate(0);
    dWorldSetGravity(world_, scene.gravity.x(), scene.gravity.y(), scene.gravity.z());
    for (const SceneBody& body : scene.bodies) add(body);
    for (const Plane& plane : scene.planes)
      dCreatePlane(space_, plane.normal.x(), plane.normal.y(), plane.normal.z(), plane.offset);
    for (const BallJoint& joint : scene.joints) {
      const dJointID ball = dJointCreateBall(world_, nullptr);
      dJointAttach(ball, joint.body1 == kNone ? nullptr : bodies_[joint.body1], bodies_[joint.body2]);
      dJointSetBallAnchor(ball, joint.point.x(), joint.point.y(), joint.point.z());
    }
  }
  ~OdeWorld() override {
    dJointGroupDestroy(contacts_);
    dSpaceDestroy(space_);
    dWorldDestroy(world_);
  }

  void step() override {
    if (scene_.collides) dSpaceCollide(space_, this, &OdeWorld::on_near);
    const int is_done = is_direct_ ? dWorldStep(world_, scene_.time_step) : dWorldQuickStep(world_, scene_.time_step);
    if (is_done == 0) throw std::runtime_error("out of memory");
    dJointGroupEmpty(contacts_);
  }

  BodyState state(std::size_t i) override {
    const dBodyID body = bodies_[i];
    const dReal* const q = dBodyGetQuaternion(body);
    return {{from_ode(dBodyGetPosition(body)), Quaternion(q[0], q[1], q[2], q[3])},
            {from_ode(dBodyGetLinearVel(body)), from_ode(dBodyGetAngularVel(body))}};
  }

 private:
  void add(const SceneBody& body) {
    const dBodyID added = dBodyCreate(world_);
    dMass mass;
    dMassSetParameters(&mass, body.mass, 0, 0, 0, body.inertia.x(), body.inertia.y(), body.inertia.z(), 0, 0, 0);
    dBodySetMass(added, &mass);
    const auto& [pose, twist] = body.start;
    const Quaternion& q = pose.orientation;
    const dQuaternion turned = {q.w(), q.x(), q.y(), q.z()};
    dBodySetPosition(added, pose.position.x(), pose.position.y(), pose.position.z());
    dBodySetQuaternion(added, turned);
    dBodySetLinearVel(added, twist.linear.x(), twist.linear.y(), twist.linear.z());
    dBodySetAngularVel(added, twist.angular.x(), twist.angular.y(), twist.angular.z());
    bodies_.push_back(added);
    if (!scene_.collides) return;
    const Vector3& half = body.half_sizes;
    dGeomSetBody(body.form == Form::kSphere ? dCreateSphere(space_, half.x())
                                            : dCreateBox(space_, 2 * half.x(), 2 * half.y(), 2 * half.z()),
                 added);
  }

  static void on_near(void* self, dGeomID a, dGeomID b) { static_cast<OdeWorld*>(self)->touch(a, b); }

  void touch(dGeomID a, dGeomID b) {
    if (dGeomGetBody(a) == nullptr && dGeomGetBody(b) == nullptr) return;
    dContact found[kMostContacts];
    const int count = dCollide(a, b, kMostContacts, &found[0].geom, sizeof(dContact));
    for (int i = 0; i < count; ++i) {
      found[i].surface = {};
      found[i].surface.mode = dContactApprox1;
      found[i].surface.mu = scene_.friction;
      if (scene_.restitution > 0.0) {
        found[i].surface.mode |= dContactBounce;
        found[i].surface.bounce = scene_.restitution;
      }
      dJointAttach(dJointCreateContact(world_, contacts_, &found[i]), dGeomGetBody(a), dGeomGetBody(b));
    }
  }

  Scene scene_;
  bool is_direct_;
  dWorldID world_;
  dSpaceID space_;
  dJointGroupID contacts_;
  std::vector<dBodyID> bodies_;
};

Engine way(const std::string& name, const std::string& how, bool is_direct) {
  return {name, how, [=](const Scene& scene) { return std::make_unique<OdeWorld>(scene, is_direct); }};
}

}  // namespace

std::vector<Engine> ode_for(const Scene& scene) {
  std::vector<Engine> engines = {way("ODE_quick", "quick step, 20 sweeps", false)};
  // its cost grows with the cube of the rows
  if (scene.bodies.size() <= 21) engines.push_back(way("ODE_direct", "direct step", true));
  return engines;
}

}  // namespace gravitas::peers
