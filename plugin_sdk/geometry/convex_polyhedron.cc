// A polyhedron from its faces: every edge must have a face on either side, neighbours in one plane are merged by
// tracing the outline of what they cover, and every vertex is compared with every face.
#include "plugin_sdk/geometry/convex_polyhedron.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>

namespace gravitas {
namespace {

using Loop = std::vector<std::uint32_t>;
using Edge = std::pair<std::uint32_t, std::uint32_t>;

constexpr double kFlat = 1e-6;  // of the extent
constexpr double kOfThickness = 1e-3;

// The area of a polygon, twice, as a vector (M. Newell): sum of x_i x x_{i+1} from the first corner.
Vector3 area_vector(std::span<const Vector3> vertices, std::span<const std::uint32_t> loop) {
  Vector3 area = Vector3::Zero();
  const Vector3& first = vertices[loop[0]];
  for (std::size_t i = 1; i + 1 < loop.size(); ++i)
    area += (vertices[loop[i]] - first).cross(vertices[loop[i + 1]] - first);
  return area;
}

struct Refused {
  std::string why;
};

std::string face_text(std::size_t face) { return "face " + std::to_string(face); }

class Builder {
 public:
  Builder(std::span<const Vector3> vertices, std::span<const Loop> loops)
      : vertices_(vertices), loops_(loops.begin(), loops.end()) {}

  ConvexPolyhedron build() {
    check_vertices();
    check_loops();
    find_edges();
    orient();
    check_convexity();
    merge();
    return assembled();
  }

 private:
  void check_vertices() {
    if (vertices_.size() < 4) throw Refused{"fewer than 4 vertices"};
    Vector3 lower = vertices_[0], upper = vertices_[0];
    for (std::size_t i = 0; i < vertices_.size(); ++i) {
      if (!vertices_[i].allFinite()) throw Refused{"vertex " + std::to_string(i) + " is not finite"};
      lower = lower.cwiseMin(vertices_[i]), upper = upper.cwiseMax(vertices_[i]);
    }
    extent_ = (upper - lower).maxCoeff();
    if (!std::isfinite(extent_) || !(extent_ > 0.0)) throw Refused{"the vertices have no extent"};
  }

  void check_loops() {
    if (loops_.size() < 4) throw Refused{"fewer than 4 faces"};
    for (std::size_t f = 0; f < loops_.size(); ++f) {
      const Loop& loop = loops_[f];
      if (loop.size() < 3) throw Refused{face_text(f) + " has fewer than 3 vertices"};
      Loop sorted = loop;
      std::sort(sorted.begin(), sorted.end());
      if (sorted.back() >= vertices_.size())
        throw Refused{face_text(f) + " names vertex " + std::to_string(sorted.back()) + " of " +
                      std::to_string(vertices_.size())};
      const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
      if (twice != sorted.end()) throw Refused{face_text(f) + " names vertex " + std::to_string(*twice) + " twice"};
      const Vector3 area = area_vector(vertices_, loop);
      const double twice_area = std::sqrt(area.squaredNorm());
      // sheets and needles have faces as small as 1e-6 of the extent, squared
      if (!(twice_area > 1e-14 * extent_ * extent_)) throw Refused{face_text(f) + " has no area"};
      normals_.push_back(area / twice_area);
      areas_.push_back(twice_area);
    }
  }

  void find_edges() {
    for (std::size_t f = 0; f < loops_.size(); ++f) {
      for (std::size_t i = 0; i < loops_[f].size(); ++i) {
        const Edge edge{loops_[f][i], loops_[f][(i + 1) % loops_[f].size()]};
        if (!face_of_edge_.emplace(edge, f).second)
          throw Refused{face_text(f) + " runs along the edge from vertex " + std::to_string(edge.first) + " to " +
                        std::to_string(edge.second) + " the same way as " + face_text(face_of_edge_.at(edge))};
      }
    }
    for (const auto& [edge, f] : face_of_edge_) {
      if (!face_of_edge_.contains({edge.second, edge.first}))
        throw Refused{face_text(f) + " has no neighbour at the edge from vertex " + std::to_string(edge.first) +
                      " to " + std::to_string(edge.second)};
    }
  }

