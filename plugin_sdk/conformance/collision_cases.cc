// Slot collision: closed forms for shapes of the scene language, and laws of any convex solids. The strongest
// needs no known answer: moved apart along the normal by the depth, two bodies touch no more, and by half of it they
// still do.
//
// Tolerances: shapes are of about a metre and iterative methods stop at about 1e-6 of that. A method may prefer faces
// to edges where both separate almost as well; so depths of one overlap asked in two ways may differ by kPreference.
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "plugin_sdk/conformance/hostile_numbers.h"
#include "plugin_sdk/conformance/sample_values.h"
#include "plugin_sdk/conformance/slot_cases.h"
#include "plugin_sdk/conformance/solids.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas::conformance {
namespace {

constexpr stage::Method kManifolds = stage::Method::kCollisionManifolds;
constexpr double kContactAccuracy = 1e-6;  // m
constexpr double kPreference = 0.03;       // of the depth
constexpr double kDeepest = 0.01;          // of the depth: a manifold may miss the very deepest point of a round edge
constexpr std::uint32_t kForeignBody = 1000000;

std::string shown_pair(const Solids& world) { return world.solids[0].type + " and " + world.solids[1].type; }

Answer probe(Subject& subject, const Solid& solid, Draw* draw) {
  return subject.ask(kManifolds, Solids::two(solid, {}, solid, draw->pose(1.0)).request());
}

std::vector<TypeDeclaration> shape_types_of(Subject& subject, std::string* refusal = nullptr) {
  constexpr const char* kKnown[] = {"Sphere", "Box", "Cylinder", "Halfspace", "Capsule", "Cone"};
  return askable_types(subject.declaration(), kKnown, refusal, [&](const TypeDeclaration& type, Draw* draw) {
    return probe(subject, random_solid(subject.declaration(), type, draw), draw);
  });
}

// Whether two bodies of the type are parted by any plane at all.
bool is_convex(const Solid& solid) {
  constexpr const char* kConvex[] = {"Sphere", "Box", "Cylinder", "Halfspace", "Capsule", "Cone", "ConvexPolyhedron"};
  return std::ranges::find(kConvex, solid.type) != std::end(kConvex);
}

// Calls judge(inquiry, world) for overlapping pairs of all types.
template <typename Judge>
void for_each_overlap(Subject& subject, std::uint64_t seed, int repeats, Judge&& judge) {
  const PluginDeclaration& declaration = subject.declaration();
  const std::vector<TypeDeclaration> types = shape_types_of(subject);
  Draw draw(seed);
  for (const TypeDeclaration& type_a : types) {
    for (const TypeDeclaration& type_b : types) {
      if (type_a.name == "Halfspace" && type_b.name == "Halfspace") continue;
      for (int repeat = 0; repeat < repeats; ++repeat) {
        const Solid a = random_solid(declaration, type_a, &draw), b = random_solid(declaration, type_b, &draw);
        Solids world = Solids::two(a, draw.pose(2.0), b, {});
        world.bodies[0].geometry = draw.pose(0.3), world.bodies[1].geometry = draw.pose(0.3);
        // some are as deep as their centres, most overlap shallowly
        const double reach = a.is_known() && b.is_known() ? draw.uniform(0.1, 1.0) * (a.inside + b.inside) : 0.2;
        const Vector3 centre = world.placed(0).position + reach * draw.direction();
        world.bodies[1].pose.orientation = draw.rotation();
        world.bodies[1].pose.position = centre - world.bodies[1].pose.orientation * world.bodies[1].geometry.position;
        for (SolidBody& body : world.bodies) body.twist = {draw.vector(2.0), draw.vector(2.0)};
        Inquiry inquiry(subject, shown_pair(world) + ", pair " + std::to_string(repeat));
        judge(&inquiry, world);
      }
    }
  }
}

// The deepest contact of two bodies whose solids must touch if they are known.
std::optional<Touch> overlap(Inquiry* inquiry, const Solids& world) {
  const std::vector<Touch> touches = world.ask(inquiry);
  const Touch* touch = deepest(touches);
  if (touch != nullptr && touch->depth > 0.0) return *touch;
  const bool must = world.solids[0].inside + world.solids[1].inside > 0.0 && world.solids[0].is_known() &&
                    world.solids[1].is_known() && !world.solids[0].is_halfspace() && !world.solids[1].is_halfspace();
  inquiry->expect(!must, "the centres are " +
                             number_text((world.placed(1).position - world.placed(0).position).norm()) +
                             " m apart, so that the bodies overlap; no contact with depth > 0 came");
  return std::nullopt;
}

// ---- laws

void judge_collision_nothing(Subject& subject) {
  Inquiry inquiry(subject, "no bodies");
  inquiry.expect(Solids{}.ask(&inquiry).empty(), "has a contact");
  Draw draw(61);
  for (const TypeDeclaration& type : shape_types_of(subject)) {
    const Solid solid = random_solid(subject.declaration(), type, &draw);
    Solids world = Solids::two(solid, {}, solid, {});
    world.pairs.clear();
    inquiry.now_asked("two bodies in one place, no pair of them");
    inquiry.expect(world.ask(&inquiry).empty(), "has a contact");
  }
}

void judge_separated(Subject& subject) {
  const PluginDeclaration& declaration = subject.declaration();
  const std::vector<TypeDeclaration> types = shape_types_of(subject);
  Draw draw(62);
  for (const TypeDeclaration& type_a : types) {
    for (const TypeDeclaration& type_b : types) {
      const Solid a = random_solid(declaration, type_a, &draw), b = random_solid(declaration, type_b, &draw);
      if (a.is_halfspace() && b.is_halfspace()) continue;
      const double margin = 0.05;
      Vector3 away = draw.direction();
      Pose pose_a{draw.vector(2.0), draw.rotation()}, pose_b{Vector3::Zero(), draw.rotation()};
      // a half-space is left along its own y axis
      if (a.is_halfspace()) away = pose_a.orientation * Vector3::UnitY();
      if (b.is_halfspace()) away = -(pose_b.orientation * Vector3::UnitY());
      pose_b.position = pose_a.position + (a.radius + b.radius + 1.01 * margin) * away;
      const Solids world = Solids::two(a, pose_a, b, pose_b, margin);
      Inquiry inquiry(subject, shown_pair(world) + " that are further apart than the margin");
      inquiry.expect(world.ask(&inquiry).empty(), "have a contact");
    }
  }
}

void judge_apart(Subject& subject) {
  for_each_overlap(subject, 63, 12, [](Inquiry* inquiry, const Solids& world) {
    if (!is_convex(world.solids[0]) || !is_convex(world.solids[1])) return;
    const std::optional<Touch> touch = overlap(inquiry, world);
    if (!touch) return;
    const double gap = 0.02;
    const auto moved = [&](double way, double margin) {
      Solids other = world;
      other.margin = margin;
      other.bodies[1].pose.position += way * touch->normal;
      const std::vector<Touch> touches = other.ask(inquiry);
      const Touch* left = deepest(touches);
      return left == nullptr ? -std::numeric_limits<double>::infinity() : left->depth;
    };
    const std::string first =
        "overlap by " + number_text(touch->depth) + " m along " + shown(touch->normal) + " from a to b; ";
    inquiry->expect_at_most(first + "depth left after b moved that way by as much",
                            moved(touch->depth + kContactAccuracy, 0.0), kContactAccuracy + kDeepest * touch->depth);
    inquiry->expect(moved(0.5 * touch->depth, 0.0) > 0.0,
                    first + "after b moved half of it there is no contact with depth > 0");
    // the gap that is left is reported within the margin, but for what the depth was not the least
    const double slack = kPreference * touch->depth + kContactAccuracy;
    const double reported = moved(touch->depth + gap, 2.0 * gap + slack);
    inquiry->expect(reported >= -gap - slack && reported <= -gap + kPreference * gap + kContactAccuracy,
                    first + "after b moved 0.02 m more than that the depth is " + number_text(reported) +
                        ", should be -0.02 (at most " + number_text(slack) + " less)");
  });
}

void judge_swap(Subject& subject) {
  for_each_overlap(subject, 64, 8, [](Inquiry* inquiry, const Solids& world) {
    const std::optional<Touch> one = overlap(inquiry, world);
    if (!one) return;
    Solids exchanged = world;
    exchanged.pairs = {1, 0};
    const std::optional<Touch> other = overlap(inquiry, exchanged);
    inquiry->expect(other.has_value(), "asked as (b, a) instead of (a, b) there is no contact");
    inquiry->expect_near("depth as (b, a)", other->depth, one->depth, kPreference * one->depth + kContactAccuracy);
  });
}

void judge_collision_frames(Subject& subject) {
  Draw draw(65);
  for_each_overlap(subject, 66, 8, [&draw](Inquiry* inquiry, const Solids& world) {
    const std::optional<Touch> one = overlap(inquiry, world);
    if (!one) return;
    const Pose moved = draw.pose(4.0);
    Solids shifted = world;
    for (SolidBody& body : shifted.bodies) {
      body.pose = compose(moved, body.pose);
      body.pose.orientation = normalized(body.pose.orientation);
    }
    const std::optional<Touch> other = overlap(inquiry, shifted);
    inquiry->expect(other.has_value(), "in a world that is shifted and turned there is no contact");
    inquiry->expect_near("depth in a world that is shifted and turned", other->depth, one->depth,
                         kPreference * one->depth + kContactAccuracy);
  });
}

// Half a depth from the point along the normal, either way, lies the surface of either body.
void judge_surface(Subject& subject) {
  for_each_overlap(subject, 67, 12, [](Inquiry* inquiry, const Solids& world) {
    if (!world.solids[0].is_known() || !world.solids[1].is_known()) return;
    for (const Touch& touch : world.ask(inquiry)) {
      for (std::size_t body = 0; body < 2; ++body) {
        const double side = body == 0 ? 0.5 : -0.5;
        const Vector3 surface = touch.point + side * touch.depth * touch.normal;
        const double off = world.solids[body].distance(inverse_transform_point(world.placed(body), surface));
        inquiry->expect_near("distance from the surface of body " + std::to_string(body) + " of " + shown(surface) +
                                 ", half a depth from the point of a contact,",
                             off, 0.0, 1e-3);
      }
    }
  });
}

void judge_velocity(Subject& subject) {
  for_each_overlap(subject, 68, 4, [](Inquiry* inquiry, const Solids& world) {
    for (const Touch& touch : world.ask(inquiry)) {
      const auto velocity = [&](const SolidBody& body) {
        return Vector3(body.twist.linear + body.twist.angular.cross(touch.point - body.pose.position));
      };
      inquiry->expect_near("relative velocity at " + shown(touch.point), touch.velocity,
                           velocity(world.bodies[1]) - velocity(world.bodies[0]), 1e-12);
    }
  });
}

// Bodies of all types in a lattice, each with its neighbours; the second ones with values of every property if they vary
// and are not known.
Solids crowd(Subject& subject, std::uint32_t count, bool varies, Draw* draw) {
  const std::vector<TypeDeclaration> types = shape_types_of(subject);
  Solids world;
  if (types.empty()) return world;
  world.margin = 0.02;
  std::uint32_t edge = 1;
  while (edge * edge * edge < count) ++edge;
  for (std::uint32_t i = 0; i < count; ++i) {
    const TypeDeclaration& type = types[i % types.size()];
    Solid solid = random_solid(subject.declaration(), type, draw);
    if (varies && !solid.is_known() && i / types.size() == 1)
      vary(type.properties, draw, &solid.parameters, [&] { return probe(subject, solid, draw); });
    world.solids.push_back(solid);
    const std::uint32_t row = i / edge % edge, layer = i / (edge * edge);
    const Vector3 place(i % edge, row, layer);
    world.bodies.push_back({.solid = i,
                            .pose = {1.4 * place + draw->vector(0.1), draw->rotation()},
                            .twist = {draw->vector(1.0), draw->vector(1.0)},
                            .geometry = draw->pose(0.1)});
    if (i > 0) world.pairs.insert(world.pairs.end(), {i - 1, i});
    if (i >= edge) world.pairs.insert(world.pairs.end(), {i - edge, i});
  }
  return world;
}

// What a body touches besides may matter (contacts over seams); the other pairs may not.
void judge_collision_independence(Subject& subject, bool varies) {
  Draw draw(69);
  const Solids all = crowd(subject, 16, varies, &draw);
  const auto count = static_cast<std::uint32_t>(all.pairs.size() / 2);
  Inquiry inquiry(subject, std::to_string(count) + " pairs at once");
  const std::vector<Touch> together = all.ask(&inquiry);
  Inquiry same = inquiry.demanding_answers();
  std::size_t next = 0;
  for (std::uint32_t pair = 0; pair < count; ++pair) {
    const std::span<const std::uint32_t> bodies(&all.pairs[2 * std::size_t{pair}], 2);
    Solids alone = all;
    alone.pairs.clear();
    std::uint32_t place = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::span<const std::uint32_t> other(&all.pairs[2 * std::size_t{i}], 2);
      if (std::ranges::find_first_of(bodies, other) == bodies.end()) continue;
      if (i == pair) place = static_cast<std::uint32_t>(alone.pairs.size() / 2);
      alone.pairs.insert(alone.pairs.end(), other.begin(), other.end());
    }
    same.now_asked("pair " + std::to_string(pair) + " of " + std::to_string(count) +
                   ", with the other pairs of its bodies and among all");
    for (const Touch& one : alone.ask(&same)) {
      if (one.pair != place) continue;
      same.expect(next < together.size() && together[next].pair == pair, "has fewer contacts among the others");
      const Touch& other = together[next++];
      same.expect_near("normal", other.normal, one.normal, 0.0);
      same.expect_near("point", other.point, one.point, 0.0);
      same.expect_near("depth", other.depth, one.depth, 0.0);
      same.expect(other.feature == one.feature, "feature is " + std::to_string(other.feature) +
                                                    " among the others and " + std::to_string(one.feature) +
                                                    " with those of its bodies");
    }
    same.expect(next == together.size() || together[next].pair > pair, "has more contacts among the others");
  }
}

