#include "plugin_sdk/host/sandbox.h"

#include <linux/capability.h>
#include <malloc.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace gravitas::host {
namespace {

// A sanitizer keeps its books in terabytes of address space.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#elif defined(__has_feature)
constexpr bool kSanitized = __has_feature(address_sanitizer) || __has_feature(thread_sanitizer);
#else
constexpr bool kSanitized = false;
#endif

// Each arena of the allocator takes 64 MiB of address space; left alone it makes eight per core.
constexpr int kMostArenas = 8;

std::string not_enforced(const std::string& what) { return "no " + what + ": " + std::strerror(errno); }

// Lowers both limits of a resource; a lower one stays. `*limit` becomes what holds.
bool limit(__rlimit_resource resource, std::uint64_t* most) {
  rlimit now{};
  if (getrlimit(resource, &now) != 0) return false;
  *most = std::min<std::uint64_t>({*most, now.rlim_cur, now.rlim_max});
  now = {*most, *most};
  return setrlimit(resource, &now) == 0;
}

std::string forbid_new_privileges() {
  return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 ? "no_new_privs" : not_enforced("no_new_privs");
}

std::string forbid_core_files() {
  std::uint64_t most = 0;
  return limit(RLIMIT_CORE, &most) ? "core files 0" : not_enforced("limit of core files");
}

std::string limit_descriptors() {
  std::uint64_t most = kDescriptorLimit;
  return limit(RLIMIT_NOFILE, &most) ? "descriptors " + std::to_string(most) : not_enforced("limit of descriptors");
}

// Only a worker of root has any. It keeps what it may need to read a library in somebody's private folder.
std::string drop_capabilities() {
  __user_cap_header_struct header = {_LINUX_CAPABILITY_VERSION_3, 0};
  __user_cap_data_struct sets[_LINUX_CAPABILITY_U32S_3] = {};
  if (syscall(SYS_capget, &header, sets) != 0) return not_enforced("loss of capabilities");
  const std::uint32_t kept = sets[0].permitted & (1U << CAP_DAC_READ_SEARCH);
  sets[0] = {kept, kept, 0};
  sets[1] = {};
  return syscall(SYS_capset, &header, sets) == 0 ? "capabilities dropped" : not_enforced("loss of capabilities");
}

std::string limit_memory(std::uint64_t most) {
  if (kSanitized) return "no limit of memory: a sanitizer needs the address space";
  mallopt(M_ARENA_MAX, kMostArenas);
  return limit(RLIMIT_AS, &most) ? "memory " + std::to_string(most >> 20) + " MiB" : not_enforced("limit of memory");
}

}  // namespace

void close_inherited(const std::vector<int>& kept) {
  const int last = kept.empty() ? STDERR_FILENO : std::max(STDERR_FILENO, *std::ranges::max_element(kept));
  for (int descriptor = STDERR_FILENO + 1; descriptor < last; ++descriptor)
    if (std::ranges::find(kept, descriptor) == kept.end()) close(descriptor);
  closefrom(last + 1);
}

std::vector<std::string> enter_bare_sandbox() {
  return {forbid_new_privileges(), forbid_core_files(), limit_descriptors()};
}

std::vector<std::string> enter_sandbox(const std::vector<std::string>& libraries, std::uint64_t memory_limit) {
  std::vector<std::string> enforced = enter_bare_sandbox();
  enforced.push_back(drop_capabilities());
  enforced.push_back(restrict_files(libraries));
  // the filter refuses to change limits, so they come before it
  enforced.push_back(limit_memory(memory_limit));
  enforced.push_back(restrict_calls());
  return enforced;
}

}  // namespace gravitas::host
