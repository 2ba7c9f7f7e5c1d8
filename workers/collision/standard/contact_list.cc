#include "workers/collision/standard/contact_list.h"

#include <algorithm>
#include <array>
#include <limits>
#include <tuple>

#include "plugin_sdk/geometry/contact_candidates.h"

namespace gravitas::collision {
namespace {

constexpr double kOneNormal = 0.99996;  // cosine of half a degree
// Of the merge distance: depths that differ by less do not decide which points are kept.
constexpr double kDepthTie = 1e3;

}  // namespace

void ContactList::clear() {
  collected_.clear();
  contacts_.clear();
  merge_distance_ = 0.0;
}

double ContactList::deepest() const {
  double depth = -std::numeric_limits<double>::infinity();
  for (const Answered& answered : contacts_) depth = std::max(depth, answered.contact.depth);
  return depth;
}

void ContactList::collect(std::uint64_t key, const Parts& parts, const ContactPoint& contact, double merge_distance) {
  merge_distance_ = std::max(merge_distance_, merge_distance);
  collected_.push_back({key_of_part(key, contact.feature), 0, contact, parts});
}

void ContactList::collect_on_face(std::uint64_t key, const Parts& parts, const ContactPoint& contact,
                                  double merge_distance) {
  constexpr int kBits = 15;
  merge_distance_ = std::max(merge_distance_, merge_distance);
  const std::uint64_t name = key_of_part(key, 0) >> (32 + kBits) << kBits | (contact.feature & ((1U << kBits) - 1U));
  collected_.push_back({name << 32, 0, contact, parts});
}

std::size_t ContactList::at_rim() const {
  Vector3 middle = Vector3::Zero();
  double deepest = -std::numeric_limits<double>::infinity();
  for (const ContactPoint& contact : group_) {
    middle += contact.point / static_cast<double>(group_.size());
    deepest = std::max(deepest, contact.depth);
  }
  std::size_t first = 0;
  double farthest = -1.0;
  for (std::size_t i = 0; i < group_.size(); ++i) {
    const double off = (group_[i].point - middle).squaredNorm();
    // the first of those that are equally far, but for rounding
    if (group_[i].depth < deepest - kDepthTie * merge_distance_ || !(off > farthest * (1.0 + 1e-9))) continue;
    first = i, farthest = off;
  }
  return first;
}

void ContactList::finish(const Vector3& origin, bool is_swapped) {
  // groups of one normal, in the order of the deepest first so that they do not depend on the order of the parts
  std::sort(collected_.begin(), collected_.end(), [](const Collected& x, const Collected& y) {
    if (x.contact.depth != y.contact.depth) return x.contact.depth > y.contact.depth;
    return x.key < y.key;
  });
  normals_.clear();
  for (Collected& one : collected_) {
    one.group = 0;
    while (one.group < normals_.size() && !(normals_[one.group].dot(one.contact.normal) >= kOneNormal)) ++one.group;
    if (one.group == normals_.size()) normals_.push_back(one.contact.normal);
  }
  std::sort(collected_.begin(), collected_.end(),
            [](const Collected& x, const Collected& y) { return std::tie(x.group, x.key) < std::tie(y.group, y.key); });
  contacts_.clear();
  for (std::size_t i = 0; i < collected_.size();) {
    group_.clear();
    Collected* const begin = &collected_[i];
    const std::uint32_t group = collected_[i].group;
    for (; i < collected_.size() && collected_[i].group == group; ++i) {
      ContactPoint& contact = group_.emplace_back(collected_[i].contact);
      contact.feature = static_cast<std::uint32_t>(collected_[i].key >> 32);
    }
    const std::size_t first = at_rim();
    std::swap(group_[0], group_[first]);
    std::swap(begin[0], begin[first]);
    std::array<int, kManifoldCapacity> chosen{};
    const int count = choose_extremes(group_, kDepthTie * merge_distance_, merge_distance_, &chosen);
    for (int k = 0; k < count; ++k) {
      const auto one = static_cast<std::size_t>(chosen[static_cast<std::size_t>(k)]);
      contacts_.push_back({group_[one], begin[one].parts});
    }
  }
  std::sort(contacts_.begin(), contacts_.end(), [](const Answered& p, const Answered& q) {
    const ContactPoint &x = p.contact, &y = q.contact;
    return std::tie(x.feature, x.depth, x.point.x(), x.point.y(), x.point.z()) <
           std::tie(y.feature, y.depth, y.point.x(), y.point.y(), y.point.z());
  });
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    ContactPoint& contact = contacts_[i].contact;
    const std::uint32_t before = i > 0 ? contacts_[i - 1].contact.feature : 0;
    if (i > 0 && contact.feature <= before) contact.feature = before + 1;
    contact.point += origin;
    if (!is_swapped) continue;
    contact.normal = -contact.normal;
    contacts_[i].parts.swap();
  }
}

}  // namespace gravitas::collision
