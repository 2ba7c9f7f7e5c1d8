// The examination of one plugin: the levels C0 to C5 in turn, each a list of cases.
//
//   describe, starts, well declared?  --no-->  nothing else is judged
//        | yes
//   C0 handshake   C2 purity   C1 wire, C3 state (need answers that repeat)   C4 limits   C5 numbers
//
// A case never knows the plugin's name: it asks the ordinary questions of the kit, which follow from the declaration.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gravitas/report/v1/check.pb.h"
#include "services/check/carrier_subject.h"

namespace gravitas::check {

struct Options {
  bool quick = false;            // within two seconds; at 20 s (60 s for a command) it is not decided
  double quick_limit = 0.0;      // s; 0: those
  std::uint32_t calls = 100000;  // of C4
  // Only these; empty: all.
  std::string level, only_case;
};

struct Progress {
  std::string level, name;          // of the case under way
  std::uint64_t done = 0, all = 0;  // of its calls; 0: it does not count
};

// How long things may take.
Patience patience_of(const Examinee& plugin, bool is_quick);

// What cases share: the plugin, its questions, and the answers of an undisturbed process.
class Examination {
 public:
  Examination(const Examinee& plugin, Options chosen, std::function<void(const Progress&)> progress);

  const Examinee& examinee;
  const Options options;
  Patience patience;

  // The ordinary questions. Throws std::runtime_error if they cannot be put.
  const std::vector<conformance::Question>& questions();
  // Answers to the questions, asked once and in order of a process of its own. Throws std::runtime_error if there is
  // none to one of them; then `is_mute`.
  const std::vector<conformance::Answer>& answers();
  bool is_mute() const { return !why_mute_.empty(); }

  // A process that answers questions of the cases that do not harm it.
  CarrierSubject& subject();
  // A new subject, whose process starts with its first question.
  std::unique_ptr<CarrierSubject> fresh(kernel::Hosting hosting, std::uint32_t threads = 1);
  kernel::Hosting usual_hosting() const { return examinee.carriers().front(); }

  // Of each method, a question of middling size.
  std::vector<const conformance::Question*> one_of_each_method();

  void show(std::uint64_t done, std::uint64_t all) const;

  // The call that a finding is about, if the case knows it better than the subject.
  std::string blamed_call;
  std::function<void(const Progress&)> on_progress;
  Progress now;
  // Cases of purity at which an answer did not come in time, which is no other answer.
  std::uint32_t late_answers = 0;
  // Processes that died or hung in a call so far.
  std::uint32_t faults = 0;

 private:
  std::unique_ptr<CarrierSubject> subject_;
  std::vector<conformance::Question> questions_;
  std::vector<conformance::Answer> answers_;
  std::string why_mute_;
};

struct CheckCase {
  conformance::Level level;
  std::string name;   // "purity/twice"
  std::string claim;  // what a conforming plugin does
  // Empty, or what is wrong; an exception is a finding too.
  std::function<std::string(Examination&)> judge;
  bool only_full = false;   // too long for a quick check
  bool is_premise = false;  // where it fails, no other case means anything
};

std::vector<CheckCase> handshake_cases();
std::vector<CheckCase> stream_cases();   // C1 over gRPC
std::vector<CheckCase> mailbox_cases();  // C1 in shared memory
std::vector<CheckCase> purity_cases();
std::vector<CheckCase> state_cases();
std::vector<CheckCase> limit_cases();
std::vector<CheckCase> numbers_cases(const PluginDeclaration& declaration);

// All cases of a plugin, in the order of the levels.
std::vector<CheckCase> all_cases(const PluginDeclaration& declaration);

// Runs them. `interrupted` is asked between cases and before each call.
report::v1::CheckReport examine(const Examinee& examinee, const Options& options,
                                const std::function<void(const Progress&)>& progress,
                                const std::function<bool()>& interrupted);

}  // namespace gravitas::check
