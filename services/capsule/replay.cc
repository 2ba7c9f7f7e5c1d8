#include "services/capsule/replay.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "kernel/fault.h"
#include "plugin_sdk/body.h"
#include "plugin_sdk/checks.h"
#include "plugin_sdk/column_comparison.h"
#include "plugin_sdk/derivative_question.h"
#include "plugin_sdk/solver.h"
#include "services/capsule/answer_verdict.h"
#include "services/capsule/capsule.h"
#include "services/catalog/catalog.h"
#include "services/check/answer_text.h"
#include "services/check/carrier_subject.h"
#include "services/check/describe.h"
#include "services/run/report.h"
#include "services/run/session.h"

namespace gravitas::capsule {

namespace v1 = recorder::v1;
using conformance::Answer;

namespace {

// A call asked for a derivative that the run did not ask for.
class OtherDerivative : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// One plugin of the capsule, or the one that takes its place.
class Asked {
 public:
  Asked(const check::Examinee& examinee, const ReplayOptions& options, std::uint32_t threads, Comparison* comparison)
      : examinee_(examinee),
        comparison_(comparison),
        with_physics_(options.with_physics),
        subject_(examinee_, examinee_.is_command() ? kernel::Hosting::kGrpc : options.hosting,
                 {.deadline = options.deadline, .cap = 10.0 * options.deadline}, threads, &faults_) {}

  // What a run would not go on with is a fault, too.
  Answer ask(const v1::CapsuleCall& call, bool is_poison);

