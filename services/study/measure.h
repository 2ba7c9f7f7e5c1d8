// The error of a run: against what is known of its problem, or against another run of the same scene. Errors are
// dimensionless: distances as shares of a size, attitudes as geodesic angles in rad; the largest counts.
#pragma once

#include <cstddef>
#include <vector>

#include "kernel/environment.h"
#include "services/study/problem.h"

namespace gravitas::study {

// Looks at a run at its start, at the ends of the coarsest rung's steps (or some of them) and at its end.
class Measure {
 public:
  virtual ~Measure() = default;
  virtual void look(const kernel::Environment& environment) = 0;
  // Not a number where something was not seen.
  virtual double error() const = 0;
};

// Against what is known. Precondition: the bodies are there.
class KnownMeasure final : public Measure {
 public:
  KnownMeasure(const std::vector<Known>& known, const kernel::EnvironmentDescription& description);
  void look(const kernel::Environment& environment) override;
  double error() const override;

 private:
  struct Row {
    Known known;
    std::uint32_t body;
  };
  std::vector<Row> rows_;
  std::size_t seen_ = 0;
  double worst_ = 0.0;
};

// Poses of the movable bodies at every look.
class Samples final : public Measure {
 public:
  void look(const kernel::Environment& environment) override;
  double error() const override { return 0.0; }

  const std::vector<std::vector<Pose>>& poses() const { return poses_; }
  // The longest way of a body from where it began, m: what distances are shares of. 1 where nothing moves.
  double size() const;

 private:
  std::vector<std::vector<Pose>> poses_;
};

// Against another run that was looked at as often. The reference must live as long.
class DistanceTo final : public Measure {
 public:
  explicit DistanceTo(const Samples& reference) : reference_(reference), size_(reference.size()) {}
  void look(const kernel::Environment& environment) override;
  double error() const override;

 private:
  const Samples& reference_;
  double size_;
  std::size_t looks_ = 0;
  double worst_ = 0.0;
};

}  // namespace gravitas::study
