// What the parts of the builder share: the scene, the growing description, where to report, and ids
// as rows.
#pragma once

#include <google/protobuf/repeated_ptr_field.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "kernel/description.h"
#include "plugin_sdk/near_miss.h"
#include "services/catalog/catalog.h"
#include "services/scene/assign.h"
#include "services/scene/place.h"
#include "services/scene/problem.h"

namespace gravitas::scene {

// Rows by id, for one kind of block.
class IdIndex {
 public:
  // Reports ids that stand twice.
  template <typename Block>
  IdIndex(std::string kind, const google::protobuf::RepeatedPtrField<Block>& blocks, Diagnostics* diagnostics)
      : kind_(std::move(kind)) {
    rows_.reserve(static_cast<std::size_t>(blocks.size()));
    for (int i = 0; i < blocks.size(); ++i) rows_.emplace_back(blocks[i].id(), static_cast<std::uint32_t>(i));
    std::sort(rows_.begin(), rows_.end());
    for (std::size_t i = 1; i < rows_.size(); ++i) {
      if (rows_[i].first != rows_[i - 1].first) continue;
      const Block& first = blocks[static_cast<int>(rows_[i - 1].second)];
      const Block& second = blocks[static_cast<int>(rows_[i].second)];
      diagnostics->error(place_of(second, Block::kIdFieldNumber),
                         kind_ + " \"" + second.id() + "\" is there already, at " +
                             diagnostics->place_text(place_of(first, Block::kIdFieldNumber)) +
                             "; allowed: an id of its own");
    }
  }

  // The row of an id, or kNone after an error at `position` that says what `property` named.
  std::uint32_t find(std::string_view id, const std::string& property, const TextPosition& position,
                     Diagnostics* diagnostics) const {
    const auto found = std::lower_bound(rows_.begin(), rows_.end(), id,
                                        [](const auto& row, std::string_view wanted) { return row.first < wanted; });
    if (found != rows_.end() && found->first == id) return found->second;
    std::vector<std::string> ids;
    for (const auto& [known, row] : rows_)
      if (ids.empty() || ids.back() != known) ids.emplace_back(known);
    diagnostics->error(position,
                       property + " names no " + kind_ + ": \"" + std::string(id) + "\"; " + allowed_names(id, ids));
    return kNone;
  }

 private:
  std::string kind_;
  std::vector<std::pair<std::string_view, std::uint32_t>> rows_;
};

struct BuildContext {
  const v1::Scene& scene;
  const v1::Environment& environment;
  Catalog* catalog;
  Diagnostics* diagnostics;
  kernel::EnvironmentDescription description;

  // Flattens a block of free properties by its declaration; errors name `what` ("Sphere \"Unit\"").
  bool flatten_properties(const std::vector<Property>& declared, const v1::Properties& given, const TextPosition& block,
                          const std::string& what, std::vector<double>* out) {
    std::vector<PropertyProblem> problems;
    const bool good = flatten(declared, named_values(given), out, &problems);
    const TextPosition written = place_of(given.location());
    diagnostics->add(problems, written.known() ? written : block, what + ": ");
    return good;
  }
};

}  // namespace gravitas::scene