 private:
  const check::Examinee examinee_;
  Comparison* const comparison_;
  const bool with_physics_;
  std::uint32_t faults_ = 0;
  check::CarrierSubject subject_;
};

stage::Method method_of(const v1::CapsuleCall& call) {
  return static_cast<stage::Method>(method_named(call.method()) - stage::kMethods);
}

const stage::MethodInfo& derivative_info() { return stage::method_info(stage::Method::kIntegratorDerivative); }

bool is_same(const MessageColumns& recorded, const stage::IntegratorDerivativeRequest& asked, Comparison* comparison) {
  const auto same = [&](const char* name, std::span<const double> numbers) {
    const auto column = std::ranges::find(derivative_info().request, std::string_view(name), &stage::ColumnInfo::name);
    return comparison->is_alike(*column, std::as_bytes(std::span(recorded.f64(name))), std::as_bytes(numbers));
  };
  const double time = asked.time();
  return same("time", {&time, 1}) && same("position", asked.position()) && same("orientation", asked.orientation()) &&
         same("linear_velocity", asked.linear_velocity()) && same("angular_velocity", asked.angular_velocity()) &&
         recorded.u32("question")[0] == asked.question();
}

// Are there so many derivatives, or those again and again? In the run it may have begun again with more room for its answer.
bool are_all(const google::protobuf::RepeatedPtrField<v1::CapsuleDerivative>& all, int asked) {
  if (asked == 0 || all.size() % asked != 0) return asked == all.size();
  for (int i = asked; i < all.size(); ++i)
    if (all[i].SerializeAsString() != all[i - asked].SerializeAsString()) return false;
  return true;
}

// Impulses of joints are no wrenches.
void add_told(const v1::CapsuleDerivative& one, WrenchRange* told) {
  const std::uint32_t question = columns_of(one.trial(), derivative_info().request).u32("question")[0];
  if (question < kFirstOfImpulses) told->add(columns_of(one.answer(), derivative_info().reply).f64("wrench"));
}

// Why a run would not go on with this; empty: it would.
std::string failure_of(const v1::CapsuleCall& call, const MessageColumns& request, const Answer& answer,
                       const WrenchRange& told, bool with_physics) {
  if (!answer.fault.empty()) return answer.fault;
  if (answer.status == GRAVITAS_REFUSED) return call.may_be_refused() ? std::string() : "it refused: " + answer.text;
  // who knows no Jacobians is not asked for them
  if (answer.status == GRAVITAS_UNKNOWN_METHOD) return {};
  if (answer.status != GRAVITAS_OK) return "it failed: " + answer.text;
  return verdict_on(method_of(call), request, answer, told, with_physics || call.breaks_law());
}

Answer Asked::ask(const v1::CapsuleCall& call, bool is_poison) {
  const stage::MethodInfo& method = *method_named(call.method());
  const stage::MethodInfo& derivative = derivative_info();
  int asked = 0;
  WrenchRange told;
  const auto answer = [&](const stage::IntegratorDerivativeRequest& trial) -> conformance::DerivativeAnswer {
    const double now = trial.time();
    for (const std::span<const double> column :
         {std::span<const double>(&now, 1), trial.position(), trial.orientation(), trial.linear_velocity(),
          trial.angular_velocity()})
      if (first_not_finite(column) != kNoRow)
        throw kernel::StageFault(kernel::FaultKind::kBadNumbers, "numbers",
                                 "its answer is wrong: it asked for a derivative in a state that is not finite");
    if (is_poison) {
      if (trial.question() >= kFirstOfImpulses) return {{}};
      const std::vector<double> nothing(2 * trial.position().size());
      told.add(nothing);
      return nothing;
    }
    const auto is_asked = [&](int number) {
      return number < call.derivatives_size() &&
             is_same(columns_of(call.derivatives(number).trial(), derivative.request), trial, comparison_);
    };
    if (!is_asked(asked)) {
      // who gets more room for the answer begins again
      if (!is_asked(0))
        throw OtherDerivative(asked < call.derivatives_size()
                                  ? fmt::format("derivative {} is asked at another state", asked + 1)
                                  : fmt::format("it asks for more than {} derivatives", asked));
      asked = 0;
    }
    const v1::CapsuleDerivative& recorded = call.derivatives(asked);
    ++asked;
    const MessageColumns all = columns_of(recorded.answer(), derivative.reply);
    add_told(recorded, &told);
    return {all.f64("wrench"), all.u32("jacobian_body"), all.f64("jacobian")};
  };
  const MessageColumns request = columns_of(call.request(), method.request);
  Answer came = subject_.ask(method_of(call), request, answer);
  if (!is_poison && came.ok() && !are_all(call.derivatives(), asked))
    throw OtherDerivative(fmt::format("it asks for {} of {} derivatives", asked, call.derivatives_size()));
  came.fault = failure_of(call, request, came, told, with_physics_);
  return came;
}

Answer recorded_answer(const v1::CapsuleCall& call, bool with_physics) {
  const stage::MethodInfo& method = *method_named(call.method());
  const bool has_answer = call.fault().empty() && call.status() == GRAVITAS_OK;
  Answer answer{.status = call.status(),
                .text = call.text(),
                .fault = call.fault(),
                .columns = has_answer ? columns_of(call.reply(), method.reply) : MessageColumns(method.reply)};
  WrenchRange told;
  for (const v1::CapsuleDerivative& one : call.derivatives()) add_told(one, &told);
  answer.fault = failure_of(call, columns_of(call.request(), method.request), answer, told, with_physics);
  return answer;
}

void add_solution(const v1::CapsuleCall& call, std::uint32_t number, const Answer& answer,
                  report::v1::ReplayReport* report) {
  const MessageColumns request = columns_of(call.request(), method_named(call.method())->request);
  report::v1::SolverOutcome& outcome = *report->add_solutions();
  outcome.set_call(number);
  outcome.set_step(call.step());
  outcome.set_bodies(static_cast<std::uint32_t>(request.u32("flags").size()));
  outcome.set_discrepancies(static_cast<std::uint32_t>(request.u32("mode").size()));
  outcome.set_contacts(static_cast<std::uint32_t>(request.u64("contact_key").size()));
  outcome.set_iterations(answer.columns.u32("iterations")[0]);
  outcome.set_residual(answer.columns.f64("residual")[0]);
  outcome.set_stop_reason(stop_reason_name(static_cast<StopReason>(answer.columns.u32("stop_reason")[0])));
}

check::Examinee usable(const std::string& argument) {
  check::Examinee examinee = check::find_examinee(argument);
  check::complete(&examinee, false);
  if (!examinee.problem.empty()) throw BadInput(fmt::format("'{}': {}", argument, examinee.problem));
  return examinee;
}

// Ids of the types that a call is about.
std::vector<std::uint64_t> types_of(const v1::CapsuleCall& call, Slot slot) {
  const MessageColumns request = columns_of(call.request(), method_named(call.method())->request);
  if (slot == Slot::kConstraint) return request.u64("constraint_type");
  if (slot == Slot::kCollision) return request.u64("shape_type");
  std::vector<std::uint64_t> types;
  if (slot != Slot::kForce) return types;
  const std::vector<std::uint64_t>& of_force = request.u64("force_type");
  const std::vector<std::uint32_t>& application = request.u32("application");
  for (std::size_t i = 0; i + 1 < application.size(); i += 2)
    if (application[i] < of_force.size()) types.push_back(of_force[application[i]]);
  return types;
}

// A type by its id, as plugins that are known call it, among them the one that answered.
std::string type_text(std::uint64_t id, Slot slot, const v1::CapsulePlugin& own) {
  Catalog catalog = Catalog::installed(installed_worker(), installed_plugins());
  std::string problem;
  if (!own.command().empty()) {
    catalog.add_command(own.command(), &problem);
  } else if (!own.library().empty()) {
    catalog.add_library(own.library(), &problem);
  }
  for (const std::string& name : catalog.type_names(slot))
    if (type_id(name) == id) return "'" + name + "'";
  return fmt::format("of id {:016x} of plugin '{}', which is not to be had", id, own.name());
}

// The first of the types that a call is about which a plugin does not serve.
std::optional<std::uint64_t> unserved_type(const v1::CapsuleCall& call, const PluginDeclaration& declaration) {
  const std::vector<std::uint64_t> types = types_of(call, declaration.slot);
  const auto is_served = [&](std::uint64_t id) {
    return std::ranges::any_of(declaration.types,
                               [&](const TypeDeclaration& type) { return type_id(type.name) == id; });
  };
  const auto found = std::ranges::find_if_not(types, is_served);
  return found == types.end() ? std::nullopt : std::optional(*found);
}

// What befell a process, whichever it was and whatever it wrote.
std::string without_process(std::string text) {
  const std::string who = "worker process ";
  text.erase(std::min(text.size(), text.find("; its last words: ")));
  const std::size_t at = text.find(who);
  if (at == std::string::npos) return text;
  const std::size_t begin = at + who.size();
  const std::size_t end = std::min(text.size(), text.find_first_not_of("0123456789", begin));
  return text.erase(begin, end - begin);
}

// Asks the plugins of a capsule.
class Player {
 public:
  Player(const Reader& capsule, const ReplayOptions& options, Comparison* comparison, report::v1::ReplayReport* report)
      : capsule_(capsule), options_(options), comparison_(comparison), report_(report) {}

