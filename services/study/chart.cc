#include "services/study/chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <utility>
#include <vector>

#include "services/recorder/svg.h"

namespace gravitas::study {
namespace {

// Distinct for most eyes, and by their marks for all.
constexpr std::array<const char*, 12> kCurveColours = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                                       "#8a6d00", "#56b4e9", "#7b3fa0", "#222222",
                                                       "#e69f00", "#7f7f7f", "#9bc400", "#a3112f"};
constexpr double kMarkSize = 3.2, kLegendLine = 19.0, kLegendText = 29.0, kLegendLetter = 6.4;
constexpr const char* kFaint = "stroke=\"#e4e4e4\"";

std::string mark_text(std::size_t number, double x, double y, bool is_hollow) {
  const std::string colour = kCurveColours[number % kCurveColours.size()];
  const std::string style = fmt::format("fill=\"{}\" stroke=\"{}\"", is_hollow ? "white" : colour, colour);
  const double s = kMarkSize;
  const auto polygon = [&](std::initializer_list<std::pair<double, double>> corners) {
    std::string points;
    for (const auto& [dx, dy] : corners) points += fmt::format("{:.2f},{:.2f} ", x + s * dx, y + s * dy);
    return fmt::format("<polygon points=\"{}\" {}/>\n", points, style);
  };
  switch (number % 6) {
    case 0:
      return fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{}\" {}/>\n", x, y, s, style);
    case 1:
      return polygon({{-0.9, -0.9}, {0.9, -0.9}, {0.9, 0.9}, {-0.9, 0.9}});
    case 2:
      return polygon({{0, -1.3}, {1.15, 0.8}, {-1.15, 0.8}});
    case 3:
      return polygon({{0, -1.35}, {1.35, 0}, {0, 1.35}, {-1.35, 0}});
    case 4:
      return polygon({{0, 1.3}, {1.15, -0.8}, {-1.15, -0.8}});
    default:
      return polygon({{-1.3, 0}, {0.8, -1.15}, {0.8, 1.15}});
  }
}

// "1e-6", or 0.2.
std::string tick_text(const Axis& axis, double value) {
  if (!axis.is_log) return fmt::format("{:.3g}", value);
  const long exponent = std::lround(std::log10(value));
  return exponent >= 0 && exponent <= 3 ? fmt::format("{:g}", value) : fmt::format("1e{}", exponent);
}

std::vector<double> ticks(const Axis& axis) {
  std::vector<double> all;
  if (!axis.is_log) {
    for (int i = 0; i <= 5; ++i) all.push_back(axis.low + 0.2 * i * (axis.high - axis.low));
    return all;
  }
  const long first = std::lround(std::log10(axis.low)), last = std::lround(std::log10(axis.high));
  const long stride = (last - first) / 9 + 1;
  for (long i = first; i <= last; ++i)
    if (i % stride == 0) all.push_back(std::pow(10.0, static_cast<double>(i)));
  return all;
}

class Frame {
 public:
  explicit Frame(const Chart& chart) : chart_(chart) {}

  double x(double value) const { return chart_.left + share(chart_.x, value) * chart_.width; }
  double y(double value) const { return chart_.top + (1.0 - share(chart_.y, value)) * chart_.height; }
  double left() const { return chart_.left; }
  double top() const { return chart_.top; }
  double right() const { return chart_.left + chart_.width; }
  double bottom() const { return chart_.top + chart_.height; }

  std::string axes() const {
    std::string text;
    if (chart_.band)
      text += fmt::format("<rect x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" fill=\"#ececec\"/>\n",
                          chart_.left, chart_.top, std::max(0.0, x(*chart_.band) - chart_.left), chart_.height);
    for (const double value : ticks(chart_.x)) {
      text += svg_line(x(value), chart_.top, x(value), bottom(), kFaint);
      text += svg_text(x(value), bottom() + 14.0, tick_text(chart_.x, value), "text-anchor=\"middle\" fill=\"#444\"");
    }
    for (const double value : ticks(chart_.y)) {
      text += svg_line(chart_.left, y(value), right(), y(value), kFaint);
      text +=
          svg_text(chart_.left - 6.0, y(value) + 4.0, tick_text(chart_.y, value), "text-anchor=\"end\" fill=\"#444\"");
    }
    text += fmt::format(
        "<rect x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" fill=\"none\" stroke=\"#888\"/>\n",
        chart_.left, chart_.top, chart_.width, chart_.height);
    text += svg_text(chart_.left + 0.5 * chart_.width, bottom() + 32.0, chart_.x.title, "text-anchor=\"middle\"");
    text += svg_text(chart_.left, chart_.top - 8.0, chart_.title.empty() ? chart_.y.title : chart_.title);
    return text;
  }

