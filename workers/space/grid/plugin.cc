// Space `Grid` (§ 4.6): a uniform grid of which only the cells with bodies exist, found by hashing.
//
//   cell of a point p: floor(p / CellSize) per axis, 21 bits each
//
//   +-----+-----+        a covers cells 1 and 2, b cell 2: both are in 2, and tested there;
//   |  1 a|aa2 b|        of several cells that two bodies share, only the one with the lowest coordinates
//   +-----+-----+        names the pair, so each is named once
//
// From call to call the grid stays, and a body is put elsewhere only when the cells it covers change. Cells left empty are
// removed every CleanupInterval calls. All is built anew when the number of bodies changes, or, where CellSize is not
// given, when the largest body is no longer about as large as a cell.
//
// A body much smaller than a cell shares it with many: the bodies of a full cell are sorted and swept along x. One that
// covers more than kMostCells cells, or has no bounds, is tested against all others. Cost: O(n) for bodies about as
// large as a cell, O(n * large bodies) besides.
#include "plugin_sdk/plugin.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <vector>

#include "plugin_sdk/pair_rule.h"
#include "plugin_sdk/ray_rule.h"
#include "plugin_sdk/space.h"

namespace gravitas {
namespace {

constexpr std::int32_t kMostCells = 64;
// Cells further out than this along an axis are clamped to the outermost; the rule is applied to them all the same.
constexpr std::int32_t kFarthestCell = 1048575;
// From so many bodies on a cell is swept.
constexpr std::size_t kFullCell = 12;
// Largest extent by cell size, between which a size that was not given is kept.
constexpr double kLeastFit = 0.5, kMostFit = 1.5;

using CellPlace = std::array<std::int32_t, 3>;

std::uint64_t cell_code(const CellPlace& place) {
  std::uint64_t code = 0;
  for (const std::int32_t k : place) code = code << 21 | static_cast<std::uint64_t>(k + (1 << 20));
  return code;
}

// The cells that a body covers; none: last < first.
struct CellRange {
  CellPlace first = {0, 0, 0}, last = {-1, -1, -1};

  bool operator==(const CellRange&) const = default;
  template <typename Visit>
  void each(Visit&& visit) const {
    for (std::int32_t x = first[0]; x <= last[0]; ++x)
      for (std::int32_t y = first[1]; y <= last[1]; ++y)
        for (std::int32_t z = first[2]; z <= last[2]; ++z) visit(CellPlace{x, y, z});
  }
};

struct Cell {
  CellPlace place;
  std::vector<std::uint32_t> bodies;
};

// Cells by their place. Open addressing with linear probing; a cell's number stays until remove_empty(). The room of removed
// cells serves later ones.
class CellMap {
 public:
  std::span<const Cell> cells() const { return {cells_.data(), count_}; }

  // With room for about as many cells before the next growth.
  void clear(std::size_t cells) {
    count_ = 0;
    rehash(std::bit_ceil(std::max<std::size_t>(16, 2 * cells)));
  }

  // The cell at a place, made if there is none.
  Cell& at(const CellPlace& place) {
    if (2 * count_ >= numbers_.size()) rehash(2 * numbers_.size());
    std::uint32_t& number = slot(place);
    if (number == kNone) {
      number = count_++;
      if (number == cells_.size()) cells_.emplace_back();
      cells_[number].place = place;
      cells_[number].bodies.clear();
    }
    return cells_[number];
  }

  void remove_empty() {
    const auto end = cells_.begin() + count_;
    const auto live_end = std::partition(cells_.begin(), end, [](const Cell& cell) { return !cell.bodies.empty(); });
    if (live_end == end) return;
    count_ = static_cast<std::uint32_t>(live_end - cells_.begin());
    rehash(numbers_.size());
  }

 private:
  std::uint32_t& slot(const CellPlace& place) {
    // Fibonacci hashing (Knuth, TAOCP 3, § 6.4)
    std::size_t i = (cell_code(place) * 0x9E3779B97F4A7C15ULL >> 20) & (numbers_.size() - 1);
    while (numbers_[i] != kNone && cells_[numbers_[i]].place != place) i = (i + 1) & (numbers_.size() - 1);
    return numbers_[i];
  }

  void rehash(std::size_t size) {
    numbers_.assign(size, kNone);
    for (std::uint32_t i = 0; i < count_; ++i) slot(cells_[i].place) = i;
  }

