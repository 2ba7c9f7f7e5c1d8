// What is held against an answer known beforehand, or against geometry, where a scene of the peers is looked at. Each
// takes the states of all bodies at a time (s), and adds to what was seen before.
#pragma once

#include <vector>

#include "tests/bench/peers/scene.h"

namespace gravitas::peers {

// Any state will do.
void nothing(const Scene& scene, const std::vector<BodyState>& bodies, double time, Figures* figures);

// error_m: the largest distance of a centre from x + v t + g t^2/2.
void fall(const Scene& scene, const std::vector<BodyState>& bodies, double time, Figures* figures);

// energy_drift, as a share; attitude_error_rad from Euler's equations, solved in long double to 1e-12.
void turn(const Scene& scene, const std::vector<BodyState>& bodies, double time, Figures* figures);

// sag_mm: the most by which a centre has ever been below its place; stands: at the end none is half an edge off its own.
void stand(const Scene& scene, const std::vector<BodyState>& bodies, double time, Figures* figures);

// gap_m: the largest distance ever between the points of a joint; tip_error_m: of the last body, at the end.
void hang(const Scene& scene, const std::vector<BodyState>& bodies, double time, Figures* figures);

// energy_error: gained, as a share of the height of the fall.
void rebound(const Scene& scene, const std::vector<BodyState>& bodies, double time, Figures* figures);

// distance_error, as a share of v^2 / (2 mu g); direction_error_deg of the way from the velocity at the start.
void stop(const Scene& scene, const std::vector<BodyState>& bodies, double time, Figures* figures);

// depth_mm: the deepest overlap ever of two bodies, or of one with a plane: the way that would part them.
void overlap(const Scene& scene, const std::vector<BodyState>& bodies, double time, Figures* figures);
void stand_and_overlap(const Scene& scene, const std::vector<BodyState>& bodies, double time, Figures* figures);

// As overlap, and settled_depth_mm: the deepest in the last second; lost: bodies outside of a plane at the end.
void settle(const Scene& scene, const std::vector<BodyState>& bodies, double time, Figures* figures);

}  // namespace gravitas::peers
