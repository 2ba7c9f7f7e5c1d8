// Identity of a contact's life: who touches, with which features, since which step and inner step.
#pragma once

#include <cstdint>

namespace gravitas {

std::uint64_t new_contact_key(std::uint32_t a, std::uint32_t b, std::uint32_t feature, std::uint32_t step,
                              std::uint32_t inner);

}  // namespace gravitas
