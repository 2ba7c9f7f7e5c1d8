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
  // Of a problem that is shipped, not of a scene of the user's that is called so, too; nor of what nobody chose to run.
  bool is_built_in = false;
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

// Fills failures, what is not shown or undecided, and demands of the study. Not shown is what a file demands of a ladder that
// was not run or came to the end of its CPU, and what one misses that was interrupted; built-in demands of one that came to the
// end of its CPU are undecided.
void apply_gate(const std::vector<Demand>& demands, v1::Study* study);

// Nothing failed, nothing is not shown, and nobody interrupted it.
bool is_passed(const v1::Study& study);

}  // namespace gravitas::study
