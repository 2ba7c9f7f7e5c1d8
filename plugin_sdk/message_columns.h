// The columns of one message as values that own their numbers: what the conformance kit and tests make requests of.
//
//   MessageColumns request(stage::method_info(stage::Method::kForceWrenches).request);
//   request.f64("mass") = {2.0};
//
// Columns are named as in schemas/gravitas/stage/v1/.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "plugin_sdk/discrepancy.h"
#include "schemas/stage_frames.h"

namespace gravitas {

// The numbers of one message. Single values are there from the start, as zero.
class MessageColumns {
 public:
  MessageColumns() = default;
  explicit MessageColumns(std::span<const stage::ColumnInfo> infos);

  // A column by its name; std::logic_error if there is none of that name, std::bad_variant_access if it is of another type.
  std::vector<double>& f64(std::string_view name);
  std::vector<std::uint32_t>& u32(std::string_view name);
  std::vector<std::uint64_t>& u64(std::string_view name);
  const std::vector<double>& f64(std::string_view name) const;
  const std::vector<std::uint32_t>& u32(std::string_view name) const;
  const std::vector<std::uint64_t>& u64(std::string_view name) const;

  // For reading; valid until a column changes. Not aligned as a host aligns columns (column_vector.h).
  std::vector<gravitas_column> plain() const;
  std::vector<std::span<const std::byte>> column_bytes() const;
  // For filling, with the present sizes as room.
  std::vector<gravitas_reply_column> rooms();
  void resize(std::span<const gravitas_reply_column> counts);
  std::vector<std::uint64_t> counts() const;
  // Every byte of every column.
  std::string bytes() const;

 private:
  using Numbers = std::variant<std::vector<double>, std::vector<std::uint32_t>, std::vector<std::uint64_t>>;
  std::size_t index(std::string_view name) const;

  std::span<const stage::ColumnInfo> infos_;
  std::vector<Numbers> columns_;
};

// Of an answer of Constraint.Discrepancies; valid as long as that is.
DiscrepancyColumns discrepancy_columns(const MessageColumns& reply);

}  // namespace gravitas
