#include "services/study/method.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "plugin_sdk/near_miss.h"
#include "services/run/session.h"

namespace gravitas::study {
namespace {

constexpr const char* kInnerAccuracy = "Integrator.Accuracy";
constexpr const char* kStepAccuracy = "Simulator.Accuracy";

const std::vector<Method>& method_table() {
  constexpr unsigned kFree = kMotion | kStiff;
  static const std::vector<Method> all = {
      {"Basic", "SemiImplicitEuler", "Sequential", {}, "", 1, kMotion | kStiff | kContacts},
      {"Basic", "SemiImplicitEuler", "Newton", {}, "", 1, kMotion | kContacts},
      {"Smooth", "SemiImplicitEuler", "Direct", {}, "", 1, kFree},
      {"Smooth", "Verlet", "Direct", {}, "", 2, kFree},
      {"Smooth", "ImplicitMidpoint", "Direct", {}, "", 2, kFree},
      {"Smooth", "RK4", "Direct", {}, "", 4, kFree},
      {"Smooth", "SymplecticSplitting", "Direct", {"Integrator.Order=4"}, "", 4, kMotion, "SymplecticSplitting4"},
      {"Smooth", "SymplecticSplitting", "Direct", {"Integrator.Order=6"}, "", 6, kMotion, "SymplecticSplitting6"},
      {"Smooth", "DormandPrince54", "Direct", {}, kInnerAccuracy, 0, kFree},
      {"Smooth", "DormandPrince853", "Direct", {}, kInnerAccuracy, 0, kMotion},
      {"Smooth", "Rosenbrock", "Direct", {}, kInnerAccuracy, 0, kStiff},
      {"Smooth", "Radau", "Direct", {}, kInnerAccuracy, 0, kFree},
      {"Substepping", "Verlet", "Newton", {"Simulator.Substeps=10"}, "", 0, kContacts},
      {"Bisection", "Verlet", "Newton", {}, "", 0, kContacts},
      {"Continuous", "Verlet", "Sequential", {}, "", 0, kContacts},
      {"Continuous", "Verlet", "Newton", {}, "", 0, kContacts},
      {"Continuous", "Verlet", "Newton", {}, kStepAccuracy, 0, kContacts},
  };
  return all;
}

std::vector<std::string> parts_of(const std::string& name) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= name.size();) {
    const std::size_t end = std::min(name.find('/', begin), name.size());
    parts.push_back(name.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

bool is_named_by(const Method& method, const std::string& word) {
  if (word == method.integrator) return true;
  const std::vector<std::string> parts = parts_of(method.name()), wanted = parts_of(word);
  // whole names tell the ladder of steps from that of accuracies
  if (wanted.size() == 3) return word == method.name();
  return std::search(parts.begin(), parts.end(), wanted.begin(), wanted.end()) != parts.end();
}

std::optional<Method> installed_method(const std::string& word, const Catalog& installed) {
  constexpr std::array<const char*, 5> kSimulators = {"Basic", "Substepping", "Smooth", "Bisection", "Continuous"};
  const std::vector<std::string> parts = parts_of(word);
  if (parts.size() != 3 || std::ranges::find(kSimulators, parts[0]) == kSimulators.end()) return std::nullopt;
  const InstalledPlugin* integrator = installed.find_plugin(Slot::kIntegrator, parts[1]);
  if (integrator == nullptr || installed.find_plugin(Slot::kSolver, parts[2]) == nullptr) return std::nullopt;
  Method method{parts[0], parts[1], parts[2]};
  method.tasks = kMotion | kStiff | kContacts;
  if (std::ranges::find(integrator->declaration.properties, "Accuracy", &Property::name) !=
      integrator->declaration.properties.end())
    method.accuracy = kInnerAccuracy;
  return method;
}

}  // namespace

std::string Method::name() const {
  return fmt::format("{}/{}/{}{}", simulator, label.empty() ? integrator : label, solver,
                     accuracy == kStepAccuracy ? "/Accuracy" : "");
}

std::span<const Method> offered_methods() { return method_table(); }

std::vector<Method> named_methods(const std::vector<std::string>& words, const Catalog& installed) {
  // by their whole name they are asked for whatever they are offered for
  constexpr unsigned kAnything = kMotion | kStiff | kContacts;
  std::vector<unsigned> wanted(method_table().size(), 0);
  std::vector<Method> others;
  for (const std::string& word : words) {
    bool is_known = false;
    for (std::size_t i = 0; i < wanted.size(); ++i)
      if (const Method& method = method_table()[i]; is_named_by(method, word)) {
        wanted[i] |= word == method.name() ? kAnything : method.tasks;
        is_known = true;
      }
    if (is_known) continue;
    if (std::optional<Method> other = installed_method(word, installed)) {
      const auto is_same = [&](const Method& one) { return one.name() == other->name(); };
      if (std::ranges::none_of(others, is_same)) others.push_back(std::move(*other));
      continue;
    }
    std::vector<std::string> names;
    for (const Method& method : method_table()) names.push_back(method.name());
    std::vector<std::string> near = names;
    for (const Method& method : method_table())
      for (const std::string& part : parts_of(method.name())) near.push_back(part);
    const std::string nearest = nearest_name(word, near);
    std::string all;
    for (const std::string& name : names) all += "\n  " + name;
    throw BadInput(
        fmt::format("--methods {}: no method is called so{}; allowed: one of the following, a part of its name, or "
                    "SIMULATOR/INTEGRATOR/SOLVER of plugins that are installed{}",
                    word, nearest.empty() ? "" : fmt::format("; did you mean {}?", nearest), all));
  }
  std::vector<Method> methods;
  for (std::size_t i = 0; i < wanted.size(); ++i)
    if (wanted[i] != 0) {
      methods.push_back(method_table()[i]);
      methods.back().tasks = wanted[i];
    }
  methods.insert(methods.end(), others.begin(), others.end());
  return methods;
}

}  // namespace gravitas::study
