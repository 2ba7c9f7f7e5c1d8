#include "services/study/study.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <span>
#include <utility>

#include "services/catalog/catalog.h"
#include "services/run/session.h"
#include "services/study/analysis.h"
#include "services/study/method.h"
#include "services/study/problem.h"
#include "services/study/rung.h"
#include "services/study/self_reference.h"
#include "services/study/spring_stability.h"

namespace gravitas::study {
namespace {

constexpr std::uint32_t kMostLooks = 400;
constexpr double kCoarsest = 1e-2, kFinest = 0.9e-13;  // accuracies

std::string processor_name() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("model name") && line.find(':') != std::string::npos)
      return line.substr(line.find_first_not_of(" \t", line.find(':') + 1));
  return "unknown";
}

// A problem with its scene read, and the methods that climb it.
struct Climb {
  Climb(const std::string& scene, Catalog* installed) : subject(scene, installed) {}

  v1::Problem result;
  Subject subject;
  std::vector<Method> methods;
  unsigned tasks = 0;
  std::uint32_t steps = 1, look_every = 1;  // of the coarsest rung
  MeasureMaker measure;                     // empty: the scene's own reference is still to be found
};

v1::Ladder* add_ladder(const Method& method, v1::Problem* problem) {
  v1::Ladder* ladder = problem->add_ladders();
  ladder->set_method(method.name());
  ladder->set_climbs(method.climbs_accuracy() ? "Accuracy" : "TimeStep");
  ladder->set_order(method.order);
  return ladder;
}

bool suits(const Method& method, bool has_contacts) { return method.bears_contacts() || !has_contacts; }

class StudyRun {
 public:
  StudyRun(const Options& options, const std::function<bool()>& interrupted,
           const std::function<void(const Progress&)>& report)
      : options_(options), installed_(Catalog::installed(installed_worker(), installed_plugins())), report_(report) {
    limits_.cpu_seconds = options.run_seconds > 0.0 ? options.run_seconds : options.is_short ? kShortRun : kLongRun;
    if (options.is_short) limits_.repeat_below = 0.02;
    limits_.interrupted = interrupted;
    if (!options.problems.empty() || options.scenes.empty())
      for (const Problem& problem : named_problems(options.problems)) add(problem);
    for (const std::string& scene : options.scenes) add(scene);
    // plugins that scenes bring along are known by now
    wanted_ = named_methods(options.methods, installed_);
    for (const std::unique_ptr<Climb>& climb : climbs_) {
      climb->methods = methods_for(climb->subject.has_contacts(), climb->tasks);
      ladders_ += climb->methods.size();
    }
    if (ladders_ == 0)
      throw BadInput("--methods: none of these suits the problems; Smooth is for bodies that cannot touch");
  }

  v1::Study go() {
    v1::Study study;
    study.set_build(GRAVITAS_BUILD_ID);
    study.set_processor(processor_name());
    try {
      for (const std::unique_ptr<Climb>& climb : climbs_) {
        if (climb->methods.empty()) continue;
        // what is measured before somebody interrupts is kept
        v1::Problem* result = study.add_problems();
        *result = climb->result;
        if (!climb->measure && !find_reference(climb.get(), result)) {
          study.mutable_problems()->RemoveLast();
          continue;
        }
        for (const Method& method : climb->methods) climb_ladder(*climb, method, result);
      }
      if (options_.problems.empty() && options_.methods.empty() && options_.scenes.empty()) {
        report_({done_, ladders_, "springs", "the map of stability"});
        try {
          for (v1::Limit& limit : map_stability(limits_.interrupted)) *study.add_limits() = std::move(limit);
        } catch (const BadInput& refused) {
          // the ladders are worth keeping
          study.add_failures(fmt::format("the map of stability: {}", refused.what()));
        }
      }
    } catch (const StudyInterrupted&) {
      study.set_is_interrupted(true);
    }
    // the others' results are worth keeping
    if (!without_reference_.empty() && study.problems().empty() && !study.is_interrupted())
      throw BadInput(without_reference_.front());
    for (const std::string& why : without_reference_) study.add_failures(why);
    return study;
  }

 private:
  std::vector<Method> methods_for(bool has_contacts, unsigned tasks) const {
    std::vector<Method> methods;
    for (const Method& method : options_.methods.empty() ? offered_methods() : std::span<const Method>(wanted_))
      if (suits(method, has_contacts) && (method.tasks & tasks) != 0) methods.push_back(method);
    return methods;
  }

  void add(const Problem& problem) {
    auto climb = std::make_unique<Climb>(scene_of(problem), &installed_);
    climb->steps = problem.steps;
    climb->tasks = problem.task;
    climb->measure = [known = problem.known](const kernel::EnvironmentDescription& description) {
      return std::make_unique<KnownMeasure>(known, description);
    };
    describe(problem.name, problem.family, climb.get());
    climb->result.set_reference(problem.reference);
    climb->result.set_uncertainty(problem.uncertainty);
    climbs_.push_back(std::move(climb));
  }

