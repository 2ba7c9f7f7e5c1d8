// A scene, its edits, and where they lead, for the tests of runs that are edited on the way.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "services/run/session.h"
#include "tests/run_quietly.h"
#include "tests/services/cli/program.h"

namespace gravitas::edited {

inline constexpr double kStep = 0.01;  // s

struct Row {
  Vector3 position, velocity;
  Quaternion orientation;
};

// A scene, its edits, and where it ends.
struct EditedRun {
  RunOptions options;
  harness::ScratchFolder folder;

  explicit EditedRun(const std::string& scene, const std::vector<std::string>& edits = {},
                     const std::vector<std::string>& overrides = {}) {
    options.scenes = {folder.write("scene.gravitas", scene)};
    options.hosting = {{std::nullopt, kernel::Hosting::kDirect}};
    options.overrides = overrides;
    options.edits = edits;
    options.trajectory = folder.path("motion.csv");
  }
  RunResult run() {
    RunResult result = harness::run_quietly(options);
    EXPECT_EQ(result.outcome, RunOutcome::kCompleted) << result.fault;
    return result;
  }
  // Of the last sample.
  std::map<std::string, Row> end() {
    run();
    std::map<std::string, Row> rows;
    std::istringstream text(harness::read_file(options.trajectory));
    std::string line, last;
    std::getline(text, line);
    while (std::getline(text, line)) {
      std::vector<std::string> cells;
      std::istringstream row(line);
      for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
      if (cells[0] != last) rows.clear();
      last = cells[0];
      const auto vector = [&](std::size_t i) {
        return Vector3(std::stod(cells[i]), std::stod(cells[i + 1]), std::stod(cells[i + 2]));
      };
      const Vector3 turn = vector(6);
      rows[cells[1]] = {vector(2), vector(9), {std::stod(cells[5]), turn.x(), turn.y(), turn.z()}};
    }
    return rows;
  }
  // Why it stops on the way.
  std::string fault() { return harness::run_quietly(options).fault; }
  std::string refusal() {
    try {
      harness::run_quietly(options);
    } catch (const BadInput& problem) {
      return problem.what();
    }
    ADD_FAILURE() << "it was not refused";
    return {};
  }
};

inline std::string scene(const std::string& bodies, const std::string& rest = "") {
  return R"(
Geometries { Geometry { Type = "Sphere" Id = "Unit" CustomProperties { Radius = 0.1 } }
             Geometry { Type = "Halfspace" Id = "Flat" } }
Materials { Material { Id = "Rubber" RestitutionCoefficient = 0.5 StaticFrictionCoefficient = 0 } }
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -10, 0} } } }
Simulator { CustomProperties { TimeStep = 0.01 Duration = 1 SleepEnergy = 0 } }
Environment { KineticIntegrator = "Verlet" Space { Bodies { )" +
         bodies + "} }\n" + rest + "}\n";
}

inline std::string ball(const std::string& id, const std::string& kinetic, const std::string& more = "") {
  return "Body { Id = \"" + id + "\" GeometryId = \"Unit\" Mass = 2 Material = \"Rubber\" KineticProperties { " +
         kinetic + " } " + more + " }\n";
}

inline const std::string kFalls = "Forces = { \"Down\" }";

}  // namespace gravitas::edited
