#include "plugin_sdk/solver/island_request.h"

#include <algorithm>
#include <cstring>
#include <span>
#include <string_view>

namespace gravitas {
namespace {

using Request = stage::SolverSolveRequest;

std::size_t bytes_of_row(const stage::ColumnInfo& info) {
  return info.components * (info.type == stage::ElementType::kU32 ? sizeof(std::uint32_t) : sizeof(std::uint64_t));
}

// `width` numbers a row.
void put_rows(const std::vector<double>& part, std::size_t width, const std::vector<std::uint32_t>& rows,
              std::vector<double>* whole) {
  for (std::size_t i = 0; i < rows.size(); ++i) std::copy_n(&part[width * i], width, &(*whole)[width * rows[i]]);
}

}  // namespace

void IslandRequest::load(const Request& whole, const SolverBodies& bodies, const Island& island) {
  island_ = &island;
  bodies_ = island.bodies;
  const auto add_fixed = [&](std::span<const std::uint32_t> pairs, const std::vector<std::uint32_t>& rows) {
    for (const std::uint32_t row : rows)
      for (const std::uint32_t body : {pairs[2 * row], pairs[2 * row + 1]})
        if (body != kNone && !bodies[body].is_pushed()) bodies_.push_back(body);
  };
  add_fixed(whole.discrepancy_body(), island.discrepancies);
  add_fixed(whole.contact_body(), island.contacts);
  std::ranges::sort(bodies_);
  bodies_.erase(std::unique(bodies_.begin(), bodies_.end()), bodies_.end());

  const std::span<const stage::ColumnInfo> infos = stage::method_info(stage::Method::kSolverSolve).request;
  for (std::size_t column = 0; column < kColumns; ++column) {
    const stage::ColumnInfo& info = infos[column];
    const gravitas_column& from = whole.plain()[column];
    if (info.rows_index == stage::kScalar) {
      columns_[column] = from;
      continue;
    }
    const std::string_view of = info.rows;
    const std::vector<std::uint32_t>& rows = of == "body"      ? bodies_
                                             : of == "contact" ? island.contacts
                                                               : island.discrepancies;
    const std::size_t size = bytes_of_row(info);
    memory_[column].resize((size * rows.size() + 7) / 8);
    auto* to = reinterpret_cast<std::byte*>(memory_[column].data());
    for (std::size_t i = 0; i < rows.size(); ++i)
      std::memcpy(to + size * i, static_cast<const std::byte*>(from.data) + size * rows[i], size);
    columns_[column] = {to, info.components * rows.size()};
  }
  renumber(Request::kDiscrepancyBody);
  renumber(Request::kContactBody);
}

void IslandRequest::renumber(std::size_t column) {
  auto* numbers = reinterpret_cast<std::uint32_t*>(memory_[column].data());
  for (std::uint32_t& body : std::span(numbers, columns_[column].count))
    if (body != kNone) body = static_cast<std::uint32_t>(std::ranges::lower_bound(bodies_, body) - bodies_.begin());
}

void IslandRequest::store(const SolverSolution& part, SolverSolution* whole) const {
  std::size_t next = 0;
  for (std::size_t i = 0; i < bodies_.size() && next < island_->bodies.size(); ++i) {
    if (bodies_[i] != island_->bodies[next]) continue;
    ++next;
    whole->velocity[bodies_[i]] = part.velocity[i];
    whole->displacement[bodies_[i]] = part.displacement[i];
  }
  put_rows(part.joint_impulse, 3, island_->discrepancies, &whole->joint_impulse);
  put_rows(part.joint_correction, 3, island_->discrepancies, &whole->joint_correction);
  put_rows(part.contact_impulse, 3, island_->contacts, &whole->contact_impulse);
  put_rows(part.contact_turning, 3, island_->contacts, &whole->contact_turning);
  put_rows(part.contact_correction, 1, island_->contacts, &whole->contact_correction);
  put_rows(part.contact_direction, 3, island_->contacts, &whole->contact_direction);
}

}  // namespace gravitas
