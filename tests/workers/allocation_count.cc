// The replacement of the global allocation functions, in ordinary builds: sanitizers have their own. They stand apart from
// the tests because the compiler, seeing both sides inlined, takes the pairing of malloc and delete for a mistake.
#include "tests/workers/allocation_count.h"

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

#include "tests/sanitized.h"

namespace {
std::atomic<long> count{0};
}  // namespace

namespace gravitas::test {
long allocation_count() { return count.load(); }
}  // namespace gravitas::test

#if !GRAVITAS_IS_SANITIZED
void* operator new(std::size_t size) {
  ++count;
  if (void* p = std::malloc(size > 0 ? size : 1)) return p;
  throw std::bad_alloc();
}
// what std::stable_sort asks for its buffer, and gives back to the plain delete
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++count;
  return std::malloc(size > 0 ? size : 1);
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
#endif
