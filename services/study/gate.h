// What a study is held against: errors, orders and evaluations, which are the same on every machine. Times are not gated.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "gravitas/study/v1/study.pb.h"

namespace gravitas::study {

struct Demand {
  enum class What : std::uint8_t {
    kError,       // the best rung is at most `high` off
    kOrder,       // the observed order is from `low` to `high`
    kEvaluations  // an error of at most `low` takes at most `high` evaluations
  };
  What what;
  std::string problem, method;
  double low, high;
  bool is_of_shipped = false;  // not of a scene of the user's that is called so, too
};

// A method's order is to be within this of the theory's.
inline constexpr double kOrderTolerance = 0.2;

// Of the shipped problems: bounds of errors, and orders of those whose ladders show them.
std::vector<Demand> built_in_demands();

// From a file, a demand a line, `#` comments:
//   error PROBLEM METHOD LARGEST
//   order PROBLEM METHOD LOWEST HIGHEST
//   evaluations PROBLEM METHOD ERROR LARGEST
// PROBLEM and METHOD are names of those that there are (shipped and offered), or of `problems` and `methods`. Throws BadInput
// with file and line.
std::vector<Demand> read_demands(const std::string& path, std::vector<std::string> problems,
                                 std::vector<std::string> methods);

// Fills failures and demands of the study. What was not run, or was interrupted, is not looked at; nothing is missed by a ladder
// that came to the end of its CPU before it could show it.
void apply_gate(const std::vector<Demand>& demands, v1::Study* study);

}  // namespace gravitas::study
