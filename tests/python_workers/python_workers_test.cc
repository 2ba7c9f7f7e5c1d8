// Workers in another language: the Python SDK's own tests, a force and a solver in scenes with answers known
// beforehand, and the conformance kit's verdict on both.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "plugin_sdk/body.h"
#include "services/run/figures.h"
#include "services/run/session.h"
#include "services/study/rung.h"
#include "services/study/tables.h"
#include "tests/paths.h"
#include "tests/run_quietly.h"
#include "tests/services/cli/program.h"

namespace gravitas {
namespace {

using kernel::Hosting;
using testing::Contains;
using testing::HasSubstr;

const std::string kFolder = in_source("/tests/python_workers/");
const std::string kScenes = in_source("/tests/scenes/");
const std::string kPython = "PYTHONPATH=" + in_shell(in_build("/lib/python"));
const std::string kGravitas = in_shell(in_build("/bin/gravitas"));

// What the workers inherit.
class PythonPath : public ::testing::Environment {
 public:
  void SetUp() override { setenv("PYTHONPATH", in_build("/lib/python").c_str(), 1); }
};
const ::testing::Environment* const kEnvironment = ::testing::AddGlobalTestEnvironment(new PythonPath);

// A scene whose plugins are hosted directly, but for those that a scene file hosts itself.
class MixedRun {
 public:
  MixedRun(std::vector<std::string> scenes, std::vector<std::string> overrides, Slot elsewhere) {
    RunOptions options;
    options.scenes = std::move(scenes);
    options.overrides = std::move(overrides);
    for (const Slot slot :
         {Slot::kSpace, Slot::kCollision, Slot::kConstraint, Slot::kForce, Slot::kSolver, Slot::kIntegrator})
      if (slot != elsewhere) options.hosting.push_back({slot, Hosting::kDirect, ""});
    description_ = load(options, &warnings_);
    environment_ = start(description_);
    figures_ = std::make_unique<Figures>(description_);
    figures_->follow(environment_.get());
  }

  void steps(std::uint32_t count) {
    for (std::uint32_t i = 0; i < count; ++i) {
      if (environment_->step() == kernel::StepOutcome::kPaused)
        throw std::runtime_error(environment_->fault()->fault.what());
      figures_->follow(environment_.get());
    }
  }

  std::size_t row(const std::string& id) const {
    const std::vector<std::string>& ids = environment_->model().body_id;
    return static_cast<std::size_t>(std::ranges::find(ids, id) - ids.begin());
  }
  Vector3 position(const std::string& id) const { return vector_at(environment_->state().position, row(id)); }
  Vector3 velocity(const std::string& id) const { return vector_at(environment_->state().linear_velocity, row(id)); }
  Vector3 turning(const std::string& id) const { return vector_at(environment_->state().angular_velocity, row(id)); }

  kernel::Environment& environment() { return *environment_; }
  const report::v1::Report& report() {
    figures_->write(&report_);
    return report_;
  }

