#include "tests/numerics/reached.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <vector>

namespace gravitas::harness {
namespace {

std::vector<Reached>& rows() {
  static std::vector<Reached> all;
  return all;
}

// Writes the table when all tests have run.
class TableWriter final : public ::testing::Environment {
 public:
  void TearDown() override {
    if (table_folder() == nullptr || rows().empty()) return;
    std::ofstream out(std::string(table_folder()) + "/PROBLEMS.md");
    out << "# Reference problems: wanted and reached\n\n"
           "Written by `GRAVITAS_TABLES=tests/numerics build/release/bin/test_numerics`; with "
           "`GRAVITAS_LONG_PROBLEMS=1`\n"
           "runs have their full length. Hosting direct, one thread; CPU time of the run. Rows marked * miss what is\n"
           "wanted: the README of this folder says why.\n\n"
           "| problem | method | figure | wanted | reached | CPU, s |\n| --- | --- | --- | --- | --- | --- |\n";
    for (const Reached& row : rows()) {
      char numbers[96];
      std::snprintf(numbers, sizeof numbers, "%.0e | %.1e%s | %.2f", row.target, row.value,
                    row.value <= row.target ? "" : " *", row.seconds);
      out << "| " << row.problem << " | " << row.method << " | " << row.figure << " | " << numbers << " |\n";
    }
    EXPECT_TRUE(out.good());
  }
};

[[maybe_unused]] const ::testing::Environment* const writer =
    ::testing::AddGlobalTestEnvironment(new TableWriter);  // GoogleTest deletes it

}  // namespace

void expect_reached(const Reached& row) {
  EXPECT_LE(row.value, row.bound > 0.0 ? row.bound : row.target)
      << row.problem << ", " << row.method << ": " << row.figure;
  rows().push_back(row);
}

const char* table_folder() { return std::getenv("GRAVITAS_TABLES"); }

bool runs_long_problems() { return std::getenv("GRAVITAS_LONG_PROBLEMS") != nullptr; }

}  // namespace gravitas::harness
