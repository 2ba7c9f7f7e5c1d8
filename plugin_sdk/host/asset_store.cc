#include "plugin_sdk/host/asset_store.h"

#include <xxhash.h>

#include "gravitas/stage/v1/call.pb.h"
#include "schemas/wire/columns.h"

namespace gravitas::host {

std::string AssetStore::take(std::span<const std::byte> message) {
  stage::v1::AssetChunk chunk;
  if (!chunk.ParseFromArray(message.data(), static_cast<int>(message.size()))) return "an asset that cannot be read";
  Asset& asset = assets_.try_emplace(chunk.hash(), Asset{chunk.size(), {}}).first->second;
  if (chunk.size() != asset.size || asset.size > wire::kMostElements * 8 || chunk.offset() != asset.bytes.size() ||
      chunk.data().size() > asset.size - asset.bytes.size())
    return "a part of an asset that does not follow the part before it";
  const auto data = std::as_bytes(std::span(chunk.data()));
  asset.bytes.insert(asset.bytes.end(), data.begin(), data.end());
  if (asset.bytes.size() == asset.size && XXH3_64bits(asset.bytes.data(), asset.size) != chunk.hash()) {
    assets_.erase(chunk.hash());
    return "an asset whose content does not fit its hash";
  }
  return {};
}

const ColumnVector<std::byte>* AssetStore::find(std::uint64_t hash) const {
  const auto found = assets_.find(hash);
  return found == assets_.end() || found->second.bytes.size() != found->second.size ? nullptr : &found->second.bytes;
}

}  // namespace gravitas::host
