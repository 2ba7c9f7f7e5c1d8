// What is dear to make of a shape (a hull, a mesh with its tree), kept from request to request by the hash of its
// content, so that it is made once. A cache only: what it holds can be made again from any request.
#pragma once

#include <cstdint>
#include <map>
#include <tuple>
#include <utility>
#include <vector>

namespace gravitas {

template <typename Stored>
class ShapeCache {
 public:
  // The shapes of a request follow.
  void begin() { row_ = 0; }
  // That of this content, or a new one from make(); valid until the next begin() or an exception of make().
  template <typename Make>
  const Stored& get(std::uint64_t hash, std::uint64_t type, std::size_t parameters, const Make& make) {
    const Key key{hash, type, parameters};
    // a request mostly names the shapes of the one before
    const std::size_t row = row_++;
    if (row < rows_.size() && rows_[row]->first == key) return rows_[row]->second.stored;
    is_exact_ = false;
    rows_.resize(row);
    auto found = kept_.find(key);
    if (found == kept_.end()) found = kept_.emplace(key, Kept{make()}).first;
    rows_.push_back(&*found);
    return found->second.stored;
  }
  // What the request did not name goes.
  void end() {
    if (is_exact_ && rows_.size() == row_) return;
    rows_.resize(row_);
    for (auto& [key, kept] : kept_) kept.is_used = false;
    for (Entry* const entry : rows_) entry->second.is_used = true;
    std::erase_if(kept_, [](const Entry& entry) { return !entry.second.is_used; });
    is_exact_ = true;
  }

 private:
  using Key = std::tuple<std::uint64_t, std::uint64_t, std::size_t>;  // hash, type, parameters
  struct Kept {
    Stored stored;
    bool is_used = true;
  };
  using Entry = std::pair<const Key, Kept>;

  std::map<Key, Kept> kept_;
  std::vector<Entry*> rows_;  // of the last request
  std::size_t row_ = 0;
  bool is_exact_ = true;  // every shape that is kept stands in rows_
};

}  // namespace gravitas
