// Charts of curves as parts of an SVG: axes with ticks, curves with marks, what failed hollow at an edge, a legend.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace gravitas::study {

struct Axis {
  std::string title;
  double low, high;  // where it is logarithmic above 0
  bool is_log = true;
};

struct Mark {
  double x, y;
  std::string label = {};  // near the mark, where there is room
};

struct Curve {
  std::string name;
  std::size_t style = 0;  // its colour and mark
  std::vector<Mark> marks;
  std::vector<double> failed = {};  // y of hollow marks at the right edge
  std::string note = {};            // after the name, in the legend
  bool has_steps = false;           // goes on at its height to the next mark, without marks
};

struct Chart {
  std::string title;
  Axis x, y;
  std::vector<Curve> curves;
  std::optional<double> band = {};                              // grey up to this x: nothing is known there
  std::vector<double> slopes = {};                              // guides: y as x^(-1/slope)
  double top = 0.0, left = 0.0, width = 440.0, height = 440.0;  // points, titles of axes outside
};

// Curves look as their names in the legend do. Styles repeat after 24.
std::string draw(const Chart& chart);
std::string legend(const std::vector<Curve>& curves, double left, double top);
double legend_width(const std::vector<Curve>& curves);

// An axis over whole decades that holds all of `values` that are finite and > 0; at least one decade.
Axis decades(const std::string& title, const std::vector<double>& values);

}  // namespace gravitas::study
