#include "tests/scenes/scene_run.h"

#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "services/run/exchange_spec.h"
#include "tests/paths.h"

namespace gravitas::harness {
namespace {

// A text under a name that files are opened by, while this lives.
class NamedText {
 public:
  explicit NamedText(const std::string& text) : file_(memfd_create("scene", MFD_CLOEXEC)) {
    if (file_ < 0 || write(file_, text.data(), text.size()) != static_cast<ssize_t>(text.size()))
      throw std::runtime_error("no room for the text of a scene");
  }
  ~NamedText() { close(file_); }
  NamedText(const NamedText&) = delete;
  NamedText& operator=(const NamedText&) = delete;
  std::string path() const { return "/proc/self/fd/" + std::to_string(file_); }

 private:
  int file_;
};

kernel::EnvironmentDescription load_scene(const std::string& scene, std::vector<std::string> overrides,
                                          std::vector<std::string>* warnings, Catalog* catalog) {
  RunOptions options;
  options.overrides = std::move(overrides);
  options.hosting = {{std::nullopt, kernel::Hosting::kDirect}};
  std::unique_ptr<NamedText> text;
  if (scene.find('{') != std::string::npos) {
    text = std::make_unique<NamedText>(scene);
    options.scenes = {text->path()};
  } else {
    options.scenes = {scene.starts_with('/') ? scene : in_source("/tests/scenes/") + scene};
  }
  return load(options, warnings, catalog);
}

}  // namespace

std::string literal(double value) { return fmt::format("{:.17g}", value); }

std::string literal(const Vector3& value) {
  return fmt::format("{{{:.17g}, {:.17g}, {:.17g}}}", value.x(), value.y(), value.z());
}

std::string literal(const Quaternion& value) {
  return fmt::format("{{{:.17g}, {:.17g}, {:.17g}, {:.17g}}}", value.w(), value.x(), value.y(), value.z());
}

std::string set(const std::string& path, double value) { return path + '=' + literal(value); }
std::string set(const std::string& path, const Vector3& value) { return path + '=' + literal(value); }
std::string set(const std::string& path, const Quaternion& value) { return path + '=' + literal(value); }
std::string set(const std::string& path, const std::string& value) { return path + '=' + value; }

Quaternion turned(const Vector3& axis, double angle) { return Quaternion(Eigen::AngleAxisd(angle, axis.normalized())); }

double angle_between(const Quaternion& a, const Quaternion& b) {
  const Quaternion difference = a.conjugate() * b;
  return 2.0 * std::atan2(difference.vec().norm(), std::fabs(difference.w()));
}

SceneRun::SceneRun(const std::string& scene, std::vector<std::string> overrides)
    : description_(load_scene(scene, std::move(overrides), &warnings_, &catalog_)),
      environment_(start(description_)),
      figures_(std::make_unique<Figures>(description_)) {
  environment_->set_commit_listener(&source_);
  figures_->follow(environment_.get());
}

void SceneRun::step() {
  if (environment_->step() == kernel::StepOutcome::kPaused)
    throw std::runtime_error(
        fmt::format("paused at step {}: {}", environment_->fault()->step, environment_->fault()->fault.what()));
  figures_->follow(environment_.get());
}

void SceneRun::steps(std::uint32_t count) {
  for (std::uint32_t i = 0; i < count; ++i) step();
}

void SceneRun::to_end() {
  while (!is_done()) step();
}

std::uint32_t SceneRun::row(const std::string& id) const {
  const std::vector<std::string>& ids = environment_->model().body_id;
  const auto found = std::ranges::find(ids, id);
  if (found == ids.end()) throw std::invalid_argument("no body '" + id + "'");
  return static_cast<std::uint32_t>(found - ids.begin());
}

SceneRun::Motion SceneRun::motion(std::uint32_t body) const {
  const kernel::StateView state = environment_->state();
  return {{vector_at(state.position, body), quaternion_at(state.orientation, body)},
          {vector_at(state.linear_velocity, body), vector_at(state.angular_velocity, body)}};
}

SceneRun::Motion SceneRun::body(const std::string& id) const { return motion(row(id)); }

double SceneRun::mass(const std::string& id) const { return environment_->model().mass[row(id)]; }

Vector3 SceneRun::moments(const std::string& id) const {
  return vector_at(environment_->model().inertia.span(), row(id));
}

std::vector<std::string> SceneRun::movable_bodies() const {
  const kernel::Model& model = environment_->model();
  std::vector<std::string> ids;
  for (std::uint32_t i = 0; i < model.body_count; ++i)
    if ((model.flags[i] & kMovable) != 0) ids.push_back(model.body_id[i]);
  return ids;
}

bool SceneRun::holds(const std::string& joint) const {
  const std::vector<kernel::ConstraintDescription>& joints = environment_->model().constraints;
  const auto found = std::ranges::find(joints, joint, &kernel::ConstraintDescription::id);
  if (found == joints.end()) throw std::invalid_argument("no joint '" + joint + "'");
  return environment_->is_intact(static_cast<std::uint32_t>(found - joints.begin()));
}

double SceneRun::kinetic_energy() const {
  double sum = 0.0;
  for (const std::string& id : movable_bodies()) {
    const Motion m = body(id);
    sum += gravitas::kinetic_energy(mass(id), moments(id), m.pose.orientation, m.twist);
  }
  return sum;
}

Vector3 SceneRun::momentum() const {
  Vector3 sum = Vector3::Zero();
  for (const std::string& id : movable_bodies()) sum += mass(id) * body(id).twist.linear;
  return sum;
}

Vector3 SceneRun::angular_momentum() const {
  Vector3 sum = Vector3::Zero();
  for (const std::string& id : movable_bodies()) {
    const Motion m = body(id);
    sum += gravitas::angular_momentum(mass(id), moments(id), m.pose, m.twist);
  }
  return sum;
}

void SceneRun::order_swap(const std::string& order) {
  environment_->order_swap(resolve_swap(parse_swap(order), description_, &catalog_));
}

const report::v1::Report& SceneRun::report() {
  report_.Clear();
  figures_->write(&report_);
  return report_;
}

std::uint32_t SceneRun::count_events(EventKind kind) const {
  return static_cast<std::uint32_t>(std::ranges::count(events_, kind, &Event::kind));
}

}  // namespace gravitas::harness
