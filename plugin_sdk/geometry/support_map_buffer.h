// Room for the support map of a primitive shape, so that a query makes one without the heap.
#pragma once

#include <cstddef>

#include "plugin_sdk/geometry/support_map.h"

namespace gravitas {

class SupportMapBuffer {
 public:
  SupportMapBuffer() = default;
  ~SupportMapBuffer() { clear(); }
  SupportMapBuffer(const SupportMapBuffer&) = delete;
  SupportMapBuffer& operator=(const SupportMapBuffer&) = delete;

  // Of a sphere, box, cylinder, capsule or cone; `size` as in SceneShape. Lives until the next call.
  const SupportMap& emplace(SceneShape::Kind kind, const Vector3& size);

 private:
  void clear();
  alignas(32) std::byte room_[160];
  SupportMap* map_ = nullptr;
};

}  // namespace gravitas
