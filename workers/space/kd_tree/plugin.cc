// Space `KDTree` (§ 4.6): space is cut in two by a plane across the longest axis, each half again, and so on.
//
//              x = 2            every body is kept in the smallest cell that holds it wholly: a in the left half,
//        a       |   c          c in the right, b, which the plane cuts, in the node above both.
//            b---+---b
//                |              Bodies on different sides of a plane touch no plane and not each other, so a body
//                               is tested against those of its node and of the nodes below that its bounds reach.
//
// From call to call the planes stay. A body that leaves its cell climbs until it is inside, and sinks from there. The tree
// is built anew when the number of bodies changes, when finding pairs took twice the tests of the call after the build,
// and after kCallsPerBuild calls. Cost: O(n log n) to build, O(n) to look after bodies that stay, O(n log n) tests or
// so for bodies that few planes cut; bodies that many cut, such as those much larger than others, gather above.
#include "plugin_sdk/plugin.h"

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "plugin_sdk/pair_rule.h"
#include "plugin_sdk/ray_rule.h"
#include "plugin_sdk/space.h"

namespace gravitas {
namespace {

constexpr std::uint64_t kCallsPerBuild = 200;
constexpr double kGrowth = 2.0;

// The bounds of a body, where the tests read them. [m], world
struct Bounds3 {
  std::array<double, 3> lower, upper;
};

bool overlap(const Bounds3& a, const Bounds3& b) {
  return a.lower[0] <= b.upper[0] && b.lower[0] <= a.upper[0] && a.lower[1] <= b.upper[1] && b.lower[1] <= a.upper[1] &&
         a.lower[2] <= b.upper[2] && b.lower[2] <= a.upper[2];
}

struct Node {
  // what it holds lies inside, clear of the faces
  Bounds3 cell;
  std::uint32_t parent = kNone;
  std::uint32_t children = kNone;  // the left one; the right one is next to it
  std::size_t axis = 0;
  double plane = 0.0;

