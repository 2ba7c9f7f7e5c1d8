#include "services/scene/change.h"

#include <algorithm>
#include <string_view>
#include <vector>

#include "plugin_sdk/near_miss.h"
#include "services/scene/overrides.h"
#include "services/scene/reader.h"

namespace gravitas::scene {
namespace {

const std::vector<std::string> kElements = {"Body", "Constraint", "Geometry", "Material", "Force"};

class Changing {
 public:
  Changing(v1::Scene* scene, ChangeLog* log, Problems* problems) : scene_(scene), log_(log), problems_(problems) {}

  bool apply(const edit::v1::Change& change) {
    switch (change.kind_case()) {
      case edit::v1::Change::kAdd:
        return add(change.add());
      case edit::v1::Change::kRemove:
        return remove(change.remove());
      case edit::v1::Change::kSet:
        return set(change.set());
      case edit::v1::Change::KIND_NOT_SET:
        break;
    }
    return refuse("edit", "a change that says nothing; allowed: add, remove, set");
  }

 private:
  bool refuse(const std::string& what, const std::string& why) {
    const auto file = static_cast<std::uint32_t>(scene_->files_size());
    scene_->add_files(what);
    Diagnostics(*scene_, problems_).error({file, 1, 1}, why);
    return false;
  }

  bool add(const edit::v1::Addition& addition) {
    v1::Addition elements;
    if (!read_addition({addition.name(), addition.text()}, scene_, &elements, problems_)) return false;
    if (scene_->environment_size() == 0) return refuse("add " + addition.name(), "the scene has no Environment");
    v1::Environment* environment = scene_->mutable_environment(0);
    for (const v1::Body& body : elements.bodies().body()) {
      log_->new_bodies.insert(body.id());
      log_->motions.erase(body.id());
    }
    for (const v1::Constraint& joint : elements.constraints().constraint()) log_->new_joints.insert(joint.id());
    const auto append = [](const auto& from, auto* to) { to->MergeFrom(from); };
    append(elements.geometries().geometry(), scene_->mutable_geometries()->mutable_geometry());
    append(elements.materials().material(), scene_->mutable_materials()->mutable_material());
    append(elements.forces().force(), scene_->mutable_forces()->mutable_force());
    append(elements.bodies().body(), environment->mutable_space()->mutable_bodies()->mutable_body());
    append(elements.constraints().constraint(), environment->mutable_constraints()->mutable_constraint());
    return true;
  }

  template <typename Elements>
  bool remove_from(Elements* elements, const std::string& path, const std::string& id) {
    const auto found = std::ranges::find_if(*elements, [&](const auto& one) { return one.id() == id; });
    if (found != elements->end()) {
      elements->erase(found);
      return true;
    }
    std::vector<std::string> ids;
    for (const auto& one : *elements) ids.push_back(one.id());
    return refuse("remove " + path, "there is none; " + allowed_names(id, ids));
  }

  bool remove(const std::string& path) {
    const std::size_t dot = std::min(path.find('.'), path.size());
    const std::string kind = path.substr(0, dot), id = dot < path.size() ? path.substr(dot + 1) : "";
    if (kind == "Geometry") return remove_from(scene_->mutable_geometries()->mutable_geometry(), path, id);
    if (kind == "Material") return remove_from(scene_->mutable_materials()->mutable_material(), path, id);
    if (kind == "Force") return remove_from(scene_->mutable_forces()->mutable_force(), path, id);
    if (scene_->environment_size() > 0 && kind == "Body")
      return remove_from(scene_->mutable_environment(0)->mutable_space()->mutable_bodies()->mutable_body(), path, id);
    if (scene_->environment_size() > 0 && kind == "Constraint")
      return remove_from(scene_->mutable_environment(0)->mutable_constraints()->mutable_constraint(), path, id);
    return refuse("remove " + path, "\"" + kind + "\" is nothing that can go; " + allowed_names(kind, kElements));
  }

  bool set(const std::string& text) {
    const std::string root = text.substr(0, text.find_first_of(".="));
    if (std::ranges::find(kElements, root) == kElements.end())
      return refuse("set " + text, "\"" + root + "\" is nothing that an edit sets; " + allowed_names(root, kElements) +
                                       "; a plugin and its properties are exchanged by a swap");
    const bool is_set = apply_override(scene_, text, problems_);
    // it was not an option of a command line
    for (std::vector<SceneError>* said : {&problems_->errors, &problems_->warnings})
      for (SceneError& one : *said)
        if (one.file == "--set " + text) one.file = "set " + text;
    if (!is_set) return false;
    *scene_->mutable_files()->rbegin() = "set " + text;
    if (root == "Body") note_motion(text);
    return true;
  }

  // "Body.<id>[.KineticProperties].Position=…"
  void note_motion(const std::string& text) {
    std::string_view path = std::string_view(text).substr(0, text.find('='));
    while (path.ends_with(' ') || path.ends_with('\t')) path.remove_suffix(1);
    const std::size_t dot = path.rfind('.');
    const std::string_view property = path.substr(dot + 1);
    std::string_view id = path.substr(0, dot);
    constexpr std::string_view kInside = ".KineticProperties";
    if (id.ends_with(kInside)) id.remove_suffix(kInside.size());
    id.remove_prefix(std::min(id.find('.') + 1, id.size()));
    if (log_->new_bodies.contains(std::string(id))) return;
    SetMotion motion = log_->motions[std::string(id)];
    motion.position |= property == "Position";
    motion.orientation |= property == "Orientation";
    motion.linear_velocity |= property == "LinearVelocity";
    motion.angular_velocity |= property == "AngularVelocity";
    log_->motions[std::string(id)] = motion;
  }

  v1::Scene* scene_;
  ChangeLog* log_;
  Problems* problems_;
};

}  // namespace

bool apply_changes(const google::protobuf::RepeatedPtrField<edit::v1::Change>& changes, v1::Scene* scene,
                   ChangeLog* log, Problems* problems) {
  Changing changing(scene, log, problems);
  return std::ranges::all_of(changes, [&](const edit::v1::Change& change) { return changing.apply(change); });
}

}  // namespace gravitas::scene
