// Space `Grid` (§ 4.6): a uniform grid kept as a sorted list of (cell, body), so that only cells with bodies
// exist. Two bodies are tested wherever they share a cell; doubles are dropped at the end.
//
//   cell of a point p: floor(p / CellSize) per axis, 21 bits each
//
// A body that covers more than kMostCells cells (the ground, a body much larger than a cell, an unbounded one)
// is not put into the grid but tested against all others. Cost: O(n log n) for bodies about as large as a cell,
// O(n * large bodies) besides; all bodies in one cell are O(n^2), as with `Basic`.
#include "plugin_sdk/plugin.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "plugin_sdk/pair_rule.h"

namespace gravitas {
namespace {

constexpr std::int64_t kMostCells = 64;
// Cells further out than this along an axis are clamped to the outermost; the rule is applied to them all the same.
constexpr double kFarthestCell = 1048575.0;

struct Entry {
  std::uint64_t cell;
  std::uint32_t body;
  bool operator<(const Entry& other) const { return cell != other.cell ? cell < other.cell : body < other.body; }
};

struct CellRange {
  std::array<std::int64_t, 3> first, last;
  std::int64_t count() const {
    std::int64_t cells = 1;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int64_t span = last[k] - first[k] + 1;
      if (span > kMostCells) return kMostCells + 1;
      cells *= span;
    }
    return cells;
  }
};

std::uint64_t cell_code(std::int64_t x, std::int64_t y, std::int64_t z) {
  const auto bits = [](std::int64_t v) { return static_cast<std::uint64_t>(v + (1 << 20)) & 0x1FFFFF; };
  return bits(x) << 42 | bits(y) << 21 | bits(z);
}

class GridSpace final : public SpacePlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "Grid",
            .version = "1.0",
            .slot = Slot::kSpace,
            .meaning = "Uniform grid of cells: O(n log n) for bodies of about one size.",
            .properties = {Property::number("CellSize", "m")
                               .above(0.0)
                               .means("Edge of a cell; twice the largest half extent of a bounded body if absent."),
                           Property::integer("CleanupInterval")
                               .at_least(1)
                               .at_most(1e9)
                               .defaults_to({1})
                               .means("Steps between removals of empty cells; this grid is rebuilt in every step, so "
                                      "it has none.")}};
  }
  explicit GridSpace(PropertyCursor settings) : cell_size_(settings.number()) {}

  void pairs(const stage::SpacePairsRequest& request, const stage::SpacePairsReply& reply, Host& host) override {
    const PairRule is_pair(request);
    const auto bodies = static_cast<std::uint32_t>(request.flags().size());
    const double cell = std::isnan(cell_size_) ? default_cell_size(request) : cell_size_;
    entries_.clear(), large_.clear(), found_.clear();
    for (std::uint32_t i = 0; i < bodies; ++i)
      if ((request.flags()[i] & kHasShape) != 0) insert(request, i, cell);
    std::sort(entries_.begin(), entries_.end());
    host.mark_progress();

    for (std::size_t first = 0; first < entries_.size();) {
      std::size_t last = first;
      while (last < entries_.size() && entries_[last].cell == entries_[first].cell) ++last;
      for (std::size_t i = first; i < last; ++i)
        for (std::size_t k = i + 1; k < last; ++k)
          if (is_pair(entries_[i].body, entries_[k].body)) add(entries_[i].body, entries_[k].body);
      first = last;
    }
    host.mark_progress();
    for (const std::uint32_t large : large_)
      for (std::uint32_t i = 0; i < bodies; ++i)
        if (i != large && is_pair(large, i)) add(large, i);

    std::sort(found_.begin(), found_.end());
    found_.erase(std::unique(found_.begin(), found_.end()), found_.end());
    const stage::ReplyColumn<std::uint32_t> pair = reply.pair();
    for (const std::uint64_t both : found_) pair.push(both >> 32, both & 0xFFFFFFFF);
  }

 private:
  static double default_cell_size(const stage::SpacePairsRequest& request) {
    double largest = 0.0;
    for (std::size_t i = 0; i < request.lower().size(); ++i) {
      const double extent = request.upper()[i] - request.lower()[i];
      if (std::isfinite(extent)) largest = std::max(largest, extent);
    }
    return largest > 0.0 ? largest : 1.0;
  }

  void insert(const stage::SpacePairsRequest& request, std::uint32_t body, double cell) {
    CellRange range{};
    for (std::size_t k = 0; k < 3; ++k) {
      const double lower = std::floor(request.lower()[3 * body + k] / cell);
      const double upper = std::floor(request.upper()[3 * body + k] / cell);
      if (!(upper - lower < static_cast<double>(kMostCells))) {
        large_.push_back(body);
        return;
      }
      range.first[k] = static_cast<std::int64_t>(std::clamp(lower, -kFarthestCell, kFarthestCell));
      range.last[k] = static_cast<std::int64_t>(std::clamp(upper, -kFarthestCell, kFarthestCell));
    }
    if (range.count() > kMostCells) {
      large_.push_back(body);
      return;
    }
    for (std::int64_t x = range.first[0]; x <= range.last[0]; ++x)
      for (std::int64_t y = range.first[1]; y <= range.last[1]; ++y)
        for (std::int64_t z = range.first[2]; z <= range.last[2]; ++z) entries_.push_back({cell_code(x, y, z), body});
  }

  void add(std::uint32_t a, std::uint32_t b) {
    found_.push_back(static_cast<std::uint64_t>(std::min(a, b)) << 32 | std::max(a, b));
  }

  double cell_size_;
  // scratch, filled anew in every call
  std::vector<Entry> entries_;
  std::vector<std::uint32_t> large_;
  std::vector<std::uint64_t> found_;
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::GridSpace)
