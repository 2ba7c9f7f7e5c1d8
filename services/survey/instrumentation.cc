#include "services/survey/instrumentation.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/iterator/counting_iterator.hpp>
#include <cctype>
#include <stdexcept>

#include "plugin_sdk/collision.h"
#include "plugin_sdk/near_miss.h"
#include "services/survey/numbers.h"

namespace gravitas::survey {
namespace {

namespace v1 = instrumentation::v1;

constexpr std::string_view kPrefix = "KIND_";
constexpr const char* kCapability = "debug_geometry";

void add_line(Kind kind, const std::string& id, const Vector3& from, const Vector3& to, Frame* frame) {
  v1::Line* line = frame->add_lines();
  line->set_kind(kind);
  line->set_id(id);
  write(from, line->mutable_from());
  write(to, line->mutable_to());
}

void add_arrow(Kind kind, const std::string& id, const Vector3& origin, const Vector3& vector, Frame* frame) {
  v1::Arrow* arrow = frame->add_arrows();
  arrow->set_kind(kind);
  arrow->set_id(id);
  write(origin, arrow->mutable_origin());
  write(vector, arrow->mutable_vector());
}

void add_box(Kind kind, const std::string& id, const Pose& pose, const Vector3& half_extents, std::uint32_t depth,
             Frame* frame) {
  v1::Box* box = frame->add_boxes();
  box->set_kind(kind);
  box->set_id(id);
  box->set_depth(depth);
  write(pose.position, box->mutable_centre());
  write(half_extents, box->mutable_half_extents());
  write(pose.orientation, box->mutable_orientation());
}

void add_box(Kind kind, const std::string& id, const Vector3& lower, const Vector3& upper, std::uint32_t depth,
             Frame* frame) {
  add_box(kind, id, Pose{0.5 * (lower + upper), Quaternion::Identity()}, 0.5 * (upper - lower), depth, frame);
}

void add_label(Kind kind, const std::string& id, const Vector3& position, const std::string& text, Frame* frame) {
  v1::Label* label = frame->add_labels();
  label->set_kind(kind);
  label->set_id(id);
  label->set_text(text);
  write(position, label->mutable_position());
}

template <typename T>
std::span<const T> column_of(const kernel::SavedState& state, std::string_view name) {
  for (const kernel::SavedColumn& column : state.columns)
    if (column.name == name) return std::get<std::span<const T>>(column.numbers);
  throw std::logic_error("no column " + std::string(name) + " in the state");
}

// What the last step remembers of its contacts.
class Impulses {
 public:
  explicit Impulses(const kernel::Environment& environment)
      : state_(environment.saved_state()),
        body_(column_of<std::uint32_t>(state_, "contact_body")),
        feature_(column_of<std::uint32_t>(state_, "contact_feature")),
        impulse_(column_of<double>(state_, "contact_impulse")) {}

  // On the second body, N s; zero if the contact is new.
  Vector3 of(const Contact& contact) const {
    const auto identity = [&](std::size_t i) { return std::array{body_[2 * i], body_[2 * i + 1], feature_[i]}; };
    const std::array wanted{contact.a, contact.b, contact.feature};
    const boost::counting_iterator<std::size_t> begin(0), end(feature_.size());
    const std::size_t found = *std::partition_point(begin, end, [&](std::size_t i) { return identity(i) < wanted; });
    if (found == feature_.size() || identity(found) != wanted) return Vector3::Zero();
    return vector_at(impulse_, found);
  }

