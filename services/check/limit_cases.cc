// C4: over many calls a plugin answers in time and takes no more memory, descriptors or threads than at their start.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <memory>

#include "services/check/answer_text.h"
#include "services/check/examination.h"
#include "services/check/large_question.h"
#include "services/check/process_use.h"

namespace gravitas::check {

using conformance::Answer;
using conformance::Level;
using conformance::Question;

namespace {

using LimitClock = std::chrono::steady_clock;

// What a process may grow by between the end of the warm-up and the last call: an allocator's and a stack's pages.
// Over 100,000 calls, ten bytes a call are found.
constexpr std::uint64_t kMostGrowth = 1 << 20;
// Of the calls, this part is warm-up; at least, and in a quick check, all questions some times over.
constexpr std::uint64_t kWarmUpPart = 10, kWarmUpRounds = 5;
constexpr std::chrono::milliseconds kQuickTime{250};
// Over gRPC, this part of the calls.
constexpr std::uint32_t kStreamPart = 10;
// gRPC starts some of its threads when it first has work for them.
constexpr std::uint32_t kSpareThreads = 4;
constexpr std::uint32_t kCopies = 32;

// What many calls came to, on one carrier.
struct Series {
  std::string finding, blamed_call;  // of the first answer that was late, missing or another than before
  std::uint64_t calls = 0;
  ProcessUse before, after;
};

Series run_series(Examination& examination, kernel::Hosting hosting, std::uint64_t calls) {
  const std::vector<Answer>& expected = examination.answers();
  const std::vector<Question>& questions = examination.questions();
  const std::unique_ptr<CarrierSubject> subject = examination.fresh(hosting);
  const std::uint64_t rounds = kWarmUpRounds * questions.size();
  const std::uint64_t warm_up = examination.options.quick ? rounds : std::max(calls / kWarmUpPart, rounds);
  LimitClock::time_point end = LimitClock::time_point::max();
  Series series;
  for (std::uint64_t i = 0; i < std::max(calls, warm_up + questions.size()) && LimitClock::now() < end; ++i) {
    if (i == warm_up) {
      series.before = use_of(subject->process_id());
      if (examination.options.quick) end = LimitClock::now() + kQuickTime;
    }
    if (i % 256 == 0) examination.show(i, calls);
    const Question& question = questions[i % questions.size()];
    const std::string differs = difference(question.method, expected[i % questions.size()], subject->ask(question));
    ++series.calls;
    if (differs.empty()) continue;
    series.blamed_call = subject->last_call();
    series.finding = fmt::format("call {} of a process by {}, '{}': {}", i + 1, kernel::hosting_name(hosting),
                                 question.name, differs);
    return series;
  }
  series.after = use_of(subject->process_id());
  return series;
}

// All series of an examination, run once for all cases.
class AllSeries {
 public:
  const std::vector<Series>& of(Examination& examination) {
    if (!series_.empty()) return series_;
    std::uint64_t calls = examination.options.calls;
    // a quick one is ended by the clock
    if (examination.options.quick) calls = std::min<std::uint64_t>(calls, 5000);
    for (const kernel::Hosting hosting : examination.examinee.carriers()) {
      const bool is_usual = hosting == examination.usual_hosting();
      if (!is_usual && examination.options.quick) continue;
      series_.push_back(run_series(examination, hosting, is_usual ? calls : calls / kStreamPart));
      if (!series_.back().finding.empty()) break;
    }
    return series_;
  }

 private:
  std::vector<Series> series_;
};

using JudgeLimit = std::string (*)(const Series&);

CheckCase of_series(const std::shared_ptr<AllSeries>& all, std::string name, std::string claim, JudgeLimit judge) {
  const auto judge_each = [all, judge](Examination& examination) -> std::string {
    for (const Series& series : all->of(examination)) {
      const std::string finding = judge(series);
      if (finding.empty()) continue;
      examination.blamed_call = series.blamed_call;
      return finding;
    }
    return {};
  };
  return {Level::kLimits, "limits/" + std::move(name), std::move(claim), judge_each};
}

std::string judge_answers(const Series& series) { return series.finding; }

std::string judge_memory(const Series& series) {
  if (!series.finding.empty() || series.after.resident_bytes <= series.before.resident_bytes + kMostGrowth) return {};
  return fmt::format("its process grew by {} KiB over {} calls; allowed after the warm-up: {} KiB",
                     (series.after.resident_bytes - series.before.resident_bytes) / 1024, series.calls,
                     kMostGrowth / 1024);
}

std::string judge_descriptors(const Series& series) {
  if (!series.finding.empty() || series.after.descriptors <= series.before.descriptors) return {};
  return fmt::format("its process had {} descriptors, and {} after {} calls", series.before.descriptors,
                     series.after.descriptors, series.calls);
}

std::string judge_thread_count(const Series& series) {
  if (!series.finding.empty() || series.after.threads <= series.before.threads + kSpareThreads) return {};
  return fmt::format("its process had {} threads, and {} after {} calls", series.before.threads, series.after.threads,
                     series.calls);
}

// The largest question of each method, many times over.
std::string judge_large(Examination& examination) {
  const std::unique_ptr<CarrierSubject> subject = examination.fresh(examination.usual_hosting());
  for (const Question* one : examination.one_of_each_method()) {
    const Question* largest = one;
    for (const Question& other : examination.questions())
      if (other.method == one->method) largest = &other;
    const Question large = repeated(*largest, kCopies);
    const Answer answer = subject->ask(large);
    if (answer.ok()) continue;
    examination.blamed_call = subject->last_call();
    return fmt::format("'{}': {}", large.name, outcome_text(answer));
  }
  return {};
}

}  // namespace

std::vector<CheckCase> limit_cases() {
  const auto all = std::make_shared<AllSeries>();
  return {
      of_series(all, "answers", "Each of many calls is answered in time, and as the first.", judge_answers),
      of_series(all, "memory", "Many calls take no more memory than few.", judge_memory),
      of_series(all, "descriptors", "Many calls leave no descriptor open.", judge_descriptors),
      of_series(all, "threads", "Many calls leave no thread behind.", judge_thread_count),
      {Level::kLimits, "limits/large", "A large question is answered in time.", judge_large, true},
  };
}

}  // namespace gravitas::check
