#include "services/study/stability_diagram.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "services/recorder/svg.h"
#include "services/study/spring_stability.h"

namespace gravitas::study {
namespace {

// Points of the page.
constexpr double kBandLeft = 210.0, kBandsTop = 74.0, kRow = 11.0, kBandGap = 7.0, kCellWidth = 17.0, kPageRight = 40.0;

// From `from` to `to` by a share.
std::string mixed(const std::array<int, 3>& from, const std::array<int, 3>& to, double share) {
  const auto channel = [&](std::size_t i) {
    return static_cast<int>(std::lround(from[i] + std::clamp(share, 0.0, 1.0) * (to[i] - from[i])));
  };
  return fmt::format("#{:02x}{:02x}{:02x}", channel(0), channel(1), channel(2));
}

std::string growth_colour(double growth) {
  constexpr std::array<int, 3> kKept = {214, 230, 244}, kDamped = {33, 102, 172}, kGrows = {253, 212, 190},
                               kFlies = {178, 24, 43};
  if (growth <= 1.0 + kTellsApart) return mixed(kKept, kDamped, 1.0 - growth);
  return mixed(kGrows, kFlies, std::log10(growth) / 2.0);
}

class Map {
 public:
  explicit Map(const v1::Study& study) {
    for (const v1::Limit& limit : study.limits())
      for (const v1::Cell& cell : limit.cells()) {
        const double at = std::log10(cell.stiffness());
        first_ = std::min(first_, at), last_ = std::max(last_, at);
      }
    // the map's cells are equally wide
    const v1::Limit& any = study.limits(0);
    if (any.cells_size() > 1) step_ = std::log10(any.cells(1).stiffness() / any.cells(0).stiffness());
  }

  // Left edge of a cell, or a place in it, by log10 of k h^2.
  double x(double at) const { return kBandLeft + ((at - first_) / step_ + 0.5) * kCellWidth; }
  double first() const { return first_; }
  double last() const { return last_; }

  std::string row(const v1::Limit& limit, double y) const {
    std::string text;
    for (const v1::Cell& cell : limit.cells())
      text += fmt::format("<rect x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" fill=\"{}\"/>\n",
                          x(std::log10(cell.stiffness())) - 0.5 * kCellWidth, y, kCellWidth - 0.5, kRow - 0.5,
                          growth_colour(cell.measured()));
    if (limit.has_theory() && limit.theory() > 0.0) {
      const double at = x(std::log10(limit.theory()));
      text += svg_line(at, y - 1.0, at, y + kRow, "stroke=\"black\" stroke-width=\"2\"");
    }
    return text + svg_text(kBandLeft - 6.0, y + 9.0, fmt::format("{:g}", limit.zeta()),
                           "font-size=\"9\" text-anchor=\"end\" fill=\"#666\"");
  }

 private:
  double first_ = 1e300, last_ = -1e300, step_ = 1.0;
};

}  // namespace

std::string stability_diagram(const v1::Study& study) {
  if (study.limits().empty()) return svg_page(kBandLeft, kBandsTop, svg_text(14.0, 26.0, "No map was measured"));
  const Map map(study);
  std::string parts = svg_text(14.0, 26.0, "Where integrators are stable on a damped spring", "font-size=\"17\"");
  parts += svg_text(14.0, 44.0,
                    "blue: stable, darker: more is damped in a step; red: grows; tick: the theory's limit; rows: "
                    "damping c / (2 sqrt(k m))",
                    "fill=\"#555\"");
  double y = kBandsTop;
  for (int i = 0; i < study.limits_size(); ++i) {
    const v1::Limit& limit = study.limits(i);
    if (i == 0 || study.limits(i - 1).integrator() != limit.integrator()) {
      if (i > 0) y += kBandGap;
      parts += svg_text(14.0, y + 2.0 * kRow + 4.0, limit.integrator());
    }
    parts += map.row(limit, y);
    y += kRow;
  }
  for (double at = std::ceil(map.first()); at <= map.last() + 1e-9; at += 1.0)
    parts += svg_text(map.x(at), y + 16.0, fmt::format("1e{:.0f}", at), "text-anchor=\"middle\" fill=\"#444\"");
  parts += svg_text(map.x(0.5 * (map.first() + map.last())), y + 34.0, "k h^2 / m", "text-anchor=\"middle\"");
  return svg_page(map.x(map.last()) + kPageRight, y + 48.0, parts);
}

}  // namespace gravitas::study
