// Dispatch by the pair of types, and the canonical order that makes the mirror law exact: a pair is
// always computed in one order, and the other order is its answer with the normals turned round.
#include "workers/collision/standard/narrow_phase.h"

#include <utility>

#include "workers/collision/standard/composite_pairs.h"
#include "workers/collision/standard/detector_table.h"

namespace gravitas::collision {
namespace {

// -1, 0 or 1 as the first difference of x from y is positive, absent or negative: larger goes first
template <typename Vector>
int larger_first(const Vector& x, const Vector& y) {
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    if (x[i] != y[i]) return x[i] > y[i] ? -1 : 1;
  }
  return 0;
}

// Whether the pair is computed as (b, a). Between bodies of one type the larger goes first: the
// order decides ties between reference faces and enters the feature ids, so it must not change
// while the bodies move. Equal sizes leave only the poses. Then the order follows a direction that
// is unlikely to be perpendicular to the line of centres of bodies that stand or lie side by side.
bool computed_swapped(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB) {
  if (a.type != b.type) return a.type > b.type;
  if (const int order = larger_first(a.size, b.size); order != 0) return order > 0;
  const Vector3 offset = X_WB.position - X_WA.position;
  const double along = offset.dot(Vector3(0.2746, 0.8537, 0.4425));
  if (along != 0.0) return along < 0.0;
  if (const int order = larger_first(offset, Vector3(-offset)); order != 0) return order > 0;
  return larger_first(X_WA.orientation.coeffs(), X_WB.orientation.coeffs()) > 0;
}

// Bounding spheres apart by more than the margin. False comparisons make NaN and infinity "apart".
bool surely_apart(const Shape& a, const Shape& b, const Vector3& offset, double margin) {
  const double reach = (bounding_radius(a) + bounding_radius(b)) * (1.0 + 1e-12) + margin;
  if (reach == std::numeric_limits<double>::infinity()) return !offset.allFinite();
  if (!(offset.cwiseAbs().maxCoeff() <= reach)) return true;
  return !(offset.squaredNorm() <= reach * reach);
}

void collide_in_order(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB, double margin,
                      Manifold* out) {
  out->count = 0;
  const Vector3 offset = X_WB.position - X_WA.position;
  if (surely_apart(a, b, offset, margin)) return;
  const Placement placement{X_WA.orientation.toRotationMatrix(), X_WB.orientation.toRotationMatrix(), offset};
  detector(a.type, b.type)(a, b, placement, margin, out);
  for (int i = 0; i < out->count; ++i) {
    out->contacts[static_cast<std::size_t>(i)].point += X_WA.position;
  }
}

}  // namespace

void collide(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB, double margin, Manifold* out) {
  if (!computed_swapped(a, X_WA, b, X_WB)) {
    collide_in_order(a, X_WA, b, X_WB, margin, out);
    return;
  }
  collide_in_order(b, X_WB, a, X_WA, margin, out);
  for (int i = 0; i < out->count; ++i) {
    Vector3& normal = out->contacts[static_cast<std::size_t>(i)].normal;
    normal = -normal;
  }
}

void collide(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB, double margin, ContactList* out,
             const PairRests* rests) {
  out->clear();
  const bool is_composite = a.is_composite() || b.is_composite();
  if (!is_composite && rests == nullptr) {
    Manifold manifold;
    collide(a, X_WA, b, X_WB, margin, &manifold);
    for (int i = 0; i < manifold.count; ++i) out->add(manifold.contacts[static_cast<std::size_t>(i)]);
    return;
  }
  if (surely_apart(a, b, X_WB.position - X_WA.position, margin)) return;
  const bool is_swapped = computed_swapped(a, X_WA, b, X_WB);
  const Shape &first = is_swapped ? b : a, &second = is_swapped ? a : b;
  const Pose &X_W1 = is_swapped ? X_WB : X_WA, &X_W2 = is_swapped ? X_WA : X_WB;
  PairRests own;
  if (rests != nullptr) own = *rests;
  if (is_swapped) own.swap();
  if (is_composite) {
    own.origin = X_W1.position;
    collide_composite(first, {Vector3::Zero(), X_W1.orientation}, second,
                      {X_W2.position - X_W1.position, X_W2.orientation}, own, margin, out);
    out->finish(X_W1.position, is_swapped);
    return;
  }
  Manifold manifold;
  collide_in_order(first, X_W1, second, X_W2, margin, &manifold);
  lay_flush(first, X_W1, second, X_W2, own, margin, &manifold);
  for (int i = 0; i < manifold.count; ++i) {
    ContactPoint& contact = manifold.contacts[static_cast<std::size_t>(i)];
    if (is_swapped) contact.normal = -contact.normal;
    out->add(contact);
  }
}

bool intersects(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB) {
  ContactList contacts;
  collide(a, X_WA, b, X_WB, 0.0, &contacts);
  return contacts.size() > 0;
}

}  // namespace gravitas::collision
