#include "services/study/spring_stability.h"

#include <fmt/format.h>

#include <array>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include "plugin_sdk/math/types.h"
#include "services/catalog/catalog.h"
#include "services/run/session.h"
#include "services/scene/reader.h"
#include "services/study/rung.h"

namespace gravitas::study {
namespace {

using Matrix2 = Eigen::Matrix2d;
using Theory = Eigen::MatrixXd (*)(double k, double c);

double spectral_radius(const Eigen::MatrixXd& matrix) { return matrix.eigenvalues().cwiseAbs().maxCoeff(); }

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

constexpr double kZetas[] = {0.0, 0.1, 1.0, 10.0};
constexpr int kCellsOfDecade = 4, kFirstDecade = -2, kLastDecade = 6;

// "SymplecticSplitting 4" as scenes have it.
std::string integrator_block(const std::string& method) {
  const std::size_t blank = method.find(' ');
  const std::string type = method.substr(0, blank);
  std::string settings;
  if (blank != std::string::npos) settings = "Order = " + method.substr(blank + 1);
  if (type == "DormandPrince54") settings = "Accuracy = 1 DenseOutput = false";
  if (type == "DormandPrince853" || type == "Rosenbrock" || type == "Radau") settings = "Accuracy = 1";
  return fmt::format("KineticIntegrator {{ Type = \"{}\" CustomProperties {{ {} }} }}", type, settings);
}

scene::SceneText spring_scene(const std::string& method, const std::vector<SpringCell>& cells, double place,
                              double speed) {
  std::string forces, bodies;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    forces += fmt::format(
        "Force {{ Type = \"Spring\" Id = \"{}\" CustomProperties {{ Stiffness = {:.17g} Damping = {:.17g} }} }}\n", i,
        cells[i].stiffness, cells[i].damping());
    bodies += fmt::format(
        "Body {{ Id = \"{0}\" Mass = 1 PrincipalMoments = {{1, 1, 1}} Forces = {{\"{0}\"}} KineticProperties {{ "
        "Position = {{{1:.17g}, 0, 0}} LinearVelocity = {{{2:.17g}, 0, 0}} }} }}\n",
        i, place, speed);
  }
  return {"springs",
          fmt::format("Forces {{\n{}}}\nSimulator {{ CustomProperties {{ TimeStep = 1 Duration = {} SleepEnergy "
                      "= 0 }} }}\nEnvironment {{\n{}\nSpace {{ Bodies {{\n{}}} }} }}\n",
                      forces, steps_to_see(method), integrator_block(method), bodies)};
}

std::vector<SpringPath> engine_paths(const std::string& method, const std::vector<SpringCell>& cells, double place,
                                     double speed, Catalog* installed) {
  scene::SceneDocument document;
  scene::Problems problems;
  const scene::SceneText texts[] = {spring_scene(method, cells, place, speed)};
  if (!scene::read_texts(texts, &document, &problems)) throw BadInput(scene::to_string(problems.errors.front()));
  RunOptions options;
  options.hosting = {{std::nullopt, kernel::Hosting::kDirect}};
  std::vector<std::string> warnings;
  const std::unique_ptr<kernel::Environment> world =
      start(build_scene(options, document.scene(), installed, &warnings));
  std::vector<SpringPath> paths(cells.size());
  for (int i = 0;; ++i) {
    for (std::size_t body = 0; body < cells.size(); ++body)
      paths[body].emplace_back(world->state().position[3 * body], world->state().linear_velocity[3 * body]);
    if (i == steps_to_see(method)) return paths;
    if (world->step() != kernel::StepOutcome::kCommitted) throw BadInput(world->fault()->fault.text());
  }
}

v1::Limit limit_of(const std::string& method, double zeta, Catalog* installed) {
  constexpr double kOverflows = 1e200;  // stages of such a step are no numbers, and it is refused
  v1::Limit limit;
  limit.set_integrator(method);
  limit.set_zeta(zeta);
  if (const double theory = stability_limit(method, zeta); std::isfinite(theory)) limit.set_theory(theory);
  std::vector<SpringCell> cells;
  for (int i = kFirstDecade * kCellsOfDecade; i <= kLastDecade * kCellsOfDecade; ++i)
    if (const SpringCell cell{std::pow(10.0, static_cast<double>(i) / kCellsOfDecade), zeta};
        amplification_in_theory(method, cell) < kOverflows)
      cells.push_back(cell);
  const std::vector<SpringPath> moved = engine_paths(method, cells, kSmallSwing, 0.0, installed),
                                thrown = engine_paths(method, cells, 0.0, kSmallSwing, installed);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    v1::Cell* cell = limit.add_cells();
    cell->set_stiffness(cells[i].stiffness);
    cell->set_theory(amplification_in_theory(method, cells[i]));
    cell->set_measured(growth_of(method, moved[i], thrown[i], kSmallSwing, 1e-9));
    const bool grows = cell->measured() > 1.0 + kTellsApart;
    if (grows == (cell->theory() > 1.0 + kTellsApart)) limit.set_agreeing(limit.agreeing() + 1);
  }
  return limit;
}

}  // namespace

double amplification_in_theory(const std::string& method, const SpringCell& cell) {
  const Eigen::MatrixXd map = theories().at(method)(cell.stiffness, cell.damping());
  return map.allFinite() ? spectral_radius(map) : std::numeric_limits<double>::infinity();
}

double stability_limit(const std::string& method, double zeta) {
  constexpr double kFinest = 1e-4, kLargest = 1e12, kSlack = 1e-11;
  const auto is_stable = [&](double k) { return amplification_in_theory(method, {k, zeta}) <= 1.0 + kSlack; };
  double low = kFinest;
  if (!is_stable(low)) return 0.0;
  while (low < kLargest && is_stable(1.02 * low)) low *= 1.02;
  if (low >= kLargest) return std::numeric_limits<double>::infinity();
  double high = 1.02 * low;
  for (int i = 0; i < 60; ++i) (is_stable(0.5 * (low + high)) ? low : high) = 0.5 * (low + high);
  return low;
}

int steps_to_see(const std::string& method) { return method == "BasicVerlet" ? 3 : 1; }

double growth_of(const std::string& method, const SpringPath& moved, const SpringPath& thrown, double size,
                 double noise) {
  if (steps_to_see(method) == 1) return spectral_radius((Matrix2() << moved[1], thrown[1]).finished() / size);
  // what maps three states (x, last displacement, v), which may span two dimensions alone, to the next ones
  const auto state = [](const SpringPath& path, std::size_t at) {
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
  return spectral_radius(next * inverse.pseudoInverse());
}

std::vector<v1::Limit> map_stability(const std::function<bool()>& interrupted) {
  Catalog installed = Catalog::installed(installed_worker(), installed_plugins());
  std::vector<v1::Limit> limits;
  for (const auto& [method, theory] : theories()) {
    if (installed.find_plugin(Slot::kIntegrator, method.substr(0, method.find(' '))) == nullptr) continue;
    for (const double zeta : kZetas) {
      if (interrupted()) throw StudyInterrupted{};
      limits.push_back(limit_of(method, zeta, &installed));
    }
  }
  return limits;
}

}  // namespace gravitas::study
