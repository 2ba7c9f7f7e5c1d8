// Where the properties of a block were written: kept in its `places` (four numbers each), so that
// checks long after reading can still point at the text.
#pragma once

#include <google/protobuf/repeated_field.h>

#include <cstdint>

#include "services/scene/problem.h"

namespace gravitas::scene {

// The place of a written property, or nowhere. The last one counts: an override comes after the
// file.
inline TextPosition find_place(int field_number, const google::protobuf::RepeatedField<std::uint32_t>& places) {
  for (int i = places.size() - 4; i >= 0; i -= 4)
    if (places[i] == static_cast<std::uint32_t>(field_number)) return {places[i + 1], places[i + 2], places[i + 3]};
  return {};
}

// The place of a property of a block's message, or that of the block where the property was not
// written.
template <typename Block>
TextPosition place_of(const Block& block, int field_number) {
  const TextPosition place = find_place(field_number, block.places());
  return place.known() ? place : place_of(block.location());
}

// Whether the author wrote the property, as against a default.
template <typename Block>
bool is_written(const Block& block, int field_number) {
  return find_place(field_number, block.places()).known();
}

}  // namespace gravitas::scene
