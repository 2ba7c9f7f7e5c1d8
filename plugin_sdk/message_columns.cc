#include "plugin_sdk/message_columns.h"

#include <stdexcept>

namespace gravitas {

MessageColumns::MessageColumns(std::span<const stage::ColumnInfo> infos) : infos_(infos) {
  for (const stage::ColumnInfo& column : infos) {
    const std::size_t size = column.rows_index == stage::kScalar ? 1 : 0;
    switch (column.type) {
      case stage::ElementType::kF64:
        columns_.emplace_back(std::vector<double>(size));
        break;
      case stage::ElementType::kU32:
        columns_.emplace_back(std::vector<std::uint32_t>(size));
        break;
      case stage::ElementType::kU64:
        columns_.emplace_back(std::vector<std::uint64_t>(size));
        break;
    }
  }
}

std::size_t MessageColumns::index(std::string_view name) const {
  for (std::size_t i = 0; i < infos_.size(); ++i)
    if (infos_[i].name == name) return i;
  throw std::logic_error("no column " + std::string(name));
}

std::vector<double>& MessageColumns::f64(std::string_view name) {
  return std::get<std::vector<double>>(columns_[index(name)]);
}
std::vector<std::uint32_t>& MessageColumns::u32(std::string_view name) {
  return std::get<std::vector<std::uint32_t>>(columns_[index(name)]);
}
std::vector<std::uint64_t>& MessageColumns::u64(std::string_view name) {
  return std::get<std::vector<std::uint64_t>>(columns_[index(name)]);
}
const std::vector<double>& MessageColumns::f64(std::string_view name) const {
  return std::get<std::vector<double>>(columns_[index(name)]);
}
const std::vector<std::uint32_t>& MessageColumns::u32(std::string_view name) const {
  return std::get<std::vector<std::uint32_t>>(columns_[index(name)]);
}
const std::vector<std::uint64_t>& MessageColumns::u64(std::string_view name) const {
  return std::get<std::vector<std::uint64_t>>(columns_[index(name)]);
}

std::vector<gravitas_column> MessageColumns::plain() const {
  std::vector<gravitas_column> columns;
  for (const Numbers& numbers : columns_) {
    std::visit([&](const auto& v) { columns.push_back({v.data(), v.size()}); }, numbers);
  }
  return columns;
}

std::vector<std::span<const std::byte>> MessageColumns::column_bytes() const {
  std::vector<std::span<const std::byte>> columns;
  for (const Numbers& numbers : columns_)
    std::visit([&](const auto& v) { columns.push_back(std::as_bytes(std::span(v))); }, numbers);
  return columns;
}

std::vector<gravitas_reply_column> MessageColumns::rooms() {
  std::vector<gravitas_reply_column> columns;
  for (Numbers& numbers : columns_) {
    std::visit([&](auto& v) { columns.push_back({v.data(), v.size(), 0}); }, numbers);
  }
  return columns;
}

void MessageColumns::resize(std::span<const gravitas_reply_column> counts) {
  for (std::size_t i = 0; i < columns_.size(); ++i)
    std::visit([&](auto& v) { v.resize(counts[i].count); }, columns_[i]);
}

std::vector<std::uint64_t> MessageColumns::counts() const {
  std::vector<std::uint64_t> counts;
  for (const Numbers& numbers : columns_) std::visit([&](const auto& v) { counts.push_back(v.size()); }, numbers);
  return counts;
}

std::string MessageColumns::bytes() const {
  std::string bytes;
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    const std::size_t size = stage::element_size(infos_[i].type);
    std::visit(
        [&](const auto& v) {
          if (!v.empty()) bytes.append(reinterpret_cast<const char*>(v.data()), v.size() * size);
        },
        columns_[i]);
  }
  return bytes;
}

DiscrepancyColumns discrepancy_columns(const MessageColumns& reply) {
  DiscrepancyColumns columns;
  columns.point1 = reply.f64("point1"), columns.point2 = reply.f64("point2"), columns.velocity = reply.f64("velocity");
  columns.correction = reply.f64("correction"), columns.axes = reply.f64("axes"), columns.mode = reply.u32("mode");
  columns.lower = reply.f64("lower"), columns.upper = reply.f64("upper"), columns.compliance = reply.f64("compliance");
  columns.damping = reply.f64("damping"), columns.maximum_force = reply.f64("maximum_force");
  columns.restitution = reply.f64("restitution"), columns.desired_acceleration = reply.f64("desired_acceleration");
  return columns;
}

}  // namespace gravitas
