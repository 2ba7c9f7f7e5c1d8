// A scene that runs in this process, and a surveyor beside it.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "services/run/session.h"
#include "services/survey/instrumentation.h"
#include "services/survey/surveyor.h"
#include "tests/services/cli/program.h"

namespace gravitas::harness {

struct SurveyedScene {
  explicit SurveyedScene(const std::string& scene, kernel::Hosting hosting = kernel::Hosting::kDirect,
                         const std::vector<std::string>& overrides = {}) {
    RunOptions options;
    options.scenes = {folder.write("scene", scene)};
    options.hosting = {{std::nullopt, hosting}};
    options.overrides = overrides;
    std::vector<std::string> warnings;
    description = load(options, &warnings, &catalog);
    environment = start(description);
    surveyor.emplace(description);
  }

  void steps(int count) {
    for (int i = 0; i < count; ++i) ASSERT_EQ(environment->step(), kernel::StepOutcome::kCommitted);
  }

  ScratchFolder folder;
  Catalog catalog;
  kernel::EnvironmentDescription description;
  std::unique_ptr<kernel::Environment> environment;
  std::optional<survey::Surveyor> surveyor;
};

inline Vector3 vector_of(const google::protobuf::RepeatedField<double>& numbers) {
  return {numbers.Get(0), numbers.Get(1), numbers.Get(2)};
}

}  // namespace gravitas::harness
