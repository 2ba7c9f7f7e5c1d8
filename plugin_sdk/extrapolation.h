// Extrapolation of a method of order 1 to step 0 (Richardson; the scheme of Aitken and Neville): the same interval is made
// in 1, 2, 3, … equal pieces, the results are T_{j,1}, and
//
//   T_{j,k+1} = T_{j,k} + (T_{j,k} - T_{j-1,k}) / (n_j / n_{j-k} - 1),    n_j = j,
//
// is of order k + 1 where the error of the method has an expansion in powers of the step, as it does while nothing in the
// interval jumps. Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.9.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace gravitas {

class Extrapolation {
 public:
  void begin();
  // A number of the result in one piece more than the last, and the size of an error of 1 in it (> 0), in the same order
  // each time.
  void put(double number, double scale);
  // With all numbers in place: the estimated error, the largest |T_{j,j} - T_{j,j-1}| / scale; infinite for the first
  // result, and where a number is not finite.
  double add();
  // T_{j,j} of the last result.
  std::span<const double> best() const { return table_[pieces_ - 1]; }

 private:
  std::vector<double> row_;
  std::vector<double> scale_;
  std::vector<std::vector<double>> table_;  // the last row: T_{j,1} … T_{j,j}
  std::size_t pieces_ = 0;
};

}  // namespace gravitas
