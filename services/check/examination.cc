#include "services/check/examination.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <iterator>
#include <map>
#include <stdexcept>
#include <utility>

#include "plugin_sdk/counted.h"
#include "plugin_sdk/declaration_check.h"
#include "plugin_sdk/shell_word.h"
#include "services/check/answer_text.h"

namespace gravitas::check {

using conformance::Answer;
using conformance::Level;
using conformance::Question;

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::uint64_t kSeed = 20090131;
// A level whose cases killed or hung this many processes is judged; asking on would only take time.
constexpr std::uint32_t kMostFaults = 3;
// In a quick check, cases after the first finding are left out beyond this.
constexpr std::chrono::milliseconds kQuickBudget{1100};
// It ends at this, for a plugin whose calls are slow; a command may start an interpreter for each process.
constexpr double kQuickLimit = 20.0, kQuickLimitOfCommands = 60.0;  // s

constexpr const char* kMeanings[] = {"handshake and refusals",           "wire abuse",
                                     "purity: same request, same bytes", "state: nothing kept that can be lost",
                                     "deadlines, memory, descriptors",   "numbers: known answers, laws, hostile input"};

// The levels in the order in which they are judged: wire and state compare answers, which must repeat.
constexpr Level kOrder[] = {Level::kHandshake, Level::kPurity, Level::kWire,
                            Level::kState,     Level::kLimits, Level::kNumbers};

constexpr const char* kInterrupted = "interrupted";

double usual_limit(const Examinee& plugin) { return plugin.is_command() ? kQuickLimitOfCommands : kQuickLimit; }

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

// The run of one examination.
class Run {
 public:
  Run(const Examinee& examinee, const Options& options, const std::function<void(const Progress&)>& progress,
      const std::function<bool()>& interrupted)
      : examination_(examinee, options, progress), interrupted_(interrupted) {
    examination_.patience.ends = [this] { return !why_ended().empty(); };
  }

  report::v1::CheckReport report();

 private:
  // Why no further call is made, or empty.
  std::string why_ended() const;
  bool is_chosen(const CheckCase& one) const;
  void judge_level(Level level, const std::vector<CheckCase>& cases);
  std::string judge(const CheckCase& one);
  void add_finding(const CheckCase& one, std::string text);
  std::string premise_of(Level level) const;
  std::string reason_to_stop(Level level, std::uint32_t faults) const;
  report::v1::CheckLevel& of(Level level) { return *report_.mutable_levels(static_cast<int>(level)); }
  const report::v1::CheckLevel& of(Level level) const { return report_.levels(static_cast<int>(level)); }
  void conclude();