  // `substitute`: instead of the capsule's own.
  Answer ask(const v1::CapsuleCall& call, const std::optional<std::string>& substitute) {
    const auto key = std::make_pair(capsule_.plugins()[call.plugin()].SerializeAsString(), substitute);
    std::unique_ptr<Asked>& asked = asked_[key];
    if (!asked) asked = start(call, substitute);
    return asked->ask(call, capsule_.header().poison());
  }

  // True if it does not serve a type that the call is about: a slot may have several plugins, each with types of its own.
  bool must_leave_out(const v1::CapsuleCall& call, const std::string& substitute) {
    const check::Examinee& examinee = substitute_named(substitute);
    const std::optional<std::uint64_t> type = unserved_type(call, examinee.declaration);
    if (!type) return false;
    std::string& why = unserved_[{substitute, *type}];
    if (!why.empty()) return true;
    why = fmt::format("'{}' cannot take the place: it does not serve the type {}", substitute,
                      type_text(*type, examinee.declaration.slot, capsule_.plugins()[call.plugin()]));
    report_->add_left_out_because(why);
    return true;
  }

 private:
  const check::Examinee& substitute_named(const std::string& argument) {
    const auto known = substitutes_.find(argument);
    return known != substitutes_.end() ? known->second
                                       : substitutes_.emplace(argument, of_slot(argument)).first->second;
  }

  check::Examinee of_slot(const std::string& argument) const {
    check::Examinee examinee = usable(argument);
    if (slot_name(examinee.declaration.slot) != capsule_.header().slot())
      throw BadInput(fmt::format("'{}' is of slot {}, the capsule of slot {}", examinee.argument,
                                 slot_name(examinee.declaration.slot), capsule_.header().slot()));
    return examinee;
  }

