#include "workers/space/dynamic_bvh/pair_finder.h"

#include <algorithm>
#include <cstring>
#include <limits>

namespace gravitas::dynamic_bvh {
namespace {

// Of the mean of a body's three extents, to each side: more makes fat boxes last longer and candidates more.
constexpr double kMargin = 0.08;
// Calls for which a fat box reaches ahead, if the body keeps its velocity.
constexpr double kCallsAhead = 10.0;
// As far as this, in extents: a body that is set elsewhere has no velocity.
constexpr double kFarthestAhead = 0.5;
// If more than this share of the bodies left their fat boxes, all that moved get new ones: finding the pairs of many costs
// little more than those of some, and the calls that follow are free of it.
constexpr std::size_t kRenewedShare = 16;
constexpr double kGrowth = 2.0;
constexpr std::uint32_t kBodiesOfProgress = 4096;

Box everything() {
  const double infinity = std::numeric_limits<double>::infinity();
  return {_mm256_set1_pd(-infinity), _mm256_set1_pd(infinity)};
}

// Bit for bit, so that a number that is none equals itself.
bool has_changed(std::span<const double> now, const std::vector<double>& before) {
  return now.size() != before.size() || (!now.empty() && std::memcmp(now.data(), before.data(), now.size_bytes()) != 0);
}

double mean_extent(const Box& box) {
  alignas(32) double lanes[4];
  _mm256_store_pd(lanes, _mm256_sub_pd(box.upper, box.lower));
  return (lanes[0] + lanes[1] + lanes[2]) / 3.0;
}

}  // namespace

void PairFinder::find(const stage::SpacePairsRequest& request, const stage::SpacePairsReply& reply, Host& host) {
  const PairRule rule(request);
  ++call_;
  const bool is_other = is_other_scene(request);
  if (is_other || has_changed(request.lower(), lower_) || has_changed(request.upper(), upper_)) {
    lower_.assign(request.lower().begin(), request.lower().end());
    upper_.assign(request.upper().begin(), request.upper().end());
    if (is_other) birth_.clear();
    if (is_other || look_for_moved(request, rule)) {
      build(request, rule);
    } else if (!moved_.empty()) {
      update(request, rule);
    }
    host.mark_progress();
    find_pairs(request, rule, host);
  }
  host.mark_progress();
  const std::span<std::uint32_t> out = reply.pair().resize(pair_end_);
  std::copy_n(pairs_.begin(), out.size(), out.begin());
}

bool PairFinder::is_other_scene(const stage::SpacePairsRequest& request) const {
  return !std::ranges::equal(request.flags(), flags_) || !std::ranges::equal(request.filter_group(), group_) ||
         !std::ranges::equal(request.filter_mask(), mask_);
}

bool PairFinder::look_for_moved(const stage::SpacePairsRequest& request, const PairRule& rule) {
  moved_.clear();
  for (std::uint32_t i = 0; i < rule.bodies(); ++i)
    if (!contains(fat_[i], box_at(request.lower(), request.upper(), i))) moved_.push_back(i);
  if (std::ranges::any_of(moved_, [&](std::uint32_t body) { return !rule.is_regular(body); })) return true;
  if (moved_.size() <= members_.size() / kRenewedShare) return false;
  moved_.clear();
  for (const std::uint32_t i : members_) {
    const Box bounds = box_at(request.lower(), request.upper(), i);
    if (!contains(birth_[i].bounds, bounds)) moved_.push_back(i);
  }
  return std::ranges::any_of(moved_, [&](std::uint32_t body) { return !rule.is_regular(body); });
}

void PairFinder::build(const stage::SpacePairsRequest& request, const PairRule& rule) {
  const std::uint32_t bodies = rule.bodies();
  flags_.assign(request.flags().begin(), request.flags().end());
  group_.assign(request.filter_group().begin(), request.filter_group().end());
  mask_.assign(request.filter_mask().begin(), request.filter_mask().end());

  members_.clear(), outsiders_.clear();
  fat_.assign(bodies, everything());
  has_moved_.assign(bodies, 0);
  double sum = 0.0;
  for (std::uint32_t i = 0; i < bodies; ++i) {
    if (!rule.has_shape(i)) continue;
    if (!rule.is_regular(i)) {
      outsiders_.push_back(i);
      continue;
    }
    members_.push_back(i);
    sum += mean_extent(box_at(request.lower(), request.upper(), i));
    // a pair has a body that can be pushed: the others need not search
    has_moved_[i] = (flags_[i] & kMovable) != 0;
  }
  mean_extent_ = members_.empty() ? 0.0 : sum / static_cast<double>(members_.size());
  birth_.resize(bodies);
  for (const std::uint32_t i : members_) fat_[i] = fat_box(i, box_at(request.lower(), request.upper(), i));

  tree_.build(members_, fat_, has_moved_);
  edges_at_build_ = tree_.edges();
  find_candidates(rule);
  begin_.assign(bodies + std::size_t{1}, 0);
  partner_.clear();
  merge_found();
}

void PairFinder::update(const stage::SpacePairsRequest& request, const PairRule& rule) {
  has_moved_.assign(rule.bodies(), 0);
  for (const std::uint32_t i : moved_) {
    fat_[i] = fat_box(i, box_at(request.lower(), request.upper(), i));
    has_moved_[i] = 1;
    tree_.move(i, fat_[i]);
  }
  tree_.refit();
  if (tree_.edges() > kGrowth * edges_at_build_) {
    build(request, rule);
    return;
  }
  find_candidates(rule);
  merge_found();
}

Box PairFinder::fat_box(std::uint32_t body, const Box& bounds) {
  const double extent = mean_extent(bounds);
  const __m256d margin = _mm256_set1_pd(kMargin * extent), zero = _mm256_setzero_pd();
  Box fat = {_mm256_sub_pd(bounds.lower, margin), _mm256_add_pd(bounds.upper, margin)};
  Birth& birth = birth_[body];
  if (birth.call > 0 && birth.call < call_) {
    const __m256d ahead = _mm256_set1_pd(kCallsAhead / static_cast<double>(call_ - birth.call));
    const __m256d farthest = _mm256_set1_pd(kFarthestAhead * std::max(extent, mean_extent_));
    __m256d motion = _mm256_mul_pd(ahead, _mm256_sub_pd(bounds.lower, birth.bounds.lower));
    motion = _mm256_max_pd(_mm256_min_pd(motion, farthest), _mm256_sub_pd(zero, farthest));
    fat.lower = _mm256_add_pd(fat.lower, _mm256_min_pd(motion, zero));
    fat.upper = _mm256_add_pd(fat.upper, _mm256_max_pd(motion, zero));
  }
  birth = {bounds, call_};
  // the fourth lane takes no part
  fat.lower = _mm256_blend_pd(fat.lower, zero, 0x8);
  fat.upper = _mm256_blend_pd(fat.upper, zero, 0x8);
  return fat;
}

void PairFinder::find_candidates(const PairRule& rule) {
  found_.clear();
  tree_.visit_marked_pairs([&](std::uint32_t a, std::uint32_t b) {
    if (rule.may_touch(a, b)) found_.add(a, b);
  });
  found_.sort(rule.bodies());
}

void PairFinder::merge_found() {
  const auto bodies = static_cast<std::uint32_t>(has_moved_.size());
  next_begin_.resize(bodies + std::size_t{1});
  next_partner_.resize(partner_.size() + found_.size());
  std::uint32_t* const out = next_partner_.data();
  std::uint64_t k = 0;
  for (std::uint32_t a = 0; a < bodies; ++a) {
    next_begin_[a] = k;
    std::uint64_t i = has_moved_[a] != 0 ? begin_[a + 1] : begin_[a];
    for (const std::uint32_t b : found_.partners(a)) {
      for (; i < begin_[a + 1] && partner_[i] < b; ++i) {
        out[k] = partner_[i];
        k += has_moved_[partner_[i]] == 0;
      }
      out[k++] = b;
    }
    for (; i < begin_[a + 1]; ++i) {
      out[k] = partner_[i];
      k += has_moved_[partner_[i]] == 0;
    }
  }
  next_begin_[bodies] = k;
  next_partner_.resize(k);
  begin_.swap(next_begin_);
  partner_.swap(next_partner_);
}

void PairFinder::find_pairs(const stage::SpacePairsRequest& request, const PairRule& rule, Host& host) {
  const std::uint32_t bodies = rule.bodies();
  std::size_t k = 0;
  std::size_t next = 0;  // of the outsiders
  for (std::uint32_t a = 0; a < bodies; ++a) {
    if (a % kBodiesOfProgress == 0) host.mark_progress();
    const bool is_outsider = next < outsiders_.size() && outsiders_[next] == a;
    next += is_outsider ? 1 : 0;
    const std::size_t most = is_outsider ? bodies - a : begin_[a + 1] - begin_[a] + outsiders_.size() - next;
    if (pairs_.size() < k + 2 * most) pairs_.resize(2 * (k + 2 * most));
    if (is_outsider) {
      for (std::uint32_t b = a + 1; b < bodies; ++b)
        if (rule(a, b)) pairs_[k++] = a, pairs_[k++] = b;
      continue;
    }
    // both lists ascend: candidates between two outsiders, then the outsider
    const Box box = box_at(request.lower(), request.upper(), a);
    std::uint64_t i = begin_[a];
    for (std::size_t o = next; o <= outsiders_.size(); ++o) {
      const std::uint32_t limit = o < outsiders_.size() ? outsiders_[o] : bodies;
      for (; i < begin_[a + 1] && partner_[i] < limit; ++i) {
        const std::uint32_t b = partner_[i];
        pairs_[k] = a, pairs_[k + 1] = b;
        k += overlap(box, box_at(request.lower(), request.upper(), b)) ? 2 : 0;
      }
      if (limit < bodies && rule(a, limit)) pairs_[k++] = a, pairs_[k++] = limit;
    }
  }
  pair_end_ = k;
}

}  // namespace gravitas::dynamic_bvh
