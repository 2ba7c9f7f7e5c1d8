#include "services/study/problem.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <utility>

#include "plugin_sdk/near_miss.h"
#include "services/run/session.h"

namespace gravitas::study {
namespace {

constexpr Known::What kAttitude = Known::What::kAttitude;
constexpr const char* kElliptic = "elliptic functions, in quadruple precision";
constexpr const char* kQuadruple = "quadruple precision";
constexpr const char* kClosed = "closed form";
constexpr const char* kFast = "Smooth/DormandPrince853/Direct";
constexpr const char* kSteps = "Smooth/RK4/Direct";
constexpr const char* kImpacts = "Continuous/Verlet/Newton";
constexpr const char* kExact = "Continuous/Verlet/Newton/Accuracy";
constexpr const char* kLStable = "Smooth/Radau/Direct";

// Those of an order above 1 with steps: here their leading term stands alone from coarse rungs on.
std::vector<std::string> higher_orders() { return {"Verlet", "ImplicitMidpoint", "RK4", "SymplecticSplitting"}; }

Known position(const char* body, double time, std::vector<double> value, double size = 1.0) {
  return {Known::What::kPosition, body, time, std::move(value), size};
}

Known attitude(const char* body, double time, std::vector<double> value) {
  return {kAttitude, body, time, std::move(value)};
}

// Offset of body i along y, at 0.25 s and 1 s.
void add_spring(const char* body, double y, double early, double late, std::vector<Known>* all) {
  all->push_back(position(body, 0.25, {early, y, 0}));
  all->push_back(position(body, 1.0, {late, y, 0}));
}

std::vector<Known> known_of_springs() {
  std::vector<Known> all;
  add_spring("K2Z0_1", 0, -0.5704156886808966555, -0.3368516805904133628, &all);
  add_spring("K2Z1", 1, 0.2872974951836457831, 0.0004993992273873333669, &all);
  add_spring("K2Z10", 2, 0.8844420083734388099, 0.6072950367029781681, &all);
  add_spring("K4Z1", 3, 3.610865404890645355e-10, 0.0, &all);
  add_spring("K4Z10", 4, 0.2863257922201341516, 0.006670588761362053487, &all);
  add_spring("K6Z1", 5, 0.0, 0.0, &all);
  add_spring("K6Z10", 6, 3.620525079893408152e-6, 1.705330361825342303e-22, &all);
  return all;
}

const std::vector<Problem>& problem_table() {
  static const std::vector<Problem> all = {
      {"tumbling_box",
       "smooth",
       kMotion,
       50,
       kElliptic,
       1e-15,
       {attitude("Box", 10,
                 {0.2251645634139581639, -0.6199275624994524883, -0.2770291506871945918, 0.6987457236403101407}),
        position("Box", 10, {-20, 20, -410}, 411)},
       {{"Smooth/Verlet/Direct", 1e-10}, {kFast, 1e-7}},
       {"SemiImplicitEuler", "ImplicitMidpoint"}},
      {"point_pendulum",
       "smooth",
       kMotion,
       40,
       kElliptic,
       1e-15,
       {position("Bob", 10, {-0.275087462576116860, -0.961419205099125064, 0})},
       {{kFast, 1e-10}, {kSteps, 1e-6}},
       {"ImplicitMidpoint", "SymplecticSplitting"}},
      {"spherical_pendulum",
       "smooth",
       kMotion,
       40,
       kQuadruple,
       1e-15,
       {position("Bob", 10, {0.04578256339846101085, -0.7377486044706621106, -0.6735213088613132007})},
       {{kFast, 1e-10}, {kSteps, 1e-6}},
       {"ImplicitMidpoint", "SymplecticSplitting"}},
      {"heavy_top",
       "smooth",
       kMotion,
       100,
       kQuadruple,
       1e-15,
       {attitude("Top", 2,
                 {0.1229471350415334671, -0.4910798925500270147, 0.3504300303436209618, -0.7879868875504856693}),
        position("Top", 2, {-0.15041682274564176, -0.72416559163689565, -0.67302226956044410})},
       {{kFast, 1e-8}}},
      {"double_pendulum",
       "smooth",
       kMotion,
       40,
       kQuadruple,
       1e-15,
       {position("Upper", 5, {0.3050542574151395863, -0.3961589327945259834, 0}, 2),
        position("Lower", 5, {0.7464933633600585439, -1.273357544920714936, 0}, 2)},
       {{kFast, 1e-10}},
       higher_orders()},
      {"four_bar",
       "smooth",
       kMotion,
       100,
       kElliptic,
       1e-15,
       {position("Crank0", 10, {0.5 * 0.328458111540815379, 0.5 * 0.944518538178600962, 0}, 0.5)},
       {{kSteps, 1e-3}}},
      {"bounce",
       "contact",
       kContacts,
       25,
       kClosed,
       1e-15,
       {position("Ball", 4.5, {0, 3.763727052522523, 0}, 4.9)},
       {{kImpacts, 1e-9}}},
      {"zeno_bounce",
       "contact",
       kContacts,
       25,
       kClosed,
       1e-15,
       {position("Ball", 2.7, {0, 0.2023151805511139, 0}), position("Ball", 4.5, {0, 0.1, 0})},
       {{kImpacts, 1e-9}}},
      {"slide_to_stop",
       "contact",
       kContacts,
       20,
       kClosed,
       1e-15,
       {position("Box", 2, {3.678327403093946002, 0.2, 2.123683316343866803}, 4.2473666)},
       {{kImpacts, 1e-9}},
       {"SemiImplicitEuler"}},
      {"slide_to_roll",
       "contact",
       kContacts,
       20,
       kClosed,
       1e-15,
       {position("Ball", 0.6, {2.489580949607161927, 0.2, 0}, 2.5),
        attitude("Ball", 0.6, {-0.9988228247294600031, 0, 0, 0.0485073685068817445})},
       {{kImpacts, 1e-7}}},
      {"falling_rod",
       "contact",
       kContacts,
       30,
       "quadrature, in quadruple precision",
       1e-15,
       {position("Rod", 0.5, {0, 0.2239215752534287697, 0}),
        attitude("Rod", 0.5, {0.8390003428208052703, 0, 0, -0.5441308893516074137}),
        position("Rod", 0.75, {0, 0.02, 0}),
        attitude("Rod", 0.75, {0.7071067811865475244, 0, 0, -0.7071067811865475244})},
       {{kExact, 1e-7}},
       {"SemiImplicitEuler"}},
      {"damped_springs", "stiff", kStiff, 20, kClosed, 1e-15, known_of_springs(), {{kLStable, 1e-8}}},
      {"flyball_governor",
       "stiff",
       kStiff,
       100,
       "quadruple precision, two models",
       1e-15,
       {position("Slider", 10, {0, 0, 0.619622917061365659})},
       {{kLStable, 1e-6}}},
      {"welded_pendulum",
       "stiff",
       kMotion,
       20,
       kElliptic,
       1e-15,
       {position("Bob", 2, {0.7865110580763950554, -0.6175761941036502779, 0})},
       {{kFast, 1e-9}},
       higher_orders()},
      {"thin_plate",
       "extreme",
       kContacts,
       10,
       kClosed,
       1e-15,
       {position("Ball", 0.1, {0, 3.721 - 345.6e-2 - 25.0 * 0.06544, 0}, 10),
        position("Plate", 0.1, {0, -75.0 * 0.06544, 0}, 10)},
       {{kImpacts, 1e-9}}},
      {"fast_spin",
       "extreme",
       kMotion,
       100,
       kClosed,
       1e-12,
       {attitude("Rotor", 0.5,
                 {-0.546696442529387269, -0.2715258370136268911, -0.01200840272406623501, -0.791992751118202045}),
        attitude("Rotor", 1,
                 {-0.4019575959794580032, 0.2767784549100795342, 0.02452938336702851942, 0.8724804222924645214})},
       {{"Smooth/Verlet/Direct", 1e-9}}},
      {"far_away",
       "extreme",
       kContacts,
       20,
       kClosed,
       1e-8,
       {position("Box", 2, {100000003.678327403093946, 0.2, 2.123683316343866803}, 4.2473666)},
       {{kImpacts, 1e-6}}},
  };
  return all;
}

std::filesystem::path problem_folder() {
  constexpr const char* kFolder = "deploy/scenes/study";
  const std::filesystem::path above = folder_above_with(kFolder);
  if (!above.empty()) return above / kFolder;
  throw BadInput(fmt::format("gravitas study: no folder above '{}' holds {}; --scene FILE studies a scene of your own",
                             installed_worker(), kFolder));
}

}  // namespace

std::span<const Problem> shipped_problems() { return problem_table(); }

std::vector<Problem> named_problems(const std::vector<std::string>& names) {
  std::vector<std::string> known;
  for (const Problem& problem : problem_table()) known.push_back(problem.name);
  for (const char* family : {"smooth", "contact", "stiff", "extreme"}) known.emplace_back(family);
  for (const std::string& name : names) {
    if (std::ranges::find(known, name) != known.end()) continue;
    const std::string nearest = nearest_name(name, known);
    throw BadInput(fmt::format("--problems {}: there is no such problem{}; allowed: {}", name,
                               nearest.empty() ? "" : fmt::format("; did you mean {}?", nearest),
                               fmt::join(known, ", ")));
  }
  std::vector<Problem> problems;
  for (const Problem& problem : problem_table())
    if (names.empty() || std::ranges::find(names, problem.name) != names.end() ||
        std::ranges::find(names, problem.family) != names.end())
      problems.push_back(problem);
  return problems;
}

std::string scene_of(const Problem& problem) { return (problem_folder() / (problem.name + ".gravitas")).string(); }

}  // namespace gravitas::study
