// Work-precision diagrams: what an error costs, method by method.
#pragma once

#include <string>

#include "gravitas/study/v1/study.pb.h"

namespace gravitas::study {

// SVG of a problem: the error of every rung against CPU seconds per simulated second, and against evaluations. Curves lead
// from the coarsest setting to the finest, both labelled where there is room; hollow marks at the right edge failed; in the
// grey band errors are below what the reference is good for; dashed guides have the slopes of the orders 1, 2 and 4. A method
// looks the same in all diagrams of a study. Precondition: the problem is one of the study's.
std::string diagram(const v1::Study& study, const v1::Problem& problem);

// SVG of the profiles (analysis.h) to kProfileError, of problems without and with contacts. Precondition: has_profiles().
std::string profile_diagram(const v1::Study& study);

}  // namespace gravitas::study
