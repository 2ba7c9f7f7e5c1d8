#include "services/survey/picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include "plugin_sdk/math/types.h"
#include "services/recorder/svg.h"
#include "services/survey/instrumentation.h"
#include "services/survey/numbers.h"

namespace gravitas::survey {
namespace {

namespace v1 = instrumentation::v1;

// Points of the page.
constexpr double kWidth = 1000.0, kHeight = 750.0, kEdge = 40.0, kLegend = 18.0;
constexpr double kNormalLength = 34.0, kLongestArrow = 130.0;

// By the number of the kind.
constexpr std::array<const char*, 10> kColours = {"#888888", "#d62728", "#9467bd", "#1f77b4", "#bbbbbb",
                                                  "#17becf", "#8c9a2b", "#333333", "#e8a33d", "#2ca02c"};

struct Point2 {
  double x = 0.0, y = 0.0;
};

Vector3 vector_of(const Numbers& numbers) { return {numbers.Get(0), numbers.Get(1), numbers.Get(2)}; }

// From the world to the page.
class View {
 public:
  explicit View(const std::vector<Vector3>& points) {
    double left = std::numeric_limits<double>::infinity(), low = left, right = -left, high = -left;
    for (const Vector3& point : points) {
      const double x = point.dot(right_), y = point.dot(up_);
      left = std::min(left, x), right = std::max(right, x);
      low = std::min(low, y), high = std::max(high, y);
    }
    if (points.empty()) left = right = low = high = 0.0;
    const double across = std::max(right - left, 1e-9), upright = std::max(high - low, 1e-9);
    scale_ = std::min((kWidth - 2.0 * kEdge) / across, (kHeight - 2.0 * kEdge) / upright);
    middle_ = {0.5 * (left + right), 0.5 * (low + high)};
  }

  Point2 at(const Vector3& point) const {
    return {0.5 * kWidth + scale_ * (point.dot(right_) - middle_.x),
            0.5 * kHeight - scale_ * (point.dot(up_) - middle_.y)};
  }
  // Points of the page per metre.
  double scale() const { return scale_; }

 private:
  // from the front, a little from the right and from above
  const Vector3 back_ = Vector3(0.4, 0.45, 1.0).normalized();
  const Vector3 right_ = Vector3::UnitY().cross(back_).normalized();
  const Vector3 up_ = back_.cross(right_);
  double scale_ = 1.0;
  Point2 middle_;
};

std::string line_text(const Point2& from, const Point2& to) { return svg_line(from.x, from.y, to.x, to.y); }

std::array<Vector3, 8> corners_of(const v1::Box& box) {
  const Numbers& q = box.orientation();
  const Quaternion orientation(q.Get(0), q.Get(1), q.Get(2), q.Get(3));
  const Vector3 centre = vector_of(box.centre()), half = vector_of(box.half_extents());
  std::array<Vector3, 8> corners;
  for (unsigned i = 0; i < 8; ++i)
    corners[i] = centre + orientation * half.cwiseProduct(Vector3((i & 1) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1,
                                                                  (i & 4) != 0 ? 1 : -1));
  return corners;
}

// All that the picture must have room for.
std::vector<Vector3> points_of(const v1::Frame& frame) {
  std::vector<Vector3> points;
  for (const v1::Line& line : frame.lines()) {
    points.push_back(vector_of(line.from()));
    points.push_back(vector_of(line.to()));
  }
  for (const v1::Arrow& arrow : frame.arrows()) points.push_back(vector_of(arrow.origin()));
  for (const v1::Label& label : frame.labels()) points.push_back(vector_of(label.position()));
  for (const v1::Box& box : frame.boxes())
    for (const Vector3& corner : corners_of(box)) points.push_back(corner);
  for (const v1::Sphere& sphere : frame.spheres())
    for (const double side : {-1.0, 1.0})
      points.push_back(vector_of(sphere.centre()) + Vector3::Constant(side * sphere.radius()));
  return points;
}

// The parts of one kind, bodies of the drawing by their kinds.
class Groups {
 public:
  explicit Groups(const v1::Frame& frame) : view_(points_of(frame)) {
    for (const v1::Box& box : frame.boxes()) draw(box);
    for (const v1::Line& line : frame.lines())
      groups_[line.kind()] += line_text(view_.at(vector_of(line.from())), view_.at(vector_of(line.to())));
    for (const v1::Sphere& sphere : frame.spheres()) draw(sphere);
    std::map<int, double> longest;
    for (const v1::Arrow& arrow : frame.arrows())
      longest[arrow.kind()] = std::max(longest[arrow.kind()], vector_of(arrow.vector()).norm());
    for (const v1::Arrow& arrow : frame.arrows()) draw(arrow, longest[arrow.kind()]);
    for (const v1::Label& label : frame.labels()) draw(label);
  }

