// Slot constraint, of plugins that tell coordinates of their joints: a rate is how its value changes, and a coordinate knows
// no frame but those of its bodies. Angles are the same where they differ by whole turns.
#include <algorithm>
#include <cmath>
#include <optional>

#include "plugin_sdk/conformance/hostile_numbers.h"
#include "plugin_sdk/conformance/joints.h"
#include "plugin_sdk/conformance/sample_values.h"
#include "plugin_sdk/conformance/slot_cases.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas::conformance {
namespace {

constexpr stage::Method kCoordinates = stage::Method::kConstraintCoordinates;
constexpr double kCoordinateRounding = 1e-10;

struct ToldCoordinate {
  std::uint32_t joint, index;
  double value, rate;
};

std::vector<ToldCoordinate> told(const Joints& world, Inquiry* inquiry) {
  const MessageColumns reply = world.answer(inquiry, kCoordinates);
  std::vector<ToldCoordinate> all;
  for (std::size_t i = 0; i < reply.u32("constraint").size(); ++i) {
    const ToldCoordinate one{reply.u32("constraint")[i], reply.u32("coordinate")[i], reply.f64("value")[i],
                             reply.f64("rate")[i]};
    const std::string row = " of row " + std::to_string(i) + " ";
    inquiry->expect(one.joint < world.joints.size() && world.joints[one.joint].intact != 0,
                    "constraint" + row + "is " + std::to_string(one.joint) + ", no joint that holds");
    const bool is_declared = std::ranges::any_of(inquiry->declaration().types, [&](const TypeDeclaration& type) {
      return type_id(type.name) == world.joints[one.joint].type && one.index < type.coordinates.size();
    });
    inquiry->expect(is_declared, "coordinate" + row + "is " + std::to_string(one.index) + ", which is not declared");
    inquiry->expect(
        all.empty() || all.back().joint < one.joint || (all.back().joint == one.joint && all.back().index < one.index),
        "constraint and coordinate" + row + "are out of order");
    all.push_back(one);
  }
  return all;
}

bool are_of_one_kind(const std::vector<ToldCoordinate>& a, const std::vector<ToldCoordinate>& b) {
  return std::ranges::equal(a, b, [](const ToldCoordinate& one, const ToldCoordinate& other) {
    return one.joint == other.joint && one.index == other.index;
  });
}

double difference(const CoordinateDeclaration& declared, double from, double to) {
  const double apart = to - from;
  return declared.unit == "rad" ? apart - kWholeTurn * std::round(apart / kWholeTurn) : apart;
}

// Joints of each type that has coordinates, bound between two bodies: as their required properties have them, and with the
// directions that may be given beside, where the plugin takes these.
template <typename Judge>
void for_each_told(Subject& subject, std::uint64_t seed, const Judge& judge) {
  Draw draw(seed);
  for (const TypeDeclaration& type : joint_types_of(subject)) {
    if (type.coordinates.empty()) continue;
    std::size_t rows = 0;
    for (const bool has_more : {false, true}) {
      for (int repeat = 0; repeat < 5; ++repeat) {
        Joints world = joined(type, &draw);
        if (has_more) world.joints[0].properties = with_directions(type.properties, world.joints[0].properties, &draw);
        const Answer bound = subject.ask(stage::Method::kConstraintBind, world.bind_request());
        if (has_more && bound.status == GRAVITAS_REFUSED) break;
        Inquiry inquiry(subject, "coordinates of " + type.name + ", its bodies moved");
        world.bind(&inquiry);
        world.bodies[1].pose = displaced(world.bodies[1].pose, draw.vector(0.3), draw.vector(0.5));
        rows += told(world, &inquiry).size();
        judge(type, world, &draw, &inquiry);
      }
    }
    Inquiry(subject, "coordinates of " + type.name).expect(rows > 0, "tells none of those that it declares");
  }
}

void judge_rates(Subject& subject) {
  constexpr double kTime = 1e-6;
  for_each_told(subject, 71, [](const TypeDeclaration& type, const Joints& world, Draw*, Inquiry* inquiry) {
    const auto at = [&](double time) {
      Joints moved = world;
      for (JointedBody& body : moved.bodies)
        body.pose = displaced(body.pose, time * body.twist.linear, time * body.twist.angular);
      return told(moved, inquiry);
    };
    const std::vector<ToldCoordinate> before = at(-kTime), now = told(world, inquiry), after = at(kTime);
    // what begins or ceases to mean something has no slope
    if (!are_of_one_kind(before, now) || !are_of_one_kind(after, now)) return;
    for (std::size_t i = 0; i < now.size(); ++i) {
      const CoordinateDeclaration& declared = type.coordinates[now[i].index];
      const double slope = difference(declared, before[i].value, after[i].value) / (2.0 * kTime);
      // the next order, and rounding over the time
      inquiry->expect_near("rate of " + declared.name, now[i].rate, slope, 1e-5 * (1.0 + std::fabs(slope)));
    }
  });
}

void judge_frames(Subject& subject) {
  for_each_told(subject, 72, [](const TypeDeclaration& type, const Joints& world, Draw* draw, Inquiry* inquiry) {
    const std::vector<ToldCoordinate> plain = told(world, inquiry);
    Joints other = world;
    const Pose moved = draw->pose(3.0);
    for (JointedBody& body : other.bodies) {
      body.pose = compose(moved, body.pose);
      body.pose.orientation = normalized(body.pose.orientation);
      body.twist = {moved.orientation * body.twist.linear, moved.orientation * body.twist.angular};
    }
    inquiry->now_asked("coordinates of " + type.name + ", and in a world that is shifted and turned");
    const std::vector<ToldCoordinate> turned = told(other, inquiry);
    inquiry->expect(are_of_one_kind(plain, turned), "has other coordinates");
    for (std::size_t i = 0; i < plain.size(); ++i) {
      const CoordinateDeclaration& declared = type.coordinates[plain[i].index];
      inquiry->expect_near(declared.name, plain[i].value + difference(declared, plain[i].value, turned[i].value),
                           plain[i].value, kCoordinateRounding);
      inquiry->expect_near("rate of " + declared.name, turned[i].rate, plain[i].rate,
                           kCoordinateRounding * (1.0 + std::fabs(plain[i].rate)));
    }
  });
}

// Joints of all types, three of each, the second with values of every property if it varies.
Joints several(Subject& subject, bool varies, Draw* draw) {
  const std::vector<TypeDeclaration> types = joint_types_of(subject);
  Joints all;
  for (int i = 0; i < 4; ++i) all.bodies.push_back({draw->pose(3.0), {draw->vector(2.0), draw->vector(2.0)}});
  for (std::uint32_t copy = 0; copy < 3; ++copy)
    for (const TypeDeclaration& type : types)
      all.joints.push_back({.type = type_id(type.name),
                            .body1 = copy == 2 ? kNone : copy,
                            .body2 = copy + 1,
                            .properties = sample_values(type.properties, draw)});
  for (std::size_t i = 0; i < types.size() && varies; ++i) vary_joint(subject, types[i], types.size() + i, draw, &all);
  return all;
}

// A broken joint tells nothing, and what the others tell is no matter of it; asked again they tell the same.
void judge_broken(Subject& subject, bool varies) {
  Draw draw(73);
  Joints all = several(subject, varies, &draw);
  if (all.joints.empty()) return;
  Inquiry inquiry(subject, "coordinates of " + std::to_string(all.joints.size()) + " joints, and with one broken");
  all.bind(&inquiry);
  for (JointedBody& body : all.bodies) body.pose = displaced(body.pose, draw.vector(0.1), draw.vector(0.1));
  const std::vector<ToldCoordinate> whole = told(all, &inquiry);
  const auto broken = static_cast<std::uint32_t>(all.joints.size() / 2);
  all.joints[broken].intact = 0;
  Inquiry same = inquiry.demanding_answers();
  const std::vector<ToldCoordinate> rest = told(all, &same);
  std::vector<ToldCoordinate> expected = whole;
  std::erase_if(expected, [&](const ToldCoordinate& one) { return one.joint == broken; });
  inquiry.expect(are_of_one_kind(rest, expected), "the others have other coordinates");
  for (std::size_t i = 0; i < rest.size(); ++i) {
    inquiry.expect_near("value of row " + std::to_string(i), rest[i].value, expected[i].value, 0.0);
    inquiry.expect_near("rate of row " + std::to_string(i), rest[i].rate, expected[i].rate, 0.0);
  }
  all.joints[broken].intact = 1;
  const std::vector<ToldCoordinate> again = told(all, &same);
  inquiry.expect(are_of_one_kind(again, whole), "has other coordinates, asked again");
  for (std::size_t i = 0; i < again.size(); ++i)
    inquiry.expect(again[i].value == whole[i].value && again[i].rate == whole[i].rate,
                   "row " + std::to_string(i) + " is another, asked again");
}

void judge_hostile_coordinates(Subject& subject) {
  Draw draw(74);
  for (const TypeDeclaration& type : joint_types_of(subject)) {
    Joints world = joined(type, &draw);
    Inquiry inquiry(subject, "binding " + type.name);
    world.bind(&inquiry);
    expect_hostile_numbers_survived(subject, "coordinates of " + type.name, kCoordinates, world.describe_request());
  }
}

}  // namespace

std::vector<Case> coordinate_cases(const PluginDeclaration& declaration) {
  if (!has_capability(declaration, "coordinates"))
    return {unknown_case("constraint/coordinates_unknown", kCoordinates)};
  return {
      make_case("constraint/coordinate_rates", "A coordinate's rate is how it changes as its bodies move.",
                judge_rates),
      make_case("constraint/coordinate_frames", "Coordinates know no frame but those of their bodies.", judge_frames),
      make_varied_case("constraint/coordinate_rows",
                       "A broken joint has no coordinates, and changes those of no other.", judge_broken),
      make_case("constraint/coordinate_hostile",
                "Hostile numbers are refused with a reason, or answered with finite ones.", judge_hostile_coordinates)};
}

std::vector<Question> coordinate_questions(Subject& subject, Draw* draw) {
  if (!has_capability(subject.declaration(), "coordinates")) return {};
  const std::optional<Joints> all =
      bound_and_moved(subject, kCoordinates, 0.1, draw, [&](bool varies) { return several(subject, varies, draw); });
  if (!all || all->joints.empty()) return {};
  return {
      {"coordinates of " + std::to_string(all->joints.size()) + " joints", kCoordinates, all->describe_request(), {}}};
}

}  // namespace gravitas::conformance
