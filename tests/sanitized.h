// Built with a sanitizer: laws are then looked at for fewer seeds and steps, since the first few show what it looks for.
#pragma once

#if defined(__has_feature)  // Clang
#define GRAVITAS_IS_THREAD_SANITIZED __has_feature(thread_sanitizer)
#define GRAVITAS_IS_SANITIZED (__has_feature(address_sanitizer) || __has_feature(thread_sanitizer))
#elif defined(__SANITIZE_THREAD__)
#define GRAVITAS_IS_THREAD_SANITIZED true
#define GRAVITAS_IS_SANITIZED true
#else
#define GRAVITAS_IS_THREAD_SANITIZED false
#if defined(__SANITIZE_ADDRESS__)
#define GRAVITAS_IS_SANITIZED true
#else
#define GRAVITAS_IS_SANITIZED false
#endif
#endif

namespace gravitas::harness {

inline constexpr bool kSanitized = GRAVITAS_IS_SANITIZED;
inline constexpr bool kThreadSanitized = GRAVITAS_IS_THREAD_SANITIZED;

// `count`, or one in so many of it.
constexpr int unless_sanitized(int count, int one_in = 20) {
  return kSanitized ? (count + one_in - 1) / one_in : count;
}

}  // namespace gravitas::harness
