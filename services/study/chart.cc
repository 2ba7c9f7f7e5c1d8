#include "services/study/chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <utility>

#include "services/recorder/svg.h"

namespace gravitas::study {
namespace {

// Distinct for most eyes, and by their marks for all.
constexpr std::array<const char*, 10> kCurveColours = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#8a6d00",
                                                       "#56b4e9", "#7b3fa0", "#222222", "#e69f00", "#7f7f7f"};
constexpr double kMarkSize = 3.2, kLegendLine = 19.0;
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

// Colours repeat after ten, then dashed, and marks after six.
std::string stroke_of(std::size_t style) {
  return fmt::format("stroke=\"{}\" stroke-width=\"1.5\"{}", kCurveColours[style % kCurveColours.size()],
                     style >= kCurveColours.size() ? " stroke-dasharray=\"5 3\"" : "");
}

// Labels where they cover no other; where there is no such place they are left out.
class Labels {
 public:
  std::string place(double x, double y, const std::string& text, const std::string& colour) {
    constexpr double kHigh = 9.0, kWide = 5.2;
    const double width = kWide * static_cast<double>(text.size());
    // below, above, and to the sides of the mark
    for (const auto& [left, bottom] : {std::pair{x - 0.5 * width, y + 14.0}, std::pair{x - 0.5 * width, y - 6.0},
                                       std::pair{x - width - 6.0, y + 3.0}, std::pair{x + 6.0, y + 3.0}}) {
      const Box box{left, bottom - kHigh, left + width, bottom};
      if (std::ranges::any_of(taken_, [&](const Box& other) { return box.meets(other); })) continue;
      taken_.push_back(box);
      return svg_text(left, bottom, text, fmt::format("font-size=\"9\" fill=\"{}\"", colour));
    }
    return {};
  }

 private:
  struct Box {
    double left, top, right, bottom;
    bool meets(const Box& b) const { return left < b.right && b.left < right && top < b.bottom && b.top < bottom; }
  };
  std::vector<Box> taken_;
};

std::string curve_text(const Frame& frame, const Curve& curve, Labels* labels) {
  const std::size_t number = curve.style;
  const std::string colour = kCurveColours[number % kCurveColours.size()];
  std::string points, marks;
  double height = 0.0;
  for (std::size_t i = 0; i < curve.marks.size(); ++i) {
    const double x = frame.x(curve.marks[i].x), y = frame.y(curve.marks[i].y);
    if (curve.has_steps && i > 0) points += fmt::format("{:.2f},{:.2f} ", x, height);
    points += fmt::format("{:.2f},{:.2f} ", x, y);
    height = y;
    if (!curve.has_steps) marks += mark_text(number, x, y, false);
    if (!curve.marks[i].label.empty()) marks += labels->place(x, y, curve.marks[i].label, colour);
  }
  if (curve.has_steps && !curve.marks.empty()) points += fmt::format("{:.2f},{:.2f} ", frame.right(), height);
  // at the edge
  for (const double failed : curve.failed) marks += mark_text(number, frame.right(), frame.y(failed), true);
  return fmt::format("<polyline points=\"{}\" fill=\"none\" {}/>\n{}", points, stroke_of(number), marks);
}

}  // namespace

std::string draw(const Chart& chart) {
  const Frame frame(chart);
  Labels labels;
  std::string text = frame.axes() + frame.guides();
  for (const Curve& curve : chart.curves) text += curve_text(frame, curve, &labels);
  return text;
}

std::string legend(const std::vector<Curve>& curves, double left, double top) {
  std::string text;
  double y = top;
  for (const Curve& curve : curves) {
    text += svg_line(left, y, left + 22.0, y, stroke_of(curve.style));
    if (!curve.has_steps) text += mark_text(curve.style, left + 11.0, y, false);
    text += svg_text(left + 29.0, y + 4.0, curve.name + (curve.note.empty() ? "" : " (" + curve.note + ")"));
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
