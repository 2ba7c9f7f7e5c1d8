// MuJoCo with its defaults: soft contacts with a pyramid of friction, Newton's solver, Euler or RK4. Jointed bodies make a
// tree, so that a joint cannot open. It knows no restitution: where a ball is to bounce, the contact is a spring without
// damping. The version that Debian 12 ships counts the bytes of its arrays in an int, which bounds bodies times contacts.
#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/bench/peers/engine.h"
#include "tests/turn_between.h"

namespace gravitas::peers {
namespace {

std::string text(const Vector3& v) { return fmt::format("{:.17g} {:.17g} {:.17g}", v.x(), v.y(), v.z()); }
std::string text(const Quaternion& q) {
  return fmt::format("{:.17g} {:.17g} {:.17g} {:.17g}", q.w(), q.x(), q.y(), q.z());
}

class ModelText {
 public:
  ModelText(const Scene& scene, const std::string& options) : scene_(scene) {
    // four rows for each contact; what it takes for itself fits in no memory where there are many bodies
    const std::size_t contacts = scene.planes.empty() ? 1 : 20 + contacts_of_body() * scene.bodies.size();
    const std::size_t rows = 4 * contacts, columns = 6 * scene.bodies.size();
    text_ = fmt::format("<mujoco><option timestep=\"{:.17g}\" gravity=\"{}\" {}/>", scene.time_step,
                        text(scene.gravity), options);
    text_ += fmt::format("<size nconmax=\"{}\" njmax=\"{}\" nstack=\"{}\"/>", contacts, rows,
                         100'000 + columns * columns + 2 * rows * columns);
    text_ += fmt::format("<default><geom friction=\"{:.17g} 0.005 0.0001\" {}{}/></default><worldbody>", scene.friction,
                         scene.collides ? "" : "contype=\"0\" conaffinity=\"0\" ",
                         scene.restitution > 0.0 ? "solref=\"-1000 0\" " : "");
    for (const Plane& plane : scene.planes)
      text_ += fmt::format("<geom type=\"plane\" size=\"0 0 1\" pos=\"{}\" quat=\"{}\"/>",
                           text(Vector3(plane.offset * plane.normal)),
                           text(test::turn_between(Vector3::UnitZ(), plane.normal)));
    for (std::uint32_t i = 0; i < scene.bodies.size(); ++i)
      if (parent(i) == kNone) add(i, Pose{});
    text_ += "</worldbody></mujoco>";
  }

  const std::string& get() const { return text_; }

 private:
  // As many as there are at most in these scenes.
  std::size_t contacts_of_body() const { return scene_.bodies[0].form == Form::kSphere ? 3 : 16; }

  const BallJoint* joint_of(std::uint32_t body) const {
    for (const BallJoint& joint : scene_.joints)
      if (joint.body2 == body) return &joint;
    return nullptr;
  }
  std::uint32_t parent(std::uint32_t body) const {
    const BallJoint* const joint = joint_of(body);
    return joint == nullptr ? kNone : joint->body1;
  }

  // A body and all that hangs on it; poses are relative to what it hangs on.
  void add(std::uint32_t i, const Pose& frame) {
    const SceneBody& body = scene_.bodies[i];
    const auto& [position, attitude] = body.start.pose;
    text_ += fmt::format("<body name=\"{}\" pos=\"{}\" quat=\"{}\">", i,
                         text(Vector3(frame.orientation.conjugate() * (position - frame.position))),
                         text(Quaternion(frame.orientation.conjugate() * attitude)));
    text_ +=
        fmt::format("<inertial pos=\"0 0 0\" mass=\"{:.17g}\" diaginertia=\"{}\"/>", body.mass, text(body.inertia));
    if (const BallJoint* const joint = joint_of(i))
      text_ += fmt::format("<joint type=\"ball\" pos=\"{}\"/>",
                           text(Vector3(attitude.conjugate() * (joint->point - position))));
    else
      text_ += "<freejoint/>";
    if (body.form == Form::kSphere)
      text_ += fmt::format("<geom type=\"sphere\" size=\"{:.17g}\"/>", body.half_sizes.x());
    else
      text_ += fmt::format("<geom type=\"box\" size=\"{}\"/>", text(body.half_sizes));
    for (std::uint32_t k = 0; k < scene_.bodies.size() && !scene_.joints.empty(); ++k)
      if (parent(k) == i) add(k, body.start.pose);
    text_ += "</body>";
  }

  const Scene& scene_;
  std::string text_;
};

using Model = std::unique_ptr<mjModel, decltype(&mj_deleteModel)>;

Model compiled(const std::string& text) {
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  mj_makeEmptyFileVFS(files.get(), "scene.xml", static_cast<int>(text.size()));
  text.copy(static_cast<char*>(files->filedata[0]), text.size());
  char problem[1000] = "";
  Model model(mj_loadXML("scene.xml", files.get(), problem, sizeof problem), &mj_deleteModel);
  mj_deleteVFS(files.get());
  if (model == nullptr) throw std::runtime_error(problem);
  return model;
}

class MujocoWorld final : public World {
 public:
  MujocoWorld(const Scene& scene, const std::string& options)
      : model_(compiled(ModelText(scene, options).get())), data_(mj_makeData(model_.get()), &mj_deleteData) {
    // it would write a file; what it warns of is asked for below
    mju_user_warning = [](const char*) {};
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
      body_.push_back(mj_name2id(model_.get(), mjOBJ_BODY, std::to_string(i).c_str()));
      if (!scene.joints.empty()) continue;
      const auto& [pose, twist] = scene.bodies[i].start;
      mjtNum* const velocity = data_->qvel + model_->jnt_dofadr[model_->body_jntadr[body_.back()]];
      const Vector3 spin = pose.orientation.conjugate() * twist.angular;
      for (int k = 0; k < 3; ++k) {
        velocity[k] = twist.linear[k];
        velocity[3 + k] = spin[k];
      }
    }
  }

