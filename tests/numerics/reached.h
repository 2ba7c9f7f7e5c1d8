// What a method reaches on a reference problem beside what is wanted of it: an expectation, and a row of the table in
// tests/numerics/PROBLEMS.md.
#pragma once

#include <ctime>
#include <string>

namespace gravitas::harness {

struct Reached {
  std::string problem, method, figure;  // "bounce", "Continuous, Verlet, 10 ms", "energy, relative RMS"
  double target = 0.0;                  // what is wanted
  double value = 0.0;                   // what came out
  double seconds = 0.0;                 // of the run, CPU
  double bound = 0.0;                   // what the test insists on where the target is missed; 0: the target
};

// Expects value <= bound, and keeps the row.
void expect_reached(const Reached& row);

// CPU time since it was made, s.
class CpuClock {
 public:
  double seconds() const { return static_cast<double>(std::clock() - start_) / CLOCKS_PER_SEC; }

 private:
  std::clock_t start_ = std::clock();
};

// The folder that tables are to be written to; null: they are not. It is what GRAVITAS_TABLES says.
const char* table_folder();

// Whether runs that take minutes are wanted: GRAVITAS_LONG_PROBLEMS is set.
bool runs_long_problems();

}  // namespace gravitas::harness
