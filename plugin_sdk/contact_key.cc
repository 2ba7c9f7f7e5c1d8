#include "plugin_sdk/contact_key.h"

#include <array>

#include "plugin_sdk/channel/digest.h"

namespace gravitas {

std::uint64_t new_contact_key(std::uint32_t a, std::uint32_t b, std::uint32_t feature, std::uint32_t step,
                              std::uint32_t inner) {
  const std::array<std::uint32_t, 4> identity = {a, b, feature, step};
  channel::Digest digest;
  digest.add(identity.data(), sizeof identity);
  if (inner > 0) digest.add(&inner, sizeof inner);
  return digest.value();
}

}  // namespace gravitas
