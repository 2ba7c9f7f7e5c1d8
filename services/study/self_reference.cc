#include "services/study/self_reference.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "services/run/session.h"

namespace gravitas::study {
namespace {

struct Candidate {
  Method method;
  // The finer one is the reference: times the steps, and an accuracy.
  std::uint32_t finer[2];
  std::optional<double> accuracy[2];
};

std::vector<Candidate> candidates(bool has_contacts) {
  const std::string solver = has_contacts ? "Newton" : "Direct";
  std::vector<Candidate> all;
  if (!has_contacts)
    for (const auto& [integrator, accuracy] : {std::pair{"DormandPrince853", 1e-12}, std::pair{"Radau", 1e-11}})
      all.push_back({{"Smooth", integrator, solver, {}, "Integrator.Accuracy"}, {1, 1}, {accuracy, 10.0 * accuracy}});
  all.push_back({{"Continuous", "Verlet", solver, {}, "Simulator.Accuracy"}, {4, 4}, {1e-10, 1e-9}});
  all.push_back({{"Continuous", "Verlet", solver}, {512, 256}, {}});
  all.push_back({{"Basic", "SemiImplicitEuler", solver}, {512, 256}, {}});
  all.push_back({{"Basic", "SemiImplicitEuler", "Sequential"}, {32, 16}, {}});
  return all;
}

}  // namespace

SelfReference find_self_reference(const Subject& subject, std::uint32_t steps, std::uint32_t look_every,
                                  const RunLimits& limits) {
  RunLimits patient = limits;
  patient.cpu_seconds = std::max(8.0 * limits.cpu_seconds, kReferenceSeconds);
  patient.runs = 1;
  std::string why;
  for (const Candidate& one : candidates(subject.has_contacts())) {
    const auto setting = [&](std::size_t i) {
      return Setting{one.finer[i] * steps, one.finer[i] * look_every, one.accuracy[i]};
    };
    const auto samples = std::make_shared<Samples>();
    // the samples outlive their run
    class Recorded final : public Measure {
     public:
      explicit Recorded(Samples* to) : to_(to) {}
      void look(const kernel::Environment& environment) override { to_->look(environment); }
      double error() const override { return 0.0; }

     private:
      Samples* to_;
    };
    const v1::Rung fine = make_rung(
        subject, one.method, setting(0), [&](const auto&) { return std::make_unique<Recorded>(samples.get()); },
        patient);
    const std::string name = one.accuracy[0] ? fmt::format("{} at {:g}", one.method.name(), *one.accuracy[0])
                                             : fmt::format("{} with {:.3g} s", one.method.name(), fine.setting());
    if (!fine.failed().empty()) {
      why += fmt::format("\n  {}: {}", name, fine.failed());
      continue;
    }
    const v1::Rung coarse = make_rung(
        subject, one.method, setting(1), [&](const auto&) { return std::make_unique<DistanceTo>(*samples); }, patient);
    if (!coarse.failed().empty()) {
      why += fmt::format("\n  {}: not yet near itself: {}", name, coarse.failed());
      continue;
    }
    return {samples, fmt::format("itself by {}", name), std::max(coarse.error(), 1e-15)};
  }
  throw BadInput(
      fmt::format("{}: no fine run comes to its end that others could be measured against; a shorter "
                  "Duration, or a longer --run-seconds, may help:{}",
                  subject.path(), why));
}

}  // namespace gravitas::study
