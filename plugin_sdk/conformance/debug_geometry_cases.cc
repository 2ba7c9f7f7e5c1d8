// The optional question for debug geometry, of the slots collision and space: lines lie on surfaces, boxes hold what is
// sorted into them, what is not asked for is absent.
#include <algorithm>
#include <cmath>
#include <limits>

#include "plugin_sdk/collision.h"
#include "plugin_sdk/conformance/hostile_numbers.h"
#include "plugin_sdk/conformance/inquiry.h"
#include "plugin_sdk/conformance/sample_values.h"
#include "plugin_sdk/conformance/slot_cases.h"
#include "plugin_sdk/conformance/solids.h"

namespace gravitas::conformance {
namespace {

constexpr stage::Method kShapes = stage::Method::kCollisionDebugGeometry;
constexpr stage::Method kBodies = stage::Method::kSpaceDebugGeometry;
constexpr const char* kDrawn[] = {"Sphere", "Box", "Cylinder", "Capsule", "Cone", "Halfspace"};
constexpr double kExtent = 10.0;  // m

// ---- shapes

std::vector<Solid> known_solids(const PluginDeclaration& d) {
  std::vector<Solid> solids;
  for (const char* name : kDrawn) {
    if (find_type(d, name) == nullptr) continue;
    const std::string type = name;
    if (type == "Sphere") solids.push_back(make_sphere(d, 0.7));
    if (type == "Box") solids.push_back(make_box(d, {1.0, 2.0, 0.5}));
    if (type == "Cylinder") solids.push_back(make_cylinder(d, 0.6, 1.8));
    if (type == "Capsule") solids.push_back(make_capsule(d, 0.4, 1.2));
    if (type == "Cone") solids.push_back(make_cone(d, 0.5, 2.0));
    if (type == "Halfspace") solids.push_back(make_halfspace(d));
  }
  return solids;
}

MessageColumns shapes_request(const std::vector<Solid>& solids, std::uint32_t kinds) {
  Solids world;
  world.solids = solids;
  MessageColumns manifolds = world.request();
  MessageColumns columns = empty_request(kShapes);
  columns.u32("kinds") = {kinds};
  columns.f64("extent") = {kExtent};
  columns.u64("shape_hash") = manifolds.u64("shape_hash");
  columns.u64("shape_type") = manifolds.u64("shape_type");
  columns.u32("shape_parameter_begin") = manifolds.u32("shape_parameter_begin");
  columns.f64("shape_parameter") = manifolds.f64("shape_parameter");
  return columns;
}

void judge_outlines(Subject& subject) {
  const std::vector<Solid> solids = known_solids(subject.declaration());
  for (std::size_t i = 0; i < solids.size(); ++i) {
    Inquiry inquiry(subject, "the outline of a " + solids[i].type);
    const MessageColumns reply = inquiry.answer(kShapes, shapes_request({solids[i]}, collision::kOutlines));
    inquiry.expect(!reply.u32("line_shape").empty(), "has no line");
    for (const char* end : {"line_from", "line_to"}) {
      for (std::size_t k = 0; k < reply.f64(end).size() / 3; ++k) {
        const Vector3 point = vector_at(reply.f64(end), k);
        inquiry.expect_near("distance of " + std::string(end) + " " + shown(point) + " from the surface",
                            solids[i].distance(point), 0.0, 1e-9);
        if (solids[i].is_halfspace())
          inquiry.expect_at_most("a coordinate of a half-space's line", point.cwiseAbs().maxCoeff(), kExtent);
      }
    }
    if (solids[i].type == "Box")
      inquiry.expect(reply.u32("line_shape").size() == 12,
                     "has " + std::to_string(reply.u32("line_shape").size()) + " lines, a box has 12 edges");
  }
}

void judge_kinds(Subject& subject) {
  const std::vector<Solid> solids = known_solids(subject.declaration());
  Inquiry inquiry(subject, "shapes of which nothing is asked");
  for (const std::uint32_t kinds : {0U, static_cast<std::uint32_t>(collision::kTrees)}) {
    const MessageColumns reply = inquiry.answer(kShapes, shapes_request(solids, kinds));
    inquiry.expect(reply.u32("line_shape").empty(), "has lines, which were not asked for");
    inquiry.expect(reply.u32("node_shape").empty(), "has nodes, which were not asked for, or of which there are none");
  }
  inquiry.now_asked("several shapes");
  const MessageColumns reply = inquiry.answer(kShapes, shapes_request(solids, collision::kOutlines));
  inquiry.expect(std::ranges::is_sorted(reply.u32("line_shape")), "its shapes do not ascend");
  for (std::size_t i = 0; i < solids.size(); ++i) {
    const auto alone = inquiry.answer(kShapes, shapes_request({solids[i]}, collision::kOutlines));
    std::vector<double> from;
    for (std::size_t row = 0; row < reply.u32("line_shape").size(); ++row)
      if (reply.u32("line_shape")[row] == i) append(&from, vector_at(reply.f64("line_from"), row));
    inquiry.expect_equal("the lines of shape " + std::to_string(i) + " among others", from, alone.f64("line_from"));
  }
}

void judge_shape_refusals(Subject& subject) {
  const MessageColumns good = shapes_request(known_solids(subject.declaration()), collision::kOutlines);
  expect_foreign_indices_refused(subject, "outlines of shapes", kShapes, good);
  Inquiry inquiry(subject, "a type that the plugin does not serve");
  MessageColumns bad = good;
  if (bad.u64("shape_type").empty()) return;
  bad.u64("shape_type")[0] = 1;
  inquiry.demand_refusal(kShapes, bad);
  bad = good;
  bad.f64("extent")[0] = -1.0;
  inquiry.now_asked("a negative extent");
  inquiry.demand_refusal(kShapes, bad);
}

// The hashes of spoiled shapes are those of their content.
void hash_again(MessageColumns* request) {
  MessageColumns manifolds = empty_request(stage::Method::kCollisionManifolds);
  manifolds.u64("shape_hash") = request->u64("shape_hash");
  manifolds.u64("shape_type") = request->u64("shape_type");
  manifolds.u32("shape_parameter_begin") = request->u32("shape_parameter_begin");
  manifolds.f64("shape_parameter") = request->f64("shape_parameter");
  hash_shapes(&manifolds);
  request->u64("shape_hash") = manifolds.u64("shape_hash");
}

void judge_shape_hostile(Subject& subject) {
  expect_hostile_numbers_survived(
      subject, "outlines and trees of shapes", kShapes,
      shapes_request(known_solids(subject.declaration()), collision::kOutlines | collision::kTrees), {}, hash_again);
}

// ---- bodies

// Unit boxes in a cube that gives each some neighbours, and a ground.
MessageColumns boxes_request(std::uint32_t count, std::uint64_t seed) {
  Draw draw(seed);
  MessageColumns request = empty_request(kBodies);
  const auto add = [&](const Vector3& lower, const Vector3& upper) {
    append(&request.f64("lower"), lower);
    append(&request.f64("upper"), upper);
    request.u32("flags").push_back(kMovable | kHasShape);
    request.u64("filter_group").push_back(1);
    request.u64("filter_mask").push_back(1);
  };
  for (std::uint32_t i = 0; i < count; ++i) {
    const Vector3 centre = draw.vector(2.0 + 0.01 * count);
    add(centre - Vector3::Constant(0.5), centre + Vector3::Constant(0.5));
  }
  const double infinity = std::numeric_limits<double>::infinity();
  add(Vector3::Constant(-infinity), {infinity, 0.0, infinity});
  return request;
}

void judge_nodes(Subject& subject) {
  for (const std::uint32_t count : {1U, 5U, 200U}) {
    Inquiry inquiry(subject, std::to_string(count) + " unit boxes over a ground");
    const MessageColumns request = boxes_request(count, 60 + count);
    const MessageColumns reply = inquiry.answer(kBodies, request);
    const std::size_t nodes = reply.u32("depth").size();
    inquiry.expect(nodes > 0, "there is no node");
    const auto lower = [&](std::size_t i) { return vector_at(reply.f64("node_lower"), i); };
    const auto upper = [&](std::size_t i) { return vector_at(reply.f64("node_upper"), i); };
    for (std::size_t i = 0; i < nodes; ++i)
      inquiry.expect((lower(i).array() <= upper(i).array()).all(),
                     "node " + std::to_string(i) + " is upside down: " + shown(lower(i)) + " … " + shown(upper(i)));
    for (std::size_t body = 0; body < count; ++body) {
      const Vector3 centre = 0.5 * (vector_at(request.f64("lower"), body) + vector_at(request.f64("upper"), body));
      bool is_held = false;
      for (std::size_t i = 0; i < nodes && !is_held; ++i)
        is_held = (lower(i).array() <= centre.array()).all() && (centre.array() <= upper(i).array()).all();
      inquiry.expect(is_held, "no node holds the centre " + shown(centre) + " of body " + std::to_string(body));
    }
    // the answer must not show what was asked before
    inquiry.answer(kBodies, boxes_request(count + 3, 90));
    inquiry.expect_equal("node_lower, asked again", inquiry.answer(kBodies, request).f64("node_lower"),
                         reply.f64("node_lower"));
  }
  Inquiry inquiry(subject, "no body");
  inquiry.expect(inquiry.answer(kBodies, empty_request(kBodies)).u32("depth").empty(), "there are nodes");
}

void judge_node_hostile(Subject& subject) {
  expect_hostile_numbers_survived(subject, "5 unit boxes over a ground", kBodies, boxes_request(5, 61));
}

}  // namespace

Case unknown_case(const char* name, stage::Method method) {
  return make_case(name, "What is not declared is not answered.", [method](Subject& subject) {
    const Answer answer = subject.ask(method, [&] {
      MessageColumns nothing = empty_request(method);
      for (const stage::ColumnInfo& column : stage::method_info(method).request)
        if (column.extra == 1) nothing.u32(column.name) = {0};
      return nothing;
    }());
    if (answer.fault.empty() && answer.status == GRAVITAS_UNKNOWN_METHOD) return;
    throw Finding("a method whose capability is not declared: must be answered as unknown");
  });
}

std::vector<Case> collision_geometry_cases(const PluginDeclaration& declaration) {
  if (!has_capability(declaration, "debug_geometry")) return {unknown_case("collision/debug_unknown", kShapes)};
  return {
      make_case("collision/debug_outlines", "The lines that show a shape end on its surface.", judge_outlines),
      make_case("collision/debug_kinds", "What is not asked for is absent; each shape is answered for itself.",
                judge_kinds),
      make_case("collision/debug_refusals", "Shapes and types that do not exist are refused.", judge_shape_refusals),
      make_case("collision/debug_hostile", "Hostile numbers are refused with a reason, or answered with finite ones.",
                judge_shape_hostile),
  };
}

std::vector<Case> space_geometry_cases(const PluginDeclaration& declaration) {
  if (!has_capability(declaration, "debug_geometry")) return {unknown_case("space/debug_unknown", kBodies)};
  return {
      make_case("space/debug_nodes", "Nodes hold the bodies, whatever was asked before.", judge_nodes),
      make_case("space/debug_hostile", "Hostile bounds are refused, or answered with finite nodes.",
                judge_node_hostile),
  };
}

std::vector<Question> collision_geometry_questions(const PluginDeclaration& declaration) {
  if (!has_capability(declaration, "debug_geometry")) return {};
  const std::vector<Solid> solids = known_solids(declaration);
  if (solids.empty()) return {};
  return {
      {"outlines and trees of shapes", kShapes, shapes_request(solids, collision::kOutlines | collision::kTrees), {}}};
}

std::vector<Question> space_geometry_questions(const PluginDeclaration& declaration) {
  if (!has_capability(declaration, "debug_geometry")) return {};
  return {{"nodes over 40 unit boxes", kBodies, boxes_request(40, 62), {}}};
}

}  // namespace gravitas::conformance
