// For tests against results that are known beforehand: what a run's trajectory holds, and comparisons that count.
#pragma once

#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "plugin_sdk/math/types.h"

namespace known_result {

using gravitas::Vector3;

struct Sample {
  double time = 0.0;                                                            // s
  Vector3 position = Vector3::Zero();                                           // of the geometry's frame, m
  Vector3 velocity = Vector3::Zero();                                           // of the centre of mass, m/s
  gravitas::Quaternion orientation = gravitas::Quaternion(1.0, 0.0, 0.0, 0.0);  // body to world
  Vector3 angular_velocity = Vector3::Zero();                                   // rad/s, world
};

// The samples of a body, none where there is no file, in that of `gravitas run --trajectory`: a header, then
// time,body,px,py,pz,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz.
inline std::vector<Sample> samples_of(const std::string& body, const char* file) {
  std::vector<Sample> samples;
  if (file == nullptr) return samples;
  std::ifstream lines(file);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string time, name, number;
    std::getline(words, time, ',');
    std::getline(words, name, ',');
    if (name != body) continue;
    std::vector<double> n;
    while (std::getline(words, number, ',')) n.push_back(std::stod(number));
    if (n.size() != 13) continue;
    samples.push_back({std::stod(time),
                       {n[0], n[1], n[2]},
                       {n[7], n[8], n[9]},
                       gravitas::Quaternion(n[3], n[4], n[5], n[6]),
                       {n[10], n[11], n[12]}});
  }
  return samples;
}

inline int failures = 0;

inline void expect(bool holds, const std::string& what) {
  if (holds) return;
  ++failures;
  std::fprintf(stderr, "FAILED: %s\n", what.c_str());
}
inline void expect_near(const std::string& what, double came, double right, double tolerance) {
  expect(came - right <= tolerance && right - came <= tolerance,
         what + " is " + std::to_string(came) + ", right is " + std::to_string(right));
}
inline void expect_near(const std::string& what, const Vector3& came, const Vector3& right, double tolerance) {
  for (int k = 0; k < 3; ++k) expect_near(what + '.' + "xyz"[k], came[k], right[k], tolerance);
}

}  // namespace known_result
