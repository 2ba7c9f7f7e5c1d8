// What a study measured, in files and for a person.
#pragma once

#include <string>

#include "gravitas/study/v1/study.pb.h"

namespace gravitas::study {

// A line a rung, failures included: problem, family, method, climbs, setting, error, energy_drift, joint_error_m,
// penetration_m, cpu_min_s, cpu_median_s, runs, simulated_s, steps, derivatives, iterations, evaluations, failed, build,
// processor. 17 significant digits of errors, which are the same on every machine, and empty where a run did not come to its
// end; times with 4.
std::string csv(const v1::Study& study);

// A line a cell of the map of stability: growth in a step, measured on the engine and by theory.
std::string stability_csv(const v1::Study& study);

// STUDY.md: how to read it, a table a problem, profiles, limits of stability, what the gate says.
std::string page(const v1::Study& study);

// The short form that the program prints.
std::string summary(const v1::Study& study);

}  // namespace gravitas::study
