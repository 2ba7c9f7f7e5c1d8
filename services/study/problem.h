// The problems of a study: scenes of deploy/scenes/study, each with what is known of it. References of 17 digits are closed
// forms, or were computed in quadruple precision; they stand in problem.cc, with their sources in the heads of the scenes.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "services/study/method.h"

namespace gravitas::study {

// Of one body at one time.
struct Known {
  enum class What : std::uint8_t { kPosition, kAttitude };
  What what = What::kPosition;
  const char* body;
  double time;  // s, a multiple of Duration / `steps` of its problem
  // m, world, of the centre of mass; or (w, x, y, z) of the principal axes
  std::vector<double> value;
  double size = 1.0;  // m, that the error counts by; attitudes count in rad
};

// What the built-in gate wants of the best rung of a method.
struct Bound {
  std::string method;
  double error;
};

struct Problem {
  std::string name;    // of the scene's file, too
  const char* family;  // "smooth", "contact", "stiff", "extreme"
  Task task;
  std::uint32_t steps;  // of the coarsest rung
  std::string reference;
  double uncertainty;  // of the reference, a share of its size
  std::vector<Known> known;
  std::vector<Bound> bounds;
  // Integrators whose ladders are to show the order of their theory, however few of their finer rungs a slow machine runs:
  // the others' are not yet there, or go beyond it.
  std::vector<std::string> orders = {};
};

// All that are shipped.
std::span<const Problem> shipped_problems();

// The named ones, in the order of the list; all of them if `names` is empty. A family stands for its problems. Throws
// BadInput for another name, with the nearest and the list.
std::vector<Problem> named_problems(const std::vector<std::string>& names);

// Path of its scene: in the folder deploy/scenes/study above this program. Throws BadInput where there is none.
std::string scene_of(const Problem& problem);

}  // namespace gravitas::study
