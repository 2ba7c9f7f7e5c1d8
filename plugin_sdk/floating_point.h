// How floating-point arithmetic behaves in this process, and whether this processor can run this build.
#pragma once

#include <immintrin.h>

#include <cstdint>
#include <string>
#include <vector>

namespace gravitas {

// Sticky flags of MXCSR.
inline constexpr std::uint32_t kFloatingPointExceptions = 0x3F;

// The MXCSR control register without its sticky exception flags: rounding mode, flush-to-zero,
// denormals-are-zero, exception masks.
inline std::uint32_t floating_point_control() { return _mm_getcsr() & ~kFloatingPointExceptions; }
void set_floating_point_control(std::uint32_t control);
// Sets it to what it was before something that must not change it; true if that did.
bool restore_floating_point_control(std::uint32_t control);

// The C library and its version.
std::string c_library();

// Those of the processor's abilities that this build or its libraries choose code by.
std::vector<std::string> cpu_features();

// Empty if the processor has what the build needs (x86-64-v3), else a sentence that says what is missing.
std::string missing_cpu_features();

}  // namespace gravitas