 private:
  kernel::SavedState state_;
  std::span<const std::uint32_t> body_, feature_;
  std::span<const double> impulse_;
};

}  // namespace

std::string kind_name(Kind kind) {
  std::string name = v1::Kind_Name(kind).substr(kPrefix.size());
  std::ranges::transform(name, name.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return name;
}

std::vector<Kind> all_kinds() {
  std::vector<Kind> kinds;
  for (int i = v1::Kind_MIN + 1; i <= v1::Kind_MAX; ++i) kinds.push_back(static_cast<Kind>(i));
  return kinds;
}

Kind find_kind(const std::string& name) {
  std::vector<std::string> names;
  for (const Kind kind : all_kinds()) {
    names.push_back(kind_name(kind));
    if (names.back() == name) return kind;
  }
  throw std::invalid_argument(
      fmt::format("there is no kind '{}' of instrumentation; {}", name, allowed_names(name, names)));
}

Instrumentation::Instrumentation(Surveyor* surveyor) : surveyor_(*surveyor) {}

Frame Instrumentation::frame(const kernel::Environment& environment, const std::vector<Kind>& kinds) {
  Frame frame;
  frame.set_time(environment.time());
  frame.set_step(environment.step_count());
  const auto is_wanted = [&](Kind kind) { return std::ranges::find(kinds, kind) != kinds.end(); };
  // what cannot be had leaves nothing behind but its reason
  const auto add = [&](Kind kind, const auto& part) {
    Frame piece;
    try {
      part(&piece);
      frame.MergeFrom(piece);
    } catch (const NoAnswer& reason) {
      frame.add_missing(kind_name(kind) + ": " + reason.what());
    }
  };
  const auto add_if_wanted = [&](Kind kind, const auto& part) {
    if (is_wanted(kind)) add(kind, part);
  };
  const bool contacts = is_wanted(v1::KIND_CONTACT), reactions = is_wanted(v1::KIND_REACTION);
  if (contacts || reactions)
    add(contacts ? v1::KIND_CONTACT : v1::KIND_REACTION,
        [&](Frame* piece) { add_contacts(environment, contacts, reactions, piece); });
  add_if_wanted(v1::KIND_JOINT, [&](Frame* piece) { add_joints(environment, piece); });
  add_if_wanted(v1::KIND_FORCE, [&](Frame* piece) { add_forces(environment, piece); });
  add_if_wanted(v1::KIND_BOUNDS, [&](Frame* piece) { add_bounds(environment, piece); });
  add_if_wanted(v1::KIND_TRAJECTORY, [&](Frame* piece) { add_trajectories(environment, piece); });
  add_if_wanted(v1::KIND_SPACE, [&](Frame* piece) { add_space(environment, piece); });
  add_if_wanted(v1::KIND_SHAPE, [&](Frame* piece) { add_shapes(environment, piece); });
  add_if_wanted(v1::KIND_TREE, [&](Frame* piece) { add_trees(environment, piece); });
  return frame;
}

const std::string& Instrumentation::body_id(std::uint32_t body) const {
  return surveyor_.description().bodies[body].id;
}

void Instrumentation::add_contacts(const kernel::Environment& environment, bool shows_contacts, bool shows_reactions,
                                   Frame* frame) {
  if (shows_reactions && surveyor_.description().simulator >= kernel::Simulator::kBisection) {
    frame->add_missing("reaction: this simulator makes inner steps of any length, and keeps the impulses of the last");
    shows_reactions = false;
  }
  const double last_step = environment.saved_state().step_length, same_time = 1e-9 * last_step;
  const auto has_jumped = [&](double jump) {
    return jump > environment.time() - last_step + same_time && jump < environment.time() - same_time;
  };
  if (shows_reactions && std::ranges::any_of(surveyor_.description().switches, has_jumped)) {
    frame->add_missing("reaction: a force has jumped within the last step, which was made in parts");
    shows_reactions = false;
  }
  if (!shows_contacts && !shows_reactions) return;
  const std::vector<Contact> contacts = surveyor_.contacts(environment);
  const Impulses impulses(environment);
  // the last step may be a shorter one; what sleepers keep is of a whole one
  const auto stands = [&](std::uint32_t body) {
    return environment.is_asleep(body) || (environment.model().flags[body] & kMovable) == 0;
  };
  const auto inner_length = [&](const Contact& contact) {
    const double made = environment.inner_step_length();
    if (made > 0.0 && !(stands(contact.a) && stands(contact.b))) return made;
    return environment.time_step() / surveyor_.description().substeps;
  };
  for (const Contact& contact : contacts) {
    const std::string id = body_id(contact.a) + "/" + body_id(contact.b);
    if (shows_contacts) {
      const Vector3 half = 0.5 * contact.depth * contact.normal;
      add_arrow(v1::KIND_CONTACT, id, contact.point, contact.normal, frame);
      if (contact.depth != 0.0) add_line(v1::KIND_CONTACT, id, contact.point + half, contact.point - half, frame);
      add_label(v1::KIND_CONTACT, id, contact.point, fmt::format("{:#x} {:.3g} m", contact.feature, contact.depth),
                frame);
    }
    const Vector3 impulse = impulses.of(contact);
    if (shows_reactions && !impulse.isZero(0.0))
      add_arrow(v1::KIND_REACTION, id, contact.point, impulse / inner_length(contact), frame);
  }
}

void Instrumentation::add_joints(const kernel::Environment& environment, Frame* frame) {
  for (const Anchor& anchor : surveyor_.anchors(environment)) {
    const kernel::ConstraintDescription& joint = surveyor_.description().constraints[anchor.joint];
    if (anchor.point1 != anchor.point2) add_line(v1::KIND_JOINT, joint.id, anchor.point1, anchor.point2, frame);
    for (const auto& [body, point] : {std::pair{joint.body1, anchor.point1}, {joint.body2, anchor.point2}})
      if (body != kNone && pose_of(environment, body).position != point)
        add_line(v1::KIND_JOINT, joint.id, pose_of(environment, body).position, point, frame);
    add_label(v1::KIND_JOINT, joint.id, anchor.point1, fmt::format("{} {:.3g} m", joint.id, anchor.error), frame);
  }
}

void Instrumentation::add_forces(const kernel::Environment& environment, Frame* frame) {
  for (const AppliedForce& applied : surveyor_.forces(environment)) {
    const std::string id = surveyor_.description().forces[applied.force].id + " on " + body_id(applied.body);
    const Vector3 centre = pose_of(environment, applied.body).position;
    if (!applied.wrench.force.isZero(0.0)) add_arrow(v1::KIND_FORCE, id, centre, applied.wrench.force, frame);
    if (!applied.wrench.torque.isZero(0.0))
      add_arrow(v1::KIND_FORCE, id + " torque", centre, applied.wrench.torque, frame);
  }
}

void Instrumentation::add_bounds(const kernel::Environment& environment, Frame* frame) const {
  for (std::uint32_t body = 0; body < environment.model().body_count; ++body) {
    if (environment.model().bound[body].kind == BoundKind::kEverywhere) continue;
    const Bounds bounds = bounds_of(environment, body);
    add_box(v1::KIND_BOUNDS, body_id(body), bounds.lower, bounds.upper, 0, frame);
  }
}

void Instrumentation::add_trajectories(const kernel::Environment& environment, Frame* frame) {
  std::map<std::string, Vector3> origins;
  for (std::uint32_t body = 0; body < environment.model().body_count; ++body) {
    const Vector3 origin = origins[body_id(body)] = placed(environment, body).position;
    const auto last = last_origins_.find(body_id(body));
    if (last != last_origins_.end() && last->second != origin)
      add_line(v1::KIND_TRAJECTORY, body_id(body), last->second, origin, frame);
  }
  last_origins_ = std::move(origins);
}

void Instrumentation::add_space(const kernel::Environment& environment, Frame* frame) {
  for (const kernel::LeftOut& left_out : environment.plan().left_out)
    if (left_out.what == slot_name(Slot::kSpace)) throw NoAnswer("the plan left the space out: " + left_out.why);
  surveyor_.require(Slot::kSpace, kCapability, "nodes of the space");
  const double margin = contact_margin(environment.model().bound);
  const MessageColumns nodes =
      surveyor_.ask(stage::Method::kSpaceDebugGeometry,
                    surveyor_.request(stage::Method::kSpaceDebugGeometry, environment, 0.5 * margin));
  for (std::size_t i = 0; i < nodes.u32("depth").size(); ++i)
    add_box(v1::KIND_SPACE, surveyor_.slot(Slot::kSpace).description().plugins[0].declaration.name,
            vector_at(nodes.f64("node_lower"), i), vector_at(nodes.f64("node_upper"), i), nodes.u32("depth")[i], frame);
}

// How far from the origin the bounds of the scene reach, and 1 m at least.
double Instrumentation::extent(const kernel::Environment& environment) {
  if (!extent_) {
    extent_ = 1.0;
    for (std::uint32_t body = 0; body < environment.model().body_count; ++body) {
      if (environment.model().bound[body].kind == BoundKind::kEverywhere) continue;
      const Bounds bounds = bounds_of(environment, body);
      extent_ = std::max({*extent_, bounds.lower.cwiseAbs().maxCoeff(), bounds.upper.cwiseAbs().maxCoeff()});
    }
  }
  return *extent_;
}

// Shapes do not change, so each is asked for once.
const MessageColumns& Instrumentation::shape_geometry(const kernel::Environment& environment, std::uint32_t kinds) {
  surveyor_.require(Slot::kCollision, kCapability, "lines and nodes of shapes");
  const std::string& plugin = surveyor_.slot(Slot::kCollision).description().plugins[0].declaration.name;
  if (plugin != geometry_plugin_) shape_geometry_.clear();
  geometry_plugin_ = plugin;
  const auto known = shape_geometry_.find(kinds);
  if (known != shape_geometry_.end()) return known->second;
  MessageColumns request = surveyor_.request(stage::Method::kCollisionDebugGeometry, environment);
  request.u32("kinds") = {kinds};
  request.f64("extent") = {extent(environment)};
  const std::uint32_t shapes = environment.model().shape_count;
  const auto check = [&](const MessageColumns& reply) -> AnswerProblem {
    for (const char* name : {"line_shape", "node_shape"}) {
      const std::vector<std::uint32_t>& rows = reply.u32(name);
      if (!std::ranges::is_sorted(rows)) return {true, std::string(name) + " does not ascend"};
      if (!rows.empty() && rows.back() >= shapes)
        return {true, std::string(name) + " names a shape that does not exist"};
    }
    return {};
  };
  return shape_geometry_[kinds] = surveyor_.ask(stage::Method::kCollisionDebugGeometry, request, check);
}

void Instrumentation::add_shapes(const kernel::Environment& environment, Frame* frame) {
  const kernel::Model& model = environment.model();
  if (model.shape_count == 0) return;
  const MessageColumns& lines = shape_geometry(environment, collision::kOutlines);
  const std::vector<std::uint32_t>& shape = lines.u32("line_shape");
  for (std::uint32_t body = 0; body < model.body_count; ++body) {
    const Pose pose = placed(environment, body);
    const auto [begin, end] = std::equal_range(shape.begin(), shape.end(), model.body_shape[body]);
    for (auto row = begin; row != end; ++row) {
      const auto i = static_cast<std::size_t>(row - shape.begin());
      add_line(v1::KIND_SHAPE, body_id(body), transform_point(pose, vector_at(lines.f64("line_from"), i)),
               transform_point(pose, vector_at(lines.f64("line_to"), i)), frame);
    }
  }
}

void Instrumentation::add_trees(const kernel::Environment& environment, Frame* frame) {
  const kernel::Model& model = environment.model();
  if (model.shape_count == 0) return;
  const MessageColumns& nodes = shape_geometry(environment, collision::kTrees);
  const std::vector<std::uint32_t>& shape = nodes.u32("node_shape");
  for (std::uint32_t body = 0; body < model.body_count; ++body) {
    const Pose pose = placed(environment, body);
    const auto [begin, end] = std::equal_range(shape.begin(), shape.end(), model.body_shape[body]);
    for (auto row = begin; row != end; ++row) {
      const auto i = static_cast<std::size_t>(row - shape.begin());
      const Pose own{vector_at(nodes.f64("node_centre"), i), quaternion_at(nodes.f64("node_orientation"), i)};
      add_box(v1::KIND_TREE, body_id(body), compose(pose, own), vector_at(nodes.f64("node_half_extents"), i),
              nodes.u32("node_depth")[i], frame);
    }
  }
}

}  // namespace gravitas::survey