  Examination examination_;
  const std::function<bool()> interrupted_;
  report::v1::CheckReport report_;
  Clock::time_point start_ = Clock::now();
  bool is_unusable_ = false;
};

std::string Run::why_ended() const {
  if (interrupted_()) return kInterrupted;
  const Options& options = examination_.options;
  const double limit = options.quick_limit > 0.0 ? options.quick_limit : usual_limit(examination_.examinee);
  if (!options.quick || seconds_since(start_) < limit) return {};
  return fmt::format("its calls take too long for --quick, which ends after {:g} s", limit);
}

bool Run::is_chosen(const CheckCase& one) const {
  const Options& options = examination_.options;
  if (!options.only_case.empty()) return one.name == options.only_case;
  if (!options.level.empty() && options.level != conformance::level_name(one.level)) return false;
  return !one.only_full || !options.quick;
}

// Why a level cannot be judged, or empty.
std::string Run::premise_of(Level level) const {
  if (level != Level::kHandshake && is_unusable_) return "it cannot be started as what it says it is (C0)";
  const bool compares = level == Level::kWire || level == Level::kState;
  if (compares && examination_.is_mute())
    return "it compares answers, and the ordinary questions are not answered (C2)";
  const std::uint32_t impure = of(Level::kPurity).failed();
  if (compares && impure > 0)
    return impure > examination_.late_answers ? "it compares answers, and those do not repeat (C2)"
                                              : "it compares answers, and some do not come in time (C2)";
  return {};
}

std::string Run::reason_to_stop(Level level, std::uint32_t faults) const {
  if (const std::string ended = why_ended(); !ended.empty()) return ended;
  if (faults >= kMostFaults) return fmt::format("its processes died or hung {} times", faults);
  const bool is_late = examination_.options.quick && Clock::now() - start_ > kQuickBudget;
  if (is_late && report_.findings_size() > 0) return "it has failed, and the time of --quick is over";
  const bool asks_ordinary = level == Level::kPurity || level == Level::kLimits;
  if (asks_ordinary && examination_.is_mute()) return "it does not answer the ordinary questions";
  return level == Level::kHandshake && is_unusable_ ? "it cannot be started as what it says it is" : "";
}

std::string Run::judge(const CheckCase& one) {
  try {
    return one.judge(examination_);
  } catch (const std::exception& problem) {
    return problem.what();
  }
}

void Run::add_finding(const CheckCase& one, std::string text) {
  const Examinee& examinee = examination_.examinee;
  report::v1::CheckFinding* finding = report_.add_findings();
  finding->set_level(conformance::level_name(one.level));
  finding->set_case_(one.name);
  finding->set_claim(one.claim);
  finding->set_text(std::move(text));
  finding->set_call(std::exchange(examination_.blamed_call, {}));
  const Options& options = examination_.options;
  const bool counts = one.level == Level::kLimits && options.calls != Options{}.calls;
  finding->set_again(fmt::format("gravitas check {} --case '{}'{}{}", shell_word(examinee.argument), one.name,
                                 options.quick && !one.only_full ? " --quick" : "",
                                 counts ? fmt::format(" --calls {}", options.calls) : ""));
}

void Run::judge_level(Level level, const std::vector<CheckCase>& cases) {
  report::v1::CheckLevel& verdict = of(level);
  const Clock::time_point start = Clock::now();
  std::string why = premise_of(level);
  const std::uint32_t faults_before = examination_.faults;
  for (const CheckCase& one : cases) {
    if (one.level != level || !is_chosen(one)) continue;
    if (why.empty()) why = reason_to_stop(level, examination_.faults - faults_before);
    if (!why.empty()) {
      verdict.set_left_out(verdict.left_out() + 1);
      continue;
    }
    examination_.now = {conformance::level_name(level), one.name, 0, 0};
    examination_.show(0, 0);
    examination_.blamed_call.clear();
    std::string finding;
    try {
      finding = judge(one);
    } catch (const Interrupted&) {
      why = why_ended();
      verdict.set_left_out(verdict.left_out() + 1);
      continue;
    }
    verdict.set_cases(verdict.cases() + 1);
    if (finding.empty()) continue;
    verdict.set_failed(verdict.failed() + 1);
    is_unusable_ = is_unusable_ || one.is_premise;
    add_finding(one, finding);
  }
  verdict.set_seconds(seconds_since(start));
  verdict.set_why(why);
}

void Run::conclude() {
  std::string passed, failed, open;
  for (report::v1::CheckLevel& level : *report_.mutable_levels()) {
    const bool is_complete = level.cases() > 0 && level.left_out() == 0;
    level.set_verdict(level.failed() > 0 ? "failed" : is_complete ? "passed" : "not judged");
    if (level.failed() == 0 && level.cases() == 0 && level.left_out() == 0) level.set_why("not asked for");
    (level.failed() > 0 ? failed : is_complete ? passed : open) += " " + level.level();
  }
  const Options& options = examination_.options;
  const bool is_whole = options.level.empty() && options.only_case.empty();
  report_.set_conforms(failed.empty() && (open.empty() || !is_whole) && !passed.empty());
  if (report_.conforms()) {
    report_.set_badge((is_whole ? "conforms:" : "no finding in what was asked for:") + passed +
                      (is_whole && options.quick ? " (quick)" : ""));
  } else if (failed.empty()) {
    report_.set_badge("not decided: not judged" + open);
  } else {
    report_.set_badge("does not conform: fails" + failed);
  }
}

// In a process that has been asked nothing else.
bool passes_alone(const conformance::Case& one, const Examination& examination) {
  std::uint32_t faults = 0;  // none that counts: the case has failed already
  CarrierSubject subject(examination.examinee, examination.usual_hosting(), examination.patience, 1, &faults);
  return one.judge(subject).empty() && faults == 0;
}

report::v1::CheckReport Run::report() {
  const Examinee& examinee = examination_.examinee;
  report_.set_plugin(examinee.argument);
  report_.set_name(examinee.declaration.name);
  report_.set_version(examinee.declaration.version);
  if (examinee.problem.empty()) report_.set_slot(slot_name(examinee.declaration.slot));
  report_.set_library(examinee.library);
  report_.set_command(examinee.command);
  report_.set_quick(examination_.options.quick);
  for (std::size_t i = 0; i < std::size(kMeanings); ++i) {
    report::v1::CheckLevel* level = report_.add_levels();
    level->set_level(conformance::level_name(static_cast<Level>(i)));
    level->set_meaning(kMeanings[i]);
  }
  std::vector<CheckCase> cases = all_cases(examinee.declaration);
  if (!examinee.problem.empty()) {
    const auto judge = [](Examination& examination) { return examination.examinee.problem; };
    cases = {{Level::kHandshake, "handshake/description", "It can be asked what it is.", judge, false, true}};
  }
  for (const Level level : kOrder) judge_level(level, cases);
  conclude();
  report_.set_seconds(seconds_since(start_));
  return std::move(report_);
}

}  // namespace

