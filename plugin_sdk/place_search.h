// When the search for impulses that bring bodies to where joints want them (Derivatives::place_impulses) is at its end:
//
//   for (PlaceSearch search(found);;) {
//     ask; of each body: search.add(what it is asked to move by, how far it goes, where it is); move anew
//     if (search.judge() != PlaceSearch::Verdict::kGoOn) ...
//   }
#pragma once

#include <cstdint>
#include <limits>

#include "plugin_sdk/dynamics.h"

namespace gravitas {

class PlaceSearch {
 public:
  enum class Verdict : std::uint8_t { kGoOn, kFound, kNotFound };

  // `found`: of the way, what may be left where questions bring the bodies no nearer.
  explicit PlaceSearch(double found) : found_(found) {}

  // The square of a body's displacement or velocity, by its mass and largest moment; its attitude is left aside.
  static double size(double inverse_mass, const Vector3& moments, const Twist& twist) {
    return (inverse_mass > 0.0 ? twist.linear.squaredNorm() / inverse_mass : 0.0) +
           moments.maxCoeff() * twist.angular.squaredNorm();
  }
  // Sizes of one body, in the question in hand; coordinates, with a radian each for angles, are rounded.
  void add(double asked, double way, double coordinates) { asked_ += asked, way_ += way, coordinates_ += coordinates; }
  // Ends the question.
  Verdict judge() {
    constexpr int kMost = 40;
    constexpr double kNear = 1e-14;  // of the way
    constexpr double kRounding = 64.0 * std::numeric_limits<double>::epsilon();
    const double asked = asked_, left = found_ * found_ * way_ + kRounding * kRounding * coordinates_;
    const bool is_near = asked <= kNear * kNear * way_, is_nearing = asked < 0.25 * last_;
    asked_ = way_ = coordinates_ = 0.0;
    last_ = asked;
    if (is_near) return Verdict::kFound;
    // what does not come nearer any more is rounding, or not found
    if (!is_nearing) return asked <= left ? Verdict::kFound : Verdict::kNotFound;
    return ++questions_ < kMost ? Verdict::kGoOn : Verdict::kNotFound;
  }

 private:
  double found_;
  double asked_ = 0.0, way_ = 0.0, coordinates_ = 0.0;
  double last_ = std::numeric_limits<double>::infinity();
  int questions_ = 0;
};

}  // namespace gravitas
