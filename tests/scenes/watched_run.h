// A run of a scene with the reactions of its last step.
#pragma once

#include <string>
#include <vector>

#include "services/recorder/reaction_log.h"
#include "tests/scenes/scene_run.h"

namespace gravitas::harness {

class WatchedRun final : private kernel::CommitListener {
 public:
  explicit WatchedRun(const std::string& text, const std::vector<std::string>& overrides = {})
      : run(text, overrides), log_("", run.description(), 0.0) {
    run.environment().set_commit_listener(this);
  }
  std::vector<report::v1::Reaction> reactions() const { return log_.last(run.environment()); }

  SceneRun run;

 private:
  void on_inner_step(const kernel::Environment& environment, const kernel::InnerStep& inner) override {
    log_.add(environment, inner);
  }
  void on_attempt(const kernel::StepData& data, std::uint32_t pieces) override { log_.add_attempt(data, pieces); }
  void on_commit(const kernel::Environment&) override {}

  ReactionLog log_;
};

}  // namespace gravitas::harness
