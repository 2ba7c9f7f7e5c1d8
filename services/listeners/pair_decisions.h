// Stands between an environment and who decides about its pairs: asks for each pair once, keeps the answers, and keeps the
// run from harm by a listener that throws, stalls or answers nonsense.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "kernel/environment.h"
#include "services/listeners/pair_listener.h"

namespace gravitas {

inline constexpr double kListenerDeadline = 1.0;  // s

class PairDecisions final : public kernel::PairArbiter {
 public:
  // `report` hears, in the thread that steps, why a listener has been left aside.
  explicit PairDecisions(std::function<void(const std::string&)> report) : report_(std::move(report)) {}
  ~PairDecisions() override { leave(); }
  PairDecisions(const PairDecisions&) = delete;
  PairDecisions& operator=(const PairDecisions&) = delete;

  // It is asked about pairs that nobody has decided about yet, and has `deadline` seconds for each answer.
  void listen(std::shared_ptr<PairListener> listener, double deadline = kListenerDeadline);
  // Nobody is asked any more; what was decided holds.
  void leave();
  bool is_listening() const { return desk_ != nullptr; }
  // True if a trajectory may depend on what was decided.
  bool has_decided() const { return !decided_.empty(); }
  // The scene was edited: what was decided holds for who is still there by id, but where what the scene says of the two
  // materials is new, which is asked about anew.
  void follow(const kernel::Model& before, const kernel::Model& after);
  // Of another run: nothing is decided.
  void forget() { decided_.clear(); }

  std::size_t keep_allowed(const kernel::Environment& environment, std::span<std::uint32_t> pairs) override;
  std::size_t leave_out_forbidden(std::span<std::uint32_t> pairs) const override;
  void mix_materials(std::span<const std::uint32_t> bodies, std::span<double> rows) override;

 private:
  // Where a listener's thread and the run meet. A thread that stalls keeps it.
  struct Desk;
  using Decisions = std::vector<PairQuestion>;  // ascending

  // Of the pair, not before `from`; the end if nobody has decided.
  Decisions::const_iterator find(Decisions::const_iterator from, std::uint32_t a, std::uint32_t b) const;
  void ask(std::vector<PairQuestion> questions);
  void leave_aside(const std::string& why);

  std::function<void(const std::string&)> report_;
  std::shared_ptr<Desk> desk_;
  double deadline_ = kListenerDeadline;
  Decisions decided_;
};

}  // namespace gravitas
