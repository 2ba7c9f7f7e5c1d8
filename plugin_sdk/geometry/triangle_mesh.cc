// The tree is divided by the median of the centroids across the longest span of their boxes (§ 4.3.1.5, which divides at
// the middle of the span: a few far triangles then make a deep tree).
#include "plugin_sdk/geometry/triangle_mesh.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "plugin_sdk/geometry/simplex.h"
#include "plugin_sdk/math/transcendental.h"

namespace gravitas {
namespace {

// Of the longest edge, squared: a triangle with less area, doubled, has no direction.
constexpr double kNoArea = 1e-13;
constexpr std::uint32_t kDeepest = 60;
// Of the largest coordinate: heights over a plane that are none, and of the distance from where its normal is known.
constexpr double kFlatHeight = 1e-14;
constexpr double kFlatSlope = 1e-12;
constexpr double kMostSlope = 1e-7;  // however little the normal of a sliver is known

bool precedes(const Vector3& a, const Vector3& b) {
  return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
}

}  // namespace

std::optional<TriangleMesh> TriangleMesh::make(std::span<const Vector3> vertices, std::span<const Triangle> triangles,
                                               const MeshOptions& options, std::string* why) {
  const auto refuse = [why](std::string text) {
    *why = std::move(text);
    return std::nullopt;
  };
  for (std::size_t i = 0; i < vertices.size(); ++i)
    if (!vertices[i].allFinite() || !(vertices[i].cwiseAbs().maxCoeff() < 1e100))
      return refuse("vertex " + std::to_string(i) + " is not finite, or beyond 1e100 m");
  for (std::size_t i = 0; i < triangles.size(); ++i)
    for (const std::uint32_t v : triangles[i])
      if (v >= vertices.size())
        return refuse("face " + std::to_string(i) + " names vertex " + std::to_string(v) + " of " +
                      std::to_string(vertices.size()));

  TriangleMesh mesh;
  // one vertex for all that are equal
  std::vector<std::uint32_t> order(vertices.size());
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    if (precedes(vertices[a], vertices[b])) return true;
    return !precedes(vertices[b], vertices[a]) && a < b;
  });
  std::vector<std::uint32_t> first(vertices.size());
  for (std::size_t i = 0; i < order.size(); ++i)
    first[order[i]] = i > 0 && vertices[order[i]] == vertices[order[i - 1]] ? first[order[i - 1]] : order[i];
  std::vector<std::uint32_t> row(vertices.size(), kNone);
  for (const Triangle& t : triangles) {
    const Vector3 ab = vertices[t[1]] - vertices[t[0]], ac = vertices[t[2]] - vertices[t[0]];
    const Vector3 area = ab.cross(ac);
    const double longest = std::max({ab.squaredNorm(), ac.squaredNorm(), (ac - ab).squaredNorm()});
    const double twice_area = std::sqrt(area.squaredNorm());
    if (!(twice_area > kNoArea * longest) || !(twice_area > 0.0)) {
      ++mesh.dropped_;
      continue;
    }
    Triangle& own = mesh.triangles_.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t& index = row[first[t[k]]];
      if (index == kNone) {
        index = static_cast<std::uint32_t>(mesh.vertices_.size());
        mesh.vertices_.push_back(vertices[t[k]]);
      }
      own[k] = index;
    }
    mesh.normals_.push_back(area / twice_area);
  }
  if (mesh.triangles_.empty()) return refuse("no triangle has an area");
  mesh.join();
  mesh.find_flat_faces();
  mesh.options_ = options;
  mesh.build_tree();
  return mesh;
}

// Neighbours, rings, and whether the mesh is closed.
void TriangleMesh::join() {
  struct HalfEdge {
    std::uint32_t low, high, triangle, edge;
    bool is_forward;
  };
  std::vector<HalfEdge> edges;
  edges.reserve(3 * triangles_.size());
  for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t a = triangles_[t][k], b = triangles_[t][(k + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), t, k, a < b});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const HalfEdge& x, const HalfEdge& y) {
    return std::tie(x.low, x.high, x.triangle, x.edge) < std::tie(y.low, y.high, y.triangle, y.edge);
  });
  neighbours_.assign(triangles_.size(), {kNone, kNone, kNone});
  is_closed_ = true;
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t end = i;
    while (end < edges.size() && edges[end].low == edges[i].low && edges[end].high == edges[i].high) ++end;
    const bool is_joined = end - i == 2 && edges[i].is_forward != edges[i + 1].is_forward;
    if (is_joined) {
      neighbours_[edges[i].triangle][edges[i].edge] = edges[i + 1].triangle;
      neighbours_[edges[i + 1].triangle][edges[i + 1].edge] = edges[i].triangle;
    }
    is_closed_ = is_closed_ && is_joined;
    i = end;
  }
  ring_begin_.assign(vertices_.size() + 1, 0);
  for (const Triangle& t : triangles_)
    for (const std::uint32_t v : t) ++ring_begin_[v + 1];
  std::partial_sum(ring_begin_.begin(), ring_begin_.end(), ring_begin_.begin());
  rings_.resize(3 * triangles_.size());
  std::vector<std::uint32_t> next(ring_begin_.begin(), ring_begin_.end() - 1);
  for (std::uint32_t t = 0; t < triangles_.size(); ++t)
    for (const std::uint32_t v : triangles_[t]) rings_[next[v]++] = t;

  if (!is_closed_) return;
  double volume = 0.0;
  for (const Triangle& t : triangles_) {
    const Vector3 &a = vertices_[t[0]] - vertices_[0], &b = vertices_[t[1]] - vertices_[0];
    volume += a.dot(b.cross(vertices_[t[2]] - vertices_[0]));
  }
  if (volume >= 0.0) return;
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    // the edges of (a, c, b) are ca, bc, ab of (a, b, c) turned round
    std::swap(triangles_[t][1], triangles_[t][2]);
    std::swap(neighbours_[t][0], neighbours_[t][2]);
    normals_[t] = -normals_[t];
  }
}

