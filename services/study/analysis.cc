#include "services/study/analysis.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gravitas::study {
namespace {

// Beyond these an error is useless, or rounding's.
constexpr double kUseless = 0.05, kRounding = 1e-12;
constexpr std::size_t kFewestSlopes = 3;

bool is_good(const v1::Rung& rung) { return rung.failed().empty(); }

// The median of the slopes between neighbouring rungs: those at either end, before the leading term stands alone and where
// rounding begins, have no say.
void find_order(double uncertainty, v1::Ladder* ladder) {
  std::vector<double> slopes;
  const v1::Rung* before = nullptr;
  const double least = std::max(kRounding, 10.0 * uncertainty);
  for (const v1::Rung& rung : ladder->rungs()) {
    if (!is_good(rung) || rung.error() > kUseless) {
      before = nullptr;
      continue;
    }
    // exact methods, and what comes after
    if (rung.error() < least || (before != nullptr && rung.error() > 0.8 * before->error())) break;
    if (before != nullptr)
      slopes.push_back(std::log(before->error() / rung.error()) / std::log(before->setting() / rung.setting()));
    before = &rung;
  }
  if (slopes.size() < kFewestSlopes) return;
  std::ranges::sort(slopes);
  const std::size_t middle = slopes.size() / 2;
  ladder->set_observed_order(slopes.size() % 2 == 1 ? slopes[middle] : 0.5 * (slopes[middle - 1] + slopes[middle]));
}

void find_achieved(double uncertainty, v1::Ladder* ladder) {
  double sum = 0.0;
  int count = 0;
  for (const v1::Rung& rung : ladder->rungs()) {
    if (!is_good(rung) || rung.error() < std::max(kRounding, uncertainty)) continue;
    sum += std::log(rung.error() / rung.setting());
    ++count;
  }
  if (count > 0) ladder->set_achieved_to_requested(std::exp(sum / count));
}

double cost_of(const v1::Ladder& ladder, double error) {
  for (const v1::Reached& reached : ladder.reached())
    if (reached.error() == error) return reached.cost();
  return std::numeric_limits<double>::infinity();
}

}  // namespace

double evaluations(const v1::Rung& rung) {
  return static_cast<double>(std::max(rung.derivatives() + rung.iterations(), rung.steps()));
}

double best_error(const v1::Ladder& ladder) {
  double best = std::numeric_limits<double>::infinity();
  for (const v1::Rung& rung : ladder.rungs())
    if (is_good(rung)) best = std::min(best, rung.error());
  return best;
}

void judge(double duration, double uncertainty, v1::Ladder* ladder) {
  ladder->clear_reached();
  if (ladder->climbs() == "TimeStep") {
    find_order(uncertainty, ladder);
  } else {
    find_achieved(uncertainty, ladder);
  }
  for (const double wanted : kWantedErrors) {
    const v1::Rung* cheapest = nullptr;
    for (const v1::Rung& rung : ladder->rungs())
      // nobody knows what is better than the reference
      if (is_good(rung) && std::max(rung.error(), uncertainty) <= wanted &&
          (cheapest == nullptr || rung.cpu_median() < cheapest->cpu_median()))
        cheapest = &rung;
    if (cheapest == nullptr) continue;
    v1::Reached* reached = ladder->add_reached();
    reached->set_error(wanted);
    reached->set_cost(cheapest->cpu_median() / duration);
    reached->set_setting(cheapest->setting());
  }
}

std::vector<Profile> profiles(const v1::Study& study, bool has_contacts, double error, std::size_t* problems) {
  std::vector<Profile> all;
  *problems = 0;
  for (const v1::Problem& problem : study.problems()) {
    if (problem.has_contacts() != has_contacts) continue;
    double best = std::numeric_limits<double>::infinity();
    for (const v1::Ladder& ladder : problem.ladders()) best = std::min(best, cost_of(ladder, error));
    if (std::isinf(best)) continue;
    ++*problems;
    for (const v1::Ladder& ladder : problem.ladders()) {
      auto found = std::ranges::find(all, ladder.method(), &Profile::method);
      if (found == all.end()) found = all.insert(all.end(), {ladder.method(), {}});
      if (const double cost = cost_of(ladder, error); std::isfinite(cost)) found->ratios.push_back(cost / best);
    }
  }
  if (*problems < 2) return {};
  for (Profile& profile : all) std::ranges::sort(profile.ratios);
  return all;
}

bool has_profiles(const v1::Study& study) {
  std::size_t problems = 0;
  return !profiles(study, false, kProfileError, &problems).empty() ||
         !profiles(study, true, kProfileError, &problems).empty();
}

double share_within(const Profile& profile, double factor, std::size_t problems) {
  const auto within = std::ranges::count_if(profile.ratios, [&](double ratio) { return ratio <= factor; });
  return problems == 0 ? 0.0 : static_cast<double>(within) / static_cast<double>(problems);
}

}  // namespace gravitas::study
