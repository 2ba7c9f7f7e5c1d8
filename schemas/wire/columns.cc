#include "schemas/wire/columns.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>
#include <xxhash.h>

#include <algorithm>
#include <cstring>
#include <limits>

namespace gravitas::wire {
namespace {

using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedInputStream;
using google::protobuf::io::CodedOutputStream;
using stage::ColumnInfo;
using stage::ElementType;

std::uint32_t tag_of(std::uint32_t field, WireFormatLite::WireType type) {
  return WireFormatLite::MakeTag(static_cast<int>(field), type);
}

bool is_scalar(const ColumnInfo& info) { return info.rows_index == stage::kScalar; }

std::uint64_t element(const ColumnInfo& info, const void* data, std::size_t i) {
  if (info.type == ElementType::kU32) return static_cast<const std::uint32_t*>(data)[i];
  return static_cast<const std::uint64_t*>(data)[i];
}

// Bytes of the elements alone.
std::size_t payload_size(const ColumnInfo& info, const gravitas_column& column) {
  if (info.type == ElementType::kF64) return column.count * sizeof(double);
  std::size_t size = 0;
  for (std::size_t i = 0; i < column.count; ++i) size += CodedOutputStream::VarintSize64(element(info, column.data, i));
  return size;
}

std::uint8_t* write_payload(const ColumnInfo& info, const gravitas_column& column, std::uint8_t* out) {
  if (info.type == ElementType::kF64) {
    std::memcpy(out, column.data, column.count * sizeof(double));
    return out + column.count * sizeof(double);
  }
  for (std::size_t i = 0; i < column.count; ++i)
    out = CodedOutputStream::WriteVarint64ToArray(element(info, column.data, i), out);
  return out;
}

// proto3 leaves out a single value of all zero bits, and a list without elements.
bool is_left_out(const ColumnInfo& info, const gravitas_column& column) {
  if (column.data == nullptr || column.count == 0) return true;
  static constexpr std::uint64_t kZero = 0;
  return is_scalar(info) && std::memcmp(column.data, &kZero, stage::element_size(info.type)) == 0;
}

std::uint32_t scalar_tag(const ColumnInfo& info, std::uint32_t field) {
  return tag_of(field,
                info.type == ElementType::kF64 ? WireFormatLite::WIRETYPE_FIXED64 : WireFormatLite::WIRETYPE_VARINT);
}

std::uint64_t read_varint(const std::uint8_t** at) {
  std::uint64_t value = 0;
  for (int shift = 0;; shift += 7) {
    const std::uint8_t byte = *(*at)++;
    value |= static_cast<std::uint64_t>(byte & 0x7F) << shift;
    if (byte < 0x80) return value;
  }
}

}  // namespace

std::size_t columns_size(std::span<const ColumnInfo> infos, std::span<const gravitas_column> columns) {
  std::size_t size = 0;
  for (std::size_t i = 0; i < infos.size(); ++i) {
    if (is_left_out(infos[i], columns[i])) continue;
    const std::size_t payload = payload_size(infos[i], columns[i]);
    size += CodedOutputStream::VarintSize32(scalar_tag(infos[i], static_cast<std::uint32_t>(i) + 1)) + payload;
    if (!is_scalar(infos[i])) size += CodedOutputStream::VarintSize64(payload);
  }
  return size;
}

std::uint8_t* write_columns(std::span<const ColumnInfo> infos, std::span<const gravitas_column> columns,
                            std::uint8_t* out) {
  for (std::size_t i = 0; i < infos.size(); ++i) {
    if (is_left_out(infos[i], columns[i])) continue;
    const auto field = static_cast<std::uint32_t>(i) + 1;
    if (is_scalar(infos[i])) {
      out = CodedOutputStream::WriteTagToArray(scalar_tag(infos[i], field), out);
    } else {
      out = CodedOutputStream::WriteTagToArray(tag_of(field, WireFormatLite::WIRETYPE_LENGTH_DELIMITED), out);
      out = CodedOutputStream::WriteVarint64ToArray(payload_size(infos[i], columns[i]), out);
    }
    out = write_payload(infos[i], columns[i], out);
  }
  return out;
}

std::size_t submessage_head_size(Field field, std::size_t size) {
  return CodedOutputStream::VarintSize32(tag_of(field, WireFormatLite::WIRETYPE_LENGTH_DELIMITED)) +
         CodedOutputStream::VarintSize64(size);
}

std::uint8_t* write_submessage_head(Field field, std::size_t size, std::uint8_t* out) {
  out = CodedOutputStream::WriteTagToArray(tag_of(field, WireFormatLite::WIRETYPE_LENGTH_DELIMITED), out);
  return CodedOutputStream::WriteVarint64ToArray(size, out);
}

// Counts the elements of a run of them and checks that each is whole and fits its type.
std::string ColumnsReader::add_part(std::size_t column, const std::uint8_t* data, std::uint32_t size) {
  const ColumnInfo& info = infos_[column];
  const auto problem = [&](const char* what) { return std::string("column ") + info.name + " " + what; };
  std::uint64_t elements = 0;
  if (info.type == ElementType::kF64) {
    if (size % sizeof(double) != 0) return problem("ends within an element");
    elements = size / sizeof(double);
  } else {
    std::uint32_t length = 0;
    for (std::uint32_t i = 0; i < size; ++i) {
      ++length;
      if (length == 10 && data[i] > 1) return problem("has an element of more than 64 bits");
      if (data[i] >= 0x80) continue;
      const std::uint8_t* first = data + i + 1 - length;
      if (info.type == ElementType::kU32 && length >= 5 &&
          read_varint(&first) > std::numeric_limits<std::uint32_t>::max())
        return problem("has an element of more than 32 bits");
      ++elements;
      length = 0;
    }
    if (length != 0) return problem("ends within an element");
  }
  if (is_scalar(info)) {
    // the last one counts
    single_[column] = {static_cast<std::uint32_t>(column), size, data};
    return {};
  }
  counts_[column] += elements;
  if (counts_[column] > kMostElements) return problem("is longer than any message may be");
  parts_.push_back({static_cast<std::uint32_t>(column), size, data});
  return {};
}

std::string ColumnsReader::parse(std::span<const std::byte> bytes) {
  counts_.fill(0);
  single_.fill({});
  parts_.clear();
  header_ = derivative_ = asset_ = {};
  for (std::size_t i = 0; i < infos_.size(); ++i)
    if (is_scalar(infos_[i])) counts_[i] = 1;
  if (bytes.size() > static_cast<std::size_t>(std::numeric_limits<int>::max())) return "the message is too long";

  const auto* begin = reinterpret_cast<const std::uint8_t*>(bytes.data());
  CodedInputStream input(begin, static_cast<int>(bytes.size()));
  while (const std::uint32_t tag = input.ReadTag()) {
    const auto field = static_cast<std::uint32_t>(WireFormatLite::GetTagFieldNumber(tag));
    const WireFormatLite::WireType type = WireFormatLite::GetTagWireType(tag);
    const bool is_column = field >= 1 && field <= infos_.size();
    if (!is_column && field != kHeader && field != kDerivative && field != kAsset) {
      if (!WireFormatLite::SkipField(&input, tag)) return "an unknown field is broken off";
      continue;
    }
    const std::string name =
        is_column ? std::string("column ") + infos_[field - 1].name : "field " + std::to_string(field);
    if (type == WireFormatLite::WIRETYPE_LENGTH_DELIMITED) {
      std::uint32_t size = 0;
      const std::uint8_t* data = nullptr;
      if (!input.ReadVarint32(&size)) return name + " is broken off";
      data = begin + input.CurrentPosition();
      if (size > static_cast<std::uint32_t>(std::numeric_limits<int>::max()) || !input.Skip(static_cast<int>(size)))
        return name + " is broken off";
      if (!is_column) {
        Submessage& target = field == kHeader ? header_ : field == kDerivative ? derivative_ : asset_;
        target = {true, std::as_bytes(std::span(data, size))};
        continue;
      }
      if (is_scalar(infos_[field - 1])) return name + " is a list, not a single value";
      if (std::string problem = add_part(field - 1, data, size); !problem.empty()) return problem;
      continue;
    }
    // one element, unpacked
    if (!is_column || tag != scalar_tag(infos_[field - 1], field)) return name + " has another type";
    const std::uint8_t* data = begin + input.CurrentPosition();
    std::uint64_t ignored = 0;
    const bool read =
        type == WireFormatLite::WIRETYPE_FIXED64 ? input.ReadLittleEndian64(&ignored) : input.ReadVarint64(&ignored);
    if (!read) return name + " is broken off";
    const auto size = static_cast<std::uint32_t>(begin + input.CurrentPosition() - data);
    if (std::string problem = add_part(field - 1, data, size); !problem.empty()) return problem;
  }
  if (!input.ConsumedEntireMessage()) return "the message is broken off";
  return {};
}

// Writes the elements of a run; returns the end.
std::uint8_t* ColumnsReader::copy_part(const Part& part, std::uint8_t* out) const {
  const ColumnInfo& info = infos_[part.column];
  if (info.type == ElementType::kF64) {
    if (part.size > 0) std::memcpy(out, part.data, part.size);
    return out + part.size;
  }
  const std::uint8_t* at = part.data;
  while (at != part.data + part.size) {
    const std::uint64_t value = read_varint(&at);
    // little-endian: the low half comes first
    std::memcpy(out, &value, stage::element_size(info.type));
    out += stage::element_size(info.type);
  }
  return out;
}

void ColumnsReader::copy(std::size_t column, void* to) const {
  const ColumnInfo& info = infos_[column];
  auto* out = static_cast<std::uint8_t*>(to);
  if (is_scalar(info)) {
    std::memset(out, 0, stage::element_size(info.type));
    if (single_[column].data != nullptr) copy_part(single_[column], out);
    return;
  }
  for (const Part& part : parts_)
    if (part.column == column) out = copy_part(part, out);
}

void hash_columns(std::span<const ColumnInfo> infos, std::span<const gravitas_column> columns,
                  std::span<std::uint64_t> hashes) {
  for (std::size_t i = 0; i < infos.size(); ++i)
    hashes[i] = XXH3_64bits(columns[i].data, columns[i].count * stage::element_size(infos[i].type));
}

std::uint64_t columns_digest(std::span<const gravitas_column> columns, std::span<const std::uint64_t> hashes) {
  std::array<std::uint64_t, 2 * GRAVITAS_MAX_COLUMNS> all;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    all[2 * i] = columns[i].count;
    all[2 * i + 1] = hashes[i];
  }
  const std::uint64_t digest = XXH3_64bits(all.data(), 2 * columns.size() * sizeof all[0]);
  return digest != 0 ? digest : 1;
}

std::uint64_t columns_digest(std::span<const ColumnInfo> infos, std::span<const gravitas_column> columns) {
  std::array<std::uint64_t, GRAVITAS_MAX_COLUMNS> hashes;
  hash_columns(infos, columns, hashes);
  return columns_digest(columns.first(infos.size()), std::span(hashes).first(infos.size()));
}

}  // namespace gravitas::wire
