// Slot space: every answer against brute force with the one rule (plugin_sdk/pair_rule.h; of rays, ray_rule.h).
#include <algorithm>
#include <iterator>
#include <limits>
#include <set>
#include <utility>

#include "plugin_sdk/body.h"
#include "plugin_sdk/conformance/hostile_numbers.h"
#include "plugin_sdk/conformance/inquiry.h"
#include "plugin_sdk/conformance/sample_values.h"
#include "plugin_sdk/conformance/slot_cases.h"
#include "plugin_sdk/pair_rule.h"
#include "plugin_sdk/ray_rule.h"

namespace gravitas::conformance {
namespace {

constexpr stage::Method kPairs = stage::Method::kSpacePairs;
constexpr stage::Method kRays = stage::Method::kSpaceRays;
constexpr double kInfiniteLength = std::numeric_limits<double>::infinity();
constexpr std::uint32_t kBall = kMovable | kHasShape;
constexpr std::uint64_t kEverything = ~std::uint64_t{0};

class Bodies {
 public:
  void add(const Vector3& lower, const Vector3& upper, std::uint32_t flags = kBall, std::uint64_t group = 1,
           std::uint64_t mask = kEverything) {
    append(&request.f64("lower"), lower);
    append(&request.f64("upper"), upper);
    request.u32("flags").push_back(flags);
    request.u64("filter_group").push_back(group);
    request.u64("filter_mask").push_back(mask);
  }
  void add_ball(const Vector3& centre, double radius) {
    add(centre - Vector3::Constant(radius), centre + Vector3::Constant(radius));
  }
  void add_ground(std::uint32_t flags = kHasShape | kUnbounded) {
    add(Vector3::Constant(-kInfiniteLength), Vector3(kInfiniteLength, 0.0, kInfiniteLength), flags);
  }
  std::uint32_t count() const { return static_cast<std::uint32_t>(request.u32("flags").size()); }

