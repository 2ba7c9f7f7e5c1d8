// What ladders tell, what the gate makes of them, and the program around it.
#include "services/study/gate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <initializer_list>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "services/run/session.h"
#include "services/study/analysis.h"
#include "services/study/diagram.h"
#include "services/study/method.h"
#include "services/study/tables.h"
#include "tests/services/cli/program.h"

namespace gravitas::study {
namespace {

using harness::ProgramResult;
using harness::read_file;
using harness::run_program;
using harness::ScratchFolder;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

// Steps of 0.1 that halve, errors of an order, a cost that doubles.
v1::Ladder ladder_of(const std::string& method, double order, double cost, int rungs = 8) {
  v1::Ladder ladder;
  ladder.set_method(method);
  ladder.set_climbs("TimeStep");
  ladder.set_order(2.0);
  for (int i = 0; i < rungs; ++i) {
    v1::Rung* rung = ladder.add_rungs();
    rung->set_setting(0.1 * std::pow(2.0, -i));
    rung->set_error(std::pow(rung->setting(), order));
    rung->set_cpu_median(cost * std::pow(2.0, i));
    rung->set_runs(1);
    rung->set_steps(10U << static_cast<unsigned>(i));
  }
  judge(1.0, 1e-15, &ladder);
  return ladder;
}

v1::Study study_with(std::initializer_list<v1::Ladder> ladders, const std::string& name = "top") {
  v1::Study study;
  v1::Problem* problem = study.add_problems();
  problem->set_name(name);
  problem->set_duration(1.0);
  problem->set_uncertainty(1e-15);
  for (const v1::Ladder& ladder : ladders) *problem->add_ladders() = ladder;
  return study;
}

TEST(StudyAnalysis, FindsTheOrderBetweenTheUselessAndRounding) {
  EXPECT_NEAR(ladder_of("A", 2.0, 1.0).observed_order(), 2.0, 1e-12);
  v1::Ladder ladder = ladder_of("A", 4.0, 1.0, 12);
  ladder.mutable_rungs(0)->set_error(0.9);
  ladder.mutable_rungs(1)->set_failed("off by more than its size");
  for (int i = 8; i < 12; ++i) ladder.mutable_rungs(i)->set_error(2e-11);
  judge(1.0, 1e-15, &ladder);
  EXPECT_NEAR(ladder.observed_order(), 4.0, 1e-12);
  EXPECT_FALSE(ladder_of("A", 2.0, 1.0, 3).has_observed_order());
  // exact at every step: what there is is rounding
  v1::Ladder exact = ladder_of("A", -0.5, 1.0);
  for (v1::Rung& rung : *exact.mutable_rungs()) rung.set_error(1e-9 / std::sqrt(rung.setting()));
  judge(1.0, 1e-15, &exact);
  EXPECT_FALSE(exact.has_observed_order());
}

TEST(StudyAnalysis, CheapestRungThatIsGoodEnoughCounts) {
  v1::Ladder ladder = ladder_of("A", 2.0, 1.0);
  ASSERT_EQ(ladder.reached_size(), 2);
  EXPECT_EQ(ladder.reached(0).error(), 1e-3);
  EXPECT_DOUBLE_EQ(ladder.reached(0).setting(), 0.025);
  EXPECT_DOUBLE_EQ(ladder.reached(0).cost(), 4.0);
  ladder.mutable_rungs(2)->set_failed("it fell over");
  judge(2.0, 1e-15, &ladder);
  EXPECT_DOUBLE_EQ(ladder.reached(0).setting(), 0.0125);
  EXPECT_DOUBLE_EQ(ladder.reached(0).cost(), 4.0);
}

TEST(StudyAnalysis, ProfilesCompareWithTheCheapest) {
  v1::Study study = study_with({ladder_of("A", 2.0, 1.0), ladder_of("B", 2.0, 3.0)});
  *study.add_problems() =
      study_with({ladder_of("A", 2.0, 10.0), ladder_of("B", 2.0, 1.0), ladder_of("C", 0.1, 1.0)}).problems(0);
  std::size_t problems = 0;
  const std::vector<Profile> all = profiles(study, false, 1e-3, &problems);
  EXPECT_EQ(problems, 2U);
  ASSERT_EQ(all.size(), 3U);
  EXPECT_THAT(all[0].ratios, ElementsAre(1.0, 10.0));
  EXPECT_THAT(all[1].ratios, ElementsAre(1.0, 3.0));
  EXPECT_THAT(all[2].ratios, IsEmpty());
  EXPECT_DOUBLE_EQ(share_within(all[1], 2.0, problems), 0.5);
  EXPECT_DOUBLE_EQ(share_within(all[1], 4.0, problems), 1.0);
  EXPECT_EQ(profiles(study, true, 1e-3, &problems).size(), 0U);
}

std::vector<std::string> failures_of(v1::Study study, const Demand& demand) {
  apply_gate({demand}, &study);
  EXPECT_EQ(study.demands(), 1U);
  return {study.failures().begin(), study.failures().end()};
}

TEST(StudyGate, FailsWhereOrderErrorOrWorkIsMissed) {
  using What = Demand::What;
  const v1::Study study = study_with({ladder_of("A", 1.7, 1.0)});
  EXPECT_THAT(failures_of(study, {What::kOrder, "top", "A", 1.8, 2.2}),
              ElementsAre("top, A: its observed order is 1.70; 1.8 to 2.2 is wanted"));
  EXPECT_THAT(failures_of(study, {What::kOrder, "top", "A", 1.6, 2.0}), IsEmpty());
  EXPECT_THAT(failures_of(study, {What::kError, "top", "A", 0.0, 1e-6}),
              ElementsAre(HasSubstr("its best error is 5.2")));
  EXPECT_THAT(failures_of(study, {What::kError, "top", "A", 0.0, 1e-5}), IsEmpty());
  EXPECT_THAT(failures_of(study, {What::kEvaluations, "top", "A", 1e-3, 79.0}),
              ElementsAre("top, A: an error of 0.001 takes 80 evaluations; at most 79 are wanted"));
  EXPECT_THAT(failures_of(study, {What::kEvaluations, "top", "A", 1e-3, 80.0}), IsEmpty());
  EXPECT_THAT(failures_of(study, {What::kEvaluations, "top", "A", 1e-9, 80.0}),
              ElementsAre(HasSubstr("does not reach")));

  const v1::Study few = study_with({ladder_of("A", 2.0, 1.0, 3)});
  EXPECT_THAT(failures_of(few, {What::kOrder, "top", "A", 1.8, 2.2}), ElementsAre(HasSubstr("shows no order")));
}

// What was not run far enough is neither met nor missed.
TEST(StudyGate, IsNotPassedByWhatIsNotShown) {
  using What = Demand::What;
  const v1::Study study = study_with({ladder_of("A", 1.7, 1.0, 3)});
  const auto verdict_of = [](v1::Study judged, const Demand& demand) {
    apply_gate({demand}, &judged);
    EXPECT_THAT(judged.failures(), IsEmpty());
    EXPECT_EQ(is_passed(judged), judged.not_shown().empty() && !judged.is_interrupted());
    EXPECT_EQ(summary(judged).find("is passed") != std::string::npos, is_passed(judged) && judged.demands() > 0);
    return judged.not_shown().empty() ? std::to_string(judged.demands()) : judged.not_shown(0);
  };
  EXPECT_EQ(verdict_of(study, {What::kError, "top", "A", 0.0, 0.1}), "1");
  EXPECT_EQ(verdict_of(study, {What::kOrder, "top", "B", 1.8, 2.2}), "top, B: it was not run");
  EXPECT_EQ(verdict_of(study, {What::kOrder, "spin", "A", 1.8, 2.2}), "spin, A: it was not run");
  // the built-in demands are none of what nobody chose, nor of a scene that is called like a shipped one
  EXPECT_EQ(verdict_of(study, {What::kOrder, "spin", "A", 1.8, 2.2, true}), "0");
  v1::Study own = study;
  own.mutable_problems(0)->set_family("own");
  EXPECT_EQ(verdict_of(own, {What::kError, "top", "A", 0.0, 1e-30, true}), "0");

  v1::Study slow = study;
  slow.mutable_problems(0)->mutable_ladders(0)->mutable_rungs(2)->set_too_long(true);
  const std::string not_run = "; finer rungs were not run, since one took more CPU than it may";
  EXPECT_EQ(verdict_of(slow, {What::kOrder, "top", "A", 1.8, 2.2}),
            "top, A: its ladder shows no order; 1.8 to 2.2 is wanted" + not_run);
  EXPECT_THAT(verdict_of(slow, {What::kError, "top", "A", 0.0, 1e-9}), HasSubstr(not_run));
  EXPECT_EQ(verdict_of(slow, {What::kEvaluations, "top", "A", 1e-9, 80.0}),
            "top, A: it does not reach an error of 1e-09" + not_run);

  // what the study asks for by itself does not depend on how fast the machine is
  v1::Study shipped = slow;
  apply_gate({{What::kOrder, "top", "A", 1.8, 2.2, true}}, &shipped);
  EXPECT_TRUE(is_passed(shipped));
  ASSERT_EQ(shipped.undecided_size(), 1);
  EXPECT_THAT(summary(shipped), HasSubstr("1 demand, 1 of them undecided"));

  v1::Study ended = study;
  ended.set_is_interrupted(true);
  EXPECT_EQ(verdict_of(ended, {What::kError, "top", "A", 0.0, 0.1}), "1");
  ended.mutable_problems(0)->mutable_ladders(0)->set_is_interrupted(true);
  EXPECT_THAT(verdict_of(ended, {What::kOrder, "top", "A", 1.8, 2.2}), HasSubstr("; it was interrupted"));
}

TEST(StudyGate, FilesAreReadLineByLine) {
  const ScratchFolder folder;
  const std::string path = folder.write("gate", "# ours\nerror top A 1e-9\norder top A 1.8 2.2 # of the theory\n\n");
  const std::vector<Demand> demands = read_demands(path, {"top"}, {"A"});
  ASSERT_EQ(demands.size(), 2U);
  EXPECT_EQ(demands[0].high, 1e-9);
  EXPECT_EQ(demands[1].low, 1.8);
  EXPECT_EQ(demands[1].high, 2.2);
  const auto refusal = [&](const std::string& text) {
    try {
      read_demands(folder.write("gate", text), {"top"}, {"A"});
    } catch (const BadInput& refused) {
      return std::string(refused.what());
    }
    return std::string("not refused");
  };
  EXPECT_THAT(refusal("error top A 1\nerrors top A 1\n"),
              AllOf(HasSubstr("gate:2: error: "), HasSubstr("did you mean \"error\"?")));
  EXPECT_THAT(refusal("order top A 1\n"),
              HasSubstr("gate:1: error: \"order top A 1\"; allowed: order PROBLEM METHOD and 2 numbers"));
  EXPECT_THAT(refusal("error top A 1 2\n"), HasSubstr("and 1 number >= 0"));
  EXPECT_THAT(refusal("error heavy_to A 1\n"),
              HasSubstr("gate:1: error: problem \"heavy_to\": did you mean \"heavy_top\"?"));
  EXPECT_THAT(refusal("error top Smooth/RK5/Direct 1\n"), HasSubstr("did you mean \"Smooth/RK4/Direct\"?"));
  EXPECT_THAT(refusal("# nothing\n"), HasSubstr("it demands nothing"));
  EXPECT_GT(built_in_demands().size(), 30U);
}

// Of its first problem.
std::string drawing_of(const v1::Study& study) { return diagram(study, study.problems(0)); }

// As many marks as rungs that were run in either panel, and what failed is hollow.
TEST(StudyDiagram, ShowsEveryRun) {
  const std::string with_circles = "Basic/SemiImplicitEuler/Sequential";
  v1::Ladder ladder = ladder_of(with_circles, 2.0, 1.0);
  ladder.mutable_rungs(0)->set_failed("it fell over");
  const std::string drawing = drawing_of(study_with({ladder}));
  const auto count = [&](const std::string& part) {
    std::size_t found = 0;
    for (std::size_t at = drawing.find(part); at != std::string::npos; at = drawing.find(part, at + 1)) ++found;
    return found;
  };
  EXPECT_EQ(count("<circle"), 2U * 8U + 1U);
  EXPECT_EQ(count("fill=\"white\" stroke"), 2U);
  EXPECT_THAT(drawing,
              AllOf(HasSubstr(with_circles + " (1 failed)"), HasSubstr("CPU s per simulated s"), HasSubstr("0.05 s")));
}

// Columns of marks that stand close together, each three times.
TEST(StudyDiagram, LabelsCoverNeitherMarksNorEachOther) {
  v1::Study study = study_with({});
  for (int i = 0; i < 3; ++i) {
    const double cost = 1.0 + 0.1 * i;
    *study.mutable_problems(0)->add_ladders() = ladder_of("Basic/SemiImplicitEuler/Sequential", 0.01, cost);
    *study.mutable_problems(0)->add_ladders() = ladder_of("Smooth/SymplecticSplitting4/Direct", 0.02, cost);
    *study.mutable_problems(0)->add_ladders() = ladder_of("Substepping/Verlet/Newton", 0.03, cost);
  }
  const std::string drawing = drawing_of(study);
  struct Box {
    double left, bottom, width;
  };
  std::vector<Box> labels;
  const std::regex label("<text x=\"([0-9.]+)\" y=\"([0-9.]+)\" font-size=\"9\"[^>]*>([^<]+)<");
  for (std::sregex_iterator one(drawing.begin(), drawing.end(), label), end; one != end; ++one)
    labels.push_back({std::stod((*one)[1]), std::stod((*one)[2]), 5.0 * static_cast<double>((*one)[3].length())});
  // both ends of a ladder, in both panels
  EXPECT_EQ(labels.size(), 2U * 2U * 9U);
  constexpr double kHigh = 8.0;
  for (std::size_t i = 0; i < labels.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const Box &a = labels[i], &b = labels[j];
      EXPECT_FALSE(a.left < b.left + b.width && b.left < a.left + a.width && std::fabs(a.bottom - b.bottom) < kHigh)
          << i << ", " << j;
    }
  const std::regex mark("<circle cx=\"([0-9.]+)\" cy=\"([0-9.]+)\"");
  for (std::sregex_iterator one(drawing.begin(), drawing.end(), mark), end; one != end; ++one) {
    const double x = std::stod((*one)[1]), y = std::stod((*one)[2]);
    for (const Box& box : labels)
      EXPECT_FALSE(box.left < x && x < box.left + box.width && box.bottom - kHigh < y && y < box.bottom)
          << x << " " << y;
  }
  EXPECT_NE(drawing.find("stroke-width=\"0.6\""), std::string::npos);  // what leads to those that are far
}

// How a method's line in the legend is drawn.
std::string stroke_in(const std::string& drawing, const std::string& method) {
  const std::size_t word = drawing.find(">" + method + "<"), line = drawing.rfind("<line", word);
  EXPECT_NE(word, std::string::npos) << method;
  const std::size_t stroke = drawing.find("stroke=", line);
  return drawing.substr(stroke, drawing.find("/>", stroke) - stroke);
}

// A method that is offered looks the same whatever is offered beside it.
TEST(StudyDiagram, MethodsLookTheSameInAll) {
  const std::string alone = drawing_of(study_with({ladder_of("Smooth/RK4/Direct", 2.0, 1.0)}));
  const std::string beside =
      drawing_of(study_with({ladder_of("Smooth/Verlet/Direct", 1.0, 3.0), ladder_of("Smooth/RK4/Direct", 2.0, 1.0)}));
  EXPECT_EQ(stroke_in(alone, "Smooth/RK4/Direct"), stroke_in(beside, "Smooth/RK4/Direct"));
  EXPECT_NE(stroke_in(beside, "Smooth/Verlet/Direct"), stroke_in(beside, "Smooth/RK4/Direct"));
}

std::string colour_in(const std::string& drawing, const std::string& method) {
  return stroke_in(drawing, method).substr(0, std::string("stroke=\"#000000\"").size());
}

// Two of three had the same colour where they are not offered beside each other.
TEST(StudyDiagram, MethodsOfADiagramHaveColoursOfTheirOwn) {
  std::vector<std::string> with_contacts, without;
  for (const Method& method : offered_methods()) {
    if ((method.tasks & kContacts) != 0) with_contacts.push_back(method.name());
    if (method.tasks != kContacts) without.push_back(method.name());
  }
  for (const std::vector<std::string>& methods :
       {std::vector<std::string>{"Smooth/RK4/Direct", "Continuous/Verlet/Newton", "Basic/SemiImplicitEuler/Sequential",
                                 "Smooth/Rosenbrock/Direct", "Smooth/RKMK4/Direct", "Basic/Own/Newton"},
        with_contacts, without}) {
    v1::Study study = study_with({});
    for (const std::string& method : methods) *study.mutable_problems(0)->add_ladders() = ladder_of(method, 2.0, 1.0);
    const std::string drawing = drawing_of(study);
    std::set<std::string> colours;
    for (const std::string& method : methods) colours.insert(colour_in(drawing, method));
    EXPECT_EQ(colours.size(), methods.size()) << methods[0];
  }
}

// One problem's table has all of it: there was a drawing with a cut title and nothing else.
TEST(StudyDiagram, ASingleProblemHasNoProfile) {
  v1::Study study = study_with({ladder_of("A", 1.5, 1.0)});
  EXPECT_FALSE(has_profiles(study));
  *study.add_problems() = study_with({ladder_of("A", 1.5, 1.0)}, "bounce").problems(0);
  study.mutable_problems(1)->set_has_contacts(true);
  EXPECT_FALSE(has_profiles(study));
  EXPECT_THAT(page(study), Not(HasSubstr("Over all problems")));
  *study.add_problems() = study_with({ladder_of("A", 1.5, 1.0)}, "bar").problems(0);
  EXPECT_FALSE(has_profiles(study));  // to 1e-6
  EXPECT_THAT(page(study), AllOf(HasSubstr("\n2 problems without contacts, to 0.001:"), Not(HasSubstr("profile.svg"))));
  for (const int i : {0, 2}) *study.mutable_problems(i)->mutable_ladders(0) = ladder_of("A", 2.0, 1.0);
  EXPECT_TRUE(has_profiles(study));
  EXPECT_THAT(page(study), HasSubstr("![profiles](profile.svg)"));
  EXPECT_THAT(profile_diagram(study), AllOf(HasSubstr("2 problems without contacts"), Not(HasSubstr("1 problems"))));
}

TEST(StudyPage, LinksToFilesOfAnyName) {
  const v1::Study study = study_with({ladder_of("A", 2.0, 1.0)}, "my | sc,ene (1) é");
  EXPECT_THAT(page(study), AllOf(HasSubstr("\n## my | sc,ene (1) é\n"),
                                 HasSubstr("](my%20%7C%20sc%2Cene%20%281%29%20%C3%A9.svg)\n")));
}

// ---- the program

TEST(StudyProgram, WritesWhatItMeasuredAndFailsByItsGate) {
  const ScratchFolder folder;
  const std::string out = folder.path("study");
  const std::string gate = folder.write("gate", "error point_pendulum Smooth/RK4/Direct 1e-30\n");
  std::vector<std::string> words = {
      "study", "--problems", "point_pendulum,bounce", "--methods", "RK4,Continuous", "--rungs", "3", "--short",
      "--out", out};
  ProgramResult result = run_program(words, folder);
  // the built-in demands are of whole ladders
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("the gate demands nothing of what was run"));
  for (const char* file : {"study.csv", "STUDY.md", "point_pendulum.svg", "bounce.svg"})
    EXPECT_TRUE(std::filesystem::exists(out + "/" + file)) << file;
  EXPECT_FALSE(std::filesystem::exists(out + "/profile.svg"));
  EXPECT_THAT(read_file(out + "/STUDY.md"), AllOf(HasSubstr("## bounce"), HasSubstr("Gate: the gate demands nothing")));
  EXPECT_THAT(read_file(out + "/study.csv"), HasSubstr("\npoint_pendulum,smooth,Smooth/RK4/Direct,TimeStep,0.25,"));