void TriangleMesh::find_flat_faces() {
  double largest = 0.0;
  for (const Vector3& vertex : vertices_) largest = std::max(largest, vertex.cwiseAbs().maxCoeff());
  flat_faces_.assign(triangles_.size(), kNone);
  std::vector<std::uint32_t> open;
  for (std::uint32_t seed = 0; seed < triangles_.size(); ++seed) {
    if (flat_faces_[seed] != kNone) continue;
    const std::array<Vector3, 3> x = corners(seed);
    const Vector3& up = normals_[seed];
    const double least = (x[1] - x[0]).cross(x[2] - x[0]).norm();
    // the normal of a small triangle, or of a sliver, is known as its vertices are
    const double size = std::max({(x[1] - x[0]).norm(), (x[2] - x[1]).norm(), (x[0] - x[2]).norm()});
    const double slope = std::min(kMostSlope, kFlatSlope + 4e-16 * largest * size / least);
    const auto is_flush = [&](const Vector3& p) {
      return std::fabs(up.dot(p - x[0])) <= kFlatHeight * largest + slope * (p - x[0]).norm();
    };
    flat_faces_[seed] = seed;
    open.assign(1, seed);
    while (!open.empty()) {
      const std::uint32_t from = open.back();
      open.pop_back();
      for (const std::uint32_t next : neighbours_[from]) {
        if (next == kNone || flat_faces_[next] != kNone || !(up.dot(normals_[next]) > 0.0)) continue;
        const std::array<Vector3, 3> y = corners(next);
        if (!std::all_of(y.begin(), y.end(), is_flush)) continue;
        flat_faces_[next] = seed;
        open.push_back(next);
      }
    }
  }
}

void TriangleMesh::build_tree() {
  const std::size_t count = triangles_.size();
  std::vector<Vector3> centroids(count);
  std::vector<Box3> boxes(count);
  for (std::uint32_t t = 0; t < count; ++t) {
    for (const Vector3& corner : corners(t)) boxes[t].extend(corner);
    centroids[t] = boxes[t].centre();
  }
  order_.resize(count);
  std::iota(order_.begin(), order_.end(), 0U);
  struct Task {
    std::uint32_t node, first, count, depth;
  };
  std::vector<Task> tasks{{0, 0, static_cast<std::uint32_t>(count), 0}};
  nodes_.assign(1, {});
  const std::uint32_t deepest = std::min(options_.maximum_depth, kDeepest);
  while (!tasks.empty()) {
    const Task task = tasks.back();
    tasks.pop_back();
    Box3 box, span;
    for (std::uint32_t i = 0; i < task.count; ++i) {
      box.extend(boxes[order_[task.first + i]]);
      span.extend(centroids[order_[task.first + i]]);
    }
    nodes_[task.node] = {box, task.first, task.count};
    if (task.depth >= deepest || task.count <= std::max(options_.minimum_node_size, 1U)) continue;
    Eigen::Index axis = 0;
    (span.upper - span.lower).maxCoeff(&axis);
    const auto begin = order_.begin() + task.first;
    const std::uint32_t half = task.count / 2;
    std::nth_element(begin, begin + half, begin + task.count, [&](std::uint32_t a, std::uint32_t b) {
      return centroids[a][axis] != centroids[b][axis] ? centroids[a][axis] < centroids[b][axis] : a < b;
    });
    const auto child = static_cast<std::uint32_t>(nodes_.size());
    nodes_[task.node].first = child, nodes_[task.node].count = 0;
    nodes_.resize(nodes_.size() + 2);
    tasks.push_back({child + 1, task.first + half, task.count - half, task.depth + 1});
    tasks.push_back({child, task.first, half, task.depth + 1});
  }
  // the order inside a leaf is no business of nth_element
  for (const Node& node : nodes_)
    if (node.count > 0) std::sort(order_.begin() + node.first, order_.begin() + node.first + node.count);
}