// ---- known answers

struct Known {
  std::string name;
  Solid a;
  Pose pose_a;
  Solid b;
  Pose pose_b;
  Vector3 normal;
  double depth;
  double plane;  // normal . point of every contact
  double margin = 0.0;
};

std::vector<Known> known_touches(const PluginDeclaration& d) {
  const auto has = [&](const char* name) { return find_type(d, name) != nullptr; };
  const Vector3 x = Vector3::UnitX(), y = Vector3::UnitY(), z = Vector3::UnitZ();
  std::vector<Known> known;
  if (has("Sphere")) {
    const Solid one = make_sphere(d, 1.0), two = make_sphere(d, 2.0);
    known.push_back({"spheres of radius 2 and 1, centres 2.5 apart", two, at(x), one, at(3.5 * x), x, 0.5, 2.75});
    known.push_back({"unit spheres 0.25 apart, margin 0.3", one, {}, one, at(2.25 * z), z, -0.25, 1.125, 0.3});
    if (has("Halfspace")) {
      const Solid ground = make_halfspace(d);
      known.push_back(
          {"a unit sphere 0.5 above a half-space", one, at({3, 0.5, 4}), ground, at({7, 0, -2}), -y, 0.5, 0.25});
      known.push_back({"a half-space x <= 0 and a unit sphere at x = 0.75",
                       ground,
                       {Vector3::Zero(), exp_rotation(-0.5 * 3.14159265358979323846 * z)},
                       one,
                       at({0.75, 5, 5}),
                       x,
                       0.25,
                       -0.125});
    }
    if (has("Box")) {
      const Solid box = make_box(d, {2, 1, 2});
      known.push_back({"a unit sphere on the face of a box", one, at({0, 1.75, 0.5}), box, {}, -y, 0.25, -0.875});
      const Vector3 edge(0.6, 0.8, 0);
      known.push_back({"a unit sphere beyond the edge of a box by (0.3, 0.4)",
                       one,
                       at({2.3, 1.4, 0}),
                       box,
                       {},
                       -edge,
                       0.5,
                       -edge.dot(Vector3(2, 1, 0)) + 0.25});
      const Vector3 out = Vector3(2, 3, 6) / 7.0, vertex(2, 1, 2);
      known.push_back({"a box and a unit sphere 0.75 beyond its vertex",
                       box,
                       {},
                       one,
                       at(vertex + 0.75 * out),
                       out,
                       0.25,
                       out.dot(vertex) - 0.125});
    }
    if (has("Cylinder")) {
      const Solid can = make_cylinder(d, 1.5, 4.0);
      const Vector3 side(0.6, 0, 0.8);
      known.push_back(
          {"a unit sphere at the side of a cylinder", one, at({1.2, 0.5, 1.6}), can, {}, -side, 0.5, -1.25});
      known.push_back(
          {"a unit sphere under the end of a cylinder", one, at({0.5, -2.75, 0}), can, {}, y, 0.25, -1.875});
    }
  }
  if (has("Box")) {
    const Solid box = make_box(d, {1, 0.5, 1}), cube = make_box(d, {0.25, 0.25, 0.25});
    known.push_back(
        {"a box with its face 0.1 in the face of another", box, {}, cube, at({0.2, 0.65, -0.3}), y, 0.1, 0.45});
    known.push_back({"boxes 0.05 apart, margin 0.1", box, {}, cube, at({1.3, 0, 0}), x, -0.05, 1.025, 0.1});
    if (has("Halfspace"))
      known.push_back({"a half-space and a box with its face 0.02 in it",
                       make_halfspace(d),
                       {},
                       box,
                       at({4, 0.48, 1}),
                       y,
                       0.02,
                       -0.01});
  }
  if (has("Cylinder") && has("Halfspace")) {
    const Solid can = make_cylinder(d, 0.5, 2.0), ground = make_halfspace(d);
    known.push_back(
        {"a half-space and a cylinder that stands 0.01 in it", ground, {}, can, at({1, 0.99, 2}), y, 0.01, -0.005});
    known.push_back({"a half-space and a cylinder that lies 0.01 in it",
                     ground,
                     {},
                     can,
                     {Vector3(1, 0.49, 2), exp_rotation(0.5 * 3.14159265358979323846 * x)},
                     y,
                     0.01,
                     -0.005});
  }
  return known;
}

