// Assets: large columns that a kernel sends once, in parts, and then names by their hash (schemas/WIRE.md).
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>

#include "plugin_sdk/column_vector.h"

namespace gravitas::host {

class AssetStore {
 public:
  // Takes a part, a message AssetChunk. The parts of an asset come in order, without gaps. Empty, or what is wrong.
  std::string take(std::span<const std::byte> message);

  // The elements of an asset; null unless all of it has come.
  const ColumnVector<std::byte>* find(std::uint64_t hash) const;

  void clear() { assets_.clear(); }

 private:
  struct Asset {
    std::uint64_t size;  // in bytes, once all have come
    ColumnVector<std::byte> bytes;
  };
  std::map<std::uint64_t, Asset> assets_;  // by hash
};

}  // namespace gravitas::host