TriangleMesh::Nearest TriangleMesh::nearest(const Vector3& p) const {
  Nearest best;
  double least = std::numeric_limits<double>::infinity();
  SimplexPoint where;
  struct Entry {
    std::uint32_t node;
    double squared;
  };
  std::array<Entry, 128> stack;
  std::size_t depth = 0;
  stack[depth++] = {0, nodes_[0].box.squared_distance(p)};
  while (depth > 0) {
    const Entry entry = stack[--depth];
    if (entry.squared > least) continue;
    const Node& node = nodes_[entry.node];
    if (node.count == 0) {
      const Entry a{node.first, nodes_[node.first].box.squared_distance(p)};
      const Entry b{node.first + 1, nodes_[node.first + 1].box.squared_distance(p)};
      stack[depth++] = a.squared <= b.squared ? b : a;
      stack[depth++] = a.squared <= b.squared ? a : b;
      continue;
    }
    for (std::uint32_t i = 0; i < node.count; ++i) {
      const std::uint32_t t = order_[node.first + i];
      const std::array<Vector3, 3> x = corners(t);
      const SimplexPoint found = closest_on_triangle(x[0] - p, x[1] - p, x[2] - p);
      const double squared = found.point.squaredNorm();
      if (squared > least || (squared == least && t > best.triangle)) continue;
      least = squared, where = found;
      best.triangle = t, best.point = found.point + p;
    }
  }
  // the side: of the sum of the normals round the feature that is nearest, weighted by their angles there
  // (J. A. Baerentzen and H. Aanaes, "Signed distance computation using the angle weighted pseudonormal", 2005)
  const Triangle& t = triangles_[best.triangle];
  Vector3 side = normals_[best.triangle];
  int carried = 0, only = 0, absent = 0;
  for (int k = 0; k < 3; ++k) {
    if (where.weight[static_cast<std::size_t>(k)] > 0.0) ++carried, only = k;
    if (!(where.weight[static_cast<std::size_t>(k)] > 0.0)) absent = k;
  }
  if (carried == 2) {
    const std::uint32_t other = neighbour(best.triangle, (absent + 1) % 3);
    if (other != kNone) side += normals_[other];
  } else if (carried == 1) {
    side.setZero();
    const std::uint32_t v = t[static_cast<std::size_t>(only)];
    for (const std::uint32_t around : ring(v)) {
      const Triangle& r = triangles_[around];
      const std::size_t k = r[0] == v ? 0 : (r[1] == v ? 1 : 2);
      const Vector3 u = (vertices_[r[(k + 1) % 3]] - vertices_[v]).normalized();
      const Vector3 w = (vertices_[r[(k + 2) % 3]] - vertices_[v]).normalized();
      side += math::acos(std::clamp(u.dot(w), -1.0, 1.0)) * normals_[around];
    }
  }
  const double distance = std::sqrt(least);
  best.signed_distance = std::copysign(distance, -side.dot(where.point));
  // so near the surface the difference of the two points is their rounding
  constexpr double kTouching = 1e-9;
  double reach = 0.0;
  for (const Vector3& corner : corners(best.triangle)) reach = std::max(reach, std::sqrt((corner - p).squaredNorm()));
  best.outward = distance > kTouching * reach ? Vector3(where.point / -best.signed_distance) : side.normalized();
  return best;
}

std::optional<TriangleMesh::Hit> TriangleMesh::cast_ray(const Vector3& origin, const Vector3& direction,
                                                        double limit) const {
  std::optional<Hit> best;
  std::array<std::uint32_t, 128> stack;
  std::size_t depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const Node& node = nodes_[stack[--depth]];
    double from = 0.0, to = best ? best->distance : limit;
    for (int i = 0; i < 3 && from <= to; ++i) {
      if (direction[i] == 0.0) {
        if (origin[i] < node.box.lower[i] || origin[i] > node.box.upper[i]) to = -1.0;
        continue;
      }
      const double a = (node.box.lower[i] - origin[i]) / direction[i],
                   b = (node.box.upper[i] - origin[i]) / direction[i];
      // widened by roundings, so that no triangle in a face of the box is missed
      from = std::max(from, std::min(a, b) * (1.0 - 4e-16) - 1e-300);
      to = std::min(to, std::max(a, b) * (1.0 + 4e-16) + 1e-300);
    }
    if (from > to) continue;
    if (node.count == 0) {
      stack[depth++] = node.first + 1;
      stack[depth++] = node.first;
      continue;
    }
    for (std::uint32_t i = 0; i < node.count; ++i) {
      const std::uint32_t t = order_[node.first + i];
      const std::optional<double> at = ray_on_triangle(origin, direction, corners(t));
      if (!at || *at > (best ? best->distance : limit)) continue;
      if (!best || *at < best->distance || t < best->triangle) best = Hit{*at, t};
    }
  }
  return best;
}

}  // namespace gravitas