  bool is_inside(const Bounds3& body) const {
    for (std::size_t k = 0; k < 3; ++k)
      if (!(cell.lower[k] < body.lower[k] && body.upper[k] < cell.upper[k])) return false;
    return true;
  }
};

class KdTreeSpace final : public SpacePlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "KDTree",
            .version = "1.0",
            .slot = Slot::kSpace,
            .meaning = "Space cut in two again and again: for bodies that are spread unevenly.",
            .capabilities = {"rays", "debug_geometry"},
            .properties = {Property::integer("MaximumDepth")
                               .at_least(0)
                               .at_most(40)
                               .defaults_to({20})
                               .means("Planes above a cell, at most."),
                           Property::integer("MinimumBodies")
                               .at_least(1)
                               .at_most(1e9)
                               .defaults_to({12})
                               .means("A cell with no more bodies than this is not cut.")}};
  }
  explicit KdTreeSpace(PropertyCursor settings)
      : maximum_depth_(static_cast<std::size_t>(settings.integer())),
        minimum_bodies_(static_cast<std::size_t>(settings.integer())) {}

  void pairs(const stage::SpacePairsRequest& request, const stage::SpacePairsReply& reply, Host& host) override {
    const PairRule rule(request);
    read_bounds(request, rule);
    ++calls_since_build_;
    if (node_of_.size() != rule.bodies() || calls_since_build_ > kCallsPerBuild ||
        static_cast<double>(tests_) > kGrowth * static_cast<double>(tests_after_build_)) {
      build(rule.bodies());
    } else {
      migrate();
    }
    gather();
    host.mark_progress();

    found_.clear();
    tests_ = 0;
    for (std::uint32_t node = 0; node < nodes_.size(); ++node) {
      if (node % 256 == 0) host.mark_progress();
      test_within(node, rule);
    }
    if (calls_since_build_ == 0) tests_after_build_ = std::max<std::uint64_t>(tests_, members_.size());
    test_against_all(outsiders_, rule, &found_);
    host.mark_progress();
    found_.sort(rule.bodies());
    found_.write(reply.pair());
  }

  void rays(const stage::SpaceRaysRequest& request, const stage::SpaceRaysReply& reply, Host& host) override {
    test_rays_against_all(request, reply, host);
  }

  // The cells, as far as bodies reach.
  void debug_geometry(const stage::SpacePairsRequest& request, const stage::SpaceDebugGeometryReply& reply,
                      Host&) override {
    const PairRule rule(request);
    KdTreeSpace anew(maximum_depth_, minimum_bodies_);
    anew.read_bounds(request, rule);
    if (anew.members_.empty()) return;
    anew.build(rule.bodies());
    Bounds3 all = anew.bounds_[anew.members_[0]];
    for (const std::uint32_t i : anew.members_) {
      for (std::size_t k = 0; k < 3; ++k) {
        all.lower[k] = std::min(all.lower[k], anew.bounds_[i].lower[k]);
        all.upper[k] = std::max(all.upper[k], anew.bounds_[i].upper[k]);
      }
    }
    std::vector<std::uint32_t> depth;
    for (const Node& node : anew.nodes_) {
      depth.push_back(node.parent == kNone ? 0 : depth[node.parent] + 1);
      reply.depth().push(depth.back());
      for (std::size_t k = 0; k < 3; ++k) {
        reply.node_lower().push(std::max(node.cell.lower[k], all.lower[k]));
        reply.node_upper().push(std::min(node.cell.upper[k], all.upper[k]));
      }
    }
  }

 private:
  KdTreeSpace(std::size_t maximum_depth, std::size_t minimum_bodies)
      : maximum_depth_(maximum_depth), minimum_bodies_(minimum_bodies) {}

  void read_bounds(const stage::SpacePairsRequest& request, const PairRule& rule) {
    members_.clear(), outsiders_.clear();
    bounds_.resize(rule.bodies());
    for (std::uint32_t i = 0; i < rule.bodies(); ++i) {
      if (!rule.has_shape(i)) continue;
      if (!rule.is_regular(i)) {
        outsiders_.push_back(i);
        continue;
      }
      members_.push_back(i);
      std::copy_n(&request.lower()[3 * std::size_t{i}], 3, bounds_[i].lower.begin());
      std::copy_n(&request.upper()[3 * std::size_t{i}], 3, bounds_[i].upper.begin());
    }
  }

  void build(std::uint32_t bodies) {
    calls_since_build_ = 0;
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    nodes_.assign(1, {.cell = {{-kInfinity, -kInfinity, -kInfinity}, {kInfinity, kInfinity, kInfinity}}});
    node_of_.assign(bodies, 0);
    split_.assign(members_.begin(), members_.end());
    split(0, split_, 0);
  }

  double centre(std::uint32_t body, std::size_t axis) const {
    return 0.5 * bounds_[body].lower[axis] + 0.5 * bounds_[body].upper[axis];
  }

  // The bodies are those of the node; reorders them.
  void split(std::uint32_t node, std::span<std::uint32_t> bodies, std::size_t depth) {
    for (const std::uint32_t i : bodies) node_of_[i] = node;
    if (bodies.size() <= minimum_bodies_ || depth == maximum_depth_) return;
    std::size_t axis = 0;
    double widest = -1.0;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::ranges::minmax(bodies, {}, [&](std::uint32_t i) { return centre(i, k); });
      const double span = centre(high, k) - centre(low, k);
      if (span > widest) axis = k, widest = span;
    }
    const auto middle = bodies.begin() + static_cast<std::ptrdiff_t>(bodies.size() / 2);
    std::ranges::nth_element(bodies, middle, {}, [&](std::uint32_t i) { return centre(i, axis); });
    const double plane = centre(*middle, axis);

    // wholly left | wholly right | cut
    const auto is_left = [&](std::uint32_t i) { return bounds_[i].upper[axis] < plane; };
    const auto is_right = [&](std::uint32_t i) { return bounds_[i].lower[axis] > plane; };
    const auto right_begin = std::partition(bodies.begin(), bodies.end(), is_left);
    const auto right_end = std::partition(right_begin, bodies.end(), is_right);
    if (right_begin == bodies.begin() && right_end == right_begin) return;

    const auto children = static_cast<std::uint32_t>(nodes_.size());
    Node child = {.cell = nodes_[node].cell, .parent = node};
    nodes_[node].children = children, nodes_[node].axis = axis, nodes_[node].plane = plane;
    child.cell.upper[axis] = plane;
    nodes_.push_back(child);
    child.cell = nodes_[node].cell;
    child.cell.lower[axis] = plane;
    nodes_.push_back(child);
    split(children, {bodies.begin(), right_begin}, depth + 1);
    split(children + 1, {right_begin, right_end}, depth + 1);
  }

  // Each body into the smallest cell that holds it.
  void migrate() {
    for (const std::uint32_t i : members_) {
      std::uint32_t node = node_of_[i];
      while (!nodes_[node].is_inside(bounds_[i])) node = nodes_[node].parent;
      for (const Node* here = &nodes_[node]; here->children != kNone; here = &nodes_[node]) {
        if (bounds_[i].upper[here->axis] < here->plane) {
          node = here->children;
        } else if (bounds_[i].lower[here->axis] > here->plane) {
          node = here->children + 1;
        } else {
          break;
        }
      }
      node_of_[i] = node;
    }
  }

  // Bodies and their bounds, node after node.
  void gather() {
    begin_.assign(nodes_.size() + 1, 0);
    for (const std::uint32_t i : members_) ++begin_[node_of_[i]];
    std::uint32_t end = 0;
    for (std::uint32_t& row : begin_) row = end += row;
    held_.resize(members_.size()), held_bounds_.resize(members_.size());
    for (std::size_t m = members_.size(); m-- > 0;) {
      const std::uint32_t i = members_[m], place = --begin_[node_of_[i]];
      held_[place] = i, held_bounds_[place] = bounds_[i];
    }
  }

  void test_within(std::uint32_t node, const PairRule& rule) {
    for (std::uint32_t p = begin_[node]; p < begin_[node + 1]; ++p) {
      test(p, p + 1, begin_[node + 1], rule);
      if (nodes_[node].children != kNone) test_below(p, node, rule);
    }
  }

  // The bodies of the nodes under a node whose cells the bounds reach.
  void test_below(std::uint32_t p, std::uint32_t node, const PairRule& rule) {
    const Node& here = nodes_[node];
    const auto test_child = [&](std::uint32_t child) {
      test(p, begin_[child], begin_[child + 1], rule);
      if (nodes_[child].children != kNone) test_below(p, child, rule);
    };
    if (held_bounds_[p].lower[here.axis] < here.plane) test_child(here.children);
    if (held_bounds_[p].upper[here.axis] > here.plane) test_child(here.children + 1);
  }

  void test(std::uint32_t p, std::uint32_t begin, std::uint32_t end, const PairRule& rule) {
    tests_ += end - begin;
    for (std::uint32_t q = begin; q < end; ++q)
      if (overlap(held_bounds_[p], held_bounds_[q]) && rule.may_touch(held_[p], held_[q]))
        found_.add(held_[p], held_[q]);
  }

  std::size_t maximum_depth_, minimum_bodies_;
  // from call to call
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> node_of_;  // by body
  std::uint64_t calls_since_build_ = 0;
  std::uint64_t tests_ = 0, tests_after_build_ = 0;
  // scratch, filled anew in every call
  std::vector<std::uint32_t> members_, outsiders_, split_;
  std::vector<Bounds3> bounds_;  // by body
  // by place: node k holds places begin_[k] … begin_[k + 1]
  std::vector<std::uint32_t> begin_, held_;
  std::vector<Bounds3> held_bounds_;
  PairList found_;
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::KdTreeSpace)
