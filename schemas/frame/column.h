// What the generated stage views are made of: information about columns, and the column that a plugin fills.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "schemas/frame/layout.h"

namespace gravitas::stage {

enum class ElementType : std::uint8_t { kF64, kU32, kU64 };

constexpr std::size_t element_size(ElementType type) { return type == ElementType::kU32 ? 4 : 8; }

// `rows_index` numbers the row words of a method (request and reply together), so that columns with the same
// number must have the same count of rows; 255 for a single value. `extra` is 1 for columns with one row more;
// `asset` marks a column that stays the same for a run and can be large.
struct ColumnInfo {
  const char* name;
  ElementType type;
  std::uint32_t components;
  std::uint8_t rows_index;
  std::uint8_t extra;
  bool asset;
  const char* rows;
  const char* unit;
  const char* frame;
};

inline constexpr std::uint8_t kScalar = 255;

struct MethodInfo {
  const char* name;  // "Space.Pairs"
  const char* path;  // "/gravitas.stage.v1.Space/Pairs", as gRPC calls it
  std::span<const ColumnInfo> request;
  std::span<const ColumnInfo> reply;
  std::uint32_t row_words;
};

// A column of the reply, as the plugin's author sees it. Writing more than there is room for only counts: the
// host sees the count, makes room, and asks again; the author need not care.
template <typename T>
class ReplyColumn {
 public:
  explicit ReplyColumn(gravitas_reply_column* column) : column_(column) {}

  // Appends the elements of a row.
  template <typename... U>
  void push(U... elements) const {
    (push_element(static_cast<T>(elements)), ...);
  }

  // Sets the number of elements and returns them for writing; empty if there is no room for them.
  std::span<T> resize(std::uint64_t count) const {
    column_->count = count;
    if (count > column_->capacity) return {};
    return {static_cast<T*>(column_->data), count};
  }

  // The value of a column that is a single value.
  void set(T value) const {
    if (std::span<T> one = resize(1); !one.empty()) one[0] = value;
  }

  std::uint64_t count() const { return column_->count; }

 private:
  void push_element(T element) const {
    if (column_->count < column_->capacity) static_cast<T*>(column_->data)[column_->count] = element;
    ++column_->count;
  }

  gravitas_reply_column* column_;
};

}  // namespace gravitas::stage
