#include "kernel/arena.h"

#include <cstring>
#include <utility>

namespace gravitas::kernel {

ColumnId Arena::add(stage::ElementType type, std::uint64_t count, std::uint64_t capacity) {
  columns_.push_back({0, count, std::max<std::uint64_t>(capacity, count), type});
  return static_cast<ColumnId>(columns_.size() - 1);
}

void Arena::seal() { move_to_new_segment(columns_); }

void Arena::grow(ColumnId column, std::uint64_t capacity) {
  if (capacity <= columns_[column].capacity) return;
  std::vector<Entry> layout = columns_;
  layout[column].capacity = std::max(capacity, 2 * columns_[column].capacity);
  move_to_new_segment(std::move(layout));
}

void Arena::move_to_new_segment(std::vector<Entry> layout) {
  std::uint64_t size = 0;
  for (Entry& entry : layout) {
    entry.offset = size;
    size += channel::round_up(entry.capacity * stage::element_size(entry.type), GRAVITAS_COLUMN_ALIGNMENT);
  }
  channel::Segment segment = channel::Segment::create("gravitas state", size, channel::Sharing::kReadersOnly);
  for (std::size_t i = 0; base_ != nullptr && i < columns_.size(); ++i) {
    const Entry& old = columns_[i];
    std::memcpy(segment.data() + layout[i].offset, base_ + old.offset, old.count * stage::element_size(old.type));
  }
  columns_ = std::move(layout);
  std::swap(segment_, segment);
  if (holds_ > 0) left_.push_back(std::move(segment));
  base_ = segment_.data();
  ++generation_;
}

}  // namespace gravitas::kernel
