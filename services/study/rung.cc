#include "services/study/rung.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <limits>
#include <optional>
#include <span>
#include <stop_token>
#include <string_view>
#include <utility>
#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/slots.h"
#include "services/capsule/forwarding_host.h"
#include "services/run/session.h"
#include "services/scene/overrides.h"

namespace gravitas::study {
namespace {

using SteadyClock = std::chrono::steady_clock;

std::optional<double> seconds_of(clockid_t clock) {
  timespec now{};
  if (clock_gettime(clock, &now) != 0) return std::nullopt;
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// CPU of this process, and of those that plugins have of their own, each from when it is first asked.
class CpuClock {
 public:
  void follow(int process_id) {
    if (std::ranges::find(others_, process_id, &Other::process_id) != others_.end()) return;
    Other other{process_id, 0, 0.0, 0.0};
    // whose process is not known has none: 0 would be this one
    if (process_id <= 0 || clock_getcpuclockid(process_id, &other.clock) != 0) return;
    other.begin = other.last = seconds_of(other.clock).value_or(0.0);
    others_.push_back(other);
  }

  double seconds() {
    double sum = left_ + seconds_of(CLOCK_PROCESS_CPUTIME_ID).value_or(0.0);
    for (Other& other : others_) {
      // of one that has died what is known last
      other.last = seconds_of(other.clock).value_or(other.last);
      sum += other.last - other.begin;
    }
    return sum;
  }

  // Those processes end.
  void leave() {
    seconds();
    for (const Other& other : others_) left_ += other.last - other.begin;
    others_.clear();
  }

 private:
  struct Other {
    int process_id;
    clockid_t clock;
    double begin, last;
  };
  std::vector<Other> others_;
  double left_ = 0.0;
};

struct TooMuchWork {};

// What a run has taken so far; asked by its hosts at every call, since one step may be any work.
struct Meter {
  const RunLimits& limits;
  CpuClock& cpu;
  double begin = cpu.seconds();
  SteadyClock::time_point next_look = SteadyClock::now() + patience();
  std::uint64_t derivatives = 0, iterations = 0;

  SteadyClock::duration patience() const {
    return std::chrono::duration_cast<SteadyClock::duration>(
        std::chrono::duration<double>(std::min(limits.cpu_seconds, 1e6)));
  }

  // No CPU is used up faster than time goes by, but for threads of other work.
  void check() {
    if (limits.interrupted()) throw StudyInterrupted();
    if (SteadyClock::now() < next_look) return;
    const double left = limits.cpu_seconds - (cpu.seconds() - begin);
    if (left <= 0.0) throw TooMuchWork();
    next_look = SteadyClock::now() +
                std::chrono::duration_cast<SteadyClock::duration>(std::chrono::duration<double>(std::min(left, 1e6)));
  }
};

class CountedDerivatives final : public kernel::DerivativeSource {
 public:
  CountedDerivatives(kernel::DerivativeSource* source, Meter* meter) : source_(source), meter_(meter) {}
  void begin_attempt(bool counts) override { source_->begin_attempt(counts); }
  std::span<const kernel::ColumnId> trial_columns() const override { return source_->trial_columns(); }
  std::span<const kernel::ColumnId> answer_columns() const override { return source_->answer_columns(); }
  void evaluate() override {
    ++meter_->derivatives;
    meter_->check();
    source_->evaluate();
  }

 private:
  kernel::DerivativeSource* source_;
  Meter* meter_;
};

class MeteredHost final : public capsule::ForwardingHost {
 public:
  MeteredHost(std::unique_ptr<kernel::Carrier> host, Meter* meter) : ForwardingHost(std::move(host)), meter_(meter) {}

  kernel::CallResult call(const kernel::StageCall& call, kernel::Arena* arena,
                          kernel::DerivativeSource* derivatives) override {
    meter_->check();
    if (host_->hosting() != kernel::Hosting::kDirect) meter_->cpu.follow(host_->process_id());
    if (derivatives != nullptr) {
      CountedDerivatives counted(derivatives, meter_);
      return host_->call(call, arena, &counted);
    }
    kernel::CallResult result = host_->call(call, arena, nullptr);
    if (call.method == stage::Method::kSolverSolve && result.status == GRAVITAS_OK) count_iterations(call, *arena);
    return result;
  }

 private:
  void count_iterations(const kernel::StageCall& call, const kernel::Arena& arena) {
    const std::span<const stage::ColumnInfo> columns = call.info().reply;
    for (std::size_t i = 0; i < columns.size(); ++i)
      if (std::string_view(columns[i].name) == "iterations" && arena.count(call.reply[i]) == 1)
        meter_->iterations += *reinterpret_cast<const std::uint32_t*>(arena.data(call.reply[i]));
  }

  Meter* meter_;
};

kernel::HostStarter metered(Meter* meter) {
  return [meter](const kernel::SlotDescription& slot, std::uint32_t threads,
                 std::stop_token stop) -> std::unique_ptr<kernel::Carrier> {
    return std::make_unique<MeteredHost>(kernel::start_host(slot, threads, std::move(stop)), meter);
  };
}

struct Energy {
  double kinetic = 0.0, potential = 0.0;
  double sum() const { return kinetic + potential; }
};

Energy energy_in(kernel::Environment* environment) {
  const kernel::Model& model = environment->model();
  const kernel::StateView state = environment->state();
  Energy energy{0.0, environment->potential_energy()};
  for (std::uint32_t i = 0; i < model.body_count; ++i)
    if ((model.flags[i] & kMovable) != 0)
      energy.kinetic +=
          kinetic_energy(model.mass[i], vector_at(model.inertia.span(), i), quaternion_at(state.orientation, i),
                         {vector_at(state.linear_velocity, i), vector_at(state.angular_velocity, i)});
  return energy;
}

// "direct; grpc: PythonDrag".
std::string hosting_in(const kernel::Plan& plan) {
  std::string text = kernel::hosting_name(kernel::Hosting::kDirect);
  for (const kernel::PlannedSlot& slot : plan.slots)
    if (slot.hosting != kernel::Hosting::kDirect)
      text += fmt::format("; {}: {}", kernel::hosting_name(slot.hosting), fmt::join(slot.plugins, ", "));
  return text;
}

std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

// One of the runs of a rung.
class TimedRun {
 public:
  TimedRun(kernel::EnvironmentDescription description, const Setting& setting, const MeasureMaker& measure,
           const RunLimits& limits, CpuClock* cpu)
      : meter_{limits, *cpu},
        setting_(setting),
        measure_(measure(description)),
        environment_(start(description, metered(&meter_))) {}
  ~TimedRun() { meter_.cpu.leave(); }
  TimedRun(const TimedRun&) = delete;
  TimedRun& operator=(const TimedRun&) = delete;

  // CPU of its steps alone, s.
  double go(v1::Rung* rung) {
    kernel::Environment& environment = *environment_;
    rung->set_hosting(hosting_in(environment.plan()));
    look(rung);
    const double begin = meter_.cpu.seconds();
    double not_counted = 0.0;
    while (environment.step_count() < environment.total_steps()) {
      if (environment.step() != kernel::StepOutcome::kCommitted) {
        rung->set_failed(first_line(environment.fault()->fault.text()));
        break;
      }
      rung->set_joint_error(std::max(rung->joint_error(), environment.figures().joint_error));
      rung->set_penetration(std::max(rung->penetration(), environment.figures().penetration));
      if (environment.step_count() % setting_.look_every != 0) continue;
      const double pause = meter_.cpu.seconds();
      look(rung);
      not_counted += meter_.cpu.seconds() - pause;
    }
    const double seconds = meter_.cpu.seconds() - begin - not_counted;
    rung->set_error(measure_->error());
    rung->set_energy_drift(drift_ / std::max({std::fabs(first_.sum()), largest_kinetic_, 1e-300}));
    rung->set_steps(environment.step_count());
    rung->set_derivatives(meter_.derivatives);
    rung->set_iterations(meter_.iterations);
    return seconds;
  }

 private:
  void look(v1::Rung* rung) {
    const Energy now = energy_in(environment_.get());
    if (environment_->step_count() == 0) first_ = now;
    largest_kinetic_ = std::max(largest_kinetic_, now.kinetic);
    drift_ = std::max(drift_, std::fabs(now.sum() - first_.sum()));
    measure_->look(*environment_);
    rung->set_steps(environment_->step_count());
  }

  Meter meter_;
  const Setting& setting_;
  std::unique_ptr<Measure> measure_;
  std::unique_ptr<kernel::Environment> environment_;
  Energy first_;
  double largest_kinetic_ = 0.0, drift_ = 0.0;
};

std::string joined_errors(const scene::Problems& problems) {
  std::string text;
  for (const scene::SceneError& error : problems.errors) text += (text.empty() ? "" : "\n") + scene::to_string(error);
  return text;
}

void demand(const scene::Problems& problems) {
  if (!problems.ok()) throw BadInput(joined_errors(problems));
}

}  // namespace

Subject::Subject(const std::string& path, Catalog* installed) : path_(path), installed_(installed) {
  scene::Problems problems;
  const std::string paths[] = {path};
  scene::read_files(paths, &document_, &problems);
  demand(problems);
  if (!(duration() > 0.0)) throw BadInput(path + ": Duration 0; allowed: a scene that goes on for some time");
  const Method plain{"Basic", "SemiImplicitEuler", "Sequential"};
  const std::vector<kernel::LeftOut> left_out = start(describe(plain, 1, {}))->plan().left_out;
  has_contacts_ = std::ranges::find(left_out, slot_name(Slot::kCollision), &kernel::LeftOut::what) == left_out.end();
}

double Subject::duration() const { return document_.scene().simulator().custom_properties().duration(); }
double Subject::time_step() const { return document_.scene().simulator().custom_properties().time_step(); }

kernel::EnvironmentDescription Subject::describe(const Method& method, std::uint32_t steps,
                                                 std::optional<double> accuracy) const {
  scene::v1::Scene scene = document_.scene();
  scene.mutable_simulator()->mutable_custom_properties()->clear_accuracy();
  scene::Problems problems;
  const auto set = [&](const std::string& text) { scene::apply_override(&scene, text, &problems); };
  set("Simulator=" + method.simulator);
  set("Integrator=" + method.integrator);
  set("Solver=" + method.solver);
  set(fmt::format("Simulator.TimeStep={:.17g}", duration() / steps));
  for (const std::string& setting : method.settings) set(setting);
  if (accuracy) set(fmt::format("{}={:.17g}", method.accuracy, *accuracy));
  demand(problems);
  RunOptions options;
  options.steps = steps;
  options.hosting = {{std::nullopt, kernel::Hosting::kDirect}};
  std::vector<std::string> warnings;
  return build_scene(options, scene, installed_, &warnings);
}

v1::Rung make_rung(const Subject& subject, const Method& method, const Setting& setting, const MeasureMaker& measure,
                   const RunLimits& limits) {
  v1::Rung rung;
  rung.set_error(std::numeric_limits<double>::quiet_NaN());
  rung.set_setting(setting.accuracy ? *setting.accuracy : subject.duration() / setting.steps);
  std::vector<double> seconds;
  CpuClock cpu;
  const double begin = cpu.seconds();
  try {
    const kernel::EnvironmentDescription description = subject.describe(method, setting.steps, setting.accuracy);
    do {
      seconds.push_back(TimedRun(description, setting, measure, limits, &cpu).go(&rung));
    } while (rung.failed().empty() && seconds.size() < limits.runs && seconds.front() < limits.repeat_below);
    if (rung.failed().empty() && !(rung.error() < 1.0)) rung.set_failed("off by more than its size");
  } catch (const TooMuchWork&) {
    rung.set_failed(fmt::format("more than {:g} s of CPU", limits.cpu_seconds));
    rung.set_too_long(true);
    seconds = {cpu.seconds() - begin};
  } catch (const StudyInterrupted&) {
    throw;
  } catch (const std::exception& problem) {
    rung.set_failed(first_line(problem.what()));
    seconds = {cpu.seconds() - begin};
  }
  std::ranges::sort(seconds);
  rung.set_runs(static_cast<std::uint32_t>(seconds.size()));
  rung.set_cpu_min(seconds.front());
  rung.set_cpu_median(seconds[seconds.size() / 2]);
  return rung;
}

}  // namespace gravitas::study
