#include "kernel/shadow.h"

#include <algorithm>
#include <array>

namespace gravitas::kernel {
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

void Shadow::note(const StageCall& call, const Arena& arena) {
  std::array<std::span<const std::byte>, GRAVITAS_MAX_COLUMNS> first, second;
  for (std::size_t i = 0; i < call.reply.size(); ++i) {
    first[i] = kept_[i];
    second[i] = {arena.data(call.reply[i]),
                 arena.count(call.reply[i]) * stage::element_size(call.info().reply[i].type)};
  }
  last_differed_ =
      result_.add(call.method, std::span(first).first(kept_.size()), std::span(second).first(kept_.size())).has_value();
}

}  // namespace gravitas::kernel
