#include "tests/numerics/stability.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <iterator>
#include <limits>
#include <map>
#include <span>
#include <stdexcept>

namespace gravitas::harness {
namespace {

using Matrix2 = Eigen::Matrix2d;
using Theory = Eigen::MatrixXd (*)(double k, double c);

// Of displacements in the engine: so small that one step of adaptive methods is as exact as is asked for, and a
// power of two.
constexpr double kSmall = 0x1p-300;

double radius(const Eigen::MatrixXd& matrix) { return matrix.eigenvalues().cwiseAbs().maxCoeff(); }

// ---- theory, with h = 1: z = d/dt of (x, v)

Matrix2 rates(double k, double c) { return (Matrix2() << 0.0, 1.0, -k, -c).finished(); }

// A polynomial of z, coefficients from the constant one.
Matrix2 polynomial(std::span<const double> coefficients, const Matrix2& z) {
  Matrix2 sum = Matrix2::Zero();
  for (std::size_t i = coefficients.size(); i-- > 0;) sum = sum * z + coefficients[i] * Matrix2::Identity();
  return sum;
}

constexpr double kTaylor[] = {1.0, 1.0, 1.0 / 2, 1.0 / 6, 1.0 / 24, 1.0 / 120};

Eigen::MatrixXd euler(double k, double c) { return Matrix2::Identity() + rates(k, c); }

Eigen::MatrixXd semi_implicit_euler(double k, double c) {
  return (Matrix2() << 1.0 - k, 1.0 - c, -k, 1.0 - c).finished();
}

// v is predicted by v + a for the second derivative.
Eigen::MatrixXd verlet(double k, double c) {
  const Eigen::RowVector2d x(1.0, 0.0), v(0.0, 1.0), a = -k * x - c * v;
  const Eigen::RowVector2d next = x + v + 0.5 * a, after = -k * next - c * (v + a);
  return (Matrix2() << next, v + 0.5 * (a + after)).finished();
}

// The state is (x, last displacement, v).
Eigen::MatrixXd basic_verlet(double k, double c) {
  const Eigen::RowVector3d x(1.0, 0.0, 0.0), d(0.0, 1.0, 0.0), v(0.0, 0.0, 1.0), a = -k * x - c * v;
  const Eigen::RowVector3d moved = d + a, next = x + moved, after = -k * next - c * (moved + 0.5 * a);
  return (Eigen::Matrix3d() << next, moved, moved + 0.5 * after).finished();
}

Eigen::MatrixXd rk4(double k, double c) { return polynomial(std::span(kTaylor).first<5>(), rates(k, c)); }

// Exact drifts between kicks; in a kick v' = -k x - c v at a fixed x, by a Runge-Kutta method: its (R(z) - 1)/z.
double classical(double z) { return 1.0 + z / 2 * (1.0 + z / 3 * (1.0 + z / 4)); }

// Butcher's of order 6: the seventh stage adds -z^7/2160.
double butcher6(double z) {
  return 1.0 + z / 2 * (1.0 + z / 3 * (1.0 + z / 4 * (1.0 + z / 5 * (1.0 + z / 6 * (1.0 - z / 3)))));
}

Eigen::MatrixXd splitting(std::span<const double> weights, double k, double c, double (*kicks)(double) = classical) {
  const auto kick = [&](double s) {
    const double z = -c * s, pushed = s * kicks(z), kept = 1.0 - c * pushed;
    return (Matrix2() << 1.0, 0.0, -k * pushed, kept).finished();
  };
  Matrix2 all = Matrix2::Identity();
  double before = 0.0;
  for (const double weight : weights) {
    const Matrix2 drift = (Matrix2() << 1.0, weight, 0.0, 1.0).finished();
    all = drift * kick(0.5 * (before + weight)) * all;
    before = weight;
  }
  return kick(0.5 * before) * all;
}

Eigen::MatrixXd splitting2(double k, double c) { return splitting(std::array{1.0}, k, c); }

Eigen::MatrixXd splitting4(double k, double c) {
  const double p = 1.0 / (4.0 - std::cbrt(4.0));  // Suzuki
  return splitting(std::array{p, p, 1.0 - 4.0 * p, p, p}, k, c);
}

// Kahan and Li, Math. Comp. 66 (1997), s9odr6a.
Eigen::MatrixXd splitting6(double k, double c) {
  const double a = 0.39216144400731413928, b = 0.33259913678935943860, d = -0.70624617255763935981,
               e = 0.08221359629355080023;
  return splitting(std::array{a, b, d, e, 1.0 - 2.0 * (a + b + d + e), e, d, b, a}, k, c, butcher6);
}

Eigen::MatrixXd implicit_midpoint(double k, double c) {
  const Matrix2 half = 0.5 * rates(k, c);
  return (Matrix2::Identity() - half).inverse() * (Matrix2::Identity() + half);
}

// Its sixth stage adds z^6/600.
Eigen::MatrixXd dormand_prince(double k, double c) {
  const Matrix2 z = rates(k, c);
  constexpr double kWeights[] = {1.0, 1.0, 1.0 / 2, 1.0 / 6, 1.0 / 24, 1.0 / 120, 1.0 / 600};
  return polynomial(kWeights, z);
}

// Beyond z^8 its stages add four terms more.
Eigen::MatrixXd dormand_prince8(double k, double c) {
  constexpr double kWeights[] = {1.0,
                                 1.0,
                                 1.0 / 2,
                                 1.0 / 6,
                                 1.0 / 24,
                                 1.0 / 120,
                                 1.0 / 720,
                                 1.0 / 5040,
                                 1.0 / 40320,
                                 2.691692200169086e-6,
                                 2.341345108209780e-7,
                                 1.494736485459155e-8,
                                 3.613324578128243e-10};
  return polynomial(kWeights, rates(k, c));
}

// P(z) / (1 - z/4)^6: up to z^4 P is that of order 4, the rest follows from the coefficients of RODAS.
Eigen::MatrixXd rodas(double k, double c) {
  constexpr double kWeights[] = {1.0, -1.0 / 2, -1.0 / 16, 1.0 / 24, 5.0 / 768, -0.00215865480625998};
  const Matrix2 z = rates(k, c), inverse = (Matrix2::Identity() - 0.25 * z).inverse();
  Matrix2 sum = Matrix2::Zero();
  // z^i (1 - z/4)^-6 as products of bounded factors: k may be large
  for (std::size_t i = 0; i < 6; ++i) {
    Matrix2 term = kWeights[i] * inverse;
    for (std::size_t j = 0; j < 5; ++j) term = term * (j < i ? Matrix2(z * inverse) : inverse);
    sum += term;
  }
  return sum;
}

// The Pade approximation of e^z with degrees 2 and 3, with products of bounded factors as above.
Eigen::MatrixXd radau(double k, double c) {
  const Matrix2 z = rates(k, c), one = Matrix2::Identity();
  // the denominator's real zero, and the pair of others: (1 - z/g)(1 - 2 a z/(a^2 + b^2) + z^2/(a^2 + b^2))
  const double g = 3.637834252744496, a = 2.681082873627752, b = 3.050430199247411, d = a * a + b * b;
  const Matrix2 real = (one - z / g).inverse(), pair = (one - 2.0 * a / d * z + z * z / d).inverse();
  return real * (pair * (one + 0.4 * z + 0.05 * z * z));
}

const std::map<std::string, Theory>& theories() {
  static const std::map<std::string, Theory> all = {{"Euler", euler},
                                                    {"SemiImplicitEuler", semi_implicit_euler},
                                                    {"Verlet", verlet},
                                                    {"BasicVerlet", basic_verlet},
                                                    {"ImplicitMidpoint", implicit_midpoint},
                                                    {"RK4", rk4},
                                                    {"RKMK4", rk4},
                                                    {"SymplecticSplitting 2", splitting2},
                                                    {"SymplecticSplitting 4", splitting4},
                                                    {"SymplecticSplitting 6", splitting6},
                                                    {"DormandPrince54", dormand_prince},
                                                    {"DormandPrince853", dormand_prince8},
                                                    {"Rosenbrock", rodas},
                                                    {"Radau", radau}};
  return all;
}

// ---- measured

WorldBuilder spring_world(const MotionMethod& method, const std::vector<SpringCell>& cells, double place,
                          double speed) {
  WorldBuilder world;
  world.steps(1000000, 1.0).plugin(Slot::kIntegrator, plugin_path(method.library), method.settings);
  for (const SpringCell& cell : cells) {
    world.point(1.0, {1, 1, 1}, {place, 0, 0});
    world.body().twist.linear = {speed, 0, 0};
    spring_between(&world, {cell.stiffness, cell.damping(), 0.0}, Vector3::Zero(), kNone, Vector3::Zero());
  }
  return world;
}

bool steps(kernel::Environment* world) { return world->step() == kernel::StepOutcome::kCommitted; }

// (x, h v) before the first step and after each.
using Path = std::vector<Eigen::Vector2d>;

// The steps that show the map: of methods with a history, which starts anew, the first is another.
int steps_to_see(const MotionMethod& method) { return method.name == "BasicVerlet" ? 3 : 1; }

// From the paths of two displacements; noise: what of them is not the map, a share.
double radius_of(const MotionMethod& method, const Path& moved, const Path& thrown, double size, double noise) {
  if (steps_to_see(method) == 1) return radius((Matrix2() << moved[1], thrown[1]).finished() / size);
  // what maps three states (x, last displacement, v), which may span two dimensions alone, to the next ones
  const auto state = [](const Path& path, std::size_t at) {
    return Vector3(path[at][0], path[at][0] - path[at - 1][0], path[at][1]);
  };
  Matrix3 now, next;
  now << state(moved, 1), state(thrown, 1), state(moved, 2);
  next << state(moved, 2), state(thrown, 2), state(moved, 3);
  const Vector3 scale = now.colwise().norm().cwiseInverse();
  now *= scale.asDiagonal(), next *= scale.asDiagonal();
  Eigen::CompleteOrthogonalDecomposition<Matrix3> inverse;
  inverse.setThreshold(noise);
  inverse.compute(now);
  return radius(next * inverse.pseudoInverse());
}

std::vector<Path> paths_of(const MotionMethod& method, const std::vector<SpringCell>& cells, double place,
                           double speed) {
  kernel::Environment world(spring_world(method, cells, place, speed).description());
  std::vector<Path> paths(cells.size());
  for (int i = 0;; ++i) {
    for (std::size_t body = 0; body < cells.size(); ++body)
      paths[body].emplace_back(world.state().position[3 * body], world.state().linear_velocity[3 * body]);
    if (i == steps_to_see(method)) return paths;
    if (!steps(&world)) throw std::runtime_error(world.fault()->fault.text());
  }
}

// Eight unit masses at the corners of a box, each two joined by a spring.
struct Lattice {
  std::vector<Vector3> corners;
  Eigen::VectorXd mode;  // the stiffest, of length 1
  double eigenvalue;     // of it, where every spring has stiffness 1