Patience patience_of(const Examinee& plugin, bool is_quick) {
  if (!is_quick) return {};
  // a command may start an interpreter first; a library loads in a few milliseconds
  return {.deadline = 1.0, .cap = 2.0, .start = plugin.is_command() ? 5.0 : 1.8};
}

Examination::Examination(const Examinee& plugin, Options chosen, std::function<void(const Progress&)> progress)
    : examinee(plugin),
      options(std::move(chosen)),
      patience(patience_of(plugin, options.quick)),
      on_progress(std::move(progress)) {
  // who gives all of it longer gives each call longer, up to what a full check gives it
  const double longer = std::max(1.0, options.quick_limit / usual_limit(plugin));
  patience.deadline = std::min(longer * patience.deadline, Patience{}.deadline);
  patience.cap = std::min(longer * patience.cap, Patience{}.cap);
}

void Examination::show(std::uint64_t done, std::uint64_t all) const {
  Progress shown = now;
  shown.done = done;
  shown.all = all;
  on_progress(shown);
}

std::unique_ptr<CarrierSubject> Examination::fresh(kernel::Hosting hosting, std::uint32_t threads) {
  return std::make_unique<CarrierSubject>(examinee, hosting, patience, threads, &faults);
}

CarrierSubject& Examination::subject() {
  if (!subject_) subject_ = fresh(usual_hosting());
  return *subject_;
}

const std::vector<Question>& Examination::questions() {
  if (!questions_.empty()) return questions_;
  const std::unique_ptr<CarrierSubject> asked = fresh(usual_hosting());
  questions_ = conformance::ordinary_questions(*asked, kSeed);
  if (questions_.empty()) throw std::runtime_error("there is no ordinary question that it could be asked");
  return questions_;
}

const std::vector<Answer>& Examination::answers() {
  if (!answers_.empty()) return answers_;
  if (is_mute()) throw std::runtime_error(why_mute_);
  const std::unique_ptr<CarrierSubject> undisturbed = fresh(usual_hosting());
  std::vector<Answer> answers;
  for (const Question& question : questions()) {
    answers.push_back(undisturbed->ask(question));
    if (answers.back().ok()) continue;
    why_mute_ = fmt::format("call {} of a process, '{}', is not answered: {}", answers.size(), question.name,
                            outcome_text(answers.back()));
    blamed_call = undisturbed->last_call();
    throw std::runtime_error(why_mute_);
  }
  answers_ = std::move(answers);
  return answers_;
}

std::vector<const Question*> Examination::one_of_each_method() {
  std::map<stage::Method, std::vector<const Question*>> by_method;
  for (const Question& question : questions()) by_method[question.method].push_back(&question);
  std::vector<const Question*> chosen;
  for (auto& [method, of_method] : by_method) {
    std::ranges::stable_sort(of_method, {}, [](const Question* one) { return one->request.bytes().size(); });
    chosen.push_back(of_method[of_method.size() / 2]);
  }
  return chosen;
}

std::vector<CheckCase> numbers_cases(const PluginDeclaration& declaration) {
  std::vector<CheckCase> cases;
  for (const conformance::Case& one : conformance::number_cases(declaration)) {
    const auto judge = [one](Examination& examination) {
      CarrierSubject& subject = examination.subject();
      const std::uint32_t faults = subject.faults();
      const std::uint64_t calls = subject.calls();
      std::string finding = one.judge(subject);
      if (finding.empty() && subject.faults() != faults) finding = subject.last_fault();
      examination.blamed_call = subject.last_call();
      if (!finding.empty() && calls > 0 && passes_alone(one, examination))
        finding += fmt::format("; only after {} in one process: alone this case passes", counted(calls, "call"));
      return finding;
    };
    cases.push_back({Level::kNumbers, one.name, one.claim, judge});
  }
  return cases;
}

std::vector<CheckCase> all_cases(const PluginDeclaration& declaration) {
  std::vector<CheckCase> cases = handshake_cases();
  const auto append = [&](std::vector<CheckCase> more) {
    cases.insert(cases.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
  };
  // cases of a declaration that is not well-formed would mean nothing
  if (!check_declaration(declaration).empty()) return cases;
  append(purity_cases());
  append(stream_cases());
  append(mailbox_cases());
  append(state_cases());
  append(limit_cases());
  append(numbers_cases(declaration));
  return cases;
}

report::v1::CheckReport examine(const Examinee& examinee, const Options& options,
                                const std::function<void(const Progress&)>& progress,
                                const std::function<bool()>& interrupted) {
  return Run(examinee, options, progress, interrupted).report();
}

}  // namespace gravitas::check
