// Bullet in double precision with its defaults: sequential impulses, ten sweeps.
#include <btBulletDynamicsCommon.h>

#include <cmath>
#include <memory>
#include <vector>

#include "tests/bench/peers/engine.h"

namespace gravitas::peers {
namespace {

btVector3 to_bullet(const Vector3& v) { return {v.x(), v.y(), v.z()}; }
Vector3 from_bullet(const btVector3& v) { return {v.x(), v.y(), v.z()}; }

class BulletWorld final : public World {
 public:
  explicit BulletWorld(const Scene& scene) : time_step_(scene.time_step) {
    world_.setGravity(to_bullet(scene.gravity));
    for (const SceneBody& body : scene.bodies) add(scene, shape_of(body), body.mass, body);
    for (const Plane& plane : scene.planes)
      add(scene, std::make_unique<btStaticPlaneShape>(to_bullet(plane.normal), plane.offset), 0.0, {});
    for (const BallJoint& joint : scene.joints) add(joint);
  }
  ~BulletWorld() override {
    for (const auto& joint : joints_) world_.removeConstraint(joint.get());
    for (const auto& body : bodies_) world_.removeRigidBody(body.get());
  }

  // one step of the length, without the clock that would split it
  void step() override { world_.stepSimulation(time_step_, 0); }

  BodyState state(std::size_t body) override {
    const btTransform& pose = bodies_[body]->getWorldTransform();
    const btQuaternion q = pose.getRotation();
    return {{from_bullet(pose.getOrigin()), Quaternion(q.w(), q.x(), q.y(), q.z()).normalized()},
            {from_bullet(bodies_[body]->getLinearVelocity()), from_bullet(bodies_[body]->getAngularVelocity())}};
  }

 private:
  static std::unique_ptr<btCollisionShape> shape_of(const SceneBody& body) {
    if (body.form == Form::kSphere) return std::make_unique<btSphereShape>(body.half_sizes.x());
    return std::make_unique<btBoxShape>(to_bullet(body.half_sizes));
  }

  void add(const Scene& scene, std::unique_ptr<btCollisionShape> shape, double mass, const SceneBody& body) {
    btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, shape.get(),
                                                  mass > 0.0 ? to_bullet(body.inertia) : btVector3(0, 0, 0));
    const Quaternion& q = body.start.pose.orientation;
    info.m_startWorldTransform =
        btTransform(btQuaternion(q.x(), q.y(), q.z(), q.w()), to_bullet(body.start.pose.position));
    // those of a pair are multiplied
    info.m_friction = std::sqrt(scene.friction);
    info.m_restitution = std::sqrt(scene.restitution);
    bodies_.push_back(std::make_unique<btRigidBody>(info));
    shapes_.push_back(std::move(shape));
    btRigidBody* const added = bodies_.back().get();
    added->setLinearVelocity(to_bullet(body.start.twist.linear));
    added->setAngularVelocity(to_bullet(body.start.twist.angular));
    added->setActivationState(DISABLE_DEACTIVATION);
    if (scene.collides)
      world_.addRigidBody(added);
    else
      world_.addRigidBody(added, 0, 0);
  }

  void add(const BallJoint& joint) {
    btRigidBody& second = *bodies_[joint.body2];
    const btVector3 point = to_bullet(joint.point);
    const auto seen_from = [&](const btRigidBody& body) { return body.getWorldTransform().inverse() * point; };
    if (joint.body1 == kNone) {
      joints_.push_back(std::make_unique<btPoint2PointConstraint>(second, seen_from(second)));
    } else {
      btRigidBody& first = *bodies_[joint.body1];
      joints_.push_back(std::make_unique<btPoint2PointConstraint>(first, second, seen_from(first), seen_from(second)));
    }
    world_.addConstraint(joints_.back().get(), true);
  }

  double time_step_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broad_phase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_{&dispatcher_, &broad_phase_, &solver_, &configuration_};
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
  std::vector<std::unique_ptr<btTypedConstraint>> joints_;
};

}  // namespace

std::vector<Engine> bullet_for(const Scene&) {
  return {{"Bullet", "sequential impulses, 10 sweeps",
           [](const Scene& scene) { return std::make_unique<BulletWorld>(scene); }}};
}

}  // namespace gravitas::peers