  // Turns every face round if they run clockwise; refuses what has no volume.
  void orient() {
    double volume = 0.0, surface = 0.0;
    for (std::size_t f = 0; f < loops_.size(); ++f) {
      volume += areas_[f] * normals_[f].dot(vertices_[loops_[f][0]] - vertices_[0]) / 6.0;
      surface += 0.5 * areas_[f];
    }
    if (!(std::fabs(volume) > 1e-12 * extent_ * surface)) throw Refused{"the solid has no volume"};
    if (volume > 0.0) return;
    for (std::size_t f = 0; f < loops_.size(); ++f) {
      std::reverse(loops_[f].begin(), loops_[f].end());
      normals_[f] = -normals_[f];
    }
    std::map<Edge, std::size_t> turned;
    for (const auto& [edge, f] : face_of_edge_) turned.emplace(Edge{edge.second, edge.first}, f);
    face_of_edge_ = std::move(turned);
  }

  void check_convexity() {
    // heights of all vertices over all faces: highest and lowest
    std::vector<double> highest(loops_.size());
    std::vector<std::size_t> culprit(loops_.size());
    double thickness = extent_;
    for (std::size_t f = 0; f < loops_.size(); ++f) {
      const Vector3& origin = vertices_[loops_[f][0]];
      double lowest = 0.0;
      for (std::size_t i = 0; i < vertices_.size(); ++i) {
        const double height = normals_[f].dot(vertices_[i] - origin);
        lowest = std::min(lowest, height);
        if (height > highest[f]) highest[f] = height, culprit[f] = i;
      }
      thickness = std::min(thickness, -lowest);
    }
    tolerance_ = std::min(kFlat * extent_, kOfThickness * thickness);
    for (std::size_t f = 0; f < loops_.size(); ++f) {
      for (const std::uint32_t corner : loops_[f]) {
        const double height = normals_[f].dot(vertices_[corner] - vertices_[loops_[f][0]]);
        if (height < -tolerance_)
          throw Refused{face_text(f) + " is not flat: vertex " + std::to_string(corner) + " lies " +
                        std::to_string(-height) + " m below it"};
      }
      if (!(highest[f] > tolerance_)) continue;
      const bool is_own = std::find(loops_[f].begin(), loops_[f].end(), culprit[f]) != loops_[f].end();
      throw Refused{face_text(f) + (is_own ? " is not flat" : " is not convex") + ": vertex " +
                    std::to_string(culprit[f]) + " lies " + std::to_string(highest[f]) + " m above it"};
    }
  }

  std::size_t group_of(std::size_t f) {
    while (group_[f] != f) f = group_[f] = group_[group_[f]];
    return f;
  }

  // Whether the corners of face g lie in the plane of face f.
  bool lies_in(std::size_t g, std::size_t f) const {
    const Vector3& origin = vertices_[loops_[f][0]];
    return std::all_of(loops_[g].begin(), loops_[g].end(), [&](std::uint32_t i) {
      return std::fabs(normals_[f].dot(vertices_[i] - origin)) <= 1e-3 * tolerance_;
    });
  }

  // Joins neighbours in one plane: groups_ of faces, each traced along the edges that it does not share with itself.
  void merge() {
    group_.resize(loops_.size());
    std::iota(group_.begin(), group_.end(), std::size_t{0});
    for (const auto& [edge, f] : face_of_edge_) {
      const std::size_t g = face_of_edge_.at({edge.second, edge.first});
      const std::size_t a = group_of(f), b = group_of(g);
      // the larger face of a group is its plane
      const std::size_t plane = areas_[a] >= areas_[b] ? a : b, joins = plane == a ? b : a;
      if (a == b || normals_[a].dot(normals_[b]) < 0.5 || !lies_in(joins, plane)) continue;
      group_[joins] = plane;
    }
    std::map<std::size_t, std::map<std::uint32_t, std::uint32_t>> outlines;
    std::map<std::size_t, std::size_t> outline_sizes;
    for (const auto& [edge, f] : face_of_edge_) {
      const std::size_t group = group_of(f);
      if (group_of(face_of_edge_.at({edge.second, edge.first})) == group) continue;
      outlines[group].emplace(edge.first, edge.second);
      ++outline_sizes[group];
    }
    std::vector<Loop> merged;
    std::vector<Vector3> normals;
    for (const auto& [group, next] : outlines) {
      Loop loop{next.begin()->first};
      for (std::uint32_t v = next.begin()->second; v != loop.front() && loop.size() < next.size(); v = next.at(v))
        loop.push_back(v);
      // one closed line through all edges, else what was given stays
      if (loop.size() == outline_sizes[group]) {
        merged.push_back(loop), normals.push_back(normals_[group]);
        continue;
      }
      for (std::size_t f = 0; f < loops_.size(); ++f)
        if (group_of(f) == group) merged.push_back(loops_[f]), normals.push_back(normals_[f]);
    }
    loops_ = std::move(merged);
    normals_ = std::move(normals);
    straighten();
  }

