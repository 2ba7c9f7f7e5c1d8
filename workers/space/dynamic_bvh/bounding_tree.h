// A binary tree of axis-aligned boxes over bodies, balanced by construction.
//
//   level 0            [0 ......... n)          node i of level d covers the places [i n >> d, (i + 1) n >> d);
//   level 1     [0 .. n/2)     [n/2 .. n)       leaves, the nodes of the last level, cover at most kLeaf of them.
//   …            .    .          .    .         Its children are nodes 2 i and 2 i + 1 of level d + 1.
//
// So the shape of the tree depends on n alone, no node points to another, and refitting is one walk from behind. A
// build splits the bodies of a node at the median of their centres along the axis on which these spread most:
// O(n log n) wherever bodies are, also all in one place.
#pragma once

#include <immintrin.h>

#include <cstdint>
#include <span>
#include <vector>

namespace gravitas::dynamic_bvh {

// One lane an axis; the fourth is 0 in both, so that it never decides. [m], world
struct alignas(32) Box {
  __m256d lower, upper;
};

inline Box united(const Box& a, const Box& b) {
  return {_mm256_min_pd(a.lower, b.lower), _mm256_max_pd(a.upper, b.upper)};
}

// Closed boxes; false where a number is none.
inline bool overlap(const Box& a, const Box& b) {
  const __m256d below = _mm256_cmp_pd(a.lower, b.upper, _CMP_LE_OQ),
                above = _mm256_cmp_pd(b.lower, a.upper, _CMP_LE_OQ);
  return _mm256_movemask_pd(_mm256_and_pd(below, above)) == 0xF;
}

inline bool contains(const Box& outer, const Box& inner) {
  const __m256d below = _mm256_cmp_pd(outer.lower, inner.lower, _CMP_LE_OQ);
  const __m256d above = _mm256_cmp_pd(inner.upper, outer.upper, _CMP_LE_OQ);
  return _mm256_movemask_pd(_mm256_and_pd(below, above)) == 0xF;
}

// Row `body` of columns with three components; reads no more than these.
inline Box box_at(std::span<const double> lower, std::span<const double> upper, std::size_t body) {
  const __m256i three = _mm256_setr_epi64x(-1, -1, -1, 0);
  return {_mm256_maskload_pd(lower.data() + 3 * body, three), _mm256_maskload_pd(upper.data() + 3 * body, three)};
}

class BoundingTree {
 public:
  // Orders the bodies; boxes[i] is that of body i, and marked[i] says whether it is marked.
  void build(std::span<const std::uint32_t> bodies, std::span<const Box> boxes, std::span<const std::uint8_t> marked);

  // New box of a body of the build, and the nodes above it: O(log n).
  void move(std::uint32_t body, const Box& box);
  // The same for many, and marks: call refit() when all are there, O(n).
  void set(std::uint32_t body, const Box& box) { box_[place_[body]] = box; }
  void mark(std::uint32_t body) { mark_[place_[body]] = 1; }
  void refit();

  // Calls found(a, b) for every two bodies of which one is marked and whose boxes overlap, each pair once. Those marked
  // are none after it.
  template <typename Found>
  void visit_marked_pairs(Found&& found) {
    if (!body_.empty()) visit_within(0, 0, found);
    mark_.assign(mark_.size(), 0);
    node_mark_.assign(node_mark_.size(), 0);
  }

  // Calls visit(level, box) for every node that holds bodies, level by level.
  template <typename Visit>
  void visit_nodes(Visit&& visit) const {
    for (std::uint32_t level = 0; level <= levels_; ++level)
      for (std::uint32_t i = 0; i < 1U << level; ++i)
        if (place(level, i) < place(level, i + 1)) visit(level, node_box_[node(level, i)]);
  }

  // Calls found(body) for the bodies of all leaves that lie in nodes whose boxes meets(box) accepts.
  template <typename Meets, typename Found>
  void visit_met(Meets&& meets, Found&& found) const {
    if (!body_.empty()) visit_met(0, 0, meets, found);
  }

  // Sum of the edges of all nodes' boxes, m: what finding pairs costs grows with it.
  double edges() const { return edges_; }

 private:
  // At most this many bodies in a leaf: fewer make a deeper tree, more make more tests in it.
  static constexpr std::uint32_t kLeaf = 4;

  struct Centre {
    float position[3];
    std::uint32_t body;
  };

  std::uint32_t place(std::uint32_t level, std::uint32_t i) const {
    return static_cast<std::uint32_t>(std::uint64_t{i} * body_.size() >> level);
  }
  std::uint32_t node(std::uint32_t level, std::uint32_t i) const { return (1U << level) - 1 + i; }

  std::uint32_t leaf_of(std::uint32_t p) const;
  Box box_of_leaf(std::uint32_t i) const;
  void split(std::uint32_t level, std::uint32_t i);

  template <typename Meets, typename Found>
  void visit_met(std::uint32_t level, std::uint32_t i, Meets& meets, Found& found) const {
    if (!meets(node_box_[node(level, i)])) return;
    if (level == levels_) {
      for (std::uint32_t p = place(level, i); p < place(level, i + 1); ++p) found(body_[p]);
      return;
    }
    visit_met(level + 1, 2 * i, meets, found);
    visit_met(level + 1, 2 * i + 1, meets, found);
  }

  template <typename Found>
  void visit_within(std::uint32_t level, std::uint32_t i, Found& found) {
    if (!node_mark_[node(level, i)]) return;
    if (level == levels_) {
      const std::uint32_t begin = place(level, i), end = place(level, i + 1);
      for (std::uint32_t p = begin; p < end; ++p) test(p, p + 1, end, found);
      return;
    }
    visit_within(level + 1, 2 * i, found);
    visit_within(level + 1, 2 * i + 1, found);
    visit_between(level + 1, 2 * i, 2 * i + 1, found);
  }

  template <typename Found>
  void visit_between(std::uint32_t level, std::uint32_t i, std::uint32_t k, Found& found) {
    const std::uint32_t a = node(level, i), b = node(level, k);
    if (!(node_mark_[a] | node_mark_[b]) || !overlap(node_box_[a], node_box_[b])) return;
    if (level == levels_) {
      const std::uint32_t begin = place(level, k), end = place(level, k + 1);
      for (std::uint32_t p = place(level, i); p < place(level, i + 1); ++p)
        if (overlap(box_[p], node_box_[b])) test(p, begin, end, found);
      return;
    }
    for (std::uint32_t child = 0; child < 4; ++child)
      visit_between(level + 1, 2 * i + (child >> 1), 2 * k + (child & 1), found);
  }

  template <typename Found>
  void test(std::uint32_t p, std::uint32_t begin, std::uint32_t end, Found& found) {
    for (std::uint32_t q = begin; q < end; ++q)
      if ((mark_[p] | mark_[q]) && overlap(box_[p], box_[q])) found(body_[p], body_[q]);
  }

  std::uint32_t levels_ = 0;  // the last one's number
  double edges_ = 0.0;
  // by place
  std::vector<Box> box_;
  std::vector<std::uint32_t> body_;
  std::vector<std::uint8_t> mark_;
  // by node, level after level
  std::vector<Box> node_box_;
  std::vector<std::uint8_t> node_mark_;
  // by body
  std::vector<std::uint32_t> place_;
  // scratch of build(), by place
  std::vector<Centre> centre_;
};

}  // namespace gravitas::dynamic_bvh
