// C2: the same request gets the same bytes: hundreds of times, twice, after others, in a fresh process, on another carrier,
// hosted direct, with other numbers of threads.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <numeric>

#include "services/check/answer_text.h"
#include "services/check/direct_child.h"
#include "services/check/examination.h"

namespace gravitas::check {

using conformance::Answer;
using conformance::Level;
using conformance::Question;

namespace {

// Asks the questions in an order and compares each answer with that of the undisturbed process.
std::string compare(Examination& examination, CarrierSubject* subject, const std::vector<std::size_t>& order,
                    const std::string& where) {
  const std::vector<Answer>& expected = examination.answers();
  for (const std::size_t i : order) {
    const Question& question = examination.questions()[i];
    const Answer came = subject->ask(question);
    const std::string differs = difference(question.method, expected[i], came);
    if (differs.empty()) continue;
    examination.blamed_call = call_text(question.method, question.request);
    if (subject->was_late()) {
      ++examination.late_answers;
      return fmt::format("too slow to be judged: '{}' {}: {}; its limit here is {:g} s, {:g} s whatever it marks{}",
                         question.name, where, came.fault, examination.patience.deadline, examination.patience.cap,
                         examination.options.quick ? " (--quick sets them, without it there is more)" : "");
    }
    return fmt::format("'{}' {}: {}", question.name, where, differs);
  }
  return {};
}

std::vector<std::size_t> forward(Examination& examination) {
  std::vector<std::size_t> order(examination.questions().size());
  std::iota(order.begin(), order.end(), 0);
  return order;
}

std::vector<std::size_t> backward(Examination& examination) {
  std::vector<std::size_t> order = forward(examination);
  std::ranges::reverse(order);
  return order;
}

std::string judge_answered(Examination& examination) {
  examination.answers();
  return {};
}

// Else what depends on how often a process was asked shows in whatever case comes by then, and not in that case alone.
std::string judge_many(Examination& examination) {
  const std::uint32_t calls = examination.options.quick ? 200 : 500;
  constexpr std::chrono::seconds kLongest{5};  // for each method
  const std::unique_ptr<CarrierSubject> subject = examination.fresh(examination.usual_hosting());
  for (const Question* question : examination.one_of_each_method()) {
    const Answer first = subject->ask(*question);
    // that it is answered at all is another case's
    if (!first.ok()) continue;
    const auto begin = std::chrono::steady_clock::now();
    for (std::uint32_t call = 2; call <= calls && std::chrono::steady_clock::now() - begin < kLongest; ++call) {
      const Answer came = subject->ask(*question);
      const std::string differs = difference(question->method, first, came);
      if (differs.empty()) continue;
      examination.blamed_call = call_text(question->method, question->request);
      if (subject->was_late()) ++examination.late_answers;
      return fmt::format("{}'{}' in call {} of one process: {}", subject->was_late() ? "too slow to be judged: " : "",
                         question->name, call, differs);
    }
  }
  return {};
}

std::string judge_twice(Examination& examination) {
  const std::unique_ptr<CarrierSubject> subject = examination.fresh(examination.usual_hosting());
  std::vector<std::size_t> order;
  for (const std::size_t i : forward(examination)) order.insert(order.end(), 3, i);
  return compare(examination, subject.get(), order, "asked three times in a row");
}

std::string judge_after_others(Examination& examination) {
  const std::unique_ptr<CarrierSubject> subject = examination.fresh(examination.usual_hosting());
  std::vector<std::size_t> order = forward(examination);
  const std::vector<std::size_t> back = backward(examination);
  order.insert(order.end(), back.begin(), back.end());
  return compare(examination, subject.get(), order, "asked again after all others, in reverse order");
}

std::string judge_fresh(Examination& examination) {
  const std::unique_ptr<CarrierSubject> subject = examination.fresh(examination.usual_hosting());
  return compare(examination, subject.get(), backward(examination),
                 "in another process that was asked in reverse order");
}

std::string judge_carriers(Examination& examination) {
  for (const kernel::Hosting hosting : examination.examinee.carriers()) {
    if (hosting == examination.usual_hosting()) continue;
    const std::unique_ptr<CarrierSubject> subject = examination.fresh(hosting);
    const std::string finding = compare(examination, subject.get(), forward(examination),
                                        fmt::format("hosted by {}", kernel::hosting_name(hosting)));
    if (!finding.empty()) return finding;
  }
  return {};
}

std::string judge_direct(Examination& examination) {
  return examination.examinee.is_command() ? "" : compare_direct(examination);
}

std::string judge_threads(Examination& examination) {
  for (const std::uint32_t threads : {2U, 3U}) {
    const std::unique_ptr<CarrierSubject> subject = examination.fresh(examination.usual_hosting(), threads);
    const std::string finding =
        compare(examination, subject.get(), forward(examination), fmt::format("with {} threads instead of 1", threads));
    if (!finding.empty()) return finding;
  }
  return {};
}

}  // namespace

std::vector<CheckCase> purity_cases() {
  return {
      {Level::kPurity, "purity/answered", "Ordinary questions are answered.", judge_answered},
      {Level::kPurity, "purity/many-calls", "How often it was asked does not matter.", judge_many},
      {Level::kPurity, "purity/twice", "The same question gets the same bytes.", judge_twice},
      {Level::kPurity, "purity/after-others", "What was asked before does not matter.", judge_after_others},
      {Level::kPurity, "purity/fresh-process", "Which process answers does not matter.", judge_fresh},
      {Level::kPurity, "purity/carriers", "How its process is reached does not matter.", judge_carriers},
      {Level::kPurity, "purity/direct", "Being hosted in the kernel's own process does not matter.", judge_direct},
      {Level::kPurity, "purity/threads", "The number of threads does not matter.", judge_threads},
  };
}

}  // namespace gravitas::check
