#include "plugin_sdk/solver/elimination_order.h"

#include <algorithm>
#include <limits>

#include "plugin_sdk/body.h"

namespace gravitas {
namespace {

// Rows between the same two bodies, by their places among those that have rows.
struct Link {
  std::uint32_t one, two;
  std::uint32_t first_row, count;
};

class BodyGraph {
 public:
  explicit BodyGraph(std::span<const RowEnds> rows) {
    find_bodies(rows);
    for (std::uint32_t r = 0; r < rows.size(); ++r) {
      if (r > 0 && rows[r] == rows[r - 1])
        ++links_.back().count;
      else
        links_.push_back({place_of(rows[r].first), place_of(rows[r].second), r, 1});
    }
  }

  std::vector<std::uint32_t> given() const {
    std::vector<std::uint32_t> order(links_.size());
    for (std::uint32_t k = 0; k < order.size(); ++k) order[k] = k;
    return order;
  }

  // Multiplications, but for a factor; rows of a profile are taken to be full.
  double work(const std::vector<std::uint32_t>& order) const {
    std::vector<std::size_t> first_of(count(), std::numeric_limits<std::size_t>::max());
    std::vector<double> entries_before{0.0};
    double work = 0.0;
    for (const std::uint32_t k : order) {
      const Link& link = links_[k];
      std::size_t row = entries_before.size() - 1, first = row;
      for (const std::uint32_t body : {link.one, link.two}) {
        if (body == kNone) continue;
        first_of[body] = std::min(first_of[body], row);
        first = std::min(first, first_of[body]);
      }
      for (std::uint32_t i = 0; i < link.count; ++i, ++row) {
        work += entries_before[row] - entries_before[first];
        entries_before.push_back(entries_before[row] + static_cast<double>(row - first));
      }
    }
    return work;
  }

  // Of each body, those with fewer neighbours first. To be called before by_level() and by_branch().
  void find_neighbours() {
    neighbours_.resize(count());
    for (const Link& link : links_) {
      if (link.one == kNone || link.two == kNone || link.one == link.two) continue;
      neighbours_[link.one].push_back(link.two);
      neighbours_[link.two].push_back(link.one);
    }
    std::vector<std::size_t> degree;
    for (const auto& list : neighbours_) degree.push_back(list.size());
    for (auto& list : neighbours_)
      std::sort(list.begin(), list.end(),
                [&](std::uint32_t a, std::uint32_t b) { return std::pair(degree[a], a) < std::pair(degree[b], b); });
  }

  // Bodies from the last one that is reached from any, and so for each part.
  std::vector<std::uint32_t> by_level() const {
    std::vector<std::uint32_t> order;
    std::vector<bool> is_known(count(), false);
    for (std::uint32_t body = 0; body < count(); ++body) {
      if (is_known[body]) continue;
      std::uint32_t end = body;
      for (int repeat = 0; repeat < 2; ++repeat) {
        std::vector<bool> seen = is_known;
        end = reach(end, &seen).back();
      }
      const std::vector<std::uint32_t> part = reach(end, &is_known);
      order.insert(order.end(), part.begin(), part.end());
    }
    return order;
  }

  // Each after what hangs on it, as seen from the first of its part.
  std::vector<std::uint32_t> by_branch() const {
    std::vector<std::uint32_t> reached, parent(count(), kNone), size(count(), 1);
    std::vector<bool> is_known(count(), false);
    for (std::uint32_t body = 0; body < count(); ++body) {
      if (is_known[body]) continue;
      const std::vector<std::uint32_t> part = reach(body, &is_known, &parent);
      reached.insert(reached.end(), part.begin(), part.end());
    }
    std::vector<std::vector<std::uint32_t>> branches(count());
    for (std::size_t i = reached.size(); i-- > 0;)
      if (const std::uint32_t body = reached[i]; parent[body] != kNone) size[parent[body]] += size[body];
    for (const std::uint32_t body : reached)
      if (parent[body] != kNone) branches[parent[body]].push_back(body);
    for (auto& list : branches)
      std::stable_sort(list.begin(), list.end(), [&](std::uint32_t a, std::uint32_t b) { return size[a] < size[b]; });
    // from the end: a body, then its branches, the smallest first
    std::vector<std::uint32_t> order, stack;
    for (std::size_t i = reached.size(); i-- > 0;) {
      if (parent[reached[i]] != kNone) continue;
      for (stack = {reached[i]}; !stack.empty();) {
        const std::uint32_t body = stack.back();
        stack.pop_back();
        order.push_back(body);
        stack.insert(stack.end(), branches[body].rbegin(), branches[body].rend());
      }
    }
    std::reverse(order.begin(), order.end());
    return order;
  }

