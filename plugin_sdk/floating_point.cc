#include "plugin_sdk/floating_point.h"

#include <gnu/libc-version.h>

namespace gravitas {

void set_floating_point_control(std::uint32_t control) { _mm_setcsr(control & ~kFloatingPointExceptions); }

bool restore_floating_point_control(std::uint32_t control) {
  if (floating_point_control() == control) return false;
  set_floating_point_control(control);
  return true;
}

std::string c_library() { return std::string("glibc ") + gnu_get_libc_version(); }

std::vector<std::string> cpu_features() {
  __builtin_cpu_init();
  std::vector<std::string> features;
  if (__builtin_cpu_supports("avx2")) features.emplace_back("avx2");
  if (__builtin_cpu_supports("fma")) features.emplace_back("fma");
  if (__builtin_cpu_supports("bmi2")) features.emplace_back("bmi2");
  if (__builtin_cpu_supports("avx512f")) features.emplace_back("avx512f");
  return features;
}

std::string missing_cpu_features() {
  __builtin_cpu_init();
  std::string missing;
  if (!__builtin_cpu_supports("avx2")) missing += " AVX2";
  if (!__builtin_cpu_supports("fma")) missing += " FMA";
  if (!__builtin_cpu_supports("bmi2")) missing += " BMI2";
  return missing.empty() ? missing : "this build needs an x86-64-v3 processor; this one lacks" + missing;
}

}  // namespace gravitas
