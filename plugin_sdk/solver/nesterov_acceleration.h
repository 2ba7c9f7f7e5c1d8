// Nesterov acceleration of the sweeps: what takes plain relaxation n^2 of them takes some n.
//
// With z_k the multipliers (and what is linear in them) after sweep k, a sweep starts from where they are going,
//
//   y_k = z_k + (t_k - 1)/t_{k+1} (z_k - z_{k-1}),   t_{k+1} = (1 + sqrt(1 + 4 t_k^2))/2,   z_{k+1} = sweep(y_k)
//
// and t begins anew at 1 where a sweep turns back, (y_k - z_{k+1}) . (z_{k+1} - z_k) > 0, each multiplier's square counted
// as the energy that it is, times its response. What sweeps end with has been relaxed and projected like any other, so they
// end at the same place; only the way is another.
//
// The first kPlain sweeps are plain: most of what touches is done by then. Where a sweep changes `growth` times what one did
// since, twice as many follow as before: sliding friction is no gradient, and of thousands of contacts on one body the
// multipliers may be anything, on which acceleration swings without end.
//
// Sources: Nesterov, Soviet Math. Doklady 27 (1983) 372; O'Donoghue, Candes, Found. Comput. Math. 15 (2015) 715, whose
// gradient scheme the restart is; Mazhar et al., ACM Trans. Graph. 34 (2015) 32, for contacts, with gradient steps in place
// of sweeps.
#pragma once

#include <vector>

namespace gravitas {

// What is swept: multipliers, then what is linear in them.
class SweptState {
 public:
  virtual ~SweptState() = default;

  virtual void read(std::vector<double>* state) const = 0;
  // What a law's value changes by with one of each multiplier.
  virtual void read_responses(std::vector<double>* responses) const = 0;
  virtual void write(const std::vector<double>& state) = 0;

 protected:
  SweptState() = default;
  SweptState(const SweptState&) = default;
  SweptState& operator=(const SweptState&) = default;
};

class NesterovAcceleration {
 public:
  explicit NesterovAcceleration(double growth = 10.0) : growth_(growth) {}
  // What was swept before says nothing about what comes.
  void forget() { sweeps_ = 0, plain_ = kPlain; }
  // Before a sweep: the state goes on to y_k.
  void go_ahead(SweptState* swept);
  // After it; `change`: of the sweep, m or m/s.
  void note(const SweptState& swept, double change);

 private:
  static constexpr int kPlain = 8;
  const double growth_;

  int sweeps_ = 0, plain_ = kPlain;
  double t_ = 1.0;
  double least_ = 0.0;                        // change since t began
  std::vector<double> response_;              // of the multipliers
  std::vector<double> before_, now_, ahead_;  // z_{k-1}, z_k, y_k
};

}  // namespace gravitas
