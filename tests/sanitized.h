// Built with a sanitizer: laws are then looked at for fewer seeds and steps, since the first few show what it looks for.
#pragma once

namespace gravitas::harness {

#if defined(__clang__)
inline constexpr bool kSanitized = __has_feature(address_sanitizer) || __has_feature(thread_sanitizer);
#elif defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

// `count`, or one in so many of it.
constexpr int unless_sanitized(int count, int one_in = 20) {
  return kSanitized ? (count + one_in - 1) / one_in : count;
}

}  // namespace gravitas::harness
