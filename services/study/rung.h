// One run of a ladder: a scene by a method at a setting, measured and timed; in this process, but for plugins that have one
// of their own, whose CPU counts as well.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "gravitas/study/v1/study.pb.h"
#include "kernel/description.h"
#include "services/scene/reader.h"
#include "services/study/measure.h"
#include "services/study/method.h"

namespace gravitas::study {

// A scene that is read once and made finer and finer.
class Subject {
 public:
  // `installed` must live as long. Throws BadInput for a scene that cannot be read or built.
  Subject(const std::string& path, Catalog* installed);

  const std::string& path() const { return path_; }
  double duration() const;
  double time_step() const;
  // Bodies may touch: Smooth refuses it.
  bool has_contacts() const { return has_contacts_; }

  // With `steps` steps over its Duration, hosted in this process, but for a Command or an address. Throws BadInput.
  kernel::EnvironmentDescription describe(const Method& method, std::uint32_t steps,
                                          std::optional<double> accuracy) const;

 private:
  std::string path_;
  Catalog* installed_;
  scene::SceneDocument document_;
  bool has_contacts_ = false;
};

// What one run may take, and who may end it.
struct RunLimits {
  double cpu_seconds = 4.0;
  // Runs that took less CPU than this, s, are made `runs` times in all.
  double repeat_below = 0.1;
  std::uint32_t runs = 3;
  std::function<bool()> interrupted = [] { return false; };
};

struct Setting {
  std::uint32_t steps;
  std::uint32_t look_every;  // steps
  std::optional<double> accuracy = {};
};

// Somebody wants the study to end.
struct StudyInterrupted {};

// `measure` makes the one of each run. A run that is refused, fails, or takes more than it may is a rung that failed, with
// the reason. Throws StudyInterrupted.
using MeasureMaker = std::function<std::unique_ptr<Measure>(const kernel::EnvironmentDescription&)>;
v1::Rung make_rung(const Subject& subject, const Method& method, const Setting& setting, const MeasureMaker& measure,
                   const RunLimits& limits);

}  // namespace gravitas::study
