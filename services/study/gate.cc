#include "services/study/gate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <sstream>
#include <utility>

#include "plugin_sdk/counted.h"
#include "plugin_sdk/near_miss.h"
#include "services/run/session.h"
#include "services/study/analysis.h"
#include "services/study/method.h"
#include "services/study/problem.h"

namespace gravitas::study {
namespace {

struct DemandWord {
  const char* word;
  Demand::What what;
  std::size_t numbers;
};
constexpr DemandWord kDemandWords[] = {{"error", Demand::What::kError, 1},
                                       {"order", Demand::What::kOrder, 2},
                                       {"evaluations", Demand::What::kEvaluations, 2}};

const v1::Ladder* find_ladder(const v1::Study& study, const Demand& demand) {
  for (const v1::Problem& problem : study.problems())
    for (const v1::Ladder& ladder : problem.ladders())
      if (problem.name() == demand.problem && !(demand.is_built_in && problem.family() == "own") &&
          ladder.method() == demand.method)
        return &ladder;
  return nullptr;
}

bool ran_out_of_time(const v1::Ladder& ladder) {
  return !ladder.rungs().empty() && ladder.rungs().rbegin()->too_long();
}

// How a ladder misses a demand; without words: it does not.
struct Miss {
  std::string why = {};
  bool finer_rungs_may_do = false;
};

Miss miss_of_error(const v1::Ladder& ladder, double largest) {
  const double best = best_error(ladder);
  if (best <= largest) return {};
  return {std::isinf(best) ? fmt::format("no rung comes to its end; at most {:g} is wanted", largest)
                           : fmt::format("its best error is {:.3g}; at most {:g} is wanted", best, largest),
          true};
}

Miss miss_of_order(const v1::Ladder& ladder, const Demand& demand) {
  if (!ladder.has_observed_order())
    return {fmt::format("its ladder shows no order; {:g} to {:g} is wanted", demand.low, demand.high), true};
  const double order = ladder.observed_order();
  if (order >= demand.low && order <= demand.high) return {};
  return {fmt::format("its observed order is {:.2f}; {:g} to {:g} is wanted", order, demand.low, demand.high)};
}

Miss miss_of_evaluations(const v1::Ladder& ladder, const Demand& demand) {
  double least = std::numeric_limits<double>::infinity();
  for (const v1::Rung& rung : ladder.rungs())
    if (rung.failed().empty() && rung.error() <= demand.low) least = std::min(least, evaluations(rung));
  if (least <= demand.high) return {};
  if (std::isinf(least)) return {fmt::format("it does not reach an error of {:g}", demand.low), true};
  return {fmt::format("an error of {:g} takes {:.0f} evaluations; at most {:g} are wanted", demand.low, least,
                      demand.high)};
}

Miss miss_of(const Demand& demand, const v1::Ladder& ladder) {
  switch (demand.what) {
    case Demand::What::kError:
      return miss_of_error(ladder, demand.high);
    case Demand::What::kOrder:
      return miss_of_order(ladder, demand);
    case Demand::What::kEvaluations:
      return miss_of_evaluations(ladder, demand);
  }
  return {};
}

}  // namespace

std::vector<Demand> built_in_demands() {
  std::vector<Demand> demands;
  for (const Problem& problem : shipped_problems()) {
    for (const Bound& bound : problem.bounds)
      demands.push_back({Demand::What::kError, problem.name, bound.method, 0.0, bound.error, true});
    for (const Method& method : offered_methods())
      if ((method.tasks & problem.task) != 0 && method.order > 0.0 &&
          std::ranges::find(problem.orders, method.integrator) != problem.orders.end())
        demands.push_back({Demand::What::kOrder, problem.name, method.name(), method.order - kOrderTolerance,
                           method.order + kOrderTolerance, true});
  }
  return demands;
}

std::vector<Demand> read_demands(const std::string& path, std::vector<std::string> problems,
                                 std::vector<std::string> methods) {
  for (const Problem& problem : shipped_problems()) problems.push_back(problem.name);
  for (const Method& method : offered_methods()) methods.push_back(method.name());
  std::ifstream file(path);
  if (!file) throw BadInput(fmt::format("--gate {}: it cannot be read", path));
  std::vector<std::string> words;
  for (const DemandWord& known : kDemandWords) words.emplace_back(known.word);
  std::vector<Demand> demands;
  int number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    std::istringstream rest(line.substr(0, line.find('#')));
    std::string word;
    if (!(rest >> word)) continue;
    const auto refuse = [&](const std::string& why) {
      throw BadInput(fmt::format("{}:{}: error: {}", path, number, why));
    };
    const auto* known = std::ranges::find_if(kDemandWords, [&](const DemandWord& one) { return word == one.word; });
    if (known == std::end(kDemandWords)) refuse(fmt::format("\"{}\": {}", word, allowed_names(word, words)));
    Demand demand{known->what, {}, {}, 0.0, 0.0};
    double numbers[2] = {0.0, 0.0};
    rest >> demand.problem >> demand.method;
    for (std::size_t i = 0; i < known->numbers; ++i) rest >> numbers[i];
    std::string more;
    if (!rest || rest >> more || !(numbers[0] >= 0.0) || !(numbers[1] >= 0.0))
      refuse(
          fmt::format("\"{}\"; allowed: {} PROBLEM METHOD and {} >= 0", line, word, counted(known->numbers, "number")));
    (known->numbers == 1 ? demand.high : demand.low) = numbers[0];
    if (known->numbers == 2) demand.high = numbers[1];
    if (demand.what == Demand::What::kOrder && demand.low > demand.high)
      refuse(fmt::format("\"{}\": the lowest order is above the highest", line));
    // a slip would be demanded of nothing
    if (std::ranges::find(problems, demand.problem) == problems.end())
      refuse(fmt::format("problem \"{}\": {}", demand.problem, allowed_names(demand.problem, problems)));
    if (std::ranges::find(methods, demand.method) == methods.end())
      refuse(fmt::format("method \"{}\": {}", demand.method, allowed_names(demand.method, methods)));
    demands.push_back(std::move(demand));
  }
  if (demands.empty()) throw BadInput(fmt::format("{}: error: it demands nothing", path));
  return demands;
}

void apply_gate(const std::vector<Demand>& demands, v1::Study* study) {
  for (const Demand& demand : demands) {
    const v1::Ladder* ladder = find_ladder(*study, demand);
    if (ladder == nullptr && demand.is_built_in) continue;
    study->set_demands(study->demands() + 1);
    const std::string which = fmt::format("{}, {}: ", demand.problem, demand.method);
    if (ladder == nullptr) {
      study->add_not_shown(which + "it was not run");
      continue;
    }
    const Miss miss = miss_of(demand, *ladder);
    if (miss.why.empty()) continue;
    if (ladder->is_interrupted())
      study->add_not_shown(which + miss.why + "; it was interrupted");
    else if (miss.finer_rungs_may_do && ran_out_of_time(*ladder))
      (demand.is_built_in ? study->add_undecided() : study->add_not_shown())
          ->append(which + miss.why + "; finer rungs were not run, since one took more CPU than it may");
    else
      study->add_failures(which + miss.why);
  }
}

bool is_passed(const v1::Study& study) {
  return study.failures().empty() && study.not_shown().empty() && !study.is_interrupted();
}

}  // namespace gravitas::study
