// The methods that a study compares: a simulator, an integrator and a solver, and what of them is made finer from rung to
// rung. One table holds those that are offered; any others that are installed are named in the same way.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "services/catalog/catalog.h"

namespace gravitas::study {

// Problems that ask the same of a method.
enum Task : unsigned {
  kMotion = 1,    // nothing can touch: free and jointed bodies
  kStiff = 2,     // the same, with forces far stiffer than the motion that is of interest
  kContacts = 4,  // bodies touch
};

struct Method {
  std::string simulator, integrator, solver;
  // Beside these, as --set has it: "Integrator.Order=6".
  std::vector<std::string> settings = {};
  // What becomes finer: the time step (empty), or an accuracy by its path, "Integrator.Accuracy".
  std::string accuracy = {};
  double order = 0.0;      // by theory, of the error on smooth problems that is observed; 0: none that is gated
  unsigned tasks = 0;      // on which it is offered unasked
  std::string label = {};  // instead of the integrator in the name

  // "Smooth/RK4/Direct"; of what both a step and an accuracy can make finer "…/Accuracy" at the end.
  std::string name() const;
  bool climbs_accuracy() const { return !accuracy.empty(); }
  // False where the simulator is for bodies that cannot touch.
  bool bears_contacts() const { return simulator != "Smooth"; }
};

// All that are offered.
std::span<const Method> offered_methods();

// Those that `words` name, in the order of the table: whole names, or parts of them in order ("RK4", "Smooth/RK4",
// "Continuous"), which count for the tasks alone that they are offered for. SIMULATOR/INTEGRATOR/SOLVER of plugins in
// `installed` that the table lacks is added; an integrator with an Accuracy then climbs by it. Throws BadInput for a word that
// names nothing, with the nearest and the list.
std::vector<Method> named_methods(const std::vector<std::string>& words, const Catalog& installed);

}  // namespace gravitas::study
