#include "services/edit/edited_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <set>
#include <stdexcept>

#include "plugin_sdk/checks.h"
#include "plugin_sdk/motion_curve.h"
#include "services/edit/disturbance.h"
#include "services/edit/turned_joints.h"

namespace gravitas {
namespace {

constexpr std::uint32_t kCarried = kMovable | kKinematic;

// -0 is 0, as in a state.
Pose without_negative_zeros(Pose pose) {
  pose.position.array() += 0.0;
  pose.orientation.coeffs().array() += 0.0;
  return pose;
}

bool is_same(const Pose& a, const Pose& b) {
  return a.position == b.position && a.orientation.coeffs() == b.orientation.coeffs();
}

template <typename Elements>
std::map<std::string, std::uint32_t> rows_of(const Elements& elements) {
  std::map<std::string, std::uint32_t> rows;
  for (std::uint32_t i = 0; i < elements.size(); ++i) rows[elements[i].id] = i;
  return rows;
}

std::uint32_t find_row(const std::map<std::string, std::uint32_t>& rows, const std::string& id) {
  const auto found = rows.find(id);
  return found == rows.end() ? kNone : found->second;
}

Hash digest_of(const edit::v1::Edit& edit) {
  std::string text;
  const auto add = [&](const std::string& one) { text += fmt::format("{} {} ", one.size(), one); };
  for (const edit::v1::Change& change : edit.changes()) {
    add(change.has_add() ? "add" : change.kind_case() == edit::v1::Change::kRemove ? "remove" : "set");
    add(change.has_add()                                  ? change.add().text()
        : change.kind_case() == edit::v1::Change::kRemove ? change.remove()
                                                          : change.set());
  }
  const XXH128_hash_t hash = XXH3_128bits(text.data(), text.size());
  return {hash.low64, hash.high64};
}

// As on a command line.
std::string text_of(const edit::v1::Change& change) {
  if (change.has_add()) return "add " + change.add().name();
  return change.kind_case() == edit::v1::Change::kRemove ? "remove " + change.remove() : "set " + change.set();
}

// Forces of a scene that act once.
std::set<std::string> impulses_in(const scene::v1::Scene& scene) {
  std::set<std::string> ids;
  for (const scene::v1::Force& force : scene.forces().force())
    for (const scene::v1::Property& property : force.custom_properties().property())
      if (property.name() == "Instantaneous" && property.value().flag()) ids.insert(force.id());
  return ids;
}

scene::SetMotion motion_set_of(const scene::ChangeLog& log, const std::string& body) {
  const auto set = log.motions.find(body);
  return set == log.motions.end() ? scene::SetMotion{} : set->second;
}

}  // namespace

EditedScene::EditedScene(const RunOptions& options, const scene::v1::Scene& scene,
                         const kernel::EnvironmentDescription& before, Catalog* catalog, edit::v1::Edit* edit,
                         const kernel::Environment* now)
    : first_(scene), before_(before), edit_(*edit), scene_(scene) {
  read_changes(options, catalog);
  if (edit_.step() > 1) refuse_late_impulses();
  find_kept();
  keep_stopped();
  if (now != nullptr) {
    find_motions(*now);
    write_places();
    warn_of_broken(*now);
  }
  place();
}

// By the changes, where the problem does not stand in one of them.
std::string EditedScene::named(const std::string& problem) const {
  std::string changes;
  for (const edit::v1::Change& change : edit_.changes()) {
    const std::string what = text_of(change);
    if (problem.starts_with(change.has_add() ? change.add().name() : what))
      return fmt::format("edit before step {}: {}", edit_.step(), problem);
    changes += (changes.empty() ? "" : ", ") + what;
  }
  return fmt::format("edit before step {} ({}): {}", edit_.step(), changes, problem);
}

void EditedScene::read_changes(const RunOptions& options, Catalog* catalog) {
  scene::Problems problems;
  if (!scene::apply_changes(edit_.changes(), &scene_, &log_, &problems))
    throw BadInput(named(scene::to_string(problems.errors.at(0))));
  try {
    description_ = build_scene(options, scene_, catalog, &warnings_);
    // a library of a swap may have their names
    keep_who_answers(before_, before_, &description_);
  } catch (const BadInput& problem) {
    throw BadInput(named(problem.what()));
  }
}

std::unique_ptr<kernel::Environment> EditedScene::start(const kernel::EnvironmentDescription& begun,
                                                        const kernel::HostStarter& starter) const {
  try {
    return gravitas::start(begun, starter, &scene_);
  } catch (const BadInput& problem) {
    throw BadInput(named(problem.what()));
  }
}

void EditedScene::refuse_late_impulses() const {
  const std::set<std::string> impulses = impulses_in(scene_), acted_at_start = impulses_in(first_);
  const auto rows = rows_of(before_.bodies);
  for (const kernel::BodyDescription& body : description_.bodies) {
    const std::uint32_t row = log_.new_bodies.contains(body.id) ? kNone : find_row(rows, body.id);
    for (const std::uint32_t force : body.forces) {
      const std::string& id = description_.forces[force].id;
      const bool acted = row != kNone && acted_at_start.contains(id) &&
                         std::ranges::any_of(before_.bodies[row].forces,
                                             [&](std::uint32_t one) { return before_.forces[one].id == id; });
      if (impulses.contains(id) && !acted)
        throw BadInput(
            fmt::format("edit before step {}: the force '{}' on '{}' is Instantaneous and would act at t = 0; "
                        "set the body's velocity instead",
                        edit_.step(), id, body.id));
    }
  }
}

void EditedScene::look_at_limits(const kernel::EnvironmentDescription& active, const kernel::Environment& now,
                                 const kernel::EnvironmentDescription& begun, const kernel::Environment& next) {
  std::ranges::move(warnings_of_turned_joints(edit_, {active, now}, {begun, next}), std::back_inserter(warnings_));
}

// Whatever is set of a joint that broke, it holds nothing.
void EditedScene::warn_of_broken(const kernel::Environment& now) {
  for (const edit::v1::Change& change : edit_.changes())
    for (std::size_t j = 0; j < old_joint_.size(); ++j)
      if (old_joint_[j] != kNone && !now.is_intact(old_joint_[j]) &&
          change.set().starts_with("Constraint." + description_.constraints[j].id + "."))
        warnings_.push_back(fmt::format(
            "edit before step {}: {}: the joint is broken, and stays so; to have it again, remove it and add it",
            edit_.step(), text_of(change)));
}

void EditedScene::find_kept() {
  const auto bodies = rows_of(before_.bodies);
  for (const kernel::BodyDescription& body : description_.bodies)
    old_body_.push_back(log_.new_bodies.contains(body.id) ? kNone : find_row(bodies, body.id));
  const auto joints = rows_of(before_.constraints);
  for (const kernel::ConstraintDescription& joint : description_.constraints) {
    std::uint32_t row = log_.new_joints.contains(joint.id) ? kNone : find_row(joints, joint.id);
    if (row != kNone) {
      const kernel::ConstraintDescription& old = before_.constraints[row];
      const auto keeps = [&](std::uint32_t body, std::uint32_t old_one) {
        return body == kNone ? old_one == kNone : old_body_[body] == old_one;
      };
      if (old.type != joint.type || !keeps(joint.body1, old.body1) || !keeps(joint.body2, old.body2)) row = kNone;
    }
    old_joint_.push_back(row);
  }
}

// It can move no more, and stays where it is now.
bool EditedScene::has_stopped(std::uint32_t body) const {
  const std::uint32_t row = old_body_[body];
  return row != kNone && (before_.bodies[row].flags & kCarried) != 0 &&
         (description_.bodies[body].flags & kCarried) == 0;
}

// Whom an earlier edit stopped does not go back to where the scene's text has it.
void EditedScene::keep_stopped() {
  for (std::uint32_t i = 0; i < description_.bodies.size(); ++i) {
    const std::uint32_t row = old_body_[i];
    if (row != kNone && ((description_.bodies[i].flags | before_.bodies[row].flags) & kCarried) == 0)
      description_.bodies[i].pose = moved(before_.bodies[row].pose, i);
  }
}

Pose EditedScene::recentred(const Pose& pose, std::uint32_t body) const {
  const kernel::BodyDescription &next = description_.bodies[body], &old = before_.bodies[old_body_[body]];
  if (is_same(old.geometry, next.geometry)) return pose;
  Pose now = compose(compose(pose, old.geometry), inverse(next.geometry));
  now.orientation.normalize();
  return now;
}

Pose EditedScene::moved(Pose pose, std::uint32_t body) const {
  const kernel::BodyDescription &next = description_.bodies[body], &old = before_.bodies[old_body_[body]];
  const scene::SetMotion motion = motion_set_of(log_, next.id);
  if (!motion.position && !motion.orientation) return recentred(pose, body);
  Pose frame = compose(pose, old.geometry);
  const Pose wanted = compose(next.pose, next.geometry);
  if (motion.position) frame.position = wanted.position;
  if (motion.orientation) frame.orientation = wanted.orientation;
  pose = compose(frame, inverse(next.geometry));
  pose.orientation.normalize();
  return pose;
}

void EditedScene::find_motions(const kernel::Environment& now) {
  const kernel::StateView state = now.state();
  for (std::uint32_t i = 0; i < description_.bodies.size(); ++i) {
    const kernel::BodyDescription& body = description_.bodies[i];
    Pose pose = body.pose;
    Twist twist = body.twist;
    const std::uint32_t row = old_body_[i];
    if (row != kNone && ((body.flags & kCarried) != 0 || has_stopped(i)) && now.step_count() > 0) {
      const scene::SetMotion motion = motion_set_of(log_, body.id);
      const kernel::BodyDescription& old = before_.bodies[row];
      const Pose stood = {vector_at(state.position, row), quaternion_at(state.orientation, row)};
      const Twist was = {vector_at(state.linear_velocity, row), vector_at(state.angular_velocity, row)};
      pose = moved(stood, i);
      if (body.motion.surface != old.motion.surface && !body.motion.empty())
        twist = MotionCurve(body.motion, body.geometry).at(now.time()).twist;
      else if (!motion.linear_velocity)
        // of what of the body is at its centre of mass now
        twist.linear = was.linear + was.angular.cross(recentred(stood, i).position - stood.position);
      if (!motion.angular_velocity) twist.angular = was.angular;
    } else if (!body.motion.empty() && now.step_count() > 0) {
      const MotionCurve::State there = MotionCurve(body.motion, body.geometry).at(now.time());
      pose = there.pose;
      twist = there.twist;
    }
    pose_.push_back(without_negative_zeros(pose));
    twist_.push_back(has_stopped(i) ? Twist{} : Twist{twist.linear.array() + 0.0, twist.angular.array() + 0.0});
  }
}

void EditedScene::write_places() {
  std::set<std::uint32_t> wanted;
  for (std::uint32_t i = 0; i < description_.bodies.size(); ++i)
    if (has_stopped(i)) wanted.insert(i);
  for (std::size_t j = 0; j < description_.constraints.size(); ++j)
    if (old_joint_[j] == kNone)
      for (const std::uint32_t body : {description_.constraints[j].body1, description_.constraints[j].body2})
        if (body != kNone) wanted.insert(body);
  edit_.clear_places();
  for (const std::uint32_t body : wanted) {
    edit::v1::Place* place = edit_.add_places();
    place->set_body(description_.bodies[body].id);
    const Vector3& p = pose_[body].position;
    const Quaternion& q = pose_[body].orientation;
    for (const double number : {p.x(), p.y(), p.z()}) place->add_position(number);
    for (const double number : {q.w(), q.x(), q.y(), q.z()}) place->add_orientation(number);
  }
}

Pose EditedScene::kept_binding(std::size_t joint, std::size_t end) const {
  const auto body_of = [&](const kernel::ConstraintDescription& one) { return end == 0 ? one.body1 : one.body2; };
  const std::uint32_t body = body_of(description_.constraints[joint]);
  if (body == kNone) return {};
  const kernel::ConstraintDescription& before = before_.constraints[old_joint_[joint]];
  if (before.bound_at) return recentred(before.bound_at->at(end), body);
  const kernel::BodyDescription &next = description_.bodies[body], &old = before_.bodies[body_of(before)];
  const scene::SetMotion motion = motion_set_of(log_, next.id);
  // to the bit as in the edited scene's text, which has its geometry where it was at the start
  if (!motion.position && !motion.orientation && next.motion.rows == old.motion.rows)
    return without_negative_zeros(next.pose);
  return recentred(without_negative_zeros(old.pose), body);
}

// Where the edit says that bodies were; joints that stay are bound as they were.
void EditedScene::place() {
  std::map<std::string, Pose> places;
  for (const edit::v1::Place& one : edit_.places()) {
    const std::span position(one.position().data(), static_cast<std::size_t>(one.position_size()));
    const std::span orientation(one.orientation().data(), static_cast<std::size_t>(one.orientation_size()));
    if (position.size() != 3 || orientation.size() != 4 || first_not_finite(position) != kNoRow ||
        first_not_unit(orientation, 4) != kNoRow)
      throw BadInput(fmt::format("edit before step {}: the place of '{}' is none", edit_.step(), one.body()));
    places[one.body()] = {Vector3(one.position(0), one.position(1), one.position(2)),
                          Quaternion(one.orientation(0), one.orientation(1), one.orientation(2), one.orientation(3))};
  }
  const auto place_of = [&](std::uint32_t body) {
    if (body == kNone) return Pose{};
    const auto found = places.find(description_.bodies[body].id);
    return found == places.end() ? without_negative_zeros(description_.bodies[body].pose) : found->second;
  };
  for (std::size_t j = 0; j < description_.constraints.size(); ++j) {
    kernel::ConstraintDescription& joint = description_.constraints[j];
    joint.is_kept = old_joint_[j] != kNone;
    if (joint.is_kept)
      joint.bound_at = {kept_binding(j, 0), kept_binding(j, 1)};
    else
      joint.bound_at = {place_of(joint.body1), place_of(joint.body2)};
  }
  // after the joints: these are bound where the scene has them
  for (std::uint32_t i = 0; i < description_.bodies.size(); ++i)
    if (has_stopped(i)) description_.bodies[i].pose = place_of(i);
}

namespace {

using Numbers = std::variant<std::vector<double>, std::vector<std::uint32_t>, std::vector<std::uint64_t>>;

// Columns of a state by name.
class ColumnTable {
 public:
  explicit ColumnTable(const kernel::SavedState& saved) : saved_(saved) {}

