#include "services/recorder/identity.h"

#include <fmt/format.h>

#include <cstring>
#include <string_view>
#include <type_traits>
#include <vector>

#include "plugin_sdk/channel/digest.h"
#include "plugin_sdk/slots.h"

namespace gravitas {
namespace {

// A digest of numbers and texts, each with its length where it has one.
class PartDigest {
 public:
  template <typename T>
  requires std::is_arithmetic_v<T> || std::is_enum_v<T> PartDigest& operator<<(T number) {
    digest_.add(&number, sizeof number);
    return *this;
  }
  PartDigest& operator<<(std::string_view text) {
    *this << text.size();
    digest_.add(text.data(), text.size());
    return *this;
  }
  PartDigest& operator<<(const std::vector<double>& numbers) {
    *this << numbers.size();
    digest_.add(numbers.data(), numbers.size() * sizeof(double));
    return *this;
  }
  PartDigest& operator<<(const Vector3& v) { return *this << v.x() << v.y() << v.z(); }
  PartDigest& operator<<(const Quaternion& q) { return *this << q.w() << q.x() << q.y() << q.z(); }
  PartDigest& operator<<(const Pose& pose) { return *this << pose.position << pose.orientation; }

  std::uint64_t value() const { return digest_.value(); }

 private:
  channel::Digest digest_;
};

void add_part(const std::string& name, const PartDigest& digest, recorder::v1::Identity* identity) {
  recorder::v1::Part* part = identity->add_parts();
  part->set_name(name);
  part->set_digest(digest.value());
}

PartDigest digest_bodies(const kernel::EnvironmentDescription& d) {
  PartDigest digest;
  for (const kernel::BodyDescription& body : d.bodies) {
    digest << body.flags << body.mass << body.inertia << body.damping << body.pose << body.twist.linear
           << body.twist.angular << body.shape << body.geometry << body.bound.kind << body.bound.centre
           << body.bound.orientation << body.bound.half_extents << body.material << body.filter_group
           << body.filter_mask << body.motion.rows << body.motion.surface << body.forces.size();
    for (const std::uint32_t force : body.forces) digest << force;
  }
  return digest;
}

PartDigest digest_shapes(const kernel::EnvironmentDescription& d) {
  PartDigest digest;
  for (const kernel::ShapeDescription& shape : d.shapes) digest << shape.type << shape.parameters;
  return digest;
}

PartDigest digest_forces(const kernel::EnvironmentDescription& d) {
  PartDigest digest;
  for (const kernel::ForceDescription& force : d.forces) digest << force.type << force.parameters << force.plugin;
  return digest;
}

PartDigest digest_joints(const kernel::EnvironmentDescription& d) {
  PartDigest digest;
  for (const kernel::ConstraintDescription& joint : d.constraints)
    digest << joint.type << joint.parameters << joint.body1 << joint.body2 << joint.breaking_threshold
           << joint.breaking_force << joint.breaking_torque << joint.plugin;
  return digest;
}

PartDigest digest_plugins(const kernel::SlotDescription& slot) {
  PartDigest digest;
  for (const kernel::PluginChoice& plugin : slot.plugins)
    digest << plugin.declaration.name << plugin.declaration.version << plugin.declaration.theta << plugin.settings;
  return digest;
}

}  // namespace

recorder::v1::Identity identity_of(const kernel::EnvironmentDescription& d) {
  recorder::v1::Identity identity;
  identity.set_time_step(d.time_step);
  add_part("the simulator, its Substeps or its Accuracy", PartDigest() << d.simulator << d.substeps << d.accuracy,
           &identity);
  add_part("SleepEnergy or SleepTime", PartDigest() << d.sleep.energy << d.sleep.time, &identity);
  add_part("bodies", digest_bodies(d), &identity);
  add_part("geometries", digest_shapes(d), &identity);
  add_part("materials", PartDigest() << d.material_count << d.material_pairs, &identity);
  add_part("forces", digest_forces(d), &identity);
  add_part("joints", digest_joints(d), &identity);
  for (const Slot slot : kSlots)
    add_part(fmt::format("the plugin of slot {} or its settings", slot_name(slot)), digest_plugins(d.slot(slot)),
             &identity);
  for (const Slot slot : kSlots)
    for (const kernel::PluginChoice& plugin : d.slot(slot).plugins) {
      if (plugin.library.empty()) continue;
      recorder::v1::Library* library = identity.add_libraries();
      library->set_plugin(plugin.declaration.name);
      library->set_path(plugin.library);
    }
  return identity;
}

std::string find_difference(const recorder::v1::Identity& recorded, const recorder::v1::Identity& scene) {
  std::string differences;
  const auto add = [&](const std::string& text) { differences += (differences.empty() ? "" : ", ") + text; };
  const double recorded_step = recorded.time_step(), step = scene.time_step();
  if (std::memcmp(&recorded_step, &step, sizeof step) != 0)
    add(fmt::format("time step ({:.17g} s there, {:.17g} s here)", recorded_step, step));
  if (recorded.parts_size() != scene.parts_size()) add("number of parts");
  for (int i = 0; i < std::min(recorded.parts_size(), scene.parts_size()); ++i)
    if (recorded.parts(i).name() != scene.parts(i).name() || recorded.parts(i).digest() != scene.parts(i).digest())
      add(scene.parts(i).name());
  return differences;
}

Hash digest_of(const recorder::v1::Identity& identity) {
  std::vector<std::uint64_t> words;
  PartDigest build;
  build << std::string_view(GRAVITAS_BUILD_ID) << identity.time_step();
  words.push_back(build.value());
  for (const recorder::v1::Part& part : identity.parts()) words.push_back(part.digest());
  const XXH128_hash_t hash = XXH3_128bits(words.data(), words.size() * sizeof(std::uint64_t));
  return {hash.low64, hash.high64};
}

}  // namespace gravitas
