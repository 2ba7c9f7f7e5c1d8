#include "workers/space/dynamic_bvh/bounding_tree.h"

#include <algorithm>
#include <limits>

namespace gravitas::dynamic_bvh {
namespace {

__m256d edges_of(const Box& box) { return _mm256_sub_pd(box.upper, box.lower); }

double sum(__m256d edges) {
  alignas(32) double lanes[4];
  _mm256_store_pd(lanes, edges);
  return lanes[0] + lanes[1] + lanes[2];
}

}  // namespace

void BoundingTree::build(std::span<const std::uint32_t> bodies, std::span<const Box> boxes,
                         std::span<const std::uint8_t> marked) {
  const std::size_t count = bodies.size();
  levels_ = 0;
  while (count >> levels_ > kLeaf) ++levels_;
  // n >> levels is rounded down: a leaf may hold one more
  if (count > std::size_t{kLeaf} << levels_) ++levels_;

  // centres relative to a body, so that single precision is enough to order them wherever the scene is
  centre_.resize(count);
  if (count > 0) {
    const Box& origin = boxes[bodies[0]];
    for (std::size_t i = 0; i < count; ++i) {
      const Box& box = boxes[bodies[i]];
      const __m256d twice =
          _mm256_add_pd(_mm256_sub_pd(box.lower, origin.lower), _mm256_sub_pd(box.upper, origin.upper));
      const __m128 rounded = _mm256_cvtpd_ps(twice);
      alignas(16) float lanes[4];
      _mm_store_ps(lanes, rounded);
      centre_[i] = {{lanes[0], lanes[1], lanes[2]}, bodies[i]};
    }
  }
  body_.resize(count);
  split(0, 0);

  box_.resize(count);
  mark_.resize(count);
  place_.resize(boxes.size());
  for (std::uint32_t p = 0; p < count; ++p) {
    body_[p] = centre_[p].body;
    box_[p] = boxes[body_[p]];
    mark_[p] = marked[body_[p]];
    place_[body_[p]] = p;
  }
  node_box_.resize((std::size_t{2} << levels_) - 1);
  node_mark_.resize(node_box_.size());
  refit();
}

void BoundingTree::split(std::uint32_t level, std::uint32_t i) {
  if (level == levels_) return;
  Centre* const begin = centre_.data() + place(level, i);
  Centre* const middle = centre_.data() + place(level + 1, 2 * i + 1);
  Centre* const end = centre_.data() + place(level, i + 1);
  if (begin < end) {
    float lowest[3], highest[3];
    for (int k = 0; k < 3; ++k) lowest[k] = highest[k] = begin->position[k];
    for (const Centre* c = begin; c < end; ++c) {
      for (int k = 0; k < 3; ++k) {
        lowest[k] = std::min(lowest[k], c->position[k]);
        highest[k] = std::max(highest[k], c->position[k]);
      }
    }
    int axis = 0;
    for (int k = 1; k < 3; ++k)
      if (highest[k] - lowest[k] > highest[axis] - lowest[axis]) axis = k;
    if (highest[axis] > lowest[axis]) {
      std::nth_element(begin, middle, end,
                       [axis](const Centre& a, const Centre& b) { return a.position[axis] < b.position[axis]; });
    }
  }
  split(level + 1, 2 * i);
  split(level + 1, 2 * i + 1);
}

// The leaf whose places p is among.
std::uint32_t BoundingTree::leaf_of(std::uint32_t p) const {
  auto i = static_cast<std::uint32_t>((std::uint64_t{p} << levels_) / body_.size());
  while (place(levels_, i + 1) <= p) ++i;
  return i;
}

Box BoundingTree::box_of_leaf(std::uint32_t i) const {
  Box box = {_mm256_set1_pd(std::numeric_limits<double>::infinity()),
             _mm256_set1_pd(-std::numeric_limits<double>::infinity())};
  for (std::uint32_t p = place(levels_, i); p < place(levels_, i + 1); ++p) box = united(box, box_[p]);
  return box;
}

void BoundingTree::move(std::uint32_t body, const Box& box) {
  set(body, box);
  const std::uint32_t leaf = leaf_of(place_[body]);
  Box changed = box_of_leaf(leaf);
  __m256d edges = _mm256_setzero_pd();
  for (std::uint32_t k = node(levels_, leaf);; k = (k - 1) / 2) {
    edges = _mm256_add_pd(edges, _mm256_sub_pd(edges_of(changed), edges_of(node_box_[k])));
    node_box_[k] = changed;
    if (k == 0) break;
    const std::uint32_t parent = (k - 1) / 2;
    changed = united(node_box_[2 * parent + 1], node_box_[2 * parent + 2]);
  }
  edges_ += sum(edges);
}

void BoundingTree::refit() {
  const std::uint32_t leaves = 1U << levels_;
  __m256d edges = _mm256_setzero_pd();
  for (std::uint32_t i = 0; i < leaves; ++i) {
    const std::uint32_t begin = place(levels_, i), end = place(levels_, i + 1), leaf = node(levels_, i);
    node_box_[leaf] = box_of_leaf(i);
    node_mark_[leaf] = 0;
    for (std::uint32_t p = begin; p < end; ++p) node_mark_[leaf] |= mark_[p];
    if (begin < end) edges = _mm256_add_pd(edges, edges_of(node_box_[leaf]));
  }
  for (std::uint32_t k = leaves - 1; k-- > 0;) {
    node_box_[k] = united(node_box_[2 * k + 1], node_box_[2 * k + 2]);
    node_mark_[k] = node_mark_[2 * k + 1] | node_mark_[2 * k + 2];
    edges = _mm256_add_pd(edges, edges_of(node_box_[k]));
  }
  edges_ = sum(edges);
}

}  // namespace gravitas::dynamic_bvh