  template <typename T>
  std::span<const T> at(std::string_view name) const {
    return std::get<std::span<const T>>(std::ranges::find(saved_.columns, name, &kernel::SavedColumn::name)->numbers);
  }

  // The rows of a column, `components` numbers each.
  template <typename T>
  Numbers rows(std::string_view name, std::size_t components, const std::vector<std::size_t>& wanted) const {
    std::vector<T> numbers;
    const std::span<const T> all = at<T>(name);
    for (const std::size_t row : wanted)
      for (const T number : all.subspan(components * row, components)) numbers.push_back(number);
    return numbers;
  }

 private:
  const kernel::SavedState& saved_;
};

std::vector<std::uint32_t> new_rows(const std::vector<std::uint32_t>& old_row, std::size_t old_count) {
  std::vector<std::uint32_t> rows(old_count, kNone);
  for (std::uint32_t i = 0; i < old_row.size(); ++i)
    if (old_row[i] != kNone) rows[old_row[i]] = i;
  return rows;
}

void translate(const std::vector<std::uint32_t>& rows, Numbers* numbers) {
  for (std::uint32_t& row : std::get<std::vector<std::uint32_t>>(*numbers)) row = rows[row];
}

}  // namespace

std::vector<bool> EditedScene::resting_on(const kernel::SavedState& before) const {
  const ColumnTable state(before);
  const std::vector<bool> disturbed =
      find_disturbed({first_, scene_, log_, before_, description_, pose_}, state.at<std::uint32_t>("contact_body"),
                     state.at<std::uint32_t>("intact"));
  std::vector<bool> resting;
  for (const std::uint32_t row : old_body_) resting.push_back(row != kNone && !disturbed[row]);
  return resting;
}

std::vector<std::uint32_t> EditedScene::woken(const kernel::Environment& now, const kernel::Environment& next) const {
  std::vector<std::uint32_t> bodies;
  for (std::uint32_t i = 0; i < old_body_.size(); ++i)
    if (old_body_[i] != kNone && now.is_asleep(old_body_[i]) && !next.is_asleep(i)) bodies.push_back(i);
  return bodies;
}

// How long the bodies have rested, and under which wrench: as before, where the edit lets them and both are known.
void EditedScene::keep_rest(const kernel::SavedState& before, std::span<std::uint32_t> rested,
                            std::span<double> wrench) const {
  const ColumnTable state(before);
  const std::span<const std::uint32_t> old_rested = state.at<std::uint32_t>("rested");
  const std::span<const double> old_wrench = state.at<double>("rest_wrench");
  if (rested.empty() || old_rested.empty() || (!wrench.empty() && old_wrench.empty())) return;
  const std::vector<bool> resting = resting_on(before);
  for (std::size_t i = 0; i < rested.size(); ++i) {
    if (!resting[i]) continue;
    rested[i] = old_rested[old_body_[i]];
    if (!wrench.empty()) std::ranges::copy(old_wrench.subspan(6UL * old_body_[i], 6), &wrench[6 * i]);
  }
}

std::vector<std::array<std::uint32_t, 2>> EditedScene::hand_over(const kernel::Environment& now,
                                                                 kernel::Environment* next) const {
  const kernel::SavedState before = now.saved_state(), like = next->saved_state();
  const ColumnTable old(before), fresh(like);
  const std::vector<std::uint32_t> body_row = new_rows(old_body_, before_.bodies.size());
  const std::vector<std::uint32_t> joint_row = new_rows(old_joint_, before_.constraints.size());
  const std::vector<kernel::PlannedSlot> slots = next->plan().slots;
  const bool has_contacts = std::ranges::find(slots, Slot::kCollision, &kernel::PlannedSlot::slot) != slots.end();

  // pairs that go on: of bodies that stay what they are where they are
  const auto goes_on = [&](std::uint32_t old_one) {
    const std::uint32_t body = body_row[old_one];
    if (body == kNone) return false;
    const auto set = log_.motions.find(description_.bodies[body].id);
    if (set != log_.motions.end() && (set->second.position || set->second.orientation)) return false;
    const std::uint32_t shape = description_.bodies[body].shape, old_shape = before_.bodies[old_one].shape;
    return shape != kNone && old_shape != kNone && description_.shapes[shape].type == before_.shapes[old_shape].type &&
           description_.shapes[shape].parameters == before_.shapes[old_shape].parameters;
  };
  const auto kept_pairs = [&](std::span<const std::uint32_t> bodies) {
    std::vector<std::size_t> rows;
    for (std::size_t i = 0; i < bodies.size() / 2 && has_contacts; ++i) {
      const std::uint32_t a = bodies[2 * i], b = bodies[2 * i + 1];
      if (!goes_on(a) || !goes_on(b)) continue;
      if (((description_.bodies[body_row[a]].flags | description_.bodies[body_row[b]].flags) & kMovable) != 0)
        rows.push_back(i);
    }
    return rows;
  };
  // what an edit throws at what it touched, or at a stop, arrives there, as what pressed does not
  const std::span<const std::uint32_t> pressed = old.at<std::uint32_t>("contact_body");
  const auto is_thrown = [&](std::uint32_t old_one) {
    if (old_one == kNone || body_row[old_one] == kNone) return false;
    const auto set = log_.motions.find(description_.bodies[body_row[old_one]].id);
    return set != log_.motions.end() && (set->second.linear_velocity || set->second.angular_velocity);
  };
  std::vector<std::size_t> contacts = kept_pairs(pressed);
  std::erase_if(contacts, [&](std::size_t i) { return is_thrown(pressed[2 * i]) || is_thrown(pressed[2 * i + 1]); });
  const std::span<const std::uint32_t> touched = old.at<std::uint32_t>("touching");
  const std::vector<std::size_t> touching = kept_pairs(touched);
  std::vector<std::size_t> discrepancies;
  const std::span<const std::uint32_t> of_joint = old.at<std::uint32_t>("discrepancy_constraint");
  for (std::size_t i = 0; i < of_joint.size(); ++i) {
    const kernel::ConstraintDescription& joint = before_.constraints[of_joint[i]];
    if (joint_row[of_joint[i]] != kNone && !is_thrown(joint.body1) && !is_thrown(joint.body2))
      discrepancies.push_back(i);
  }

  std::map<std::string_view, Numbers> columns;
  std::array<std::vector<double>, 4> motion;
  for (std::size_t i = 0; i < pose_.size(); ++i) {
    const Quaternion& q = pose_[i].orientation;
    motion[0].insert(motion[0].end(), pose_[i].position.begin(), pose_[i].position.end());
    motion[1].insert(motion[1].end(), {q.w(), q.x(), q.y(), q.z()});
    motion[2].insert(motion[2].end(), twist_[i].linear.begin(), twist_[i].linear.end());
    motion[3].insert(motion[3].end(), twist_[i].angular.begin(), twist_[i].angular.end());
  }
  kernel::SavedState saved{before.step, before.step_length, true, {}, {}, before.figures, {}, {}};
  saved.state_hash = gravitas::state_hash({motion[0], motion[1], motion[2], motion[3]});
  saved.chain_hash = gravitas::chain_hash(before.chain_hash, digest_of(edit_));
  columns["position"] = std::move(motion[0]);
  columns["orientation"] = std::move(motion[1]);
  columns["linear_velocity"] = std::move(motion[2]);
  columns["angular_velocity"] = std::move(motion[3]);

  std::vector<std::uint32_t> intact;
  for (const std::uint32_t joint : old_joint_)
    intact.push_back(joint == kNone ? 1 : old.at<std::uint32_t>("intact")[joint]);
  columns["intact"] = std::move(intact);
  columns["plugin_state"] = std::vector<double>();
  columns["state_changed"] = std::vector<std::uint32_t>(pose_.size(), 1);
  columns["contact_body"] = old.rows<std::uint32_t>("contact_body", 2, contacts);
  columns["contact_feature"] = old.rows<std::uint32_t>("contact_feature", 1, contacts);
  columns["contact_key"] = old.rows<std::uint64_t>("contact_key", 1, contacts);
  columns["contact_impulse"] = old.rows<double>("contact_impulse", 3, contacts);
  columns["contact_correction"] = old.rows<double>("contact_correction", 1, contacts);
  columns["discrepancy_constraint"] = old.rows<std::uint32_t>("discrepancy_constraint", 1, discrepancies);
  columns["discrepancy_impulse"] = old.rows<double>("discrepancy_impulse", 3, discrepancies);
  columns["discrepancy_correction"] = old.rows<double>("discrepancy_correction", 3, discrepancies);
  columns["touching"] = old.rows<std::uint32_t>("touching", 2, touching);
  std::vector<std::uint32_t> rested(fresh.at<std::uint32_t>("rested").size(), 0);
  std::vector<double> rest_wrench(fresh.at<double>("rest_wrench").size(), 0.0);
  keep_rest(before, rested, rest_wrench);
  columns["rested"] = std::move(rested);
  columns["rest_wrench"] = std::move(rest_wrench);
  translate(body_row, &columns["contact_body"]);
  translate(body_row, &columns["touching"]);
  translate(joint_row, &columns["discrepancy_constraint"]);

  for (const kernel::SavedColumn& column : like.columns)
    std::visit(
        [&](const auto& numbers) {
          saved.columns.push_back({column.name, std::span(numbers)});
        },
        columns.at(column.name));
  for (kernel::SavedBudget one : before.budgets) {
    one.target = row_after(before_, description_, one.slot, one.target);
    if (one.target != kNone) saved.budgets.push_back(one);
  }
  if (const std::string problem = next->restore(saved); !problem.empty())
    throw std::logic_error("the edited scene does not take the state: " + problem);
  for (const std::uint32_t body : now.wake_orders())
    if (body_row[body] != kNone) next->wake(body_row[body]);

  std::vector<std::array<std::uint32_t, 2>> parted;
  for (std::size_t i = 0; i < touched.size() / 2; ++i)
    if (!std::ranges::binary_search(touching, i)) parted.push_back({touched[2 * i], touched[2 * i + 1]});
  return parted;
}

}  // namespace gravitas
