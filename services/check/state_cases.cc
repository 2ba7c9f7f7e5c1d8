// C3: a plugin keeps nothing that it cannot lose. Its process is killed after every call, and the next one, in another
// process, goes on as if nothing had happened.
#include <fmt/format.h>

#include <algorithm>

#include "plugin_sdk/conformance/sample_values.h"
#include "plugin_sdk/counted.h"
#include "services/check/answer_text.h"
#include "services/check/examination.h"

namespace gravitas::check {

using conformance::Answer;
using conformance::Level;
using conformance::Question;

namespace {

constexpr int kSteps = 4, kQuickSteps = 3;

// Is any part of its answers a part of the next question?
bool goes_on(stage::Method method) {
  return method == stage::Method::kIntegratorIntegrate || method == stage::Method::kSolverSolve;
}

// The question that a kernel asks next: what was answered is the new state, and what the plugin wants to be given back.
void go_on(stage::Method method, const MessageColumns& reply, MessageColumns* request) {
  if (method == stage::Method::kIntegratorIntegrate) {
    for (const char* name : {"position", "orientation", "linear_velocity", "angular_velocity", "plugin_state"})
      request->f64(name) = reply.f64(name);
    std::ranges::fill(request->u32("state_changed"), 0U);
    request->f64("time")[0] += request->f64("time_step")[0];
  }
  if (method == stage::Method::kSolverSolve) {
    request->f64("discrepancy_warm_impulse") = reply.f64("discrepancy_impulse");
    request->f64("discrepancy_warm_correction") = reply.f64("discrepancy_correction");
    request->f64("contact_warm_impulse") = reply.f64("contact_impulse");
    request->f64("contact_warm_correction") = reply.f64("contact_correction");
  }
}

// Answers to a question and those that follow from it; up to the first that there is none to.
std::vector<Answer> chain(CarrierSubject* subject, const Question& question, int steps, bool is_killed) {
  std::vector<Answer> answers;
  MessageColumns request = question.request;
  for (int step = 0; step < steps; ++step) {
    answers.push_back(subject->ask(question.method, request, question.derivative));
    if (!answers.back().ok()) break;
    if (is_killed) subject->kill();
    go_on(question.method, answers.back().columns, &request);
  }
  return answers;
}

std::string judge_chains(Examination& examination) {
  const int steps = examination.options.quick ? kQuickSteps : kSteps;
  for (const Question* question : examination.one_of_each_method()) {
    if (!goes_on(question->method)) continue;
    examination.blamed_call = call_text(question->method, question->request);
    const auto one = examination.fresh(examination.usual_hosting()),
               many = examination.fresh(examination.usual_hosting());
    const std::vector<Answer> kept = chain(one.get(), *question, steps, false);
    const std::vector<Answer> lost = chain(many.get(), *question, steps, true);
    for (std::size_t step = 0; step < std::min(kept.size(), lost.size()); ++step) {
      const std::string differs = difference(question->method, kept[step], lost[step]);
      if (!differs.empty())
        return fmt::format(
            "'{}', continued {} from its own answers: in one process, then with a new process for "
            "each call: {}",
            question->name, counted(step, "time"), differs);
    }
  }
  return {};
}

std::string judge_killed(Examination& examination) {
  const std::vector<Answer>& expected = examination.answers();
  const std::unique_ptr<CarrierSubject> subject = examination.fresh(examination.usual_hosting());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const Question& question = examination.questions()[i];
    const std::string differs = difference(question.method, expected[i], subject->ask(question));
    subject->kill();
    if (differs.empty()) continue;
    examination.blamed_call = subject->last_call();
    return fmt::format("'{}' in one process after {}, then in a process of its own: {}", question.name,
                       counted(i, "other"), differs);
  }
  return {};
}

std::string judge_declared(Examination& examination) {
  const PluginDeclaration& declaration = examination.examinee.declaration;
  if (declaration.slot != Slot::kIntegrator || has_capability(declaration, "plugin_state")) return {};
  for (const Answer& answer : examination.answers())
    if (const std::size_t size = answer.columns.f64("plugin_state").size(); size > 0)
      return fmt::format("it answers {} of plugin_state and does not declare the capability plugin_state",
                         counted(size, "number"));
  return {};
}

}  // namespace

std::vector<CheckCase> state_cases() {
  return {
      {Level::kState, "state/killed", "A new process for each call answers as one process for all.", judge_killed},
      {Level::kState, "state/continued", "What follows from its answers does not need the process that gave them.",
       judge_chains},
      {Level::kState, "state/declared", "Only a plugin that declares plugin_state hands some out.", judge_declared},
  };
}

}  // namespace gravitas::check
