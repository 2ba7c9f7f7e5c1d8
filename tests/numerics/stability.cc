#include "tests/numerics/stability.h"

#include <Eigen/Dense>
#include <algorithm>
#include <stdexcept>

namespace gravitas::harness {
namespace {

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

using Path = study::SpringPath;
using study::kSmallSwing;

std::vector<Path> paths_of(const MotionMethod& method, const std::vector<SpringCell>& cells, double place,
                           double speed) {
  kernel::Environment world(spring_world(method, cells, place, speed).description());
  std::vector<Path> paths(cells.size());
  for (int i = 0;; ++i) {
    for (std::size_t body = 0; body < cells.size(); ++body)
      paths[body].emplace_back(world.state().position[3 * body], world.state().linear_velocity[3 * body]);
    if (i == study::steps_to_see(method.name)) return paths;
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
  return study::amplification_in_theory(method.name, cell);
}

double stability_limit(const MotionMethod& method, double zeta) { return study::stability_limit(method.name, zeta); }

std::vector<double> amplifications(const MotionMethod& method, const std::vector<SpringCell>& cells) {
  std::vector<SpringCell> asked;
  const auto overflows = [&](const SpringCell& cell) { return !(amplification_in_theory(method, cell) < kOverflows); };
  std::ranges::remove_copy_if(cells, std::back_inserter(asked), overflows);
  const std::vector<Path> moved = paths_of(method, asked, kSmallSwing, 0.0),
                          thrown = paths_of(method, asked, 0.0, kSmallSwing);
  std::vector<double> found;
  std::size_t next = 0;
  for (const SpringCell& cell : cells) {
    if (overflows(cell)) {
      found.push_back(kOverflows);
      continue;
    }
    found.push_back(study::growth_of(method.name, moved[next], thrown[next], kSmallSwing, 1e-9));
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
    for (int i = 0; i < study::steps_to_see(method.name); ++i) {
      if (!steps(&world)) throw std::runtime_error(world.fault()->fault.text());
      shares.push_back(lattice.shares(world.state()));
    }
    return shares;
  };
  return study::growth_of(method.name, path(kBend, 0.0), path(0.0, kBend), kBend, 1e-4);
}

bool stays_bounded(const MotionMethod& method, const SpringCell& cell, std::uint32_t count) {
  kernel::Environment world(spring_world(method, {cell}, kSmallSwing, 0.0).description());
  const double most = 1e3 * kSmallSwing * std::max(1.0, std::sqrt(cell.stiffness));
  for (std::uint32_t i = 0; i < count; ++i)
    if (!steps(&world) || !(std::fabs(world.state().position[0]) <= most)) return false;
  return true;
}

}  // namespace gravitas::harness