  std::string text() const {
    std::string all;
    for (const auto& [kind, parts] : groups_)
      all += fmt::format("<g class=\"{0}\" stroke=\"{1}\" fill=\"none\">\n{2}</g>\n",
                         kind_name(static_cast<Kind>(kind)), kColours[static_cast<std::size_t>(kind)], parts);
    double y = 46.0;
    for (const auto& [kind, parts] : groups_) {
      all += fmt::format("<text x=\"14\" y=\"{:.0f}\" fill=\"{}\">{}</text>\n", y,
                         kColours[static_cast<std::size_t>(kind)], kind_name(static_cast<Kind>(kind)));
      y += kLegend;
    }
    return all;
  }

 private:
  void draw(const v1::Box& box) {
    const std::array<Vector3, 8> corners = corners_of(box);
    for (unsigned i = 0; i < 8; ++i)
      for (const unsigned axis : {1U, 2U, 4U})
        if ((i & axis) == 0) groups_[box.kind()] += line_text(view_.at(corners[i]), view_.at(corners[i | axis]));
  }

  void draw(const v1::Sphere& sphere) {
    const Point2 centre = view_.at(vector_of(sphere.centre()));
    groups_[sphere.kind()] += fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{:.2f}\"/>\n", centre.x, centre.y,
                                          sphere.radius() * view_.scale());
  }

  // In the world an arrow of this kind, `longest` at most, is as long as makes it fit the page.
  void draw(const v1::Arrow& arrow, double longest) {
    if (!(longest > 0.0)) return;
    const double page = arrow.kind() == v1::KIND_CONTACT ? kNormalLength : kLongestArrow;
    const Vector3 origin = vector_of(arrow.origin()), vector = vector_of(arrow.vector());
    const Point2 from = view_.at(origin), to = view_.at(origin + vector * (page / longest / view_.scale()));
    const double dx = to.x - from.x, dy = to.y - from.y, length = std::sqrt(dx * dx + dy * dy);
    std::string& group = groups_[arrow.kind()];
    group += line_text(from, to);
    // seen from its tip it is a dot
    if (length < 2.0) {
      group += fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"2.5\"/>\n", from.x, from.y);
      return;
    }
    const double head = std::min(7.0, 0.4 * length), x = dx / length * head, y = dy / length * head;
    group += line_text(to, {to.x - x - 0.5 * y, to.y - y + 0.5 * x});
    group += line_text(to, {to.x - x + 0.5 * y, to.y - y - 0.5 * x});
  }

  void draw(const v1::Label& label) {
    const Point2 at = view_.at(vector_of(label.position()));
    groups_[label.kind()] +=
        fmt::format("<text x=\"{:.2f}\" y=\"{:.2f}\" stroke=\"none\" fill=\"{}\">{}</text>\n", at.x + 5.0, at.y - 4.0,
                    kColours[static_cast<std::size_t>(label.kind())], in_markup(label.text()));
  }

  View view_;
  std::map<int, std::string> groups_;
};

}  // namespace

std::string picture(const v1::Frame& frame, const std::string& title) {
  return svg_page(kWidth, kHeight,
                  fmt::format("<text x=\"14\" y=\"24\" font-size=\"14\">{}, t = {:.6g} s, step {}</text>\n{}",
                              in_markup(title), frame.time(), frame.step(), Groups(frame).text()));
}

}  // namespace gravitas::survey