  // Leaves out what lies within an edge: it belongs to two faces alone.
  void straighten() {
    std::vector<std::size_t> faces(vertices_.size(), 0);
    for (const Loop& loop : loops_)
      for (const std::uint32_t v : loop) ++faces[v];
    const auto is_within = [&](std::uint32_t v) { return faces[v] == 2; };
    for (const Loop& loop : loops_)
      if (std::ranges::count_if(loop, std::not_fn(is_within)) < 3)
        for (const std::uint32_t v : loop) faces[v] = 3;
    for (Loop& loop : loops_) std::erase_if(loop, is_within);
  }

  ConvexPolyhedron assembled() const {
    ConvexPolyhedron result;
    std::vector<std::uint32_t> row(vertices_.size(), 0);
    for (const Loop& loop : loops_)
      for (const std::uint32_t v : loop) row[v] = 1;
    for (std::size_t i = 0; i < vertices_.size(); ++i) {
      if (row[i] == 0) continue;
      row[i] = static_cast<std::uint32_t>(result.vertices.size());
      result.vertices.push_back(vertices_[i]);
    }
    for (std::size_t f = 0; f < loops_.size(); ++f) {
      ConvexPolyhedron::Face face{normals_[f], 0.0, static_cast<std::uint32_t>(result.corners.size()),
                                  static_cast<std::uint32_t>(loops_[f].size())};
      for (const std::uint32_t v : loops_[f]) result.corners.push_back(row[v]);
      const Vector3 area = area_vector(result.vertices, result.corners_of(face));
      const double length = std::sqrt(area.squaredNorm());
      if (length > 0.0) face.normal = area / length;
      face.offset = face.normal.dot(result.vertices[result.support(face.normal)]);
      result.faces.push_back(face);
    }
    return result;
  }

  std::span<const Vector3> vertices_;
  std::vector<Loop> loops_;
  std::vector<Vector3> normals_;
  std::vector<double> areas_;  // doubled
  std::map<Edge, std::size_t> face_of_edge_;
  std::vector<std::size_t> group_;
  double extent_ = 0.0;
  double tolerance_ = 0.0;
};

}  // namespace

std::uint32_t ConvexPolyhedron::support(const Vector3& d) const {
  std::uint32_t best = 0;
  double farthest = d.dot(vertices[0]);
  for (std::uint32_t i = 1; i < vertices.size(); ++i) {
    const double along = d.dot(vertices[i]);
    if (along > farthest) farthest = along, best = i;
  }
  return best;
}

std::vector<std::uint32_t> ConvexPolyhedron::triangles() const {
  std::vector<std::uint32_t> result;
  for (const Face& face : faces) {
    const std::span<const std::uint32_t> loop = corners_of(face);
    for (std::size_t i = 1; i + 1 < loop.size(); ++i) result.insert(result.end(), {loop[0], loop[i], loop[i + 1]});
  }
  return result;
}

std::optional<ConvexPolyhedron> make_convex_polyhedron(std::span<const Vector3> vertices,
                                                       std::span<const std::vector<std::uint32_t>> faces,
                                                       std::string* why) {
  try {
    return Builder(vertices, faces).build();
  } catch (const Refused& refused) {
    *why = refused.why;
    return std::nullopt;
  }
}

}  // namespace gravitas