  Lattice() {
    for (int i = 0; i < 8; ++i) corners.emplace_back(i & 1 ? 0.5 : -0.5, i & 2 ? 1.0 : -1.0, i & 4 ? 1.5 : -1.5);
    Eigen::MatrixXd stiffness = Eigen::MatrixXd::Zero(24, 24);
    for (int i = 0; i < 8; ++i)
      for (int j = 0; j < i; ++j) {
        const Vector3 n = (corners[i] - corners[j]).normalized();
        const Matrix3 block = n * n.transpose();
        stiffness.block<3, 3>(3 * i, 3 * i) += block;
        stiffness.block<3, 3>(3 * j, 3 * j) += block;
        stiffness.block<3, 3>(3 * i, 3 * j) -= block;
        stiffness.block<3, 3>(3 * j, 3 * i) -= block;
      }
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> modes(stiffness);
    mode = modes.eigenvectors().col(23);
    eigenvalue = modes.eigenvalues()[23];
  }

  // Displaced by shares of the mode.
  WorldBuilder world(const MotionMethod& method, const SpringCell& cell, double place, double speed) const {
    WorldBuilder builder;
    builder.steps(1000000, 1.0).plugin(Slot::kIntegrator, plugin_path(method.library), method.settings);
    for (std::uint32_t i = 0; i < 8; ++i) {
      builder.point(1.0, {1, 1, 1}, corners[i] + place * mode.segment<3>(3 * i));
      builder.body().twist.linear = speed * mode.segment<3>(3 * i);
      for (std::uint32_t k = 0; k < i; ++k)
        spring_between(&builder,
                       {cell.stiffness / eigenvalue, cell.damping() / eigenvalue, (corners[i] - corners[k]).norm()},
                       Vector3::Zero(), k, Vector3::Zero());
    }
    return builder;
  }