  MessageColumns request = empty_request(kPairs);
};

// Balls of radius 0.2 to 0.6 in a cube that gives each a handful of neighbours.
Bodies crowd(std::uint32_t count, Draw* draw) {
  Bodies bodies;
  double edge = 1.0;
  while (edge * edge * edge < count) edge += 0.5;
  for (std::uint32_t i = 0; i < count; ++i) bodies.add_ball(draw->vector(0.5 * edge), draw->uniform(0.2, 0.6));
  return bodies;
}

std::vector<std::uint32_t> right_pairs(const MessageColumns& request) {
  const std::vector<gravitas_column> columns = request.plain();
  const stage::SpacePairsRequest view(columns.data());
  const PairRule is_pair(view);
  const auto bodies = static_cast<std::uint32_t>(request.u32("flags").size());
  std::vector<std::uint32_t> pairs;
  for (std::uint32_t a = 0; a < bodies; ++a)
    for (std::uint32_t b = a + 1; b < bodies; ++b)
      if (is_pair(a, b)) pairs.insert(pairs.end(), {a, b});
  return pairs;
}

std::string shown_pair(const MessageColumns& request, std::pair<std::uint32_t, std::uint32_t> pair) {
  std::string text = "pair (" + std::to_string(pair.first) + ", " + std::to_string(pair.second) + ") with bounds ";
  for (const std::uint32_t body : {pair.first, pair.second}) {
    if (body >= request.u32("flags").size()) return text + "of no body";
    text += shown(vector_at(request.f64("lower"), body)) + " … " + shown(vector_at(request.f64("upper"), body)) +
            (body == pair.first ? " and " : "");
  }
  return text;
}

using PairSet = std::set<std::pair<std::uint32_t, std::uint32_t>>;

PairSet as_set(const std::vector<std::uint32_t>& pairs) {
  PairSet set;
  for (std::size_t i = 0; i + 1 < pairs.size(); i += 2) set.emplace(pairs[i], pairs[i + 1]);
  return set;
}

// Names the first pair that is missing or wrong, or what is wrong with the order.
void expect_pairs(const Inquiry& inquiry, const MessageColumns& request, const std::vector<std::uint32_t>& came) {
  const std::vector<std::uint32_t> right = right_pairs(request);
  if (came == right) return;
  const PairSet came_set = as_set(came), right_set = as_set(right);
  for (const auto& pair : right_set)
    inquiry.expect(came_set.contains(pair), shown_pair(request, pair) + " is missing (" +
                                                std::to_string(came_set.size()) + " pairs came, " +
                                                std::to_string(right_set.size()) + " are right)");
  for (const auto& pair : came_set) inquiry.expect(right_set.contains(pair), shown_pair(request, pair) + " is no pair");
  inquiry.fail("the right " + std::to_string(right_set.size()) +
               " pairs came, but not ascending by (a, b) with each once");
}

void expect_brute_force(Subject& subject, const std::string& scene, const MessageColumns& request) {
  Inquiry inquiry(subject, std::to_string(request.u32("flags").size()) + " bodies: " + scene);
  expect_pairs(inquiry, request, inquiry.answer(kPairs, request).u32("pair"));
}

// ---- scenes

void judge_random(Subject& subject) {
  Draw draw(11);
  for (const std::uint32_t count : {2U, 3U, 10U, 60U, 200U})
    expect_brute_force(subject, "a random crowd", crowd(count, &draw).request);
}

void judge_few(Subject& subject) {
  Bodies bodies;
  expect_brute_force(subject, "an empty world", bodies.request);
  bodies.add_ball(Vector3::Zero(), 1.0);
  expect_brute_force(subject, "alone in the world", bodies.request);
}

void judge_space_coincident(Subject& subject) {
  Bodies same, points;
  for (int i = 0; i < 20; ++i) {
    same.add_ball(Vector3(0.3, -0.2, 7.0), 0.5);
    points.add_ball(Vector3(i % 3, 0, 0), 0.0);
  }
  expect_brute_force(subject, "all with the same bounds", same.request);
  expect_brute_force(subject, "points without extent in three places", points.request);
}

// Closed bounds: what shares a face, an edge or a corner overlaps.
void judge_touching(Subject& subject) {
  Bodies lattice, gaps;
  for (int x = -2; x < 2; ++x)
    for (int y = -1; y < 2; ++y)
      for (int z = 0; z < 3; ++z) {
        const Vector3 corner(x, y, z);
        lattice.add(corner, corner + Vector3::Ones());
        // the next number below one: no touch
        gaps.add(corner, corner + Vector3::Constant(1.0 - 0x1p-50));
      }
  expect_brute_force(subject, "unit cubes of a lattice, face to face", lattice.request);
  expect_brute_force(subject, "cubes of a lattice, 1e-15 apart", gaps.request);
}

void judge_unbounded(Subject& subject) {
  Draw draw(12);
  Bodies bodies = crowd(30, &draw);
  bodies.add_ground();
  bodies.add(Vector3::Constant(-kInfiniteLength), Vector3::Constant(kInfiniteLength), kHasShape | kUnbounded);
  bodies.add_ground(kHasShape | kUnbounded | kKinematic);
  bodies.add_ball(Vector3(0, 1e6, 0), 1.0);
  expect_brute_force(subject, "a crowd between unbounded bodies", bodies.request);
}

void judge_sizes(Subject& subject) {
  Draw draw(13);
  Bodies bodies;
  for (int i = 0; i < 60; ++i) {
    double radius = 1e-6;
    for (std::uint32_t k = draw.below(13); k > 0; --k) radius *= 10.0;
    bodies.add_ball(draw.vector(0.9 * radius), radius);
  }
  expect_brute_force(subject, "sizes from 1e-6 to 1e6 m, one inside the other", bodies.request);

  Bodies far;
  for (int i = 0; i < 40; ++i) far.add_ball(Vector3(1e12, -3e9, 5e15) + draw.vector(4.0), 1.0);
  expect_brute_force(subject, "balls far from the origin", far.request);

  Bodies huge;
  const double most = std::numeric_limits<double>::max();
  huge.add(Vector3::Constant(-most), Vector3::Constant(most));
  huge.add(Vector3::Constant(1e300), Vector3::Constant(1.5e300));
  huge.add(Vector3::Constant(-1e-300), Vector3::Constant(1e-300));
  huge.add(Vector3::Constant(1.5e300), Vector3::Constant(most));
  expect_brute_force(subject, "bounds up to the largest number", huge.request);
}

void judge_filters(Subject& subject) {
  Draw draw(14);
  Bodies bodies;
  for (int i = 0; i < 60; ++i) {
    const Vector3 centre = draw.vector(1.0);
    const std::uint32_t kind = draw.below(6);
    const std::uint32_t flags = kind == 0   ? kHasShape
                                : kind == 1 ? kHasShape | kKinematic
                                : kind == 2 ? kMovable
                                            : kBall | (kind == 3 ? kCanSleep : 0U);
    const std::uint64_t group = std::uint64_t{1} << (draw.below(4) * 21);
    bodies.add(centre - Vector3::Constant(0.5), centre + Vector3::Constant(0.5), flags, group, draw.bits());
  }
  expect_brute_force(subject, "with filters, kinematic and immovable bodies and some without shape", bodies.request);
}

// What it may keep from call to call must not show.
void judge_changing(Subject& subject) {
  Draw draw(15);
  for (const std::uint32_t count : {50U, 20U, 80U, 0U, 50U})
    expect_brute_force(subject, "another crowd than in the call before", crowd(count, &draw).request);
  Bodies bodies = crowd(40, &draw);
  for (int step = 0; step < 5; ++step) {
    for (std::size_t i = 0; i < 40; ++i) {
      const Vector3 move = draw.vector(i % 7 == 0 ? 20.0 : 0.1);
      set_vector(bodies.request.f64("lower"), i, vector_at(bodies.request.f64("lower"), i) + move);
      set_vector(bodies.request.f64("upper"), i, vector_at(bodies.request.f64("upper"), i) + move);
    }
    expect_brute_force(subject, "a crowd that moves", bodies.request);
  }
}

// A NaN compares with nothing, so by the rule the body pairs with none; refusing it is as good.
void judge_nan(Subject& subject) {
  Draw draw(16);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const std::size_t element : {0UL, 16UL, 31UL}) {
    for (const char* column : {"lower", "upper"}) {
      Bodies bodies = crowd(12, &draw);
      bodies.request.f64(column)[element] = nan;
      Inquiry inquiry(subject, "12 bodies, NaN in " + std::string(column) + " of body " + std::to_string(element / 3));
      if (const auto reply = inquiry.answer_or_refusal(kPairs, bodies.request))
        expect_pairs(inquiry, bodies.request, reply->u32("pair"));
    }
  }
}

void judge_space_hostile(Subject& subject) {
  Draw draw(17);
  Bodies bodies = crowd(8, &draw);
  bodies.add_ground();
  expect_hostile_numbers_survived(subject, "8 balls over a ground", kPairs, bodies.request);
  // upside down: a pair that comes must be one by the rule all the same
  std::swap(bodies.request.f64("lower"), bodies.request.f64("upper"));
  Inquiry inquiry(subject, "9 bodies with lower and upper bounds exchanged");
  if (const auto reply = inquiry.answer_or_refusal(kPairs, bodies.request)) {
    const PairSet right = as_set(right_pairs(bodies.request));
    for (const auto& pair : as_set(reply->u32("pair")))
      inquiry.expect(right.contains(pair), shown_pair(bodies.request, pair) + " is no pair");
  }
}

// ---- rays

void add_ray(MessageColumns* request, const Vector3& origin, const Vector3& direction, double length) {
  append(&request->f64("origin"), origin);
  append(&request->f64("direction"), direction);
  request->f64("length").push_back(length);
}

MessageColumns rays_at(const Bodies& bodies, std::uint32_t rays, Draw* draw) {
  MessageColumns request = empty_request(kRays);
  request.f64("lower") = bodies.request.f64("lower");
  request.f64("upper") = bodies.request.f64("upper");
  request.u32("flags") = bodies.request.u32("flags");
  for (std::uint32_t i = 0; i < rays; ++i) {
    // some along an axis, which takes another way through the rule
    const Vector3 direction = i % 4 == 3 ? Vector3(Vector3::Unit(static_cast<int>(i / 4 % 3))) : draw->direction();
    add_ray(&request, draw->vector(4.0), direction, draw->uniform(0.0, 8.0));
  }
  return request;
}

void expect_met(Subject& subject, const std::string& scene, const MessageColumns& request) {
  const std::vector<gravitas_column> columns = request.plain();
  const RayRule meets{stage::SpaceRaysRequest(columns.data())};
  std::vector<std::uint32_t> right;
  for (std::uint32_t ray = 0; ray < meets.rays(); ++ray)
    for (std::uint32_t body = 0; body < meets.bodies(); ++body)
      if (meets(ray, body)) right.insert(right.end(), {ray, body});
  Inquiry inquiry(subject, std::to_string(meets.rays()) + " rays, " + std::to_string(meets.bodies()) +
                               " bodies: " + scene + " (candidates as ray, body)");
  inquiry.expect_equal("candidate", inquiry.answer(kRays, request).u32("candidate"), right);
}

void judge_rays(Subject& subject) {
  Draw draw(19);
  for (const std::uint32_t count : {0U, 1U, 10U, 300U}) {
    Bodies bodies = crowd(count, &draw);
    bodies.add_ground();
    bodies.add(Vector3::Constant(-1.0), Vector3::Constant(1.0), kMovable);
    expect_met(subject, "a random crowd over a ground, one without shape", rays_at(bodies, 40, &draw));
  }
  // what only touches a face, an edge or a corner is met, and an origin inside counts
  Bodies lattice;
  for (int x = 0; x < 3; ++x)
    for (int y = 0; y < 3; ++y) lattice.add({1.0 * x, 1.0 * y, 0.0}, {x + 1.0, y + 1.0, 1.0});
  MessageColumns request = rays_at(lattice, 0, &draw);
  add_ray(&request, {-1, 1, 0.5}, Vector3::UnitX(), 10.0);
  add_ray(&request, {-1, 1, 1}, Vector3::UnitX(), 2.0);
  add_ray(&request, {1.5, 1.5, 0.5}, Vector3::UnitZ(), 0.0);
  add_ray(&request, {-1, 0.5, 0.5}, -Vector3::UnitX(), 10.0);
  expect_met(subject, "rays along the faces and edges of a lattice", request);
}

void judge_ray_refusals(Subject& subject) {
  Draw draw(20);
  const MessageColumns good = rays_at(crowd(8, &draw), 4, &draw);
  Inquiry inquiry(subject, "a ray of negative length");
  MessageColumns bad = good;
  bad.f64("length")[1] = -1.0;
  inquiry.demand_refusal(kRays, bad);
  bad = good;
  bad.f64("direction")[3] = 2.0;
  inquiry.now_asked("a ray whose direction is no unit vector");
  inquiry.demand_refusal(kRays, bad);
  expect_hostile_numbers_survived(subject, "rays at 8 balls", kRays, good);
}

std::vector<Case> ray_cases(const PluginDeclaration& declaration) {
  if (!has_capability(declaration, "rays")) return {unknown_case("space/rays_unknown", kRays)};
  return {make_case("space/rays", "Rays meet exactly the bounds of brute force.", judge_rays),
          make_case("space/rays_refusals", "Impossible rays are refused, hostile ones refused or answered.",
                    judge_ray_refusals)};
}

}  // namespace

