// What ladders tell: the observed order, the cost of an accuracy, and how methods compare over many problems.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "gravitas/study/v1/study.pb.h"

namespace gravitas::study {

// Errors that summaries ask for.
inline constexpr std::array<double, 3> kWantedErrors = {1e-3, 1e-6, 1e-9};

// Derivatives that integrators asked for and iterations of solvers: what of the work is the same on every machine. At least
// the steps.
double evaluations(const v1::Rung& rung);

// Of the rungs that did not fail; infinite where all did.
double best_error(const v1::Ladder& ladder);

// Fills observed_order, achieved_to_requested and reached from the rungs; `duration` in s. Rungs that failed count for
// none of them.
void judge(double duration, double uncertainty, v1::Ladder* ladder);

// Dolan and More, Math. Programming 91 (2002): the share of problems on which a method costs at most `factor` times as much
// as the cheapest one, both to an error of at most `error`.
struct Profile {
  std::string method;
  std::vector<double> ratios;  // ascending, of the problems that it solves
};
// Over the problems whose bodies may touch, or over those where nothing can; `problems` gets how many those are that any
// method solves. Methods that were run on one of them, in order; none where there is a single one, which its table tells all of.
std::vector<Profile> profiles(const v1::Study& study, bool has_contacts, double error, std::size_t* problems);

// There is something for a diagram of them, to kProfileError.
inline constexpr double kProfileError = 1e-6;
bool has_profiles(const v1::Study& study);

// Share of `problems` within `factor`.
double share_within(const Profile& profile, double factor, std::size_t problems);

}  // namespace gravitas::study
