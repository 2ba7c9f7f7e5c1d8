// Extrapolation of a method of order 1 to step 0 (Richardson; the scheme of Aitken and Neville): the same interval is made
// in 1, 2, 3, … equal pieces, the results are T_{j,1}, and
//
//   T_{j,k+1} = T_{j,k} + (T_{j,k} - T_{j-1,k}) / (n_j / n_{j-k} - 1),    n_j = j,
//
// is of order k + 1 where the error of the method has an expansion in powers of the step, as it does while nothing in the
// interval jumps. Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.9.
//
// The coarsest results may have no part in it: their first piece brings the start, which is that of no method, to where the
// method's own results lie, and that is all there is of them. T_{j,k} leaves out the first j - k of them. That one is taken
// whose estimated error is the least (as in C. J. F. Ridders' differentiation), one for all numbers.
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
  // With all numbers in place: the least estimated error of an extrapolation, which is the largest |T_{j,k} - T_{j,k-1}| / scale
  // of its numbers, and where results are left out (1 < k < j) |T_{j,k} - T_{j-1,k-1}| / scale; infinite for the first result, and
  // where a number is not finite.
  double add();
  // That extrapolation.
  std::span<const double> best() const { return table_[best_]; }
  // What it makes of the results in 1, 2, 3, … pieces: the sum of each times its weight, 0 of those left out. Of l to j pieces
  // that of n is the product of n / (n - m) over the others, m. Valid until the next call.
  std::span<const double> weights();
  // What tends to 0, how near it is in the extrapolation that leaves least of it: the largest |T_{j,k}| there.
  double least_size() const;

 private:
  std::vector<double> row_;
  std::vector<double> scale_;
  std::vector<std::vector<double>> table_;  // the last row: T_{j,1} … T_{j,j}
  std::vector<double> error_;               // of each of these
  std::vector<double> weights_;
  std::size_t pieces_ = 0, best_ = 0;
};

}  // namespace gravitas