void judge_known(Subject& subject) {
  for (const Known& one : known_touches(subject.declaration())) {
    Inquiry inquiry(subject, one.name);
    const Solids world = Solids::two(one.a, one.pose_a, one.b, one.pose_b, one.margin);
    const std::vector<Touch> touches = world.ask(&inquiry);
    const Touch* most = deepest(touches);
    inquiry.expect(most != nullptr,
                   "no contact came; depth " + number_text(one.depth) + " along " + shown(one.normal) + " is right");
    inquiry.expect_near("depth", most->depth, one.depth, kContactAccuracy);
    inquiry.expect_near("normal (from a to b)", most->normal, one.normal, kContactAccuracy);
    inquiry.expect_near("distance of the point along the normal", one.normal.dot(most->point), one.plane,
                        kContactAccuracy);
  }
}

// ---- hostile

// One body of each type over another, all of them in pairs.
Solids everything(Subject& subject, Draw* draw) {
  Solids world = crowd(subject, static_cast<std::uint32_t>(2 * shape_types_of(subject).size()), true, draw);
  world.pairs.clear();
  for (std::uint32_t i = 1; i < world.bodies.size(); ++i) world.pairs.insert(world.pairs.end(), {i - 1, i});
  return world;
}

void judge_collision_refusals(Subject& subject) {
  Draw draw(70);
  const Solids world = everything(subject, &draw);
  expect_foreign_indices_refused(subject, "a body of each type", kManifolds, world.request());
  if (world.bodies.empty()) return;
  Inquiry inquiry(subject, "a pair of a body without shape");
  Solids bare = world;
  bare.bodies[0].solid = kNone;
  inquiry.demand_refusal(kManifolds, bare.request());
  bare.bodies[0].solid = kForeignBody;
  inquiry.now_asked("a pair of a body whose shape does not exist");
  inquiry.demand_refusal(kManifolds, bare.request());
  Solids foreign = world;
  foreign.solids[0].type = "NoSuchShape";
  inquiry.now_asked("a shape of a type that the plugin did not declare");
  inquiry.demand_refusal(kManifolds, foreign.request());
}

