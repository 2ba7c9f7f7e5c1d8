// Space `SweepAndPrune` (§ 4.6): bodies sorted by the lower end of their bounds along an axis are swept, each tested
// against those that begin before it ends.
//
//   axis  ->   |---a---|        a is tested against b and c; b against c and d; …
//                 |---b-----|
//                     |--c--|
//                          |--d--|
//
// The sweep goes along that of the first `Axes` axes on which the centres vary most (Ericson, Real-Time Collision
// Detection, 2005, § 7.5). The order along each axis is kept from call to call and brought up to date by insertion,
// which is O(n) while bodies keep their neighbours; after kMovesPerBody * n moves it is sorted anew.
//
// Cost: O(n + k) where k counts the bounds that overlap along the axis, O(n log n + k) after jumps. For bodies evenly
// spread in space k grows as n^(5/3), in a layer as n^(3/2), in a row as n.
#include "plugin_sdk/plugin.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "plugin_sdk/pair_rule.h"
#include "plugin_sdk/ray_rule.h"
#include "plugin_sdk/space.h"

namespace gravitas {
namespace {

// Sorting anew costs about as much as this many moves of each body.
constexpr std::size_t kMovesPerBody = 8;

class SweepAndPruneSpace final : public SpacePlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "SweepAndPrune",
            .version = "1.0",
            .slot = Slot::kSpace,
            .meaning = "Bodies sorted along an axis: for those that are spread along one, or few.",
            .capabilities = {"rays"},
            .properties = {Property::integer("Axes").at_least(1).at_most(3).defaults_to({3}).means(
                "How many of x, y, z it may sweep along: in each call the one of these along which bodies spread "
                "most.")}};
  }
  explicit SweepAndPruneSpace(PropertyCursor settings) : axes_(static_cast<std::size_t>(settings.integer())) {}

  void pairs(const stage::SpacePairsRequest& request, const stage::SpacePairsReply& reply, Host& host) override {
    const PairRule rule(request);
    sort_bodies(rule);
    const std::size_t axis = best_axis(request);
    std::vector<std::uint32_t>& order = order_[axis];
    bring_in_order(request, axis, &order);
    host.mark_progress();

    found_.clear();
    sweep(request, rule, axis, order, host);
    test_against_all(outsiders_, rule, &found_);
    host.mark_progress();
    found_.sort(rule.bodies());
    found_.write(reply.pair());
  }

  void rays(const stage::SpaceRaysRequest& request, const stage::SpaceRaysReply& reply, Host& host) override {
    test_rays_against_all(request, reply, host);
  }

 private:
  struct Interval {
    double lower, upper;
  };

  // Into those to sweep and those to test against all.
  void sort_bodies(const PairRule& rule) {
    members_.clear(), outsiders_.clear();
    for (std::uint32_t i = 0; i < rule.bodies(); ++i)
      if (rule.has_shape(i)) (rule.is_regular(i) ? members_ : outsiders_).push_back(i);
  }

  std::size_t best_axis(const stage::SpacePairsRequest& request) const {
    std::size_t best = 0;
    double largest = -1.0;
    for (std::size_t k = 0; k < axes_; ++k) {
      const auto centre = [&](std::uint32_t i) {
        return 0.5 * request.lower()[3 * i + k] + 0.5 * request.upper()[3 * i + k];
      };
      double mean = 0.0, variance = 0.0;
      for (const std::uint32_t i : members_) mean += centre(i) / static_cast<double>(members_.size());
      for (const std::uint32_t i : members_) variance += (centre(i) - mean) * (centre(i) - mean);
      if (variance > largest) best = k, largest = variance;
    }
    return best;
  }

  // Makes `order` the members by their lower bounds, out of what it was.
  void bring_in_order(const stage::SpacePairsRequest& request, std::size_t axis, std::vector<std::uint32_t>* order) {
    // the order of other members is of no use
    is_member_.assign(request.flags().size(), 0);
    for (const std::uint32_t i : members_) is_member_[i] = 1;
    std::erase_if(*order, [&](std::uint32_t i) { return i >= is_member_.size() || is_member_[i] == 0; });
    if (order->size() != members_.size()) *order = members_;

    const auto lower = [&](std::uint32_t i) { return request.lower()[3 * i + axis]; };
    std::size_t moves_left = kMovesPerBody * order->size();
    for (std::size_t i = 1; i < order->size(); ++i) {
      const std::uint32_t body = (*order)[i];
      const double value = lower(body);
      std::size_t k = i;
      while (k > 0 && lower((*order)[k - 1]) > value && moves_left > 0) {
        (*order)[k] = (*order)[k - 1];
        --k, --moves_left;
      }
      (*order)[k] = body;
      if (moves_left == 0) {
        std::ranges::sort(*order, {}, lower);
        return;
      }
    }
  }

  void sweep(const stage::SpacePairsRequest& request, const PairRule& rule, std::size_t axis,
             const std::vector<std::uint32_t>& order, Host& host) {
    // side by side in the order of the sweep, so that it reads memory forwards
    for (std::size_t k = 0; k < 3; ++k) {
      interval_[k].resize(order.size());
      for (std::size_t i = 0; i < order.size(); ++i)
        interval_[k][i] = {request.lower()[3 * order[i] + k], request.upper()[3 * order[i] + k]};
    }
    const std::vector<Interval>&along = interval_[axis], &second = interval_[(axis + 1) % 3],
          &third = interval_[(axis + 2) % 3];
    for (std::size_t i = 0; i < order.size(); ++i) {
      if (i % 1024 == 0) host.mark_progress();
      const Interval first = along[i], across = second[i], high = third[i];
      for (std::size_t k = i + 1; k < order.size() && along[k].lower <= first.upper; ++k) {
        if (across.lower <= second[k].upper && second[k].lower <= across.upper && high.lower <= third[k].upper &&
            third[k].lower <= high.upper && rule.may_touch(order[i], order[k]))
          found_.add(order[i], order[k]);
      }
    }
  }

  std::size_t axes_;
  // by axis, from call to call: bodies by their lower bounds
  std::array<std::vector<std::uint32_t>, 3> order_;
  // scratch
  std::vector<std::uint32_t> members_, outsiders_;
  std::vector<std::uint8_t> is_member_;
  std::array<std::vector<Interval>, 3> interval_;
  PairList found_;
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::SweepAndPruneSpace)
