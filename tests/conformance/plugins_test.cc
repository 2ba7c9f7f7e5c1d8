// Every plugin of the tree passes the kit's numbers, whatever it is called, and plugins that are wrong on purpose fail
// at the claim they break.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "plugin_sdk/conformance/library_subject.h"
#include "tests/paths.h"

namespace gravitas::conformance {
namespace {

using testing::HasSubstr;

std::vector<std::string> shipped_plugins() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(in_build("/lib/gravitas")))
    if (entry.path().extension() == ".so") names.push_back(entry.path().stem().string());
  std::sort(names.begin(), names.end());
  return names;
}

class ShippedPlugin : public testing::TestWithParam<std::string> {
 protected:
  LibrarySubject subject_{in_build("/lib/gravitas/") + GetParam() + ".so"};
};

TEST_P(ShippedPlugin, KeepsEveryClaimOfItsSlot) {
  const std::vector<Case> cases = number_cases(subject_.declaration());
  EXPECT_GE(cases.size(), 5U);
  for (const Case& one : cases) EXPECT_EQ(one.judge(subject_), "") << one.name << ": " << one.claim;
}

TEST_P(ShippedPlugin, AnswersOrdinaryQuestions) {
  const std::vector<Question> questions = ordinary_questions(subject_, 7);
  EXPECT_GE(questions.size(), 3U);
  for (const Question& question : questions) {
    const Answer answer = subject_.ask(question.method, question.request, question.derivative);
    EXPECT_TRUE(answer.ok()) << question.name << ": " << answer.fault << answer.text;
  }
}

TEST_P(ShippedPlugin, IsAskedTheSameForTheSameSeed) {
  const auto bytes = [&](std::uint64_t seed) {
    std::string all;
    for (const Question& question : ordinary_questions(subject_, seed)) all += question.request.bytes();
    return all;
  };
  EXPECT_EQ(bytes(3), bytes(3));
  EXPECT_NE(bytes(3), bytes(4));
}

INSTANTIATE_TEST_SUITE_P(Tree, ShippedPlugin, testing::ValuesIn(shipped_plugins()),
                         [](const auto& one) { return one.param; });

struct Wrong {
  const char* library;
  std::vector<std::string> cases;  // all that it fails, the one that names its fault first
  const char* words;               // of the first one's finding
};

class WrongPlugin : public testing::TestWithParam<Wrong> {};

TEST_P(WrongPlugin, FailsAtTheClaimThatItBreaks) {
  LibrarySubject subject(in_build("/lib/gravitas-faulty/") + std::string(GetParam().library) + ".so");
  std::vector<std::string> failed;
  std::string first;
  for (const Case& one : number_cases(subject.declaration())) {
    const std::string finding = one.judge(subject);
    if (finding.empty()) continue;
    failed.push_back(one.name);
    if (one.name == GetParam().cases.front()) first = finding;
  }
  EXPECT_THAT(failed, testing::UnorderedElementsAreArray(GetParam().cases));
  EXPECT_THAT(first, HasSubstr(GetParam().words));
}

const Wrong kWrong[] = {
    {"space_open_bounds", {"space/touching", "space/coincident", "space/sizes"}, "unit cubes of a lattice"},
    {"collision_flipped_normal",
     {"collision/known", "collision/apart", "collision/surface"},
     "normal (from a to b) is"},
    {"constraint_unturned_anchor",
     {"constraint/rows", "constraint/frames", "constraint/spherical"},
     "growth (m/s) of the joint error"},
    {"constraint_far_points", {"constraint/ways"}, "growth (m/s) of the joint error"},
    {"constraint_swapped_points", {"constraint/rows"}, "growth (m/s) of the joint error"},
    {"constraint_backward_stop", {"constraint/rows"}, "growth (m/s) of the joint error"},
    {"constraint_no_force", {"constraint/rows"}, "with a maximum_force of 0"},
    {"constraint_first_body", {"constraint/world", "constraint/permutation"}, "point1 of discrepancy 0 is"},
    {"constraint_stays_near", {"constraint/frames"}, "must be answered, came: REFUSED (joint 0: body 1 has gone"},
    {"constraint_one_at_a_time",
     {"constraint/permutation"},
     "more than one joint); each of its rows alone is answered"},
    {"force_first_body", {"force/permutation"}, "force of application 0 in another row is"},
    {"force_one_at_a_time",
     {"force/independence", "force/permutation"},
     "more than one push); each of its rows alone is answered"},
    // the second: its type lacks properties that the scene language gives it
    {"force_wrong_torque", {"force/basic", "force/basic-table"}, "torque is"},
    // with what its refusal says
    {"force_reads_too_much", {"force/types"}, "within its declared bounds; Shove: "},
    {"solver_gains_energy", {"solver/energy"}, "kinetic energy grew from"},
    {"solver_hides_turning", {"solver/rolling", "solver/momentum"}, "impulse of turning"},
    {"solver_idle_reactions",
     {"solver/reactions", "solver/reactions_hanging", "solver/reactions_springs", "solver/reactions_start"},
     "relative acceleration of the points"},
    {"solver_forgets_start", {"solver/reactions_start"}, "that was 0.3 m further in S_n: force is"},
    {"integrator_drifts", {"integrator/rotor"}, "change of its angular momentum"},
    {"integrator_few_bodies", {"integrator/permutation"}, "linear velocity in another row is"},
    {"integrator_wrong_theta", {"integrator/theta"}, "declared theta (against (x' - x - h v) / (h (v' - v))) is 0"},
};

INSTANTIATE_TEST_SUITE_P(Tree, WrongPlugin, testing::ValuesIn(kWrong),
                         [](const auto& one) { return std::string(one.param.library); });

}  // namespace
}  // namespace gravitas::conformance