void judge_collision_hostile(Subject& subject) {
  Draw draw(71);
  Solids world = everything(subject, &draw);
  for (SolidBody& body : world.bodies) body.twist = {draw.vector(1.0), draw.vector(1.0)};
  expect_hostile_numbers_survived(subject, "a body of each type", kManifolds, world.request(), {}, hash_shapes);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t solid = 0; solid < world.solids.size() / 2; ++solid) {
    for (std::size_t i = 0; i < world.solids[solid].parameters.size(); ++i) {
      for (const double bad : {nan, 0.0, -1.0, 1e300, 1e-300, std::numeric_limits<double>::infinity()}) {
        Solids spoiled = world;
        spoiled.solids[solid].parameters[i] = bad;
        Inquiry inquiry(subject,
                        world.solids[solid].type + " with " + number_text(bad) + " as parameter " + std::to_string(i));
        inquiry.answer_or_refusal(kManifolds, spoiled.request());
      }
    }
  }
}

// In one place, of one size: no direction is better than another, and one must be taken.
void judge_collision_coincident(Subject& subject) {
  Draw draw(72);
  for (const TypeDeclaration& type : shape_types_of(subject)) {
    const Solid solid = random_solid(subject.declaration(), type, &draw);
    const Pose pose = draw.pose(2.0);
    const Solids world = Solids::two(solid, pose, solid, pose);
    Inquiry inquiry(subject, "two equal bodies of type " + type.name + " in one place");
    const std::vector<Touch> touches = world.ask(&inquiry);
    if (solid.inside > 0.0) inquiry.expect(!touches.empty(), "no contact came");
  }
}

}  // namespace

