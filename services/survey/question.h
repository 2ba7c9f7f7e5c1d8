// The questions of a batch, checked and resolved to numbers and rows.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gravitas/query/v1/query.pb.h"
#include "services/survey/surveyor.h"

namespace gravitas::survey {

// A shape that asks.
struct Probe {
  std::uint32_t body = kNone;  // whose shape it is, if anybody's
  std::uint64_t type = 0;
  std::uint64_t hash = 0;
  std::vector<double> parameters;
  Pose pose;  // of the geometry's frame
};

// Reads what people wrote. Throws BadQuestion.
class QuestionReader {
 public:
  QuestionReader(const Surveyor& surveyor, const kernel::Environment& environment, std::vector<TypeDeclaration> types)
      : surveyor_(surveyor), environment_(environment), types_(std::move(types)) {}

  // Three finite numbers; zero where none is given and none is needed.
  Vector3 vector(const google::protobuf::RepeatedField<double>& numbers, const std::string& place,
                 bool is_needed = true) const;
  // The number, which must be finite and not negative.
  double length(double number, const std::string& place) const;
  // Per body: 1 if it counts. Bodies without shape do not.
  std::vector<std::uint8_t> filter(const query::v1::Filter& filter, const std::string& place) const;
  Probe probe(const query::v1::Shape& shape, const std::string& place) const;

 private:
  std::uint32_t body(const std::string& id, const std::string& place) const;

  const Surveyor& surveyor_;
  const kernel::Environment& environment_;
  std::vector<TypeDeclaration> types_;  // that the collision plugin declares
};

// World bounds of a probe that goes this way; everywhere if its type is not known here.
Bounds bounds_of(const Probe& probe, const Vector3& displacement);

}  // namespace gravitas::survey