std::vector<Case> space_cases(const PluginDeclaration& declaration) {
  std::vector<Case> cases = {
      make_case("space/few", "Of no body or one there is no pair.", judge_few),
      make_case("space/random", "A crowd has exactly the pairs of brute force.", judge_random),
      make_case("space/coincident", "Bodies in one place are all pairs.", judge_space_coincident),
      make_case("space/touching",
                "Bounds are closed: shared faces, edges and corners make pairs, a gap of rounding does not.",
                judge_touching),
      make_case("space/unbounded", "Unbounded bodies meet everything that can move.", judge_unbounded),
      make_case("space/sizes", "Any mixture of sizes and any place give the pairs of brute force.", judge_sizes),
      make_case("space/filters", "Filters, flags and shapes decide as the pair rule says.", judge_filters),
      make_case("space/changing", "An answer does not depend on the questions before it.", judge_changing),
      make_case("space/nan", "Bounds that are no numbers are refused, or pair with nothing.", judge_nan),
      make_case("space/hostile", "Hostile bounds are refused, or answered by the rule.", judge_space_hostile),
  };
  std::ranges::move(ray_cases(declaration), std::back_inserter(cases));
  std::ranges::move(space_geometry_cases(declaration), std::back_inserter(cases));
  return cases;
}

std::vector<Question> space_questions(const PluginDeclaration& declaration, Draw* draw) {
  std::vector<Question> questions;
  for (const std::uint32_t count : {1U, 12U, 300U}) {
    Bodies bodies = crowd(count, draw);
    bodies.add_ground();
    questions.push_back({"a crowd of " + std::to_string(count) + " over a ground", kPairs, bodies.request, {}});
    if (has_capability(declaration, "rays"))
      questions.push_back({"rays at a crowd of " + std::to_string(count), kRays, rays_at(bodies, 2 * count, draw), {}});
  }
  std::ranges::move(space_geometry_questions(declaration), std::back_inserter(questions));
  return questions;
}

}  // namespace gravitas::conformance
