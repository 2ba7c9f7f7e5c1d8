// The map of stability as a picture.
#pragma once

#include <string>

#include "gravitas/study/v1/study.pb.h"

namespace gravitas::study {

// SVG: a band for each integrator, in it a row for each damping; along it k h^2 / m. Colour: growth in a step as it was measured
// on the engine, blue where it is stable, the darker the more is damped, red where it grows. A black tick: the limit by theory.
std::string stability_diagram(const v1::Study& study);

}  // namespace gravitas::study