std::vector<Case> collision_cases(const PluginDeclaration& declaration) {
  std::vector<Case> cases = {
      make_types_case("collision/types", shape_types_of),
      make_case("collision/nothing", "Without a pair there is no contact.", judge_collision_nothing),
      make_case("collision/known", "Closed forms: depth, normal and place of touching shapes.", judge_known),
      make_case("collision/separated", "Bodies further apart than the margin do not touch.", judge_separated),
      make_case("collision/apart", "Moved along the normal by the depth, bodies touch no more.", judge_apart),
      make_case("collision/swap", "The pair (b, a) overlaps as deeply as (a, b).", judge_swap),
      make_case("collision/frames", "The overlap is the same in a shifted and turned world.", judge_collision_frames),
      make_case("collision/surface", "The point is midway between the two surfaces.", judge_surface),
      make_case("collision/velocity", "The relative velocity is that of b against a at the point.", judge_velocity),
      make_varied_case("collision/independence", "Each pair is answered for itself, bit for bit.",
                       judge_collision_independence),
      make_case("collision/coincident", "Equal bodies in one place touch along some unit normal.",
                judge_collision_coincident),
      make_case("collision/refusals", "Bodies, shapes and types that do not exist are refused.",
                judge_collision_refusals),
      make_case("collision/hostile", "Hostile numbers are refused with a reason, or answered with finite ones.",
                judge_collision_hostile),
  };
  std::ranges::move(moving_collision_cases(declaration), std::back_inserter(cases));
  std::ranges::move(collision_geometry_cases(declaration), std::back_inserter(cases));
  return cases;
}

std::vector<Question> collision_questions(Subject& subject, Draw* draw) {
  std::vector<Question> questions;
  for (const std::uint32_t count : {2U, 16U, 200U}) {
    Solids world = crowd(subject, count, true, draw);
    if (is_refusal(subject.ask(kManifolds, world.request()))) world = crowd(subject, count, false, draw);
    questions.push_back({"a lattice of " + std::to_string(count) + " bodies", kManifolds, world.request(), {}});
  }
  std::ranges::move(moving_collision_questions(subject), std::back_inserter(questions));
  std::ranges::move(collision_geometry_questions(subject.declaration()), std::back_inserter(questions));
  return questions;
}

}  // namespace gravitas::conformance
