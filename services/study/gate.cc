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
      // a ladder that somebody interrupted is none
      if (problem.name() == demand.problem && !(demand.is_of_shipped && problem.family() == "own") &&
          ladder.method() == demand.method && ladder.rungs_size() > 0 && !ladder.is_interrupted())
        return &ladder;
  return nullptr;
}

bool ran_out_of_time(const v1::Ladder& ladder) {
  return !ladder.rungs().empty() && ladder.rungs().rbegin()->too_long();
}

std::string why_error_failed(const v1::Ladder& ladder, double largest) {
  const double best = best_error(ladder);
  // times are not gated
  if (best <= largest || ran_out_of_time(ladder)) return {};
  return std::isinf(best) ? fmt::format("no rung comes to its end; at most {:g} is wanted", largest)
                          : fmt::format("its best error is {:.3g}; at most {:g} is wanted", best, largest);
}

std::string why_order_failed(const v1::Ladder& ladder, const Demand& demand) {
  if (!ladder.has_observed_order())
    return ran_out_of_time(ladder)
               ? std::string()
               : fmt::format("its ladder shows no order; {:g} to {:g} is wanted", demand.low, demand.high);
  const double order = ladder.observed_order();
  if (order >= demand.low && order <= demand.high) return {};
  return fmt::format("its observed order is {:.2f}; {:g} to {:g} is wanted", order, demand.low, demand.high);
}

std::string why_evaluations_failed(const v1::Ladder& ladder, const Demand& demand) {
  double least = std::numeric_limits<double>::infinity();
  for (const v1::Rung& rung : ladder.rungs())
    if (rung.failed().empty() && rung.error() <= demand.low) least = std::min(least, evaluations(rung));
  if (least <= demand.high || (std::isinf(least) && ran_out_of_time(ladder))) return {};
  return std::isinf(least) ? fmt::format("it does not reach an error of {:g}", demand.low)
                           : fmt::format("an error of {:g} takes {:.0f} evaluations; at most {:g} are wanted",
                                         demand.low, least, demand.high);
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
    if (ladder == nullptr) continue;
    study->set_demands(study->demands() + 1);
    const std::string why = demand.what == Demand::What::kError   ? why_error_failed(*ladder, demand.high)
                            : demand.what == Demand::What::kOrder ? why_order_failed(*ladder, demand)
                                                                  : why_evaluations_failed(*ladder, demand);
    if (!why.empty()) study->add_failures(fmt::format("{}, {}: {}", demand.problem, demand.method, why));
  }
}

}  // namespace gravitas::study
