// The optional questions of slot collision: times of impact and rays. Closed forms, the law that what is found can be
// seen in the manifolds of that instant, and hostile input. Bodies move for an interval of one second.
#include <algorithm>
#include <cmath>

#include "plugin_sdk/conformance/hostile_numbers.h"
#include "plugin_sdk/conformance/sample_values.h"
#include "plugin_sdk/conformance/slot_cases.h"
#include "plugin_sdk/conformance/solids.h"
#include "plugin_sdk/math/motion.h"
#include "plugin_sdk/math/transcendental.h"

namespace gravitas::conformance {
namespace {

constexpr stage::Method kTimes = stage::Method::kCollisionTimesOfImpact;
constexpr stage::Method kShapeRays = stage::Method::kCollisionRays;
constexpr double kTarget = 1e-6;  // m
constexpr const char* kConvex[] = {"Sphere", "Box", "Cylinder", "Capsule", "Cone", "ConvexPolyhedron"};

// ---- questions

MessageColumns with_shapes(stage::Method method, const Solids& world) {
  MessageColumns columns = empty_request(method);
  MessageColumns manifolds = world.request();
  columns.u64("shape_hash") = manifolds.u64("shape_hash");
  columns.u64("shape_type") = manifolds.u64("shape_type");
  columns.u32("shape_parameter_begin") = manifolds.u32("shape_parameter_begin");
  columns.u32("body_shape") = manifolds.u32("body_shape");
  for (const char* name : {"shape_parameter", "geometry_position", "geometry_orientation", "position", "orientation"})
    columns.f64(name) = manifolds.f64(name);
  return columns;
}

MessageColumns times_request(const Solids& world, double target) {
  MessageColumns columns = with_shapes(kTimes, world);
  columns.f64("target_gap") = {target};
  for (const SolidBody& body : world.bodies) {
    append(&columns.f64("displacement"), body.twist.linear);
    append(&columns.f64("rotation"), body.twist.angular);
  }
  columns.u32("pair") = world.pairs;
  return columns;
}

struct RayQuestion {
  Vector3 origin, direction;
  double length;
};

MessageColumns rays_request(const Solids& world, const std::vector<RayQuestion>& rays) {
  MessageColumns columns = with_shapes(kShapeRays, world);
  for (std::uint32_t i = 0; i < rays.size(); ++i) {
    append(&columns.f64("origin"), rays[i].origin);
    append(&columns.f64("direction"), rays[i].direction);
    columns.f64("length").push_back(rays[i].length);
    for (std::uint32_t body = 0; body < world.bodies.size(); ++body)
      columns.u32("candidate").insert(columns.u32("candidate").end(), {i, body});
  }
  return columns;
}

// ---- answers, checked for what every one must be

struct Found {
  std::uint32_t pair;
  double fraction;
  Vector3 normal, point;
  double depth;
};

std::vector<Found> ask_times(Inquiry* inquiry, const Solids& world, double target = kTarget) {
  const MessageColumns reply = inquiry->answer(kTimes, times_request(world, target));
  inquiry->expect_unit("normal", reply.f64("normal"), 3);
  std::vector<Found> found;
  for (std::size_t i = 0; i < reply.f64("fraction").size(); ++i) {
    const Found one{reply.u32("impact_pair")[i], reply.f64("fraction")[i], vector_at(reply.f64("normal"), i),
                    vector_at(reply.f64("point"), i), reply.f64("depth")[i]};
    const std::string row = " of impact " + std::to_string(i) + " is ";
    inquiry->expect(one.pair < world.pairs.size() / 2 && (found.empty() || found.back().pair < one.pair),
                    "pair" + row + std::to_string(one.pair) + ": not asked, not ascending, or twice");
    inquiry->expect(one.fraction >= 0.0 && one.fraction <= 1.0,
                    "fraction" + row + number_text(one.fraction) + ", should be 0 to 1");
    inquiry->expect(one.fraction == 0.0 || one.depth <= 0.0,
                    "depth" + row + number_text(one.depth) + ": overlapping, though not from the start");
    found.push_back(one);
  }
  return found;
}

std::vector<TypeDeclaration> convex_types(Subject& subject) {
  std::vector<TypeDeclaration> types;
  for (const char* name : kConvex)
    if (const TypeDeclaration* type = find_type(subject.declaration(), name)) types.push_back(*type);
  return types;
}

// ---- times of impact

struct KnownImpact {
  std::string name;
  Solids world;
  double fraction;  // < 0: none
  Vector3 normal = Vector3::UnitX();
};

Solids moving(const Solid& a, const Pose& pose_a, const Twist& twist_a, const Solid& b, const Pose& pose_b,
              const Twist& twist_b) {
  Solids world = Solids::two(a, pose_a, b, pose_b);
  world.bodies[0].twist = twist_a, world.bodies[1].twist = twist_b;
  return world;
}

std::vector<KnownImpact> known_impacts(const PluginDeclaration& d) {
  const auto has = [&](const char* name) { return find_type(d, name) != nullptr; };
  const Vector3 x = Vector3::UnitX(), y = Vector3::UnitY(), zero = Vector3::Zero();
  std::vector<KnownImpact> known;
  if (has("Sphere")) {
    const Solid one = make_sphere(d, 1.0);
    known.push_back({"unit spheres 5 m apart that close in at 6 m/s",
                     moving(one, {}, {2.0 * x, y}, one, at(5.0 * x), {-4.0 * x, 9.0 * y}), 0.5});
    // at height 1.6 the centres must be 1.2 m apart along x
    known.push_back({"a unit sphere that flies over another, centre 1.6 m higher",
                     moving(one, {}, {zero, zero}, one, at({-5.0, 1.6, 0.0}), {10.0 * x, zero}), 0.38,
                     Vector3(-0.6, 0.8, 0.0)});
    known.push_back({"a unit sphere that passes another at 100 m/s, 0.1 mm away",
                     moving(one, {}, {zero, zero}, one, at({-50.0, 2.0001, 0.0}), {100.0 * x, {0, 7, 1}}), -1.0});
    known.push_back({"unit spheres that overlap and move apart",
                     moving(one, {}, {zero, zero}, one, at(1.5 * x), {5.0 * x, zero}), 0.0});
    known.push_back({"unit spheres of which one orbits the other's side of its own body",
                     [&] {
                       // the geometry stands 3 m off the centre that it turns about, by half a turn
                       Solids world = moving(one, {}, {zero, zero}, one, at(5.0 * x), {zero, {0, 0, 3.14159265358979}});
                       world.bodies[1].geometry.position = 5.0 * x;
                       return world;
                     }(),
                     // law of cosines: 25 + 25 + 50 cos(angle) = 4
                     math::acos(-46.0 / 50.0) / 3.14159265358979, Vector3(0.2, 0.0, 0.0)});
    known.back().normal = [&] {
      const double angle = math::acos(-46.0 / 50.0);
      return Vector3(0.5 * (5.0 + 5.0 * math::cos(angle)), 0.5 * 5.0 * math::sin(angle), 0.0);
    }();
    if (has("Halfspace"))
      known.push_back({"a half-space and a unit sphere that falls on it from 4 m",
                       moving(make_halfspace(d), {}, {zero, zero}, one, at(4.0 * y), {-12.0 * y, {1, 2, 3}}), 0.25, y});
  }
  if (has("Box")) {
    const Solid cube = make_box(d, {0.5, 0.5, 0.5}), wall = make_box(d, {0.0005, 5.0, 5.0});
    known.push_back({"a cube at 1000 m/s and a wall of 1 mm",
                     moving(cube, at({-500.0, 0.1, 0.2}), {1000.0 * x, zero}, wall, {}, {zero, zero}), 0.4994995});
    if (has("Halfspace"))
      known.push_back({"a half-space and a cube that falls flat on it",
                       moving(make_halfspace(d), {}, {zero, zero}, cube, at({3.0, 1.5, 1.0}), {-4.0 * y, zero}), 0.25,
                       y});
  }
  return known;
}

void judge_known_impacts(Subject& subject) {
  for (const KnownImpact& one : known_impacts(subject.declaration())) {
    Inquiry inquiry(subject, one.name);
    const std::vector<Found> found = ask_times(&inquiry, one.world);
    if (one.fraction < 0.0) {
      inquiry.expect(found.empty(), "an impact came, though they miss each other");
      continue;
    }
    inquiry.expect(found.size() == 1, "no impact came; that at fraction " + number_text(one.fraction) + " is right");
    inquiry.expect_at_most("fraction", found[0].fraction, one.fraction);
    // sizes and speeds are such that the target gap is closed within this
    inquiry.expect_near("fraction", found[0].fraction, one.fraction, 2.0 * kTarget);
    inquiry.expect_near("normal (from a to b)", found[0].normal, one.normal.normalized(), 1e-3);
  }
}

// Random flights of convex bodies past each other.
void judge_seen(Subject& subject) {
  const std::vector<TypeDeclaration> types = convex_types(subject);
  Draw draw(81);
  for (const TypeDeclaration& type_a : types) {
    for (const TypeDeclaration& type_b : types) {
      for (int repeat = 0; repeat < 4; ++repeat) {
        const Solid a = random_solid(subject.declaration(), type_a, &draw);
        const Solid b = random_solid(subject.declaration(), type_b, &draw);
        Solids world = Solids::two(a, draw.pose(1.0), b, {});
        const Vector3 way = draw.direction();
        world.bodies[1].pose = {6.0 * way + draw.vector(1.0), draw.rotation()};
        world.bodies[0].twist = {draw.vector(1.0), draw.vector(6.0)};
        world.bodies[1].twist = {-12.0 * way + draw.vector(1.0), draw.vector(6.0)};
        world.bodies[0].geometry = draw.pose(0.3), world.bodies[1].geometry = draw.pose(0.3);
        Inquiry inquiry(subject, a.type + " and " + b.type + " on their way, pair " + std::to_string(repeat));
        const std::vector<Found> found = ask_times(&inquiry, world);
        const auto depth_at = [&](double fraction) {
          Solids then = world;
          then.margin = 1e-4;
          for (SolidBody& body : then.bodies)
            body.pose = moved(body.pose, {body.twist.linear, body.twist.angular}, fraction);
          const std::vector<Touch> touches = then.ask(&inquiry);
          const Touch* most = deepest(touches);
          return most == nullptr ? -1.0 : most->depth;
        };
        const double end = found.empty() ? 1.0 : found[0].fraction;
        for (int i = 0; i < 50; ++i) {
          const double before = depth_at(end * i / 50.0);
          inquiry.expect(before <= 1e-9, "at fraction " + number_text(end * i / 50.0) + " they overlap by " +
                                             number_text(before) + " m, before any impact that came");
        }
        if (found.empty()) continue;
        const double then = depth_at(end);
        inquiry.expect(then >= -2e-6 && then <= 1e-9,
                       "at fraction " + number_text(end) + ", that of the impact, the manifold's depth is " +
                           number_text(then) + " m, should be no overlap and no gap beyond the target");
      }
    }
  }
}

// Shape casts: bodies that do not turn. To cast a at b is to cast b at a the other way, and a cast that begins on the
// way ends in the same place.
void judge_casts(Subject& subject) {
  const std::vector<TypeDeclaration> types = convex_types(subject);
  Draw draw(84);
  for (const TypeDeclaration& type_a : types) {
    for (const TypeDeclaration& type_b : types) {
      for (int repeat = 0; repeat < 4; ++repeat) {
        const Solid a = random_solid(subject.declaration(), type_a, &draw);
        const Solid b = random_solid(subject.declaration(), type_b, &draw);
        const Vector3 way = draw.direction();
        Solids world = Solids::two(a, {-6.0 * way, draw.rotation()}, b, {Vector3::Zero(), draw.rotation()});
        // through the middle of b, so that no cast grazes it
        const Vector3 cast = 12.0 * way;
        Inquiry inquiry(subject, a.type + " cast at " + b.type + ", pair " + std::to_string(repeat));
        const auto first = [&](const Vector3& way_a, const Vector3& way_b) {
          world.bodies[0].twist = {way_a, Vector3::Zero()}, world.bodies[1].twist = {way_b, Vector3::Zero()};
          const std::vector<Found> found = ask_times(&inquiry, world);
          inquiry.expect(found.size() == 1, "no impact came, though a goes through the middle of b");
          return found[0];
        };
        const Found one = first(cast, Vector3::Zero());
        // either may stop up to the target before the surface, measured along its normal
        const double along = std::fabs(one.normal.dot(cast));
        inquiry.expect(along > 0.0, "the normal is square to the way that ends there");
        const double tolerance = 1e-9 + 2.0 * kTarget / along;
        const Found other = first(Vector3::Zero(), -cast);
        inquiry.expect_near("fraction with b cast the other way", other.fraction, one.fraction, tolerance);
        world.bodies[0].pose.position += 0.5 * one.fraction * cast;
        const Found rest = first(cast, Vector3::Zero());
        inquiry.expect_near("fraction from half-way", rest.fraction, 0.5 * one.fraction, tolerance);
      }
    }
  }
}

Solids mixed_flight(Subject& subject, std::uint64_t seed) {
  Draw draw(seed);
  Solids world;
  for (const TypeDeclaration& type : convex_types(subject)) {
    const auto i = static_cast<std::uint32_t>(world.bodies.size());
    world.solids.push_back(random_solid(subject.declaration(), type, &draw));
    world.bodies.push_back({.solid = i,
                            .pose = {Vector3(3.0 * i, 0, 0), draw.rotation()},
                            .twist = {draw.vector(5.0), draw.vector(3.0)},
                            .geometry = draw.pose(0.1)});
    if (i > 0) world.pairs.insert(world.pairs.end(), {i - 1, i});
  }
  return world;
}

void judge_impact_refusals(Subject& subject) {
  const Solids world = mixed_flight(subject, 82);
  if (world.pairs.empty()) return;
  const MessageColumns good = times_request(world, kTarget);
  expect_foreign_indices_refused(subject, "a row of bodies on their way", kTimes, good);
  Inquiry inquiry(subject, "a negative target gap");
  inquiry.demand_refusal(kTimes, times_request(world, -1.0));
}

void judge_impact_hostile(Subject& subject) {
  const Solids world = mixed_flight(subject, 83);
  if (world.pairs.empty()) return;
  expect_hostile_numbers_survived(subject, "a row of bodies on their way", kTimes, times_request(world, kTarget), {},
                                  hash_shapes);
}

// ---- rays

struct KnownHit {
  std::string name;
  Solid solid;
  RayQuestion ray;
  double distance;  // < 0: none
  Vector3 normal = Vector3::UnitY();
};

std::vector<KnownHit> known_hits(const PluginDeclaration& d) {
  const auto has = [&](const char* name) { return find_type(d, name) != nullptr; };
  const Vector3 x = Vector3::UnitX(), y = Vector3::UnitY(), z = Vector3::UnitZ();
  std::vector<KnownHit> known;
  if (has("Sphere")) {
    const Solid ball = make_sphere(d, 1.0);
    known.push_back({"a ray at a unit sphere, 0.6 off its centre", ball, {{-5, 0.6, 0}, x, 10}, 4.2, {-0.8, 0.6, 0}});
    known.push_back({"a ray that ends before a unit sphere", ball, {{-5, 0, 0}, x, 3.9}, -1});
    known.push_back({"a ray away from a unit sphere", ball, {{-5, 0, 0}, -x, 100}, -1});
    known.push_back({"a ray that starts inside a unit sphere", ball, {{0.5, 0, 0}, x, 10}, 0, -x});
  }
  if (has("Box")) known.push_back({"a ray at a box", make_box(d, {1, 2, 3}), {{0.5, 9, -2}, -y, 10}, 7, y});
  if (has("Cylinder")) {
    const Solid can = make_cylinder(d, 1, 4);
    known.push_back({"a ray at the side of a cylinder", can, {{-5, 1, 0.6}, x, 10}, 4.2, {-0.8, 0, 0.6}});
    known.push_back({"a ray at the end of a cylinder", can, {{0.5, -7, 0.5}, y, 10}, 5, -y});
  }
  if (has("Capsule"))
    known.push_back(
        {"a ray at the cap of a capsule", make_capsule(d, 1, 2), {{0.6, 9, 0}, -y, 10}, 7.2, {0.6, 0.8, 0}});
  if (has("Cone"))
    known.push_back({"a ray at the side of a cone", make_cone(d, 1, 2), {{0, 0, 5}, -z, 10}, 4.5, Vector3(0, 0.5, 1)});
  if (has("Halfspace")) known.push_back({"a ray at a half-space", make_halfspace(d), {{1, 3, 1}, -y, 5}, 3, y});
  return known;
}

void judge_known_hits(Subject& subject) {
  Draw draw(84);
  for (const KnownHit& one : known_hits(subject.declaration())) {
    for (const bool turned : {false, true}) {
      Inquiry inquiry(subject, one.name + (turned ? ", in a world shifted and turned" : ""));
      const Pose frame = turned ? draw.pose(3.0) : Pose{};
      Solids world;
      world.solids = {one.solid};
      world.bodies = {{.solid = 0, .pose = frame}};
      const RayQuestion ray{transform_point(frame, one.ray.origin),
                            (frame.orientation * one.ray.direction).normalized(), one.ray.length};
      const MessageColumns reply = inquiry.answer(kShapeRays, rays_request(world, {ray}));
      inquiry.expect_unit("normal", reply.f64("normal"), 3);
      const std::vector<double>& distance = reply.f64("distance");
      inquiry.expect(distance.size() == (one.distance < 0.0 ? 0U : 1U),
                     "has " + std::to_string(distance.size()) + " hits");
      if (distance.empty()) continue;
      inquiry.expect_near("distance", distance[0], one.distance, 1e-6);
      inquiry.expect_near("normal", vector_at(reply.f64("normal"), 0), frame.orientation * one.normal.normalized(),
                          1e-3);
    }
  }
}

MessageColumns many_rays(Subject& subject, std::uint64_t seed) {
  Draw draw(seed);
  const Solids world = mixed_flight(subject, seed + 1);
  std::vector<RayQuestion> rays;
  for (int i = 0; i < 4; ++i) rays.push_back({draw.vector(5.0), draw.direction(), 20.0});
  return rays_request(world, rays);
}

void judge_shape_ray_refusals(Subject& subject) {
  const MessageColumns good = many_rays(subject, 85);
  expect_foreign_indices_refused(subject, "rays at a row of bodies", kShapeRays, good);
  MessageColumns bad = good;
  Inquiry inquiry(subject, "a ray of negative length");
  bad.f64("length")[0] = -1.0;
  inquiry.demand_refusal(kShapeRays, bad);
  bad = good;
  bad.f64("direction")[0] = 2.0;
  inquiry.now_asked("a ray whose direction is no unit vector");
  inquiry.demand_refusal(kShapeRays, bad);
}

void judge_ray_hostile(Subject& subject) {
  expect_hostile_numbers_survived(subject, "rays at a row of bodies", kShapeRays, many_rays(subject, 86), {},
                                  hash_shapes);
}

}  // namespace

std::vector<Case> moving_collision_cases(const PluginDeclaration& declaration) {
  std::vector<Case> cases;
  if (has_capability(declaration, "times_of_impact")) {
    cases.push_back(make_case("collision/impact_known",
                              "Closed forms: when moving shapes first touch, and that others miss.",
                              judge_known_impacts));
    cases.push_back(make_case("collision/impact_seen",
                              "Before an impact nothing overlaps; then the gap is within the target.", judge_seen));
    cases.push_back(make_case("collision/impact_casts",
                              "Shape casts end in one place, whichever body is cast and wherever the cast begins.",
                              judge_casts));
    cases.push_back(make_case("collision/impact_refusals", "Bodies that do not exist and no targets are refused.",
                              judge_impact_refusals));
    cases.push_back(make_case("collision/impact_hostile",
                              "Hostile numbers are refused with a reason, or answered with finite ones.",
                              judge_impact_hostile));
  } else {
    cases.push_back(unknown_case("collision/impact_unknown", kTimes));
  }
  if (has_capability(declaration, "rays")) {
    cases.push_back(make_case("collision/rays_known", "Closed forms: where rays meet shapes, and that others miss.",
                              judge_known_hits));
    cases.push_back(make_case("collision/rays_refusals", "Rays and bodies that do not exist are refused.",
                              judge_shape_ray_refusals));
    cases.push_back(make_case("collision/rays_hostile",
                              "Hostile numbers are refused with a reason, or answered with finite ones.",
                              judge_ray_hostile));
  } else {
    cases.push_back(unknown_case("collision/rays_unknown", kShapeRays));
  }
  return cases;
}

std::vector<Question> moving_collision_questions(Subject& subject) {
  std::vector<Question> questions;
  if (has_capability(subject.declaration(), "times_of_impact"))
    questions.push_back(
        {"a row of bodies on their way", kTimes, times_request(mixed_flight(subject, 87), kTarget), {}});
  if (has_capability(subject.declaration(), "rays"))
    questions.push_back({"rays at a row of bodies", kShapeRays, many_rays(subject, 88), {}});
  return questions;
}

}  // namespace gravitas::conformance