  std::uint32_t count_ = 0;  // of the cells in use, which are the first
  std::vector<Cell> cells_;
  std::vector<std::uint32_t> numbers_;  // a power of two of them
};

class GridSpace final : public SpacePlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "Grid",
            .version = "2.0",
            .slot = Slot::kSpace,
            .meaning = "Uniform grid of cells: O(n) for bodies of about one size.",
            .capabilities = {"rays", "debug_geometry"},
            .properties = {Property::number("CellSize", "m")
                               .above(0.0)
                               .means("Edge of a cell; about the largest extent of a bounded body if absent."),
                           Property::integer("CleanupInterval")
                               .at_least(1)
                               .at_most(1e9)
                               .defaults_to({60})
                               .means("Calls between removals of empty cells.")}};
  }
  explicit GridSpace(PropertyCursor settings)
      : given_cell_size_(settings.number()), cleanup_interval_(static_cast<std::uint64_t>(settings.integer())) {}

  void pairs(const stage::SpacePairsRequest& request, const stage::SpacePairsReply& reply, Host& host) override {
    const PairRule rule(request);
    if (++call_ % cleanup_interval_ == 0) map_.remove_empty();
    choose_cell_size(request, rule);
    put_bodies(request, rule);
    host.mark_progress();

    found_.clear();
    for (std::size_t i = 0; i < map_.cells().size(); ++i) {
      if (i % 1024 == 0) host.mark_progress();
      test_cell(map_.cells()[i], request, rule);
    }
    test_against_all(large_, rule, &found_);
    host.mark_progress();
    found_.sort(rule.bodies());
    found_.write(reply.pair());
  }

  void rays(const stage::SpaceRaysRequest& request, const stage::SpaceRaysReply& reply, Host& host) override {
    test_rays_against_all(request, reply, host);
  }

  // The cells that hold bodies, by their places.
  void debug_geometry(const stage::SpacePairsRequest& request, const stage::SpaceDebugGeometryReply& reply,
                      Host&) override {
    const PairRule rule(request);
    GridSpace anew(given_cell_size_, cleanup_interval_);
    anew.choose_cell_size(request, rule);
    anew.put_bodies(request, rule);
    std::vector<CellPlace> places;
    for (const Cell& cell : anew.map_.cells())
      if (!cell.bodies.empty()) places.push_back(cell.place);
    std::ranges::sort(places);
    for (const CellPlace& place : places) {
      reply.depth().push(0);
      for (const std::int32_t k : place) {
        reply.node_lower().push(k * anew.cell_size_);
        reply.node_upper().push((k + 1) * anew.cell_size_);
      }
    }
  }

 private:
  GridSpace(double given_cell_size, std::uint64_t cleanup_interval)
      : given_cell_size_(given_cell_size), cleanup_interval_(cleanup_interval) {}

  // Empties the grid if its cells, or the bodies, are no longer the same.
  void choose_cell_size(const stage::SpacePairsRequest& request, const PairRule& rule) {
    double size = given_cell_size_;
    if (std::isnan(size)) {
      double largest = 0.0;
      for (std::uint32_t i = 0; i < rule.bodies(); ++i) {
        if (!rule.has_shape(i) || !rule.is_regular(i)) continue;
        for (std::size_t k = 3 * std::size_t{i}; k < 3 * std::size_t{i} + 3; ++k)
          largest = std::max(largest, request.upper()[k] - request.lower()[k]);
      }
      if (!(largest > 0.0)) largest = 1.0;
      const double fit = largest / cell_size_;
      size = fit >= kLeastFit && fit <= kMostFit ? cell_size_ : largest;
    }
    if (size == cell_size_ && range_.size() == rule.bodies()) return;
    cell_size_ = size;
    map_.clear(rule.bodies());
    range_.assign(rule.bodies(), {});
  }

  void put_bodies(const stage::SpacePairsRequest& request, const PairRule& rule) {
    large_.clear();
    for (std::uint32_t i = 0; i < rule.bodies(); ++i) {
      CellRange range;
      if (rule.has_shape(i) && !cover(request, rule, i, &range)) large_.push_back(i);
      if (range == range_[i]) continue;
      range_[i].each([&](const CellPlace& place) {
        std::vector<std::uint32_t>& bodies = map_.at(place).bodies;
        *std::ranges::find(bodies, i) = bodies.back();
        bodies.pop_back();
      });
      range.each([&](const CellPlace& place) { map_.at(place).bodies.push_back(i); });
      range_[i] = range;
    }
  }

  // False, and no cells, if it covers too many.
  bool cover(const stage::SpacePairsRequest& request, const PairRule& rule, std::uint32_t body,
             CellRange* range) const {
    if (!rule.is_regular(body)) return false;
    CellRange covered;
    double cells = 1.0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double lower = std::floor(request.lower()[3 * body + k] / cell_size_);
      const double upper = std::floor(request.upper()[3 * body + k] / cell_size_);
      cells *= upper - lower + 1.0;
      if (!(cells <= kMostCells)) return false;
      covered.first[k] = static_cast<std::int32_t>(std::clamp<double>(lower, -kFarthestCell, kFarthestCell));
      covered.last[k] = static_cast<std::int32_t>(std::clamp<double>(upper, -kFarthestCell, kFarthestCell));
    }
    *range = covered;
    return true;
  }

  void test_cell(const Cell& cell, const stage::SpacePairsRequest& request, const PairRule& rule) {
    const std::size_t count = cell.bodies.size();
    if (count < kFullCell) {
      for (std::size_t i = 0; i < count; ++i)
        for (std::size_t k = i + 1; k < count; ++k) test(cell, cell.bodies[i], cell.bodies[k], rule);
      return;
    }
    swept_.assign(cell.bodies.begin(), cell.bodies.end());
    const auto lower = [&](std::uint32_t body) { return request.lower()[3 * std::size_t{body}]; };
    std::ranges::sort(swept_, {}, lower);
    for (std::size_t i = 0; i < count; ++i) {
      const double upper = request.upper()[3 * std::size_t{swept_[i]}];
      for (std::size_t k = i + 1; k < count && lower(swept_[k]) <= upper; ++k) test(cell, swept_[i], swept_[k], rule);
    }
  }

  void test(const Cell& cell, std::uint32_t a, std::uint32_t b, const PairRule& rule) {
    for (std::size_t k = 0; k < 3; ++k)
      if (cell.place[k] != std::max(range_[a].first[k], range_[b].first[k])) return;
    if (rule(a, b)) found_.add(a, b);
  }

  double given_cell_size_;
  std::uint64_t cleanup_interval_;
  // from call to call
  std::uint64_t call_ = 0;
  double cell_size_ = std::numeric_limits<double>::quiet_NaN();
  CellMap map_;
  std::vector<CellRange> range_;  // by body
  // scratch, filled anew in every call
  std::vector<std::uint32_t> large_, swept_;
  PairList found_;
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::GridSpace)
