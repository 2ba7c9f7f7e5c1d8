// Memory for the elements of a column where no arena or segment holds them: aligned as schemas/frame/layout.h promises.
#pragma once

#include <cstddef>
#include <new>
#include <vector>

#include "schemas/frame/layout.h"

namespace gravitas {

template <typename T>
struct ColumnAllocator {
  using value_type = T;

  ColumnAllocator() = default;
  template <typename U>
  ColumnAllocator(const ColumnAllocator<U>&) {}

  T* allocate(std::size_t count) { return static_cast<T*>(::operator new(count * sizeof(T), kAlignment)); }
  void deallocate(T* elements, std::size_t) { ::operator delete(elements, kAlignment); }
  bool operator==(const ColumnAllocator&) const { return true; }

 private:
  static constexpr std::align_val_t kAlignment{GRAVITAS_COLUMN_ALIGNMENT};
};

template <typename T>
using ColumnVector = std::vector<T, ColumnAllocator<T>>;

}  // namespace gravitas
