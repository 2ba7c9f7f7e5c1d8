// The memory of an environment: named columns, each aligned to 64 bytes, in one segment that worker processes
// map read-only. Model, state and step data are columns of it, so a stage call between processes passes
// offsets and copies nothing.
//
// A column has a count (elements in use) and a capacity. When a stage needs more room the arena moves to a
// larger segment, with a new generation: pointers and spans are valid until the next grow() or seal().
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include "plugin_sdk/channel/segment.h"
#include "schemas/frame/column.h"

namespace gravitas::kernel {

using ColumnId = std::uint32_t;

class Arena {
 public:
  // Declares a column with room for `capacity` elements and `count` in use. Only before seal().
  ColumnId add(stage::ElementType type, std::uint64_t count, std::uint64_t capacity);

  // Lays out the declared columns and makes the segment.
  void seal();

  // Makes room for at least `capacity` elements; keeps the content of all columns.
  void grow(ColumnId column, std::uint64_t capacity);

  std::byte* data(ColumnId column) const { return base_ + columns_[column].offset; }
  std::uint64_t offset(ColumnId column) const { return columns_[column].offset; }
  std::uint64_t count(ColumnId column) const { return columns_[column].count; }
  std::uint64_t capacity(ColumnId column) const { return columns_[column].capacity; }
  void set_count(ColumnId column, std::uint64_t count) { columns_[column].count = count; }

  // Segments that are left meanwhile stay mapped: of a call that others, which may make room, are nested in.
  void hold() { ++holds_; }
  void let_go() {
    if (--holds_ == 0) left_.clear();
  }

  const channel::Segment& segment() const { return segment_; }
  std::uint64_t generation() const { return generation_; }

 private:
  struct Entry {
    std::uint64_t offset, count, capacity;
    stage::ElementType type;
  };

  void move_to_new_segment(std::vector<Entry> layout);

  std::vector<Entry> columns_;
  channel::Segment segment_;
  std::vector<channel::Segment> left_;  // while held
  int holds_ = 0;
  std::byte* base_ = nullptr;
  std::uint64_t generation_ = 0;
};

template <typename T>
constexpr stage::ElementType element_type_of() {
  if constexpr (std::is_same_v<T, double>) return stage::ElementType::kF64;
  if constexpr (std::is_same_v<T, std::uint32_t>) return stage::ElementType::kU32;
  return stage::ElementType::kU64;
}

// A column with its type. Copies refer to the same column.
template <typename T>
class Column {
 public:
  Column() = default;
  Column(Arena* arena, std::uint64_t count, std::uint64_t capacity)
      : arena_(arena), id_(arena->add(element_type_of<T>(), count, capacity)) {}

  ColumnId id() const { return id_; }
  std::uint64_t size() const { return arena_->count(id_); }
  T* data() const { return reinterpret_cast<T*>(arena_->data(id_)); }
  std::span<T> span() const { return {data(), size()}; }
  T& operator[](std::size_t i) const { return data()[i]; }

  // Sets the number of elements, making room if need be; new elements have any value.
  void resize(std::uint64_t count) const {
    if (count > arena_->capacity(id_)) arena_->grow(id_, count);
    arena_->set_count(id_, count);
  }
  void assign(std::span<const T> values) const { resize(values.size()), std::ranges::copy(values, data()); }
  // Another column of the arena, which making room may move.
  void assign(const Column& values) const { resize(values.size()), std::ranges::copy(values.span(), data()); }

 private:
  Arena* arena_ = nullptr;
  ColumnId id_ = 0;
};

// Columns as the C interface has them, until the arena moves.
inline std::array<gravitas_column, GRAVITAS_MAX_COLUMNS> plain_columns(const Arena& arena,
                                                                       std::span<const ColumnId> columns) {
  std::array<gravitas_column, GRAVITAS_MAX_COLUMNS> plain;
  for (std::size_t i = 0; i < columns.size(); ++i) plain[i] = {arena.data(columns[i]), arena.count(columns[i])};
  return plain;
}

// Columns of a request or reply, in the order of its contract.
template <typename... T>
std::array<ColumnId, sizeof...(T)> ids(const Column<T>&... columns) {
  return {columns.id()...};
}

}  // namespace gravitas::kernel
