// The conformance kit's words: levels, the plugin under examination, cases.
//
// A case puts questions to a plugin through a Subject and judges the answers; it knows slots, declared types and
// declared capabilities, never a plugin's name. The same cases run in a unit test of a plugin's author (against the
// library in the test's own process) and in `gravitas check` (against a worker process that may die of them).
//
//   for (const Case& one : number_cases(declaration)) {
//     const std::string finding = one.judge(subject);     // empty: the claim holds
//   }
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "plugin_sdk/message_columns.h"
#include "plugin_sdk/plugin.h"

namespace gravitas::conformance {

enum class Level : std::uint32_t {
  kHandshake,  // C0: it starts, says who it is, and refuses what is not for it
  kWire,       // C1: abused frames are refused and leave it unharmed
  kPurity,     // C2: same request, same bytes
  kState,      // C3: it keeps nothing that it cannot lose
  kLimits,     // C4: deadlines, memory, descriptors over many calls
  kNumbers,    // C5: known answers, laws, hostile input
  kCount
};

// "C0" … "C5".
const char* level_name(Level level);

// What came back from one call.
struct Answer {
  std::int32_t status = GRAVITAS_OK;
  std::string text;  // why it was refused or failed
  // Why there is no answer at all: the host died, hung or sent a bad frame. Empty if there is one.
  std::string fault;
  MessageColumns columns;

  bool ok() const { return fault.empty() && status == GRAVITAS_OK; }
};

// What answers Integrator.Derivative: six numbers per body, and blocks where a Jacobian is wanted.
struct DerivativeAnswer {
  // NOLINTNEXTLINE(google-explicit-constructor): most functions give wrenches alone
  DerivativeAnswer(std::vector<double> wrenches, std::vector<std::uint32_t> bodies = {},
                   std::vector<double> blocks = {})
      : wrench(std::move(wrenches)), jacobian_body(std::move(bodies)), jacobian(std::move(blocks)) {}
  MessageColumns columns() const;

  std::vector<double> wrench;
  std::vector<std::uint32_t> jacobian_body;
  std::vector<double> jacobian;
};
using DerivativeFunction = std::function<DerivativeAnswer(const stage::IntegratorDerivativeRequest&)>;

// A plugin under examination, wherever it is hosted. An answer with status OK has passed check_rows().
class Subject {
 public:
  virtual ~Subject() = default;
  virtual const PluginDeclaration& declaration() const = 0;
  virtual Answer ask(stage::Method method, const MessageColumns& request,
                     const DerivativeFunction& derivative = {}) = 0;
};

struct Case {
  std::string name;                            // "integrator/free-particle", unique: `gravitas check --case` takes it
  std::string claim;                           // one sentence: what a conforming plugin does
  std::function<std::string(Subject&)> judge;  // empty, or what is wrong, with the numbers
};

// A request together with what answers its derivatives.
struct Question {
  std::string name;
  stage::Method method;
  MessageColumns request;
  DerivativeFunction derivative;
};

// C5 for a plugin of this declaration.
std::vector<Case> number_cases(const PluginDeclaration& declaration);

// Ordinary questions that every plugin of this declaration answers with GRAVITAS_OK, of several sizes (one body to
// some hundreds, with contacts, joints, forces as the slot has them); the same ones for the same seed. C1 to C4 are
// made of them. A constraint plugin's discrepancies need the answer of its bind: those are asked from the subject, as is which types can be asked at all.
// None if the declaration contradicts the scene language; then C5 says how.
std::vector<Question> ordinary_questions(Subject& subject, std::uint64_t seed);

}  // namespace gravitas::conformance
