// For authors of implicit integrators: which bodies feel each other's state, so that others are solved for apart.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "plugin_sdk/integrator.h"

namespace gravitas {

// Call it once before factors of matrices are computed with Eigen: cuts large products as on a machine with common caches
// (bytes), not as on this one, so that sums have the same order everywhere.
inline void fix_eigen_blocks() { Eigen::setCpuCacheSizes(32 << 10, 256 << 10, 2 << 20); }

// Movable bodies by row: a group each where no wrench of one changes with the state of another near `trial`, else all in
// one. Found by asking for derivatives with half of the bodies moved by 1e-3 (m, rad, m/s, rad/s), the halves chosen so
// that every two bodies are told apart once each way: 2 log2 of their number, none where wrenches are constant.
std::vector<std::vector<std::size_t>> interaction_groups(const stage::IntegratorIntegrateRequest& request,
                                                         Derivatives* derivatives, double time,
                                                         const TrialColumns& trial);

// The same from the blocks of a Jacobian: a group for all movable bodies that are connected by blocks.
std::vector<std::vector<std::size_t>> interaction_groups(const stage::IntegratorIntegrateRequest& request,
                                                         const WrenchJacobian& jacobian);

}  // namespace gravitas
