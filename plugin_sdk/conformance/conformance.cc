#include "plugin_sdk/conformance/conformance.h"

#include "plugin_sdk/conformance/inquiry.h"
#include "plugin_sdk/conformance/slot_cases.h"

namespace gravitas::conformance {

const char* level_name(Level level) {
  switch (level) {
    case Level::kHandshake:
      return "C0";
    case Level::kWire:
      return "C1";
    case Level::kPurity:
      return "C2";
    case Level::kState:
      return "C3";
    case Level::kLimits:
      return "C4";
    case Level::kNumbers:
      return "C5";
    case Level::kCount:
      break;
  }
  return "C?";
}

MessageColumns DerivativeAnswer::columns() const {
  MessageColumns all(stage::method_info(stage::Method::kIntegratorDerivative).reply);
  all.f64("wrench") = wrench, all.u32("jacobian_body") = jacobian_body, all.f64("jacobian") = jacobian;
  return all;
}

std::vector<Case> number_cases(const PluginDeclaration& declaration) {
  switch (declaration.slot) {
    case Slot::kSpace:
      return space_cases(declaration);
    case Slot::kCollision:
      return collision_cases(declaration);
    case Slot::kConstraint:
      return constraint_cases(declaration);
    case Slot::kForce:
      return force_cases(declaration);
    case Slot::kSolver:
      return solver_cases(declaration);
    case Slot::kIntegrator:
      return integrator_cases(declaration);
  }
  return {};
}

namespace {

std::vector<Question> questions_of_slot(Subject& subject, std::uint64_t seed) {
  Draw draw(seed);
  switch (subject.declaration().slot) {
    case Slot::kSpace:
      return space_questions(subject.declaration(), &draw);
    case Slot::kCollision:
      return collision_questions(subject, &draw);
    case Slot::kConstraint:
      return constraint_questions(subject, &draw);
    case Slot::kForce:
      return force_questions(subject, &draw);
    case Slot::kSolver:
      return solver_questions(subject.declaration(), &draw);
    case Slot::kIntegrator:
      return integrator_questions(&draw);
  }
  return {};
}

}  // namespace

std::vector<Question> ordinary_questions(Subject& subject, std::uint64_t seed) {
  try {
    return questions_of_slot(subject, seed);
  } catch (const Finding&) {
    return {};  // C5 says what is wrong with its declaration
  }
}

}  // namespace gravitas::conformance