  // Links where the later of their bodies comes.
  std::vector<std::uint32_t> links_after(const std::vector<std::uint32_t>& bodies) const {
    std::vector<std::uint32_t> place(count()), order = given();
    for (std::uint32_t i = 0; i < bodies.size(); ++i) place[bodies[i]] = i;
    const auto key = [&](std::uint32_t k) {
      const Link& link = links_[k];
      const std::uint32_t one = link.one == kNone ? 0 : place[link.one], two = link.two == kNone ? 0 : place[link.two];
      return std::pair(std::max(one, two), std::min(one, two));
    };
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
    return order;
  }

  std::vector<std::uint32_t> rows_of(const std::vector<std::uint32_t>& order) const {
    std::vector<std::uint32_t> rows;
    for (const std::uint32_t k : order)
      for (std::uint32_t i = 0; i < links_[k].count; ++i) rows.push_back(links_[k].first_row + i);
    return rows;
  }

 private:
  std::size_t count() const { return bodies_.size(); }

  void find_bodies(std::span<const RowEnds> rows) {
    for (const auto& [one, two] : rows)
      for (const std::uint32_t body : {one, two})
        if (body != kNone) bodies_.push_back(body);
    std::sort(bodies_.begin(), bodies_.end());
    bodies_.erase(std::unique(bodies_.begin(), bodies_.end()), bodies_.end());
  }

  std::uint32_t place_of(std::uint32_t body) const {
    if (body == kNone) return kNone;
    return static_cast<std::uint32_t>(std::lower_bound(bodies_.begin(), bodies_.end(), body) - bodies_.begin());
  }

  // Level by level.
  std::vector<std::uint32_t> reach(std::uint32_t from, std::vector<bool>* is_known,
                                   std::vector<std::uint32_t>* parent = nullptr) const {
    std::vector<std::uint32_t> reached{from};
    (*is_known)[from] = true;
    for (std::size_t i = 0; i < reached.size(); ++i) {
      for (const std::uint32_t next : neighbours_[reached[i]]) {
        if ((*is_known)[next]) continue;
        (*is_known)[next] = true;
        if (parent != nullptr) (*parent)[next] = reached[i];
        reached.push_back(next);
      }
    }
    return reached;
  }

  std::vector<std::uint32_t> bodies_;  // rising
  std::vector<Link> links_;
  std::vector<std::vector<std::uint32_t>> neighbours_;
};

}  // namespace

std::vector<std::uint32_t> elimination_order(std::span<const RowEnds> rows) {
  constexpr std::size_t kFew = 32;
  constexpr double kLittle = 1000.0;  // for a row
  constexpr double kWorth = 0.5;
  if (rows.size() <= kFew) return {};
  BodyGraph graph(rows);
  const double given = graph.work(graph.given());
  if (given <= kLittle * static_cast<double>(rows.size())) return {};
  graph.find_neighbours();
  std::vector<std::uint32_t> best;
  double least = kWorth * given;
  for (const std::vector<std::uint32_t>& bodies : {graph.by_level(), graph.by_branch()}) {
    std::vector<std::uint32_t> order = graph.links_after(bodies);
    const double work = graph.work(order);
    if (work < least) least = work, best = std::move(order);
  }
  return graph.rows_of(best);
}

}  // namespace gravitas
