// What is dear to make of a shape (a hull, a mesh with its tree), kept from request to request by the hash of its
// content, so that it is made once. A cache only: what it holds can be made again from any request.
#pragma once

#include <cstdint>
#include <map>
#include <utility>

namespace gravitas {

template <typename Stored>
class ShapeCache {
 public:
  // The shapes of a request follow.
  void begin() {
    for (auto& [hash, kept] : kept_) kept.is_used = false;
  }
  // That of this content, or a new one from make(); valid until the next begin() or an exception of make().
  template <typename Make>
  const Stored& get(std::uint64_t hash, std::uint64_t type, std::size_t parameters, const Make& make) {
    auto found = kept_.find(hash);
    if (found != kept_.end() && (found->second.type != type || found->second.parameters != parameters)) {
      kept_.erase(found);
      found = kept_.end();
    }
    if (found == kept_.end()) found = kept_.emplace(hash, Kept{type, parameters, make(), true}).first;
    found->second.is_used = true;
    return found->second.stored;
  }
  // What the request did not name goes.
  void end() {
    std::erase_if(kept_, [](const auto& kept) { return !kept.second.is_used; });
  }

 private:
  struct Kept {
    std::uint64_t type;
    std::size_t parameters;
    Stored stored;
    bool is_used;
  };
  std::map<std::uint64_t, Kept> kept_;
};

}  // namespace gravitas