  // From four times its own TimeStep on.
  void add(const std::string& scene) {
    auto climb = std::make_unique<Climb>(scene, &installed_);
    const Subject& subject = climb->subject;
    const double steps = std::clamp(subject.duration() / subject.time_step() / 4.0, 1.0, 1e6);
    climb->steps = static_cast<std::uint32_t>(std::lround(steps));
    climb->look_every = (climb->steps + kMostLooks - 1) / kMostLooks;
    // the end is looked at, too
    climb->steps = (climb->steps + climb->look_every - 1) / climb->look_every * climb->look_every;
    climb->tasks = subject.has_contacts() ? kContacts : kMotion | kStiff;
    describe(problem_name(scene), "own", climb.get());
    climbs_.push_back(std::move(climb));
  }

  void describe(const std::string& name, const char* family, Climb* climb) const {
    for (const std::unique_ptr<Climb>& other : climbs_)
      if (other->result.name() == name)
        throw BadInput(fmt::format("{} and {}: both problems are called {}; allowed: files of different names",
                                   other->subject.path(), climb->subject.path(), name));
    climb->result.set_name(name);
    climb->result.set_family(family);
    climb->result.set_scene(climb->subject.path());
    climb->result.set_duration(climb->subject.duration());
    climb->result.set_has_contacts(climb->subject.has_contacts());
  }

  // False where there is none.
  bool find_reference(Climb* climb, v1::Problem* result) {
    report_({done_, ladders_, result->name(), "its reference"});
    SelfReference reference;
    try {
      reference = find_self_reference(climb->subject, climb->steps, climb->look_every, limits_);
    } catch (const BadInput& refused) {
      without_reference_.emplace_back(refused.what());
      return false;
    }
    climb->measure = [samples = reference.samples](const kernel::EnvironmentDescription&) {
      return std::make_unique<DistanceTo>(*samples);
    };
    result->set_reference(reference.text);
    result->set_uncertainty(reference.uncertainty);
    return true;
  }

  void climb_ladder(const Climb& climb, const Method& method, v1::Problem* result) {
    v1::Ladder* ladder = add_ladder(method, result);
    std::string too_long;
    for (const Setting& setting : settings(climb, method)) {
      report_({done_, ladders_, result->name(), method.name()});
      v1::Rung rung;
      if (too_long.empty()) {
        try {
          rung = make_rung(climb.subject, method, setting, climb.measure, limits_);
        } catch (const StudyInterrupted&) {
          judge(result->duration(), result->uncertainty(), ladder);
          ladder->set_is_interrupted(true);
          throw;
        }
        // a single step of a finer one may take hours
        if (rung.too_long()) too_long = "not run: a coarser one took too long";
      } else {
        rung.set_setting(setting.accuracy ? *setting.accuracy : climb.subject.duration() / setting.steps);
        rung.set_error(std::numeric_limits<double>::quiet_NaN());
        rung.set_failed(too_long);
        rung.set_too_long(true);
      }
      *ladder->add_rungs() = std::move(rung);
    }
    judge(result->duration(), result->uncertainty(), ladder);
    ++done_;
  }

  std::vector<Setting> settings(const Climb& climb, const Method& method) const {
    std::vector<Setting> all;
    if (method.climbs_accuracy()) {
      const double factor = options_.is_short ? 10.0 : std::sqrt(10.0);
      for (double accuracy = kCoarsest; accuracy > kFinest; accuracy /= factor)
        if (options_.rungs == 0 || all.size() < options_.rungs)
          all.push_back({climb.steps, climb.look_every, accuracy});
    } else {
      const std::uint32_t rungs = options_.rungs > 0 ? options_.rungs : kRungs;
      constexpr std::uint64_t kMostSteps = 1U << 31U;
      for (std::uint32_t i = 0; i < rungs && (std::uint64_t{climb.steps} << i) <= kMostSteps; ++i)
        all.push_back({climb.steps << i, climb.look_every << i});
    }
    return all;
  }

  const Options& options_;
  Catalog installed_;
  std::vector<Method> wanted_;
  RunLimits limits_;
  const std::function<void(const Progress&)>& report_;
  std::vector<std::unique_ptr<Climb>> climbs_;
  std::vector<std::string> without_reference_;  // scenes, and why
  std::size_t done_ = 0, ladders_ = 0;
};

}  // namespace

std::string problem_name(const std::string& scene) { return std::filesystem::path(scene).stem().string(); }

v1::Study list() {
  v1::Study study;
  for (const Problem& problem : shipped_problems()) {
    v1::Problem* result = study.add_problems();
    result->set_name(problem.name);
    result->set_family(problem.family);
    result->set_scene(scene_of(problem));
    result->set_reference(problem.reference);
    result->set_uncertainty(problem.uncertainty);
    result->set_has_contacts(problem.task == kContacts);
    for (const Method& method : offered_methods())
      if ((method.tasks & problem.task) != 0) add_ladder(method, result);
  }
  return study;
}

v1::Study run(const Options& options, const std::function<bool()>& interrupted,
              const std::function<void(const Progress&)>& progress) {
  return StudyRun(options, interrupted, progress).go();
}

}  // namespace gravitas::study