 private:
  std::vector<std::string> warnings_;
  kernel::EnvironmentDescription description_;
  std::unique_ptr<kernel::Environment> environment_;
  std::unique_ptr<Figures> figures_;
  report::v1::Report report_;
};

struct Ended {
  int code;
  std::string words;  // both of its outputs
};

Ended ended(const std::string& command) {
  FILE* pipe = popen((command + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return {-1, "popen failed"};
  Ended result{0, ""};
  for (int c = fgetc(pipe); c != EOF; c = fgetc(pipe)) result.words += static_cast<char>(c);
  const int status = pclose(pipe);
  result.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return result;
}

TEST(PythonSdk, PassesItsOwnTests) {
  const Ended tests = ended(kPython + " /usr/bin/python3 -B " + in_shell(kFolder + "sdk_test.py"));
  EXPECT_EQ(tests.code, 0) << tests.words;
  EXPECT_THAT(tests.words, testing::ContainsRegex("Ran [1-9][0-9] tests"));
}

// ---- the force

TEST(PythonForce, TakesTheShareOfTheVelocityThatItsCoefficientsSay) {
  MixedRun run({kFolder + "falling_with_drag.gravitas"}, {}, Slot::kForce);
  const double h = 0.01;
  Vector3 oil(3, 0, -4), air(1, 2, 2);
  for (int step = 0; step < 200; ++step) {
    run.steps(1);
    oil -= h * 2.0 / 1.5 * oil;
    air += h * (Vector3(0, -9.81, 0) - (0.1 + 0.5 * air.norm()) / 2.0 * air);
    // rounding of two hundred steps
    ASSERT_LE((run.velocity("InOil") - oil).norm(), 1e-13) << "step " << step;
    ASSERT_LE((run.velocity("InAir") - air).norm(), 1e-12) << "step " << step;
  }
  EXPECT_EQ(run.turning("InAir"), Vector3(0, 0, 0));
  EXPECT_NEAR(run.velocity("Free").y(), -9.81 * 2.0, 1e-12);
}

TEST(PythonForce, DeclaresItsRangesToTheReaderOfScenes) {
  try {
    MixedRun run({kFolder + "falling_with_drag.gravitas"}, {"Force.Oil.LinearCoefficient=-1"}, Slot::kForce);
    FAIL() << "a negative coefficient was taken";
  } catch (const BadInput& problem) {
    EXPECT_THAT(problem.what(), HasSubstr("LinearCoefficient"));
  }
}

struct Outcome {
  std::string chain;
  std::vector<std::string> warnings;
};

Outcome outcome_of(const std::vector<std::string>& scenes, const std::vector<std::string>& overrides) {
  RunOptions options;
  options.scenes = scenes;
  options.overrides = overrides;
  options.steps = 50;
  const RunResult result = harness::run_quietly(options);
  EXPECT_EQ(result.outcome, RunOutcome::kCompleted) << result.fault;
  return {result.report.chain_hash(), {result.report.warnings().begin(), result.report.warnings().end()}};
}

TEST(PythonForce, GivesTheSameBitsAgainAndTheReportSaysWhatIsNotKnownOfThem) {
  const Outcome once = outcome_of({kFolder + "falling_with_drag.gravitas"}, {});
  const Outcome again = outcome_of({kFolder + "falling_with_drag.gravitas"}, {});
  EXPECT_EQ(once.chain, again.chain);
  EXPECT_THAT(once.warnings, Contains(HasSubstr("floating-point")));
}

// ---- the solver

std::vector<std::string> scene(const std::string& name) { return {kScenes + name, kFolder + "solver.gravitas"}; }

MixedRun solved_in_python(const std::string& name, std::vector<std::string> overrides = {}) {
  overrides.push_back("Solver=PythonIslands");
  return MixedRun(scene(name), std::move(overrides), Slot::kSolver);
}

// It commits no orders, so what can be comes from outside, and the rest is not taken for survived.
TEST(PythonForce, IsKilledAndStoppedFromOutside) {
  const std::string run = kGravitas + " run " + in_shell(kFolder + "falling_with_drag.gravitas") +
                          " --steps 30 --set Plugin.force.Deadline=1 ";
  const Ended quiet = ended(run + "--json | grep chain_hash");
  const Ended hurt =
      ended(run + "--fault force:kill@step=5 --fault force:hang@step=12 --fault force:nan@step=20 --json");
  EXPECT_EQ(hurt.code, 0) << hurt.words;
  ASSERT_THAT(quiet.words, HasSubstr("chain_hash"));
  EXPECT_THAT(hurt.words, HasSubstr(quiet.words));
  for (const char* order : {"force:kill@step=5", "force:hang@step=12"})
    EXPECT_THAT(hurt.words, HasSubstr(std::string("\"ordered\": \"") + order));
  EXPECT_THAT(hurt.words, HasSubstr("fault nan of step 20 was not injected: the worker of a Command commits no orders "
                                    "itself; allowed, since they come from outside: kill, hang, stop"));
}

// Its text with another worker.
std::string falling_with(const std::string& command) {
  std::string scene = harness::read_file(kFolder + "falling_with_drag.gravitas");
  const std::string worker = "force_drag.py";
  return scene.replace(scene.find(worker), worker.size(), command);
}

// Nothing but its CPU: ten times 10 ms and more.
TEST(PythonForce, CountsInAStudy) {
  class Nothing final : public study::Measure {
   public:
    void look(const kernel::Environment&) override {}
    double error() const override { return 0.0; }
  };
  const harness::ScratchFolder folder;
  Catalog catalog = Catalog::installed(installed_worker(), installed_plugins());
  const study::Subject subject(folder.write("falling.gravitas", falling_with(in_shell(kFolder + "busy_drag.py"))),
                               &catalog);
  const auto rung_within = [&](double cpu_seconds) {
    study::RunLimits limits;
    limits.cpu_seconds = cpu_seconds;
    limits.runs = 1;
    return study::make_rung(
        subject, {"Basic", "SemiImplicitEuler", "Sequential"}, {10, 1},
        [](const auto&) { return std::make_unique<Nothing>(); }, limits);
  };
  study::v1::Study study;
  study::v1::Rung& rung = *study.add_problems()->add_ladders()->add_rungs() = rung_within(100.0);
  EXPECT_EQ(rung.failed(), "");
  EXPECT_GE(rung.cpu_min(), 0.1);
  EXPECT_EQ(rung.hosting(), "direct; grpc: PythonDrag");
  EXPECT_THAT(study::page(study), HasSubstr("Hosting: direct; grpc: PythonDrag; one thread"));
  const study::v1::Rung hurried = rung_within(0.05);
  EXPECT_TRUE(hurried.too_long());
  EXPECT_GE(hurried.cpu_min(), 0.05);
}

// Whoever dies of it the second time has said that it was read.
TEST(PythonForce, ARequestThatKillsTwoWorkersIsKept) {
  const harness::ScratchFolder folder;
  for (const char* death : {"exit", "segv"}) {
    folder.write("falling.gravitas", falling_with(in_shell(kFolder + "mortal_drag.py") + " " + death));
    const std::string there = "cd " + in_shell(folder.path("")) + " && " + kGravitas;
    const Ended run = ended(there + " run falling.gravitas --steps 30 --checkpoint kept");
    EXPECT_EQ(run.code, 3) << run.words;
    EXPECT_THAT(run.words, HasSubstr("paused at step 5: slot force, plugin PythonDrag: "));
    EXPECT_THAT(run.words, testing::Not(HasSubstr("Failures")));
    const Ended replay = ended(there + " replay falling.force.step6.capsule");
    EXPECT_EQ(replay.code, 4) << replay.words;
    EXPECT_THAT(replay.words, HasSubstr("1 failed again"));
  }
}

TEST(PythonSolver, OrdersThatCannotComeFromOutsideAreRefused) {
  const Ended refused =
      ended(kGravitas + " run " + in_shell(kFolder + "solver.gravitas") + " " +
            in_shell(kScenes + "pendulum.gravitas") + " --set Solver=PythonIslands --fault solver:nan@step=5");
  EXPECT_EQ(refused.code, 2) << refused.words;
  EXPECT_THAT(refused.words,
              HasSubstr("fault nan in slot solver: the worker of a Command commits no orders itself; allowed"));
}

TEST(PythonSolver, KeepsABoxAtRest) {
  MixedRun run = solved_in_python("box_on_plane.gravitas");
  const Vector3 start = run.position("Box");
  for (int i = 0; i < 200; ++i) {
    run.steps(1);
    ASSERT_LE((run.position("Box") - start).norm(), 1e-9) << "step " << i;
    ASSERT_LE(run.velocity("Box").norm() + run.turning("Box").norm(), 1e-9) << "step " << i;
  }
  EXPECT_LE(run.report().max_penetration(), 1e-12);
}

// Deceleration mu g in every step, and rest afterwards.
TEST(PythonSolver, SlidesABoxToAStop) {
  MixedRun run = solved_in_python("box_on_plane.gravitas", {"Body.Box.LinearVelocity={2,0,0}"});
  const double per_step = 0.3 * 9.81 * 0.01;
  const int stop = static_cast<int>(2.0 / per_step);
  for (int i = 1; i <= stop; ++i) {
    run.steps(1);
    ASSERT_NEAR(run.velocity("Box").x(), 2.0 - i * per_step, 1e-9) << "step " << i;
  }
  run.steps(1);
  const double stopped = run.position("Box").x();
  run.steps(50);
  EXPECT_NEAR(run.position("Box").x(), stopped, 1e-9);
  EXPECT_NEAR(run.position("Box").y(), 0.1, 1e-9);
}

// e times the speed of a fall through what was left of the gap.
TEST(PythonSolver, BouncesWithTheShareOfTheSpeedOfArrival) {
  MixedRun run = solved_in_python("bounce.gravitas");
  int landings = 0;
  for (int i = 0; i < 600 && landings < 3; ++i) {
    const double gap = run.position("Ball").y() - 0.5, before = run.velocity("Ball").y();
    run.steps(1);
    const double after = run.velocity("Ball").y();
    if (before >= 0.0 || after <= before) continue;
    ++landings;
    const double arrival = std::sqrt(before * before + 2.0 * 9.81 * gap);
    ASSERT_NEAR(after, 0.8 * arrival, 1e-12 * arrival);
    ASSERT_NEAR(run.position("Ball").y(), 0.5, 1e-12);
  }
  EXPECT_EQ(landings, 3);
}

// Torque over moment, then the motor's speed: a disc of 12 kg and 0.5 m has 1.5 kg m^2.
TEST(PythonSolver, DrivesAMotorWithItsTorqueUpToItsSpeed) {
  MixedRun run = solved_in_python("motor_disc.gravitas");
  for (int i = 1; i <= 240; ++i) {
    run.steps(1);
    ASSERT_NEAR(run.turning("Rotor").y(), std::min(5.0, i * 0.01 * 3.0 / 1.5), 1e-12) << "step " << i;
  }
}

struct Both {
  const char* scene;
  std::vector<std::string> bodies;
  std::uint32_t steps;
};

void PrintTo(const Both& both, std::ostream* out) { *out << both.scene; }

class BothSolvers : public ::testing::TestWithParam<Both> {};

INSTANTIATE_TEST_SUITE_P(Scenes, BothSolvers,
                         ::testing::Values(Both{"pendulum.gravitas", {"Ball"}, 300},
                                           Both{"double_pendulum.gravitas", {"Upper", "Lower"}, 200},
                                           Both{"motor_disc.gravitas", {"Rotor"}, 200},
                                           Both{"bounce.gravitas", {"Ball"}, 200}),
                         [](const auto& one) {
                           const std::string name = one.param.scene;
                           return name.substr(0, name.find('.'));
                         });

// The laws have one solution here: whoever solves them, the motion is the same.
TEST_P(BothSolvers, MoveTheBodiesAlike) {
  MixedRun python = solved_in_python(GetParam().scene);
  MixedRun sequential({kScenes + GetParam().scene}, {"Solver=Sequential", "Solver.Iterations=10000"}, Slot::kSolver);
  python.steps(GetParam().steps);
  sequential.steps(GetParam().steps);
  for (const std::string& body : GetParam().bodies) {
    EXPECT_LE((python.position(body) - sequential.position(body)).norm(), 1e-9) << body;
    EXPECT_LE((python.velocity(body) - sequential.velocity(body)).norm(), 1e-9) << body;
  }
  EXPECT_LE(python.report().max_joint_error(), 1e-5);
}

TEST(PythonSolver, GivesTheSameBitsAgain) {
  const std::vector<std::string> overrides = {"Solver=PythonIslands"};
  EXPECT_EQ(outcome_of(scene("stack.gravitas"), overrides).chain, outcome_of(scene("stack.gravitas"), overrides).chain);
}

// Types that no installed plugin has were told by their number.
TEST(PythonForce, ItsTypeIsNamedWhereAnotherCannotTakeThePlace) {
  const harness::ScratchFolder folder;
  const std::string capsule = in_shell(folder.path("syrup.capsule"));
  const std::string worker =
      folder.write("syrup.py", "import sys\nsys.path.append('" + kFolder +
                                   "')\nfrom force_drag import Drag\nfrom gravitas_worker import Type, main\n"
                                   "class Syrup(Drag):\n"
                                   "  name = 'PythonSyrup'\n"
                                   "  types = [Type('Syrup', 'Slow.', Drag.types[0].properties)]\n"
                                   "main(Syrup)\n");
  const std::string scene = folder.write("scene.gravitas", R"(
    Forces { Force { Type = "Syrup" Id = "Oil" CustomProperties { LinearCoefficient = 2 } } }
    Environment {
      KineticIntegrator = "SemiImplicitEuler"
      Space { Bodies { Body { Id = "Ball" Mass = 1 PrincipalMoments = {1, 1, 1} Forces = {"Oil"} } } }
    }
    Plugins { Plugin { Slot = "force" Hosting = "grpc" Command = "/usr/bin/python3 -B syrup.py" } })");
  const Ended captured = ended(kGravitas + " capture " + in_shell(scene) + " --slot force --steps 1 --out " + capsule);
  ASSERT_EQ(captured.code, 0) << captured.words;
  const std::string replay = kGravitas + " replay " + capsule + " --plugin Gravity";
  const Ended named = ended(replay);
  EXPECT_EQ(named.code, 2) << named.words;
  EXPECT_THAT(named.words, HasSubstr("'Gravity' cannot take the place: it does not serve the type 'Syrup'"));
  std::filesystem::remove(worker);
  EXPECT_THAT(ended(replay).words,
              testing::ContainsRegex("type of id [0-9a-f]+ of plugin 'PythonSyrup', which is not to be had"));
}

// ---- the kit

// A worker and what of the kit it is judged by.
struct Judged {
  const char* worker;
  std::vector<std::string> parts;
};
void PrintTo(const Judged& one, std::ostream* out) { *out << one.worker; }

class PythonWorker : public ::testing::TestWithParam<Judged> {};

// Levels C0, C1 and C4 are of the SDK, which the first two show; a solver in Python takes a hundredth of a second for a call.
INSTANTIATE_TEST_SUITE_P(Each, PythonWorker,
                         ::testing::Values(Judged{"collision_balls", {""}}, Judged{"force_drag", {""}},
                                           Judged{"solver_islands",
                                                  {"--level C3", "--level C5", "--case purity/after-others"}}),
                         [](const auto& one) { return std::string(one.param.worker); });

// With the fewest calls, and with as long as a busy machine takes for them.
TEST_P(PythonWorker, ConformsSaysTheKit) {
  const std::string command = "/usr/bin/python3 " + in_shell(kFolder + GetParam().worker + ".py");
  for (const std::string& part : GetParam().parts) {
    const Ended check = ended(kPython + " " + kGravitas + " check " + in_shell(command) +
                              " --quick --quick-limit 300 --calls 300 " + part);
    EXPECT_EQ(check.code, 0) << check.words;
  }
}

TEST(PythonKit, NonsenseIsNoRefusal) {
  const auto check = [](const std::string& worker) {
    const std::string command = "/usr/bin/python3 " + in_shell(kFolder + worker);
    return ended(kPython + " " + kGravitas + " check " + in_shell(command) + " --case handshake/magic");
  };
  const Ended sound = check("force_drag.py");
  EXPECT_EQ(sound.code, 0) << sound.words;
  const Ended mumbling = check("mumbling_drag.py");
  EXPECT_EQ(mumbling.code, 4) << mumbling.words;
  EXPECT_THAT(mumbling.words, HasSubstr("it answers with something else than Welcome or Refusal"));
}

// It was no declaration any more, and no word of why.
TEST(PythonDeclaration, IsNotHiddenByWhatThePluginPrints) {
  const harness::ScratchFolder folder;
  const std::string worker =
      folder.write("talking.py", "import os\nimport sys\nsys.path.append('" + kFolder +
                                     "')\nfrom force_drag import Drag\nfrom gravitas_worker import main\n"
                                     "print('has loaded', flush=True)\nos.system('echo has started')\nmain(Drag)\n");
  const Ended check = ended(kPython + " " + kGravitas + " check " +
                            in_shell("/usr/bin/python3 -B " + in_shell(worker)) + " --case handshake/magic");
  EXPECT_EQ(check.code, 0) << check.words;
}

// It was the SDK's line alone.
TEST(PythonDeclaration, AMistakeIsToldWithTheLineOfItsAuthor) {
  const harness::ScratchFolder folder;
  const std::string worker = folder.write("mistaken.py",
                                          "from gravitas_worker import Property\n\n"
                                          "size = Property.number('Size', 'm', requird=True)\n");
  const Ended describe =
      ended(kPython + " " + kGravitas + " describe " + in_shell("/usr/bin/python3 -B " + in_shell(worker)));
  EXPECT_EQ(describe.code, 2) << describe.words;
  EXPECT_THAT(
      describe.words,
      HasSubstr("TypeError: Property.__init__() got an unexpected keyword argument 'requird' (" + worker + ":3)"));
}

TEST(PythonDeclaration, SaysWhichModulesAreMissingAndWhereTheyAre) {
  const std::string check = " " + kGravitas + " check ", script = in_shell(kFolder + "force_drag.py");
  const Ended none = ended(kPython + check + in_shell("/usr/bin/python3 -S " + script));
  EXPECT_EQ(none.code, 2) << none.words;
  EXPECT_THAT(none.words, HasSubstr("No module named 'numpy'; it needs Debian's packages python3-numpy, "));
  const Ended lost = ended("PYTHONPATH=" + check + in_shell("/usr/bin/python3 " + script));
  EXPECT_EQ(lost.code, 2) << lost.words;
  EXPECT_THAT(lost.words, HasSubstr("No module named 'gravitas_worker'; PYTHONPATH must name the folder of the Python "
                                    "SDK: " +
                                    in_shell(in_build("/lib/python"))));
}

}  // namespace
}  // namespace gravitas