  words.insert(words.end(), {"--json", "--gate", gate});
  result = run_program(words, folder);
  EXPECT_EQ(result.exit_code, 4) << result.err;
  EXPECT_THAT(result.out,
              AllOf(HasSubstr("\"failures\": ["), HasSubstr("at most 1e-30 is wanted"), HasSubstr("\"demands\": 1")));
  EXPECT_THAT(read_file(out + "/STUDY.md"), HasSubstr("Gate: the gate failed, of 1 demand:"));

  words.back() = folder.write("gate", "error point_pendulum Smooth/RK4/Direct 0.1\n");
  EXPECT_EQ(run_program(words, folder).exit_code, 0);
  words.back() = folder.write("gate", "error heavy_top Smooth/RK4/Direct 0.1\n");
  result = run_program(words, folder);
  EXPECT_EQ(result.exit_code, 4) << result.err;
  EXPECT_THAT(result.out, HasSubstr("heavy_top, Smooth/RK4/Direct: it was not run"));
}

TEST(StudyProgram, LeavesNothingBehindWhereItRefuses) {
  const ScratchFolder folder;
  const std::string out = folder.path("study");
  const ProgramResult result = run_program({"study", "--methods", "RK5", "--out", out}, folder);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("did you mean RK4?"));
  EXPECT_FALSE(std::filesystem::exists(out));
  EXPECT_EQ(run_program({"study"}, folder).exit_code, 2);
  EXPECT_THAT(run_program({"study", "--list"}, folder).out,
              AllOf(HasSubstr("heavy_top"), HasSubstr("Smooth/Radau/Direct")));
  EXPECT_THAT(run_program({"study", "--list", "--json"}, folder).out,
              AllOf(HasSubstr("\"name\": \"heavy_top\""), HasSubstr("\"method\": \"Smooth/Radau/Direct\"")));
}

TEST(StudyProgram, KeepsWhatItHasWhenInterrupted) {
  const ScratchFolder folder;
  const std::string out = folder.path("study");
  const pid_t process = harness::start_program(
      {"study", "--problems", "four_bar", "--methods", "Smooth/RK4/Direct", "--run-seconds", "100", "--out", out},
      folder);
  // it listens before it makes its files
  for (int i = 0; i < 1000 && !std::filesystem::exists(out + "/study.csv"); ++i) usleep(10'000);
  usleep(1'500'000);
  kill(process, SIGINT);
  const ProgramResult result = harness::finish_program(process, folder);
  EXPECT_EQ(result.exit_code, 130) << result.err;
  EXPECT_THAT(result.err, HasSubstr("what was computed is kept"));
  EXPECT_THAT(read_file(out + "/study.csv"), HasSubstr("\nfour_bar,smooth,Smooth/RK4/Direct,"));
  EXPECT_THAT(result.out, AllOf(HasSubstr("the gate is not passed"), Not(HasSubstr("is passed"))));
}

}  // namespace
}  // namespace gravitas::study
