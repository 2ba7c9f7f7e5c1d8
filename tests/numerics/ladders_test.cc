// Work against precision: every method climbs a ladder of settings (the step by halves, the accuracy by sqrt(10)) on five
// problems, from useless to rounding. With GRAVITAS_TABLES each run is a row of motion.csv, which
// tests/bench/motion_ladders.py draws, of all problems or of the one whose number is GRAVITAS_LADDER, of all methods or of
// GRAVITAS_LADDER_METHOD; without, two rungs show that errors fall as work grows.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/numerics/motion_problem.h"
#include "tests/numerics/reached.h"

namespace gravitas {
namespace {

using harness::MotionMethod;
using harness::MotionProblem;
using harness::MotionResult;

constexpr double kRepeated = 0.2;  // runs shorter than this are timed seven times, s

struct Ladder {
  const char* number;  // in the list of reference problems
  MotionProblem problem;
  std::uint32_t coarsest;  // steps of the first rung
  int rungs;
  std::uint32_t adaptive_steps;
  double most_seconds = 4.0;  // CPU of a run; above it is a failure
};

std::vector<Ladder> ladders() {
  return {{"2", harness::mujoco_box(), 10, 14, 100},
          {"4", harness::point_pendulum(), 20, 13, 100},
          {"6", harness::heavy_top(), 25, 12, 100},
          {"8", harness::four_bar(), 50, 10, 400},
          {"26", harness::flyball_governor(), 1000, 10, 100, 20.0}};
}

struct Climbed {
  MotionResult result;
  std::vector<double> seconds;  // ascending
  std::string failure;
};

Climbed climb(const MotionProblem& problem, const MotionMethod& method, std::uint32_t steps, double most_seconds) {
  Climbed climbed;
  const harness::CpuClock clock;
  try {
    do {
      climbed.result = harness::run_motion(problem, method, steps, kernel::Simulator::kSmooth, most_seconds);
      climbed.seconds.push_back(climbed.result.seconds);
    } while (climbed.seconds.size() < 7 && climbed.seconds.front() < kRepeated);
    std::ranges::sort(climbed.seconds);
    if (!(climbed.result.error < 1.0)) climbed.failure = "off by more than its size";
  } catch (const std::exception& failure) {
    climbed.failure = failure.what();
    std::ranges::replace(climbed.failure, '\n', ' ');
    std::ranges::replace(climbed.failure, '"', '\'');
    climbed.seconds = {clock.seconds()};
  }
  return climbed;
}

class Table {
 public:
  explicit Table(const std::string& path) : out_(path) {
    out_ << "problem,number,method,order,setting,value,steps,error,energy_error_J,joint_error_m,cpu_min_s,cpu_median_s,"
            "cpu_iqr_s,simulated_s,evaluations,failed\n";
  }

  // Where one took too long, the finer ones are not run: a single step of theirs may take hours.
  void write(const Ladder& ladder, const MotionMethod& method, const char* setting, double value, std::uint32_t steps) {
    const std::string climber = std::string(ladder.number) + method.name;
    Climbed climbed;
    if (given_up_.contains(climber)) {
      climbed.failure = "not run: a coarser one took too long";
    } else {
      climbed = climb(ladder.problem, method, steps, ladder.most_seconds);
      if (climbed.seconds.front() > ladder.most_seconds) given_up_.insert(climber);
    }
    const MotionResult& r = climbed.result;
    const std::vector<double>& t = climbed.seconds;
    char numbers[320];
    std::snprintf(numbers, sizeof numbers, "%g,%s,%.6g,%u,%.4g,%.3g,%.3g,%.4g,%.4g,%.3g,%g,%llu,", method.order,
                  setting, value, steps, r.error, r.energy_error, r.joint_error, t.empty() ? 0.0 : t.front(),
                  t.empty() ? 0.0 : t[t.size() / 2], t.empty() ? 0.0 : t[t.size() * 3 / 4] - t[t.size() / 4],
                  ladder.problem.duration,
                  static_cast<unsigned long long>(std::max<std::uint64_t>(r.derivatives, steps)));
    out_ << ladder.problem.name << ',' << ladder.number << ',' << method.name << ',' << numbers << '"'
         << climbed.failure << "\"\n"
         << std::flush;
  }

  bool is_good() const { return out_.good(); }

 private:
  std::ofstream out_;
  std::set<std::string> given_up_;
};

TEST(Ladders, AreClimbedWhereATableIsAskedFor) {
  if (harness::table_folder() == nullptr) GTEST_SKIP() << "GRAVITAS_TABLES is not set";
  Table table(std::string(harness::table_folder()) + "/motion.csv");
  const char *only = std::getenv("GRAVITAS_LADDER"), *climber = std::getenv("GRAVITAS_LADDER_METHOD");
  const auto climbing = [&](std::vector<MotionMethod> methods) {
    std::erase_if(methods, [&](const MotionMethod& method) { return climber != nullptr && method.name != climber; });
    return methods;
  };
  for (const Ladder& ladder : ladders()) {
    if (only != nullptr && std::string(only) != ladder.number) continue;
    for (const MotionMethod& method : climbing(harness::fixed_step_methods()))
      for (int rung = 0; rung < ladder.rungs; ++rung) {
        const std::uint32_t steps = ladder.coarsest << rung;
        table.write(ladder, method, "time_step_s", ladder.problem.duration / steps, steps);
      }
    for (int half_digits = 4; half_digits <= 26; ++half_digits) {
      const double accuracy = std::pow(10.0, -0.5 * half_digits);
      for (const MotionMethod& method : climbing(harness::adaptive_methods(accuracy)))
        table.write(ladder, method, "accuracy", accuracy, ladder.adaptive_steps);
    }
  }
  EXPECT_TRUE(table.is_good());
}

// Errors fall at least by a hundred where the accuracy does by 1e5.
TEST(Ladders, LeadUpwards) {
  for (const MotionProblem& problem : {harness::mujoco_box(), harness::point_pendulum(), harness::heavy_top()}) {
    double errors[2];
    for (const int finer : {0, 1}) {
      const MotionMethod method = harness::adaptive_methods(finer == 0 ? 1e-6 : 1e-11).front();
      const Climbed climbed = climb(problem, method, 100, 4.0);
      EXPECT_EQ(climbed.failure, "") << problem.name;
      errors[finer] = climbed.result.error;
    }
    EXPECT_LT(errors[1], 1e-2 * errors[0]) << problem.name;
  }
}

}  // namespace
}  // namespace gravitas