  Eigen::Vector2d shares(const kernel::StateView& state) const {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (std::size_t i = 0; i < 8; ++i) {
      const Vector3 along = mode.segment<3>(3 * static_cast<Eigen::Index>(i));
      sum += Eigen::Vector2d(along.dot(vector_at(state.position, i) - corners[i]),
                             along.dot(vector_at(state.linear_velocity, i)));
    }
    return sum;
  }
};

}  // namespace

std::vector<MotionMethod> mapped_methods() {
  std::vector<MotionMethod> methods = fixed_step_methods();
  for (const MotionMethod& method : adaptive_methods(1.0)) methods.push_back(method);
  return methods;
}

double amplification_in_theory(const MotionMethod& method, const SpringCell& cell) {
  const Eigen::MatrixXd map = theories().at(method.name)(cell.stiffness, cell.damping());
  return map.allFinite() ? radius(map) : std::numeric_limits<double>::infinity();
}

double stability_limit(const MotionMethod& method, double zeta) {
  constexpr double kFinest = 1e-4, kLargest = 1e12, kRounding = 1e-11;
  const auto is_stable = [&](double k) { return amplification_in_theory(method, {k, zeta}) <= 1.0 + kRounding; };
  double low = kFinest;
  if (!is_stable(low)) return 0.0;
  while (low < kLargest && is_stable(1.02 * low)) low *= 1.02;
  if (low >= kLargest) return std::numeric_limits<double>::infinity();
  double high = 1.02 * low;
  for (int i = 0; i < 60; ++i) (is_stable(0.5 * (low + high)) ? low : high) = 0.5 * (low + high);
  return low;
}

std::vector<double> amplifications(const MotionMethod& method, const std::vector<SpringCell>& cells) {
  std::vector<SpringCell> asked;
  const auto overflows = [&](const SpringCell& cell) { return !(amplification_in_theory(method, cell) < kOverflows); };
  std::ranges::remove_copy_if(cells, std::back_inserter(asked), overflows);
  const std::vector<Path> moved = paths_of(method, asked, kSmall, 0.0), thrown = paths_of(method, asked, 0.0, kSmall);
  std::vector<double> found;
  std::size_t next = 0;
  for (const SpringCell& cell : cells) {
    if (overflows(cell)) {
      found.push_back(kOverflows);
      continue;
    }
    found.push_back(radius_of(method, moved[next], thrown[next], kSmall, 1e-9));
    ++next;
  }
  return found;
}

double lattice_amplification(const MotionMethod& method, const SpringCell& cell) {
  static const Lattice lattice;
  // larger than above, for it is added to places of the size of 1 m; smaller than what bends the springs
  constexpr double kBend = 0x1p-24;
  const auto path = [&](double place, double speed) {
    kernel::Environment world(lattice.world(method, cell, place, speed).description());
    Path shares = {lattice.shares(world.state())};
    for (int i = 0; i < steps_to_see(method); ++i) {
      if (!steps(&world)) throw std::runtime_error(world.fault()->fault.text());
      shares.push_back(lattice.shares(world.state()));
    }
    return shares;
  };
  return radius_of(method, path(kBend, 0.0), path(0.0, kBend), kBend, 1e-4);
}

bool stays_bounded(const MotionMethod& method, const SpringCell& cell, std::uint32_t count) {
  kernel::Environment world(spring_world(method, {cell}, kSmall, 0.0).description());
  const double most = 1e3 * kSmall * std::max(1.0, std::sqrt(cell.stiffness));
  for (std::uint32_t i = 0; i < count; ++i)
    if (!steps(&world) || !(std::fabs(world.state().position[0]) <= most)) return false;
  return true;
}

}  // namespace gravitas::harness
