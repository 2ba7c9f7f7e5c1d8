#include "kernel/shadow.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace gravitas::kernel {
namespace {

double number_at(const std::byte* data, stage::ElementType type, std::uint64_t index) {
  double number = 0.0;
  std::uint32_t narrow = 0;
  std::uint64_t wide = 0;
  switch (type) {
    case stage::ElementType::kF64:
      std::memcpy(&number, data + 8 * index, 8);
      return number;
    case stage::ElementType::kU32:
      std::memcpy(&narrow, data + 4 * index, 4);
      return narrow;
    case stage::ElementType::kU64:
      std::memcpy(&wide, data + 8 * index, 8);
      break;
  }
  return static_cast<double>(wide);
}

}  // namespace

void Shadow::keep(const StageCall& call, const Arena& arena) {
  kept_.resize(call.reply.size());
  for (std::size_t i = 0; i < call.reply.size(); ++i) {
    const std::byte* data = arena.data(call.reply[i]);
    kept_[i].assign(data, data + arena.count(call.reply[i]) * stage::element_size(call.info().reply[i].type));
  }
}

void Shadow::put_back(const StageCall& call, Arena* arena) const {
  for (std::size_t i = 0; i < call.reply.size(); ++i) {
    const std::uint64_t count = kept_[i].size() / stage::element_size(call.info().reply[i].type);
    arena->set_count(call.reply[i], 0);
    if (count > arena->capacity(call.reply[i])) arena->grow(call.reply[i], count);
    std::ranges::copy(kept_[i], arena->data(call.reply[i]));
    arena->set_count(call.reply[i], count);
  }
}

Disagreement& Shadow::of(stage::Method method, const stage::ColumnInfo* column) {
  const auto found = std::ranges::find_if(
      result_.disagreements, [&](const Disagreement& one) { return one.method == method && one.column == column; });
  if (found != result_.disagreements.end()) return *found;
  return result_.disagreements.emplace_back(Disagreement{method, column});
}

void Shadow::note(const StageCall& call, const Arena& arena) {
  ++result_.calls;
  last_differed_ = false;
  for (std::size_t i = 0; i < call.reply.size(); ++i) {
    const stage::ColumnInfo& info = call.info().reply[i];
    const std::size_t size = stage::element_size(info.type);
    const std::byte* other = arena.data(call.reply[i]);
    const std::uint64_t count = arena.count(call.reply[i]);
    if (count * size != kept_[i].size()) {
      last_differed_ = true;
      ++of(call.method, &info).other_counts;
      continue;
    }
    if (std::equal(kept_[i].begin(), kept_[i].end(), other)) continue;
    last_differed_ = true;
    Disagreement& disagreement = of(call.method, &info);
    for (std::uint64_t row = 0; row < count / info.components; ++row) {
      const std::uint64_t first = row * info.components;
      if (std::equal(other + first * size, other + (first + info.components) * size, &kept_[i][first * size])) continue;
      ++disagreement.rows;
      for (std::uint64_t k = first; k < first + info.components; ++k) {
        const double difference = std::abs(number_at(other, info.type, k) - number_at(kept_[i].data(), info.type, k));
        const double counted = info.type == stage::ElementType::kF64 ? difference : std::min(difference, 1.0);
        if (counted <= disagreement.largest) continue;
        disagreement.largest = counted;
        disagreement.largest_row = row;
      }
    }
  }
  if (last_differed_) ++result_.differing_calls;
}

}  // namespace gravitas::kernel
