// Stage messages as protobuf bytes: the columns of schemas/frame/column.h written and read directly, as a generated
// class would write and read them, without copying them into one.
//
// Field number i + 1 of a message is column i: a packed repeated field, or a single value. Beside the columns a
// message has the fields of gravitas/stage/v1/call.proto: the header (101), and sometimes a derivative's message or
// a part of an asset.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "schemas/frame/column.h"

namespace gravitas::wire {

enum Field : std::uint32_t { kHeader = 101, kDerivative = 102, kAsset = 103 };

// Numbers of one message in one column beyond this are refused: no honest message is that long.
inline constexpr std::uint64_t kMostElements = std::uint64_t{1} << 28;

// Bytes of the columns as fields of a message. A column with `data` null is left out.
std::size_t columns_size(std::span<const stage::ColumnInfo> infos, std::span<const gravitas_column> columns);

// Writes them; returns the end.
std::uint8_t* write_columns(std::span<const stage::ColumnInfo> infos, std::span<const gravitas_column> columns,
                            std::uint8_t* out);

// A field that is a message: its bytes are written by the caller, `size` of them, after this head.
std::size_t submessage_head_size(Field field, std::size_t size);
std::uint8_t* write_submessage_head(Field field, std::size_t size, std::uint8_t* out);

// A received message. It points into the bytes that were parsed and lives no longer than they.
class ColumnsReader {
 public:
  explicit ColumnsReader(std::span<const stage::ColumnInfo> infos) : infos_(infos) {}

  // Reads the structure of a message, whoever wrote it. Empty, or what is wrong with it. Accepts what a protobuf
  // parser accepts: fields in any order, packed or not, in several parts, and unknown fields.
  std::string parse(std::span<const std::byte> bytes);

  // Elements of a column; a single value always has one.
  std::uint64_t count(std::size_t column) const { return counts_[column]; }
  // Writes the elements of a column: count() of them, of the column's type.
  void copy(std::size_t column, void* to) const;

  // Bytes of a field that is a message; `has` is false if it was not there.
  struct Submessage {
    bool has = false;
    std::span<const std::byte> bytes;
  };
  const Submessage& header() const { return header_; }
  const Submessage& derivative() const { return derivative_; }
  const Submessage& asset() const { return asset_; }

 private:
  struct Part {
    std::uint32_t column = 0;
    std::uint32_t size = 0;
    const std::uint8_t* data = nullptr;
  };

  std::string add_part(std::size_t column, const std::uint8_t* data, std::uint32_t size);
  std::uint8_t* copy_part(const Part& part, std::uint8_t* out) const;

  std::span<const stage::ColumnInfo> infos_;
  std::array<std::uint64_t, GRAVITAS_MAX_COLUMNS> counts_{};
  std::array<Part, GRAVITAS_MAX_COLUMNS> single_{};  // of columns that are single values
  std::vector<Part> parts_;
  Submessage header_, derivative_, asset_;
};

// XXH3 of the bytes of each column's elements, into `hashes`.
void hash_columns(std::span<const stage::ColumnInfo> infos, std::span<const gravitas_column> columns,
                  std::span<std::uint64_t> hashes);
// XXH3 over all columns: of each the count, then its hash. Never 0.
std::uint64_t columns_digest(std::span<const gravitas_column> columns, std::span<const std::uint64_t> hashes);
std::uint64_t columns_digest(std::span<const stage::ColumnInfo> infos, std::span<const gravitas_column> columns);

}  // namespace gravitas::wire
