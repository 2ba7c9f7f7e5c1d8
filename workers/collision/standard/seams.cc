#include "workers/collision/standard/seams.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "plugin_sdk/geometry/support_map_buffer.h"
#include "workers/collision/standard/narrow_phase.h"
#include "workers/collision/standard/pair_functions.h"

namespace gravitas::collision {
namespace {

constexpr double kFlat = 1e-4;  // sine of an angle wider than that of Rest::is_along()

// A convex shape where it lies.
struct PlacedMap {
  const SupportMap& map;
  Matrix3 R;
  Vector3 p;
  Vector3 front = Vector3::Zero();  // unit: of a triangle, to where contacts lead out of its mesh; zero: none

  bool is_triangle() const { return !front.isZero(0.0); }
  Vector3 farthest(const Vector3& n) const { return p + R * map.support(R.transpose() * n) + map.rounding() * n; }
};

// Of the rests of `body` whose planes `other` does not stand above, of a solid those along a flat face of it, the normal of the one
// that leads out the shortest way; zero if there is none.
// `part`: of the other's body, in the pair that is looked at.
Vector3 flush_direction(std::span<const Rest> rests, std::size_t pair, std::uint64_t part, const PlacedMap& body,
                        const PlacedMap& other, const Vector3& origin, const Vector3& normal, double flush) {
  const bool is_of_mesh = body.is_triangle() || other.is_triangle();
  Vector3 best = Vector3::Zero();
  double least = std::numeric_limits<double>::infinity();
  gravitas::Contour face;
  for (const Rest& rest : rests) {
    // triangles that are looked at without those around them know nothing of each other
    if (is_of_mesh && rest.pair == pair && rest.part == part) continue;
    if (rest.is_along(normal)) continue;
    Rest level = rest;
    other.map.contour(other.R.transpose() * rest.normal, kFlat, &face);
    const bool has_face = face.is_face() && rest.is_along(other.R * face.normal);
    // a solid without one, as a post under what rolls over it, is a body by itself
    if (!has_face && !other.is_triangle()) continue;
    if (has_face) level.normal = other.R * face.normal;
    if (level.is_along(normal) || level.normal.dot(other.front) < -kFlat) continue;
    const double top = level.height(origin + other.farthest(level.normal));
    const double bottom = level.height(origin + body.farthest(-level.normal));
    if (top > flush || bottom < level.lowest() - flush || !(top - bottom < least)) continue;
    best = level.normal, least = top - bottom;
  }
  return best;
}

// May lay_flush() find something, by the contacts of the pair alone?
bool may_be_flush(std::span<const Rest> rests, const ContactList& contacts, double side, double flush, double margin) {
  for (const Rest& rest : rests)
    for (std::size_t k = 0; k < contacts.size(); ++k) {
      const ContactPoint& contact = contacts[k];
      if (rest.is_along(side * contact.normal)) continue;
      // where an edge is about to touch a side, it may be told at the middle of either
      if (std::fabs(contact.depth) <= flush) return true;
      const double height = rest.height(contact.point);
      const double slack = flush + margin + kFlat * (contact.point - rest.point).norm();
      if (height <= slack && height >= rest.lowest() - slack) return true;
    }
  return false;
}

// The normal from a to b to take instead of this one, of either's rests; zero if there is none.
Vector3 flush_normal(const PlacedMap& a, const PlacedMap& b, const PairRests& rests, const Vector3& normal,
                     double flush) {
  const Vector3 along = -flush_direction(rests.of_a, rests.pair, rests.parts.of_b, a, b, rests.origin, -normal, flush);
  if (!along.isZero(0.0)) return along;
  return flush_direction(rests.of_b, rests.pair, rests.parts.of_a, b, a, rests.origin, normal, flush);
}

}  // namespace

double flush_length(const Shape& a, const Shape& b) {
  return 1e-6 * std::min(smallest_half_extent(a), smallest_half_extent(b));
}

Vector3 flush_normal(const PlacedPair& pair, const Fronts& fronts, const Vector3& normal, const Pose& X_FA,
                     const PairRests& rests, double flush) {
  if (rests.are_none()) return Vector3::Zero();
  const Matrix3 R_FA = X_FA.orientation.toRotationMatrix();
  const PlacedMap a{pair.a, R_FA, X_FA.position, R_FA * fronts.of_a};
  const PlacedMap b{pair.b, R_FA * pair.R_AB, X_FA.position + R_FA * pair.p_AB, R_FA * fronts.of_b};
  return R_FA.transpose() * flush_normal(a, b, rests, R_FA * normal, flush);
}

void lay_flush(const PlacedPair& pair, const Fronts& fronts, const Pose& X_FA, const PairRests& rests, double flush,
               double margin, Manifold* manifold) {
  if (manifold->count == 0) return;
  const Vector3 along = flush_normal(pair, fronts, manifold->contacts[0].normal, X_FA, rests, flush);
  if (!along.isZero(0.0)) contacts_along(pair, along, margin, nullptr, manifold);
}

void lay_flush(const Shape& a, const Pose& X_FA, const Shape& b, const Pose& X_FB, const PairRests& rests,
               double margin, Manifold* manifold) {
  if (rests.are_none() || manifold->count == 0 || a.type == ShapeType::kHalfspace || b.type == ShapeType::kHalfspace)
    return;
  SupportMapBuffer buffer_a, buffer_b;
  const PlacedMap placed_a{support_map_of(a, &buffer_a), X_FA.orientation.toRotationMatrix(), X_FA.position};
  const PlacedMap placed_b{support_map_of(b, &buffer_b), X_FB.orientation.toRotationMatrix(), X_FB.position};
  const Vector3 along = flush_normal(placed_a, placed_b, rests, manifold->contacts[0].normal, flush_length(a, b));
  if (along.isZero(0.0)) return;
  const Matrix3 R_AF = placed_a.R.transpose();
  const PlacedPair pair{placed_a.map, placed_b.map, R_AF * placed_b.R, R_AF * (placed_b.p - placed_a.p)};
  contacts_along(pair, R_AF * along, margin, nullptr, manifold);
  for (int i = 0; i < manifold->count; ++i) {
    ContactPoint& contact = manifold->contacts[static_cast<std::size_t>(i)];
    contact.point = placed_a.p + placed_a.R * contact.point;
    contact.normal = along;
  }
}

void Seams::add_rest(std::uint32_t body, const Rest& rest, double same_height) {
  std::uint32_t& count = count_[body];
  Rest* const own = &rests_[begin_[body]];
  for (std::uint32_t i = 0; i < count; ++i) {
    if (!own[i].is_along(rest.normal) || std::fabs(own[i].height(rest.point)) > same_height) continue;
    own[i].depth = std::max(own[i].depth, rest.depth);
    if (own[i].pair != rest.pair || own[i].part != rest.part) own[i].pair = Rest::kSeveral;
    return;
  }
  if (count < kMostRests) own[count++] = rest;
}

void Seams::find_rests(std::span<const std::uint32_t> pair, std::span<const ContactList> contacts, std::size_t bodies,
                       double margin) {
  constexpr double kSameHeight = 1e-5;  // of the margin
  count_.assign(bodies, 0);
  for (std::size_t i = 0; i < contacts.size(); ++i)
    for (const std::uint32_t body : pair.subspan(2 * i, 2))
      count_[body] += static_cast<std::uint32_t>(contacts[i].size());
  begin_.resize(bodies);
  std::uint32_t end = 0;
  for (std::size_t i = 0; i < bodies; ++i) begin_[i] = end, end += std::min(std::exchange(count_[i], 0), kMostRests);
  rests_.resize(end);
  for (std::size_t i = 0; i < contacts.size(); ++i)
    for (std::size_t k = 0; k < contacts[i].size(); ++k) {
      const ContactPoint& contact = contacts[i][k];
      const Vector3 to_surface = 0.5 * contact.depth * contact.normal;
      const Parts& parts = contacts[i].parts(k);
      add_rest(pair[2 * i], {-contact.normal, contact.point - to_surface, contact.depth, i, parts.of_b},
               kSameHeight * margin);
      add_rest(pair[2 * i + 1], {contact.normal, contact.point + to_surface, contact.depth, i, parts.of_a},
               kSameHeight * margin);
    }
}

void Seams::mend(std::span<const Shape> shapes, const BodyColumns& bodies, std::span<const std::uint32_t> pair,
                 double margin, std::span<ContactList> contacts) {
  find_rests(pair, contacts, bodies.body_shape.size(), margin);
  // lists keep their room from call to call
  std::size_t mended = 0;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    if (contacts[i].size() == 0) continue;
    const std::uint32_t a = pair[2 * i], b = pair[2 * i + 1];
    const Shape &shape_a = shapes[bodies.body_shape[a]], &shape_b = shapes[bodies.body_shape[b]];
    const PairRests rests{.of_a = rests_of(a), .of_b = rests_of(b), .pair = i};
    const double flush = flush_length(shape_a, shape_b);
    if (!may_be_flush(rests.of_a, contacts[i], -1.0, flush, margin) &&
        !may_be_flush(rests.of_b, contacts[i], 1.0, flush, margin))
      continue;
    if (mended == mended_.size()) mended_.emplace_back();
    auto& [place, list] = mended_[mended++];
    place = i;
    collide(shape_a, bodies.placed(a), shape_b, bodies.placed(b), margin, &list, &rests);
  }
  for (std::size_t k = 0; k < mended; ++k) std::swap(contacts[mended_[k].first], mended_[k].second);
}

}  // namespace gravitas::collision
