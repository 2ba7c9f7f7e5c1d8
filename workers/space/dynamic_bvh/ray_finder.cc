#include "workers/space/dynamic_bvh/ray_finder.h"

#include <algorithm>
#include <cstring>
#include <span>

#include "plugin_sdk/pair_rule.h"

namespace gravitas::dynamic_bvh {
namespace {

// Bit for bit, so that a number that is none equals itself.
template <typename T>
bool is_same(std::span<const T> now, const std::vector<T>& before) {
  return now.size() == before.size() && (now.empty() || std::memcmp(now.data(), before.data(), now.size_bytes()) == 0);
}

// Builds the tree over the bodies with regular bounds, and names the others that have a shape.
template <typename Request>
void build_tree(const Request& request, BoundingTree* tree, std::vector<std::uint32_t>* outsiders) {
  const auto bodies = static_cast<std::uint32_t>(request.flags().size());
  std::vector<std::uint32_t> members;
  std::vector<Box> boxes(bodies);
  outsiders->clear();
  for (std::uint32_t i = 0; i < bodies; ++i) {
    if ((request.flags()[i] & kHasShape) == 0) continue;
    if (!has_regular_bounds(request.lower(), request.upper(), i)) {
      outsiders->push_back(i);
      continue;
    }
    members.push_back(i);
    boxes[i] = box_at(request.lower(), request.upper(), i);
  }
  tree->build(members, boxes, std::vector<std::uint8_t>(bodies));
}

}  // namespace

void RayFinder::build(const stage::SpaceRaysRequest& request) {
  if (is_same(request.lower(), lower_) && is_same(request.upper(), upper_) && is_same(request.flags(), flags_)) return;
  lower_.assign(request.lower().begin(), request.lower().end());
  upper_.assign(request.upper().begin(), request.upper().end());
  flags_.assign(request.flags().begin(), request.flags().end());
  build_tree(request, &tree_, &outsiders_);
}

void RayFinder::find(const stage::SpaceRaysRequest& request, const stage::SpaceRaysReply& reply, Host& host) {
  const RayRule meets(request);
  build(request);
  const stage::ReplyColumn<std::uint32_t> candidate = reply.candidate();
  for (std::uint32_t ray = 0; ray < meets.rays(); ++ray) {
    if (ray % 256 == 0) host.mark_progress();
    found_.clear();
    const auto add = [&](std::uint32_t body) {
      if (meets(ray, body)) found_.push_back(body);
    };
    tree_.visit_met(
        [&](const Box& box) {
          alignas(32) double lower[4], upper[4];
          _mm256_store_pd(lower, box.lower);
          _mm256_store_pd(upper, box.upper);
          return meets.meets(ray, lower, upper);
        },
        add);
    std::ranges::for_each(outsiders_, add);
    std::ranges::sort(found_);
    for (const std::uint32_t body : found_) candidate.push(ray, body);
  }
}

void write_nodes(const stage::SpacePairsRequest& request, const stage::SpaceDebugGeometryReply& reply) {
  BoundingTree tree;
  std::vector<std::uint32_t> outsiders;
  build_tree(request, &tree, &outsiders);
  tree.visit_nodes([&](std::uint32_t level, const Box& box) {
    alignas(32) double lower[4], upper[4];
    _mm256_store_pd(lower, box.lower);
    _mm256_store_pd(upper, box.upper);
    reply.depth().push(level);
    reply.node_lower().push(lower[0], lower[1], lower[2]);
    reply.node_upper().push(upper[0], upper[1], upper[2]);
  });
}

}  // namespace gravitas::dynamic_bvh
