// Assets are whole or not there, lie as columns do, and parts that do not fit are refused.
#include "plugin_sdk/host/asset_store.h"

#include <gtest/gtest.h>
#include <xxhash.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>

#include "gravitas/stage/v1/call.pb.h"

namespace gravitas::host {
namespace {

constexpr const char* kDoesNotFollow = "a part of an asset that does not follow the part before it";

struct Part {
  std::uint64_t hash, size, offset;
  std::string data;
};

std::string take(AssetStore* store, const Part& part) {
  stage::v1::AssetChunk chunk;
  chunk.set_hash(part.hash);
  chunk.set_size(part.size);
  chunk.set_offset(part.offset);
  chunk.set_data(part.data);
  const std::string message = chunk.SerializeAsString();
  return store->take(std::as_bytes(std::span(message)));
}

TEST(AssetStore, PutsEveryAssetWhereColumnsLie) {
  AssetStore store;
  for (std::size_t size = 8; size < 8000; size += 136) {
    const std::string content(size, static_cast<char>(size % 251));
    const std::uint64_t hash = XXH3_64bits(content.data(), size);
    for (std::size_t at = 0; at < size; at += 1000)
      ASSERT_EQ(take(&store, {hash, size, at, content.substr(at, 1000)}), "");
    const ColumnVector<std::byte>* asset = store.find(hash);
    ASSERT_NE(asset, nullptr);
    ASSERT_EQ(asset->size(), size);
    EXPECT_EQ(std::memcmp(asset->data(), content.data(), size), 0);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(asset->data()) % GRAVITAS_COLUMN_ALIGNMENT, 0U);
  }
}

TEST(AssetStore, HasNoneBeforeAllOfItHasCome) {
  AssetStore store;
  const std::string content(24, 'x');
  const std::uint64_t hash = XXH3_64bits(content.data(), content.size());
  EXPECT_EQ(store.find(hash), nullptr);
  EXPECT_EQ(take(&store, {hash, 24, 0, content.substr(0, 16)}), "");
  EXPECT_EQ(store.find(hash), nullptr);
  EXPECT_EQ(take(&store, {hash, 24, 16, content.substr(16)}), "");
  EXPECT_NE(store.find(hash), nullptr);
  store.clear();
  EXPECT_EQ(store.find(hash), nullptr);
}

TEST(AssetStore, RefusesPartsThatDoNotFollow) {
  AssetStore store;
  const std::string content(24, 'x');
  const std::uint64_t hash = XXH3_64bits(content.data(), content.size());
  EXPECT_EQ(take(&store, {hash, 24, 0, content.substr(0, 16)}), "");
  EXPECT_EQ(take(&store, {hash, 24, 8, content.substr(0, 16)}), kDoesNotFollow);
  EXPECT_EQ(take(&store, {hash, 24, 16, content}), kDoesNotFollow);
  // of fewer bytes in all than have come
  EXPECT_EQ(take(&store, {hash, 8, 16, content}), kDoesNotFollow);
  EXPECT_EQ(take(&store, {hash + 1, 24, 0, content}), "an asset whose content does not fit its hash");
  const std::string broken = "\xff";
  EXPECT_EQ(store.take(std::as_bytes(std::span(broken))), "an asset that cannot be read");
}

}  // namespace
}  // namespace gravitas::host