  // From the lower left corner up, so that they meet no curve that matters.
  std::string guides() const {
    std::string text;
    const double begin = chart_.x.high * 0.1, level = chart_.y.low * 1.6;
    for (const double slope : chart_.slopes) {
      const double ratio = std::min(std::pow(10.0, 1.6 * slope), begin / chart_.x.low / 3.0);
      const double end = begin / ratio, top = level * std::pow(ratio, 1.0 / slope);
      text += svg_line(x(begin), y(level), x(end), y(top), "stroke=\"#aaa\" stroke-dasharray=\"4 3\"");
      text += svg_text(x(end) - 3.0, y(top) - 3.0, fmt::format("{:g}", slope), "text-anchor=\"end\" fill=\"#888\"");
    }
    return text;
  }

 private:
  static double share(const Axis& axis, double value) {
    const double at = axis.is_log ? (std::log(value) - std::log(axis.low)) / (std::log(axis.high) - std::log(axis.low))
                                  : (value - axis.low) / (axis.high - axis.low);
    return std::clamp(at, 0.0, 1.0);
  }

  const Chart& chart_;
};

// Colours repeat after twelve, then dashed, and marks after six.
std::string stroke_of(std::size_t style) {
  return fmt::format("stroke=\"{}\" stroke-width=\"1.5\"{}", kCurveColours[style % kCurveColours.size()],
                     style >= kCurveColours.size() ? " stroke-dasharray=\"5 3\"" : "");
}

// Labels near their marks, where they cover neither marks nor each other, and as little of curves as can be; one that had to
// go far is led to. Where there is no such place they are left out.
class Labels {
 public:
  explicit Labels(const Frame& frame) : inside_{frame.left(), frame.top(), frame.right(), frame.bottom()} {}

  void avoid_mark(double x, double y) { marks_.push_back({x - kClear, y - kClear, x + kClear, y + kClear}); }
  void avoid_line(double x1, double y1, double x2, double y2) {
    const int parts = 1 + static_cast<int>(std::hypot(x2 - x1, y2 - y1) / kSpotDistance);
    for (int i = 0; i <= parts; ++i) spots_.emplace_back(x1 + (x2 - x1) * i / parts, y1 + (y2 - y1) * i / parts);
  }
  void add(double x, double y, const std::string& text, const std::string& colour) {
    wanted_.push_back({x, y, text, colour});
  }

  // Once all that they avoid is known.
  std::string draw() {
    std::string text;
    for (const Label& label : wanted_) text += place(label);
    return text;
  }

 private:
  struct Box {
    double left, top, right, bottom;
    bool meets(const Box& b) const { return left < b.right && b.left < right && top < b.bottom && b.top < bottom; }
    bool holds(const Box& b) const { return left <= b.left && b.right <= right && top <= b.top && b.bottom <= bottom; }
  };
  struct Label {
    double x, y;
    std::string text, colour;
  };

  // By how far it goes, and what it covers of curves.
  std::string place(const Label& label) {
    const double width = kWide * static_cast<double>(label.text.size());
    Box best{};
    double best_gap = 0.0, least = std::numeric_limits<double>::infinity();
    for (double gap = kClear + 1.0; gap < kFarthest; gap += kRing)
      for (const auto& [dx, dy] : {std::pair{0, 1}, std::pair{0, -1}, std::pair{-1, 0}, std::pair{1, 0},
                                   std::pair{-1, 1}, std::pair{1, 1}, std::pair{-1, -1}, std::pair{1, -1}}) {
        const double x = label.x + dx * (gap + 0.5 * width), y = label.y + dy * (gap + 0.5 * kHigh);
        const Box box{x - 0.5 * width, y - 0.5 * kHigh, x + 0.5 * width, y + 0.5 * kHigh};
        const auto is_met = [&](const Box& other) { return box.meets(other); };
        if (!inside_.holds(box) || std::ranges::any_of(marks_, is_met) || std::ranges::any_of(taken_, is_met)) continue;
        const auto covered = std::ranges::count_if(spots_, [&](const std::pair<double, double>& spot) {
          return box.meets({spot.first, spot.second, spot.first, spot.second});
        });
        const double cost = gap + kSpotCost * static_cast<double>(covered);
        if (cost < least) least = cost, best = box, best_gap = gap;
      }
    if (std::isinf(least)) return {};
    taken_.push_back(best);
    std::string text;
    if (best_gap > kNear)
      text = svg_line(label.x, label.y, std::clamp(label.x, best.left, best.right),
                      std::clamp(label.y, best.top, best.bottom),
                      fmt::format("stroke=\"{}\" stroke-width=\"0.6\"", label.colour));
    // with a rim, so that it can be read on a line
    return text + svg_text(best.left, best.bottom - 2.0, label.text,
                           fmt::format("font-size=\"9\" fill=\"{}\" stroke=\"white\" stroke-width=\"2\" "
                                       "paint-order=\"stroke\"",
                                       label.colour));
  }

