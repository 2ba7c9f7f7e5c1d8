// A frame of debug geometry as a picture (SVG): parallel projection, y up, a group per kind with its name as its class
// and a legend, so that a kind can be hidden in a browser or an editor.
#pragma once

#include <string>

#include "gravitas/instrumentation/v1/instrumentation.pb.h"

namespace gravitas::survey {

// Arrows are as long as the picture allows: unit vectors alike, others in proportion to the largest of their kind.
std::string picture(const instrumentation::v1::Frame& frame, const std::string& title);

}  // namespace gravitas::survey
