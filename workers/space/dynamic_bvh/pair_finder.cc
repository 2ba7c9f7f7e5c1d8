#include "workers/space/dynamic_bvh/pair_finder.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <numeric>

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
// Compared at once, before each of them is.
constexpr std::size_t kBodiesOfComparison = 16;

Box everything() {
  const double infinity = std::numeric_limits<double>::infinity();
  return {_mm256_set1_pd(-infinity), _mm256_set1_pd(infinity)};
}

// Bodies [begin, end), bit for bit, so that a number that is none equals itself.
bool are_equal(std::span<const double> now, const std::vector<double>& before, std::size_t begin, std::size_t end) {
  return std::memcmp(&now[3 * begin], &before[3 * begin], 3 * (end - begin) * sizeof(double)) == 0;
}

std::uint32_t partner_of(std::uint64_t candidate) { return static_cast<std::uint32_t>(candidate >> 32); }

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
  if (is_other) {
    lower_.assign(request.lower().begin(), request.lower().end());
    upper_.assign(request.upper().begin(), request.upper().end());
    birth_.clear();
  }
  if (is_other || take_bounds(request)) {
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

bool PairFinder::take_bounds(const stage::SpacePairsRequest& request) {
  const std::span<const double> lower = request.lower(), upper = request.upper();
  const std::size_t bodies = flags_.size();
  for (const std::uint32_t i : changed_bodies_) state_[i] &= kFresh;
  changed_bodies_.clear();
  for (std::size_t begin = 0; begin < bodies; begin += kBodiesOfComparison) {
    const std::size_t end = std::min(begin + kBodiesOfComparison, bodies);
    if (are_equal(lower, lower_, begin, end) && are_equal(upper, upper_, begin, end)) continue;
    for (std::size_t i = begin; i < end; ++i) {
      if (are_equal(lower, lower_, i, i + 1) && are_equal(upper, upper_, i, i + 1)) continue;
      std::copy_n(&lower[3 * i], 3, &lower_[3 * i]);
      std::copy_n(&upper[3 * i], 3, &upper_[3 * i]);
      note_change(static_cast<std::uint32_t>(i));
    }
  }
  return !changed_bodies_.empty();
}

void PairFinder::note_change(std::uint32_t body) {
  if ((state_[body] & kChanged) == 0) changed_bodies_.push_back(body);
  state_[body] |= kChanged;
}

bool PairFinder::look_for_moved(const stage::SpacePairsRequest& request, const PairRule& rule) {
  moved_.clear();
  for (const std::uint32_t i : changed_bodies_)
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
  changed_bodies_.resize(bodies);
  std::iota(changed_bodies_.begin(), changed_bodies_.end(), 0U);
  state_.assign(bodies, kChanged);
  fresh_bodies_.clear(), fresh_.clear();
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
  candidate_.clear();
  overlaps_.clear();
  merge_found();
}

void PairFinder::update(const stage::SpacePairsRequest& request, const PairRule& rule) {
  has_moved_.assign(rule.bodies(), 0);
  for (const std::uint32_t i : moved_) {
    fat_[i] = fat_box(i, box_at(request.lower(), request.upper(), i));
    has_moved_[i] = 1;
    if ((state_[i] & kFresh) == 0) fresh_bodies_.push_back(i);
    state_[i] |= kFresh;
  }
  const bool is_merging = fresh_bodies_.size() > members_.size() / kRenewedShare;
  if (is_merging) {
    for (const std::uint32_t i : fresh_bodies_) tree_.set(i, fat_[i]), tree_.mark(i);
    tree_.refit();
  } else {
    for (const std::uint32_t i : moved_) tree_.move(i, fat_[i]);
  }
  if (tree_.edges() > kGrowth * edges_at_build_) {
    build(request, rule);
    return;
  }
  if (!is_merging) {
    find_fresh(rule);
    return;
  }
  for (const std::uint32_t i : fresh_bodies_) {
    has_moved_[i] = 1;
    state_[i] &= kChanged;
    note_change(i);  // it may stand still now: its candidates are new
  }
  fresh_bodies_.clear(), fresh_.clear();
  find_candidates(rule);
  merge_found();
}

// Candidates of those that moved.
void PairFinder::find_fresh(const PairRule& rule) {
  const auto has_moved = [&](std::uint64_t pair) {
    return (has_moved_[pair >> 32] | has_moved_[pair & 0xFFFFFFFF]) != 0;
  };
  std::erase_if(fresh_, has_moved);
  const auto old = static_cast<std::ptrdiff_t>(fresh_.size());
  for (const std::uint32_t m : moved_) {
    const Box& box = fat_[m];
    tree_.visit_met([&](const Box& node) { return overlap(node, box); },
                    [&](std::uint32_t other) {
                      if (other == m || (has_moved_[other] != 0 && other < m) || !overlap(fat_[other], box)) return;
                      const auto [a, b] = std::minmax(other, m);
                      if (rule.may_touch(a, b)) fresh_.push_back(std::uint64_t{a} << 32 | b);
                    });
  }
  std::sort(fresh_.begin() + old, fresh_.end());
  std::inplace_merge(fresh_.begin(), fresh_.begin() + old, fresh_.end());
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
  next_candidate_.resize(candidate_.size() + found_.size());
  next_overlaps_.resize(next_candidate_.size());
  std::uint64_t k = 0;
  std::uint64_t* const candidate = next_candidate_.data();
  std::uint8_t* const overlaps = next_overlaps_.data();
  const auto keep = [&, old_candidate = candidate_.data(), old_overlaps = overlaps_.data(),
                     has_moved = has_moved_.data()](std::uint64_t i) {
    candidate[k] = old_candidate[i];
    overlaps[k] = old_overlaps[i];
    k += has_moved[partner_of(old_candidate[i])] == 0;
  };
  for (std::uint32_t a = 0; a < bodies; ++a) {
    next_begin_[a] = k;
    std::uint64_t i = has_moved_[a] != 0 ? begin_[a + 1] : begin_[a];
    for (const std::uint32_t b : found_.partners(a)) {
      for (; i < begin_[a + 1] && partner_of(candidate_[i]) < b; ++i) keep(i);
      candidate[k++] = a | std::uint64_t{b} << 32;
    }
    for (; i < begin_[a + 1]; ++i) keep(i);
  }
  next_begin_[bodies] = k;
  next_candidate_.resize(k);
  next_overlaps_.resize(k);
  begin_.swap(next_begin_);
  candidate_.swap(next_candidate_);
  overlaps_.swap(next_overlaps_);
}

void PairFinder::add_pairs(const stage::SpacePairsRequest& request, std::uint64_t i, std::uint64_t end) {
  const std::uint8_t* const state = state_.data();
  const std::uint64_t* const candidate = candidate_.data();
  std::uint8_t* const overlaps = overlaps_.data();
  std::uint32_t* const out = pairs_.data();
  std::size_t k = pair_end_;
  for (; i < end; ++i) {
    const std::uint32_t a = static_cast<std::uint32_t>(candidate[i]), b = partner_of(candidate[i]);
    if (const int now = state[a] | state[b]; now != 0)
      overlaps[i] = (now & kFresh) == 0 && overlap(box_at(request.lower(), request.upper(), a),
                                                   box_at(request.lower(), request.upper(), b))
                        ? 1
                        : 0;
    std::memcpy(out + k, &candidate[i], sizeof candidate[i]);
    k += 2 * std::size_t{overlaps[i]};
  }
  pair_end_ = k;
}

void PairFinder::find_pairs(const stage::SpacePairsRequest& request, const PairRule& rule, Host& host) {
  const std::uint32_t bodies = rule.bodies();
  std::size_t next = 0, fresh = 0;  // of the outsiders, of fresh_
  const auto add = [&](std::uint32_t a, std::uint32_t b) {
    pairs_[pair_end_] = a, pairs_[pair_end_ + 1] = b;
    pair_end_ += 2;
  };
  pair_end_ = 0;
  for (std::uint32_t a = 0; a < bodies;) {
    if (a % kBodiesOfProgress == 0) host.mark_progress();
    // candidates alone, up to the next outsider, or body with fresh candidates
    std::uint32_t end = std::min(bodies, a + kBodiesOfProgress);
    if (next < outsiders_.size()) end = a;
    if (fresh < fresh_.size()) end = std::min(end, static_cast<std::uint32_t>(fresh_[fresh] >> 32));
    if (end > a) {
      make_room(begin_[end] - begin_[a]);
      add_pairs(request, begin_[a], begin_[end]);
      host.mark_progress();
      a = end;
      continue;
    }
    if (next < outsiders_.size() && outsiders_[next] == a) {
      ++next;
      make_room(bodies - a);
      for (std::uint32_t b = a + 1; b < bodies; ++b)
        if (rule(a, b)) add(a, b);
      ++a;
      continue;
    }
    // three lists ascend: candidates up to the next outsider or fresh candidate, then that one
    std::size_t fresh_end = fresh;
    while (fresh_end < fresh_.size() && fresh_[fresh_end] >> 32 == a) ++fresh_end;
    make_room(begin_[a + 1] - begin_[a] + outsiders_.size() - next + fresh_end - fresh);
    const Box box = box_at(request.lower(), request.upper(), a);
    std::uint64_t i = begin_[a];
    for (std::size_t o = next;;) {
      const std::uint32_t outsider = o < outsiders_.size() ? outsiders_[o] : bodies;
      const std::uint32_t new_one = fresh < fresh_end ? static_cast<std::uint32_t>(fresh_[fresh]) : bodies;
      const std::uint32_t limit = std::min(outsider, new_one);
      const std::uint64_t begin = i;
      while (i < begin_[a + 1] && partner_of(candidate_[i]) < limit) ++i;
      add_pairs(request, begin, i);
      if (limit == bodies) break;
      if (limit == outsider ? rule(a, limit) : overlap(box, box_at(request.lower(), request.upper(), limit)))
        add(a, limit);
      (limit == outsider ? o : fresh) += 1;
    }
    ++a;
  }
}

// For so many pairs more.
void PairFinder::make_room(std::size_t pairs) {
  const std::size_t wanted = pair_end_ + 2 * pairs;
  if (pairs_.size() < wanted) pairs_.resize(2 * wanted);
}

}  // namespace gravitas::dynamic_bvh