  // points: half a mark's size, a letter's, and how far labels go
  static constexpr double kClear = 4.0, kHigh = 10.0, kWide = 5.8, kRing = 7.0, kNear = 13.0, kFarthest = 90.0;
  static constexpr double kSpotDistance = 3.0, kSpotCost = 4.0;
  const Box inside_;
  std::vector<Box> marks_, taken_;
  std::vector<std::pair<double, double>> spots_;  // on curves
  std::vector<Label> wanted_;
};

std::string curve_text(const Frame& frame, const Curve& curve, Labels* labels) {
  const std::size_t number = curve.style;
  const std::string colour = kCurveColours[number % kCurveColours.size()];
  std::string points, marks;
  double last_x = 0.0, last_y = 0.0;
  const auto go_to = [&](double x, double y) {
    if (!points.empty()) labels->avoid_line(last_x, last_y, x, y);
    points += fmt::format("{:.2f},{:.2f} ", x, y);
    last_x = x, last_y = y;
  };
  for (const Mark& mark : curve.marks) {
    const double x = frame.x(mark.x), y = frame.y(mark.y);
    if (curve.has_steps && !points.empty()) go_to(x, last_y);
    go_to(x, y);
    if (!curve.has_steps) marks += mark_text(number, x, y, false);
    if (!curve.has_steps) labels->avoid_mark(x, y);
    if (!mark.label.empty()) labels->add(x, y, mark.label, colour);
  }
  if (curve.has_steps && !curve.marks.empty()) go_to(frame.right(), last_y);
  // at the edge
  for (const double failed : curve.failed) {
    marks += mark_text(number, frame.right(), frame.y(failed), true);
    labels->avoid_mark(frame.right(), frame.y(failed));
  }
  return fmt::format("<polyline points=\"{}\" fill=\"none\" {}/>\n{}", points, stroke_of(number), marks);
}

std::string legend_text(const Curve& curve) { return curve.name + (curve.note.empty() ? "" : " (" + curve.note + ")"); }

}  // namespace

std::string draw(const Chart& chart) {
  const Frame frame(chart);
  Labels labels(frame);
  std::string text = frame.axes() + frame.guides();
  for (const Curve& curve : chart.curves) text += curve_text(frame, curve, &labels);
  return text + labels.draw();
}

double legend_width(const std::vector<Curve>& curves) {
  std::size_t longest = 0;
  for (const Curve& curve : curves) longest = std::max(longest, legend_text(curve).size());
  return kLegendText + kLegendLetter * static_cast<double>(longest);
}

std::string legend(const std::vector<Curve>& curves, double left, double top) {
  std::string text;
  double y = top;
  for (const Curve& curve : curves) {
    text += svg_line(left, y, left + 22.0, y, stroke_of(curve.style));
    if (!curve.has_steps) text += mark_text(curve.style, left + 11.0, y, false);
    text += svg_text(left + kLegendText, y + 4.0, legend_text(curve));
    y += kLegendLine;
  }
  return text;
}

Axis decades(const std::string& title, const std::vector<double>& values) {
  double low = 0.0, high = 0.0;
  for (const double value : values) {
    if (!(value > 0.0) || std::isinf(value)) continue;
    low = low == 0.0 ? value : std::min(low, value);
    high = std::max(high, value);
  }
  if (low == 0.0) low = high = 1.0;
  const double first = std::floor(std::log10(low) - 0.1), last = std::ceil(std::log10(high) + 0.1);
  return {title, std::pow(10.0, first), std::pow(10.0, std::max(last, first + 1.0))};
}

}  // namespace gravitas::study
