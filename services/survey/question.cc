#include "services/survey/question.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "plugin_sdk/channel/digest.h"
#include "plugin_sdk/counted.h"
#include "plugin_sdk/geometry/scene_shape.h"
#include "plugin_sdk/near_miss.h"
#include "plugin_sdk/property_value.h"
#include "services/scene/parser.h"
#include "services/survey/queries.h"

namespace gravitas::survey {
namespace {

constexpr double kFarthest = 1e100;  // m: detectors take no more (plugin_sdk/collision.cc)

[[noreturn]] void refuse(const std::string& place, const std::string& why) {
  throw BadQuestion(fmt::format("{}: {}", place, why));
}

}  // namespace

Vector3 QuestionReader::vector(const google::protobuf::RepeatedField<double>& numbers, const std::string& place,
                               bool is_needed) const {
  if (numbers.empty() && !is_needed) return Vector3::Zero();
  if (numbers.size() != 3) refuse(place, counted(numbers.size(), "number") + "; allowed: 3");
  const Vector3 v(numbers[0], numbers[1], numbers[2]);
  if (!(v.cwiseAbs().maxCoeff() <= kFarthest))
    refuse(place, fmt::format("a number that is not finite, or beyond {:g}", kFarthest));
  return v;
}

double QuestionReader::length(double number, const std::string& place) const {
  if (!(number >= 0.0 && number <= kFarthest))
    refuse(place, fmt::format("{:g}; allowed: 0 to {:g} m", number, kFarthest));
  return number;
}

std::uint32_t QuestionReader::body(const std::string& id, const std::string& place) const {
  const std::vector<std::string>& ids = environment_.model().body_id;
  const auto found = std::ranges::find(ids, id);
  if (found == ids.end()) refuse(place, fmt::format("there is no body '{}'; {}", id, allowed_names(id, ids)));
  return static_cast<std::uint32_t>(found - ids.begin());
}

std::vector<std::uint8_t> QuestionReader::filter(const query::v1::Filter& filter, const std::string& place) const {
  const kernel::Model& model = environment_.model();
  std::vector<std::uint8_t> counts(model.body_count, filter.only().empty() ? 1 : 0);
  for (const std::string& id : filter.only()) counts[body(id, place + ".only")] = 1;
  for (const std::string& id : filter.except()) counts[body(id, place + ".except")] = 0;
  for (std::uint32_t i = 0; i < model.body_count; ++i)
    if ((model.flags[i] & kHasShape) == 0) counts[i] = 0;
  return counts;
}

Probe QuestionReader::probe(const query::v1::Shape& shape, const std::string& place) const {
  const kernel::Model& model = environment_.model();
  if ((shape.body().empty() ? 0 : 1) + (shape.geometry().empty() ? 0 : 1) + (shape.type().empty() ? 0 : 1) != 1)
    refuse(place, "a shape is named by one of: body, geometry, type");
  Probe probe;
  const auto take_row = [&](std::uint32_t row) {
    const std::uint32_t begin = model.shape_parameter_begin[row], end = model.shape_parameter_begin[row + 1];
    const std::span<const double> parameters = model.shape_parameter.span().subspan(begin, end - begin);
    probe.type = model.shape_type[row];
    probe.hash = model.shape_hash[row];
    probe.parameters.assign(parameters.begin(), parameters.end());
  };
  if (!shape.body().empty()) {
    probe.body = body(shape.body(), place + ".body");
    if (model.body_shape[probe.body] == kNone)
      refuse(place + ".body", fmt::format("'{}' has no geometry", shape.body()));
    take_row(model.body_shape[probe.body]);
    probe.pose = placed(environment_, probe.body);
  } else if (!shape.geometry().empty()) {
    std::vector<std::string> ids;
    for (const kernel::ShapeDescription& known : surveyor_.description().shapes) ids.push_back(known.id);
    const auto found = std::ranges::find(ids, shape.geometry());
    if (found == ids.end())
      refuse(place + ".geometry",
             fmt::format("there is no geometry '{}'; {}", shape.geometry(), allowed_names(shape.geometry(), ids)));
    take_row(static_cast<std::uint32_t>(found - ids.begin()));
  } else {
    std::vector<std::string> names;
    for (const TypeDeclaration& type : types_) names.push_back(type.name);
    const auto found = std::ranges::find(names, shape.type());
    if (found == names.end())
      refuse(place + ".type",
             fmt::format("there is no shape '{}'; {}", shape.type(), allowed_names(shape.type(), names)));
    std::vector<NamedValue> values;
    for (const query::v1::Property& property : shape.properties()) {
      try {
        values.push_back({property.name(), scene::bare_value(property.value()), {}});
      } catch (const scene::SyntaxError& error) {
        refuse(fmt::format("{}.properties {}", place, property.name()), error.text);
      }
    }
    std::vector<PropertyProblem> problems;
    const TypeDeclaration& type = types_[static_cast<std::size_t>(found - names.begin())];
    if (!flatten(type.properties, values, &probe.parameters, &problems))
      refuse(place + ".properties", problems.at(0).text);
    probe.type = type_id(type.name);
    std::string why;
    // types of a stranger's plugin are judged by it alone
    const bool is_known =
        std::ranges::find(scene_shape_types(), type.name, &TypeDeclaration::name) != scene_shape_types().end();
    if (is_known && !read_scene_shape(probe.type, probe.parameters, &why)) refuse(place + ".properties", why);
    // as the kernel does it for a geometry of the scene, so that equal ones are made once
    channel::Digest content;
    content.add(type.name.data(), type.name.size());
    content.add(probe.parameters.data(), probe.parameters.size() * sizeof(double));
    probe.hash = content.value();
  }
  if (!shape.position().empty()) probe.pose.position = vector(shape.position(), place + ".position");
  if (!shape.orientation().empty()) {
    const auto& q = shape.orientation();
    if (q.size() != 4) refuse(place + ".orientation", counted(q.size(), "number") + "; allowed: 4 (w, x, y, z)");
    probe.pose.orientation = Quaternion(q[0], q[1], q[2], q[3]);
    // not so for what is no number
    if (!(std::fabs(probe.pose.orientation.norm() - 1.0) <= 1e-3))
      refuse(place + ".orientation", "it is no unit quaternion (w, x, y, z)");
    probe.pose.orientation.normalize();
  }
  return probe;
}

Bounds bounds_of(const Probe& probe, const Vector3& displacement) {
  const double infinity = std::numeric_limits<double>::infinity();
  std::string why;
  const std::optional<SceneShape> shape = read_scene_shape(probe.type, probe.parameters, &why);
  if (!shape || shape->is_unbounded()) return {Vector3::Constant(-infinity), Vector3::Constant(infinity)};
  const Box3 box = local_box(*shape);
  const Bounds begin = box_bounds(probe.pose, box.centre(), Quaternion::Identity(), box.half_extents());
  return {begin.lower.cwiseMin(begin.lower + displacement), begin.upper.cwiseMax(begin.upper + displacement)};
}

}  // namespace gravitas::survey