  std::unique_ptr<Asked> start(const v1::CapsuleCall& call, const std::optional<std::string>& substitute) {
    const v1::CapsulePlugin& plugin = capsule_.plugins()[call.plugin()];
    const std::string own = plugin.command().empty() ? plugin.library() : plugin.command();
    if (!substitute && own.empty())
      throw BadInput(
          fmt::format("plugin {} was somebody else's worker; --plugin says who takes its place", plugin.name()));
    check::Examinee examinee = substitute ? substitute_named(*substitute) : of_slot(own);
    // what the run had set holds for a plugin of the same properties
    if (examinee.declaration.name == plugin.name() &&
        examinee.settings.size() == static_cast<std::size_t>(plugin.settings_size()))
      examinee.settings.assign(plugin.settings().begin(), plugin.settings().end());
    const std::string name = fmt::format("{} {} ({})", examinee.declaration.name, examinee.declaration.version,
                                         examinee.is_command() ? examinee.command : examinee.library);
    if (std::ranges::find(report_->plugins(), name) == report_->plugins().end()) report_->add_plugins(name);
    return std::make_unique<Asked>(examinee, options_, capsule_.header().threads(), comparison_);
  }

  const Reader& capsule_;
  const ReplayOptions& options_;
  Comparison* const comparison_;
  report::v1::ReplayReport* report_;
  std::map<std::string, check::Examinee> substitutes_;
  std::map<std::pair<std::string, std::uint64_t>, std::string> unserved_;  // why calls are left out
  std::map<std::pair<std::string, std::optional<std::string>>, std::unique_ptr<Asked>> asked_;  // by the plugin itself
};

// The request of a poisoned capsule without what answers its derivatives.
bool lacks_wrenches(const v1::CapsuleCall& call, const v1::CapsuleHeader& header) {
  if (!header.poison() || method_of(call) != stage::Method::kIntegratorIntegrate) return false;
  const stage::MethodInfo& method = stage::method_info(stage::Method::kIntegratorIntegrate);
  return columns_of(call.request(), method.request).u32("wrench_is_constant")[0] == 0;
}

void note_first(const v1::CapsuleCall& call, std::uint32_t number, const std::string& text,
                report::v1::ReplayReport* report) {
  if (report->has_first()) return;
  report::v1::ReplayFinding& first = *report->mutable_first();
  first.set_call(number);
  first.set_step(call.step());
  first.set_method(call.method());
  first.set_text(text);
}

// What differences are relative to: what was answered in the run, whichever calls are chosen.
Comparison comparison_in(const ReplayOptions& options, const std::function<bool(std::uint32_t)>& progress) {
  Comparison comparison;
  comparison.tolerance = options.tolerance;
  Reader capsule(options.file);
  const auto count_in = [&](const ColumnBytes& bytes, std::span<const stage::ColumnInfo> infos) {
    comparison.count_in(infos, columns_of(bytes, infos).column_bytes());
  };
  v1::CapsuleCall call;
  for (std::uint32_t number = 1; capsule.next(&call) && progress(number); ++number) {
    if (call.fault().empty() && call.status() == GRAVITAS_OK)
      count_in(call.reply(), method_named(call.method())->reply);
    for (const v1::CapsuleDerivative& one : call.derivatives()) count_in(one.trial(), derivative_info().request);
  }
  return comparison;
}

void write_differences(const Comparison& comparison, report::v1::ReplayReport* report) {
  report->set_tolerance(comparison.tolerance);
  for (const Disagreement& one : comparison.disagreements) write_disagreement(one, report->add_disagreements());
}

// Calls `judge` with each chosen call and its number, until it or `progress` says false. Throws BadInput if all must be left out.
void for_each_call(Reader* capsule, const ReplayOptions& options, report::v1::ReplayReport* report,
                   const std::function<bool(std::uint32_t)>& progress,
                   const std::function<bool(const v1::CapsuleCall&)>& must_leave_out,
                   const std::function<bool(const v1::CapsuleCall&, std::uint32_t)>& judge) {
  const auto start = std::chrono::steady_clock::now();
  v1::CapsuleCall call;
  bool goes_on = true;
  for (std::uint32_t number = 1; goes_on && capsule->next(&call); ++number) {
    if (options.only != 0 && number != options.only) continue;
    if (must_leave_out(call)) {
      report->set_left_out(report->left_out() + 1);
      continue;
    }
    report->set_calls(report->calls() + 1);
    goes_on = judge(call, number) && progress(number);
  }
  if (goes_on && report->calls() == 0 && report->left_out() > 0)
    throw BadInput(fmt::format("{}", fmt::join(report->left_out_because(), "; ")));
  if (goes_on && options.only != 0 && report->calls() == 0)
    throw BadInput(fmt::format("--call {}: '{}' has no such call", options.only, options.file));
  report->set_note(capsule->note());
  report->set_seconds(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
}

}  // namespace

report::v1::ReplayReport replay(const ReplayOptions& options, const std::function<bool(std::uint32_t)>& progress) {
  Reader capsule(options.file);
  report::v1::ReplayReport report;
  report.set_capsule(options.file);
  Comparison comparison = comparison_in(options, progress);
  Player player(capsule, options, &comparison, &report);
  const auto must_leave_out = [&](const v1::CapsuleCall& call) {
    return options.plugin && player.must_leave_out(call, *options.plugin);
  };
  for_each_call(
      &capsule, options, &report, progress, must_leave_out, [&](const v1::CapsuleCall& call, std::uint32_t number) {
        const Answer was = recorded_answer(call, options.with_physics);
        std::string text;
        bool has_failed = false;
        for (std::uint32_t i = 0; i < options.times && text.empty() && !has_failed; ++i) {
          try {
            const Answer came = player.ask(call, options.plugin);
            has_failed = !came.fault.empty();
            if (i == 0 && came.ok() && method_of(call) == stage::Method::kSolverSolve)
              add_solution(call, number, came, &report);
            if (was.fault.empty() || has_failed)
              text = was.fault.empty() ? check::difference(method_of(call), was, came, &comparison) : came.fault;
          } catch (const OtherDerivative& other) {
            text = other.what();
          }
        }
        if (lacks_wrenches(call, capsule.header())) {
          report.set_remark("what the integrator was told in the run is not kept: it is told wrenches of zero");
          if (text.empty() && call.breaks_law()) {
            report.set_not_judged(report.not_judged() + 1);
            return true;
          }
        }
        if (!was.fault.empty() && has_failed) {
          report.set_failed_again(report.failed_again() + 1);
        } else if (!was.fault.empty() && text.empty()) {
          report.set_answered_now(report.answered_now() + 1);
        } else if (text.empty()) {
          report.set_same(report.same() + 1);
          report.set_refused(report.refused() + (was.status == GRAVITAS_REFUSED ? 1 : 0));
        } else {
          report.set_different(report.different() + 1);
        }
        if (!text.empty()) note_first(call, number, text, &report);
        return true;
      });
  write_differences(comparison, &report);
  return report;
}

report::v1::ReplayReport bisect(const ReplayOptions& options, const std::string& other,
                                const std::function<bool(std::uint32_t)>& progress) {
  Reader capsule(options.file);
  report::v1::ReplayReport report;
  report.set_capsule(options.file);
  Comparison comparison = comparison_in(options, progress);
  Player player(capsule, options, &comparison, &report);
  const auto ask = [&](const v1::CapsuleCall& call, const std::string& plugin) {
    try {
      return player.ask(call, plugin);
    } catch (const OtherDerivative& problem) {
      return Answer{.status = GRAVITAS_OK, .text = {}, .fault = problem.what(), .columns = {}};
    }
  };
  const auto must_leave_out = [&](const v1::CapsuleCall& call) {
    return player.must_leave_out(call, *options.plugin) || player.must_leave_out(call, other);
  };
  for_each_call(&capsule, options, &report, progress, must_leave_out,
                [&](const v1::CapsuleCall& call, std::uint32_t number) {
                  const Answer a = ask(call, *options.plugin);
                  Answer b = ask(call, other);
                  if (!a.fault.empty() && without_process(a.fault) == without_process(b.fault)) b.fault = a.fault;
                  const std::string text = check::difference(method_of(call), a, b, &comparison);
                  if (!text.empty()) {
                    report.set_different(1);
                    report.clear_first();  // a difference is what is looked for
                    note_first(call, number, text, &report);
                  } else if (!a.fault.empty()) {
                    report.set_failed_again(report.failed_again() + 1);
                    note_first(call, number, a.fault, &report);
                  } else {
                    report.set_same(report.same() + 1);
                    report.set_refused(report.refused() + (a.status == GRAVITAS_REFUSED ? 1 : 0));
                  }
                  return text.empty();
                });
  write_differences(comparison, &report);
  return report;
}

}  // namespace gravitas::capsule
