// What the stops of joints give back, and the work of joint rows: the joints' side of the bound on energy.
#include <algorithm>
#include <cmath>

#include "plugin_sdk/solver/contact_law.h"
#include "plugin_sdk/solver/joint_bounce.h"
#include "workers/solver/sequential/relaxation_joints.h"

namespace gravitas {

template <class Use>
void RelaxationJoints::for_bounces(Use&& use) {
  for (const Block& block : blocks_)
    for (std::size_t i = block.first; i < block.end; ++i)
      if (rows_[i].law.bounces()) use(block, &rows_[i]);
}

bool RelaxationJoints::has_bounces() const {
  return std::ranges::any_of(rows_, [](const Row& row) { return row.law.bounces(); });
}

void RelaxationJoints::find_bounces(const std::vector<RelaxationDiscrepancy>& discrepancies, const BodyMotion& before,
                                    double time_step) {
  for_bounces([&](const Block& block, Row* row) {
    const JointAxisState& axis = discrepancies[row->place / 3].axes[row->place % 3];
    const double rate = row->own.along(before[block.body1], before[block.body2]) - axis.desired_velocity;
    row->law.set_bounce(bounce_of(axis, rate, time_step));
  });
}

void RelaxationJoints::drop_bounces() {
  for (Row& row : rows_) row.law.set_bounce(0.0);
}

void RelaxationJoints::leave_out_bounces() {
  for (Row& row : rows_)
    if (row.law.bounces()) row.law.has_lower = row.law.has_upper = false;
}

void RelaxationJoints::add_work(const Block& block, const Row& row, const BodyMotion& before, const BodyMotion& after,
                                Gain* gain) {
  const double start = row.own.along(before[block.body1], before[block.body2]);
  const double end = row.own.along(after[block.body1], after[block.body2]);
  gain->add(0.5 * row.multiplier * (start + end),
            0.5 * std::fabs(row.multiplier) * (std::fabs(start) + std::fabs(end)));
}

void RelaxationJoints::add_work(const SolverBodies& bodies, const BodyMotion& before, const BodyMotion& after,
                                const std::vector<std::uint32_t>& group, std::vector<Gain>& gains) const {
  for (const Block& block : blocks_) {
    Gain& gain = gains[group[owner_of(block, bodies)]];
    for (std::size_t i = block.first; i < block.end; ++i)
      if (!rows_[i].law.may_do_work()) add_work(block, rows_[i], before, after, &gain);
  }
}

std::uint32_t RelaxationJoints::lower_to_arrival(const BodyMotion& before, const BodyMotion& after) {
  std::uint32_t count = 0;
  for_bounces([&](const Block& block, Row* row) {
    Gain gain;
    add_work(block, *row, before, after, &gain);
    const double sign = std::copysign(1.0, row->law.bounce);
    double bounce = std::fabs(row->law.bounce);
    if (!gravitas::lower_to_arrival(gain, -sign * row->own.along(before[block.body1], before[block.body2]), &bounce))
      return;
    row->law.set_bounce(sign * bounce);
    ++count;
  });
  return count;
}

void RelaxationJoints::mark_sharing(const SolverBodies& bodies, const BodyMotion& before, const BodyMotion& after,
                                    const std::vector<std::uint32_t>& group, std::vector<bool>* is_some) {
  bounces_.clear();
  for_bounces([&](const Block& block, Row* row) {
    Gain gain;
    add_work(block, *row, before, after, &gain);
    const std::uint32_t owner = owner_of(block, bodies);
    bounces_.push_back({static_cast<std::uint32_t>(row - rows_.data()), owner, gain.is_to_blame(), row->law.bounce});
    if (gain.is_to_blame()) (*is_some)[group[owner]] = true;
  });
}

void RelaxationJoints::share_all(const std::vector<std::uint32_t>& group, const std::vector<bool>& which) {
  for (Bounce& bounce : bounces_)
    if (which[group[bounce.body]]) bounce.shares = true, bounce.whole = rows_[bounce.row].law.bounce;
}

std::uint32_t RelaxationJoints::share_restitution(const std::vector<std::uint32_t>& group,
                                                  const std::vector<double>& share) {
  std::uint32_t count = 0;
  for (const Bounce& bounce : bounces_) {
    const double of_group = share[group[bounce.body]];
    if (std::isnan(of_group) || !bounce.shares || bounce.whole == 0.0) continue;
    rows_[bounce.row].law.set_bounce(of_group * bounce.whole);
    ++count;
  }
  return count;
}

}  // namespace gravitas