  void step() override {
    mj_step(model_.get(), data_.get());
    is_known_ = false;
    // it starts again from the beginning where a number is bad
    for (const int bad : {mjWARN_BADQPOS, mjWARN_BADQVEL, mjWARN_BADQACC})
      if (data_->warning[bad].number > 0) throw std::runtime_error("blew up");
    for (const int full : {mjWARN_CONTACTFULL, mjWARN_CNSTRFULL})
      if (data_->warning[full].number > 0) throw std::runtime_error("ran out of the room made for contacts");
  }

  BodyState state(std::size_t i) override {
    if (!is_known_) {
      mj_kinematics(model_.get(), data_.get());
      mj_comPos(model_.get(), data_.get());
      mj_comVel(model_.get(), data_.get());
      is_known_ = true;
    }
    const int body = body_[i];
    const mjtNum *const x = data_->xpos + 3 * body, *const q = data_->xquat + 4 * body;
    mjtNum twist[6];  // about the centre of mass, axes of the world: angular, then linear
    mj_objectVelocity(model_.get(), data_.get(), mjOBJ_BODY, body, twist, 0);
    return {{{x[0], x[1], x[2]}, Quaternion(q[0], q[1], q[2], q[3])},
            {{twist[3], twist[4], twist[5]}, {twist[0], twist[1], twist[2]}}};
  }

 private:
  Model model_;
  std::unique_ptr<mjData, decltype(&mj_deleteData)> data_;
  std::vector<int> body_;  // by row of the scene
  bool is_known_ = false;
};

Engine way(const std::string& name, const std::string& how, const std::string& options) {
  return {name, how, [=](const Scene& scene) { return std::make_unique<MujocoWorld>(scene, options); }};
}

}  // namespace

std::vector<Engine> mujoco_for(const Scene& scene) {
  std::vector<Engine> engines = {way("MuJoCo_Euler", "Euler, Newton", "")};
  if (scene.name == "freefall1000" || scene.name == "freetop" || !scene.joints.empty())
    engines.push_back(way("MuJoCo_RK4", "RK4, Newton", "integrator=\"RK4\""));
  // Newton factorises a dense matrix
  if (scene.bodies.size() > 500 && !scene.planes.empty())
    engines.push_back(way("MuJoCo_CG", "Euler, CG", "solver=\"CG\""));
  return engines;
}

}  // namespace gravitas::peers
