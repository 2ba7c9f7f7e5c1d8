// C1 in shared memory: frames that no kernel writes fail or are dropped; the worker lives, and answers the next good
// question as before.
#include <fmt/format.h>

#include <map>
#include <memory>
#include <stdexcept>
#include <utility>

#include "kernel/fault.h"
#include "plugin_sdk/conformance/inquiry.h"
#include "services/check/abused_requests.h"
#include "services/check/answer_text.h"
#include "services/check/examination.h"
#include "services/check/mailbox_talk.h"

namespace gravitas::check {

using conformance::Answer;
using conformance::Level;
using conformance::Question;

namespace {

// How long (s) nothing must come for a frame to count as dropped. A worker that waits has read a frame within 0.1 ms;
// the rest is for a busy machine, and one that took even longer fails with the next good question.
constexpr double kQuiet = 0.02, kQuickQuiet = 0.005;
// Room of each column beside what the questions need.
constexpr std::uint64_t kSpareElements = 4096;

enum class Expected {
  kFailure,  // a status other than OK, with a reason
  kDropped,  // no reply
  kAnything
};

class FrameAbuser {
 public:
  // Of the examination's questions.
  FrameAbuser(Examination& examination, const Question& question)
      : question_(question),
        quiet_(examination.options.quick ? kQuickQuiet : kQuiet),
        talk_(examination.examinee, examination.patience, elements_for(examination, question)) {
    good_ = talk_.ask(question);
    if (!good_.ok()) throw std::runtime_error("before any abuse: " + outcome_text(good_));
  }

  MailboxTalk& talk() { return talk_; }
  const Question& question() const { return question_; }
  Frame good_frame() { return talk_.frame(question_.method, question_.request); }

  // Posts the frame, looks at what comes, and asks a good question.
  std::string abuse(const std::string& what, const Frame& frame, Expected expected) {
    try {
      talk_.post(frame);
      const std::optional<Answer> answer =
          talk_.receive(question_, frame, expected == Expected::kDropped ? quiet_ : talk_.deadline());
      const std::string finding = judge(what, answer, expected);
      return finding.empty() ? after(what) : finding;
    } catch (const kernel::StageFault& fault) {
      return fmt::format("it does not survive {}: {}", what, fault.text());
    }
  }

  std::string after(const std::string& what) {
    try {
      const std::string differs = difference(question_.method, good_, talk_.ask(question_));
      return differs.empty() ? "" : fmt::format("after {}, the next good answer differs: {}", what, differs);
    } catch (const kernel::StageFault& fault) {
      return fmt::format("it does not survive {}: {}", what, fault.text());
    } catch (const std::runtime_error& problem) {
      return fmt::format("after {}: {}", what, problem.what());
    }
  }

 private:
  static std::uint64_t elements_for(Examination& examination, const Question& question) {
    const auto number = static_cast<std::size_t>(&question - examination.questions().data());
    std::uint64_t most = 0;
    for (const std::uint64_t count : question.request.counts()) most = std::max(most, count);
    for (const std::uint64_t count : examination.answers()[number].columns.counts()) most = std::max(most, count);
    return 8 * most + kSpareElements;
  }

  static std::string judge(const std::string& what, const std::optional<Answer>& answer, Expected expected) {
    if (expected == Expected::kDropped)
      return answer ? fmt::format("{} is answered: {}", what, outcome_text(*answer)) : "";
    if (!answer) return fmt::format("{} gets no reply", what);
    if (expected == Expected::kFailure && answer->status == GRAVITAS_OK)
      return fmt::format("{} is answered with OK", what);
    if (answer->status > GRAVITAS_NEEDS_CAPACITY && answer->text.empty() && answer->status != GRAVITAS_UNKNOWN_METHOD)
      return fmt::format("{} gets a {} without a reason", what, outcome_text(*answer));
    return {};
  }

  const Question& question_;
  const double quiet_;
  MailboxTalk talk_;
  Answer good_{GRAVITAS_OK, {}, {}, conformance::empty_reply(question_.method)};
};

using FrameAbusers = std::map<stage::Method, std::unique_ptr<FrameAbuser>>;
using JudgeFrames = std::string (*)(FrameAbuser*);

CheckCase for_each_method(const std::shared_ptr<FrameAbusers>& workers, std::string name, std::string claim,
                          JudgeFrames judge) {
  const auto judge_all = [workers, judge](Examination& examination) -> std::string {
    // a command is reached by gRPC only
    if (examination.examinee.is_command()) return {};
    for (const Question* question : examination.one_of_each_method()) {
      // taken out, so that an exception ends it
      std::unique_ptr<FrameAbuser> worker = std::move((*workers)[question->method]);
      if (!worker) worker = std::make_unique<FrameAbuser>(examination, *question);
      examination.blamed_call = call_text(question->method, question->request);
      const std::string finding = judge(worker.get());
      if (!finding.empty()) return finding;
      (*workers)[question->method] = std::move(worker);
    }
    return {};
  };
  return {Level::kWire, "frame/" + std::move(name), std::move(claim), judge_all};
}

struct Spoilt {
  std::string what;
  void (*spoil)(Frame*);
  Expected expected = Expected::kFailure;
  bool is_sealed = true;  // the digest is made to fit again
};

std::string judge_all(FrameAbuser* worker, std::initializer_list<Spoilt> list) {
  for (const Spoilt& one : list) {
    Frame frame = worker->good_frame();
    one.spoil(&frame);
    if (one.is_sealed) frame.seal();
    const std::string finding = worker->abuse(one.what, frame, one.expected);
    if (!finding.empty()) return finding;
  }
  return {};
}

std::string judge_header(FrameAbuser* worker) {
  return judge_all(
      worker,
      {{"a frame without the magic", [](Frame* f) { f->header.magic ^= 1; }},
       {"a frame of another schema", [](Frame* f) { f->header.schema_hash ^= 1; }},
       {"a method that does not exist", [](Frame* f) { f->header.method = stage::kMethodCount; }},
       {"method 4294967295", [](Frame* f) { f->header.method = ~0U; }},
       {"a plugin that is not there", [](Frame* f) { f->header.target = 1; }},
       {"plugin 4294967295", [](Frame* f) { f->header.target = ~0U; }},
       {"a column too few", [](Frame* f) { --f->header.column_count; }},
       {"4294967295 columns", [](Frame* f) { f->header.column_count = ~0U; }, Expected::kFailure, false},
       {"no room for the reply", [](Frame* f) { f->header.reply_count = 0; }},
       {"4294967295 rooms for the reply", [](Frame* f) { f->header.reply_count = ~0U; }, Expected::kFailure, false}});
}

std::string judge_digest(FrameAbuser* worker) {
  return judge_all(worker, {{"a wrong digest", [](Frame* f) { f->header.digest ^= 1; }, Expected::kFailure, false},
                            {"a count that was changed behind the digest", [](Frame* f) { --f->columns.back().count; },
                             Expected::kFailure, false}});
}

std::string judge_places(FrameAbuser* worker) {
  return judge_all(
      worker, {{"a column beyond its segment", [](Frame* f) { f->columns[0].offset = std::uint64_t{1} << 40; }},
               {"a column at the end of all addresses", [](Frame* f) { f->columns[0].offset = ~std::uint64_t{63}; }},
               {"a column at an odd address", [](Frame* f) { f->columns[0].offset += 4; }},
               {"a column longer than its segment", [](Frame* f) { f->columns[0].count = std::uint64_t{1} << 32; }},
               // times eight bytes: nothing, and eight
               {"a column of 2^61 numbers", [](Frame* f) { f->columns[0].count = std::uint64_t{1} << 61; }},
               {"a column of 2^61 + 1 numbers", [](Frame* f) { f->columns[0].count = (std::uint64_t{1} << 61) + 1; }},
               {"a column of 2^64 - 1 numbers", [](Frame* f) { f->columns[0].count = ~std::uint64_t{0}; }},
               {"room beyond its segment", [](Frame* f) { f->rooms[0].offset = std::uint64_t{1} << 40; }},
               {"room for 2^61 numbers", [](Frame* f) { f->rooms[0].capacity = std::uint64_t{1} << 61; }},
               {"room for 2^64 - 1 numbers", [](Frame* f) { f->rooms[0].capacity = ~std::uint64_t{0}; }}});
}

std::string judge_stale(FrameAbuser* worker) {
  return judge_all(worker, {{"a frame of another epoch", [](Frame* f) { ++f->header.epoch; }, Expected::kDropped},
                            {"a frame of epoch 0", [](Frame* f) { f->header.epoch = 0; }, Expected::kDropped},
                            {"a reply instead of a request", [](Frame* f) { f->header.kind = GRAVITAS_FRAME_REPLY; },
                             Expected::kDropped},
                            {"an answer that was not asked for",
                             [](Frame* f) { f->header.kind = GRAVITAS_FRAME_ANSWER; }, Expected::kDropped},
                            {"a frame of kind 99", [](Frame* f) { f->header.kind = 99; }, Expected::kDropped}});
}

std::string judge_wake(FrameAbuser* worker) {
  const Frame frame = worker->good_frame();
  const std::string finding = worker->abuse("a good frame", frame, Expected::kAnything);
  if (!finding.empty()) return finding;
  worker->talk().post_again();
  return worker->after("a wake without a message");
}

std::string judge_requests(FrameAbuser* worker, const std::vector<AbusedRequest>& abused) {
  for (const AbusedRequest& one : abused) {
    const Frame frame = worker->talk().frame(worker->question().method, one.request);
    const std::string finding =
        worker->abuse(one.what, frame, one.may_be_answered ? Expected::kAnything : Expected::kFailure);
    if (!finding.empty()) return finding;
  }
  return {};
}

// A method that the worker knows and the plugin does not have.
std::string judge_other_slot(FrameAbuser* worker) {
  for (std::uint32_t i = 0; i < stage::kMethodCount; ++i) {
    const auto method = static_cast<stage::Method>(i);
    const std::string mine = stage::method_info(worker->question().method).name, other = stage::kMethods[i].name;
    if (mine.substr(0, mine.find('.')) == other.substr(0, other.find('.'))) continue;
    const MessageColumns nothing(stage::kMethods[i].request);
    const AbusedRequest request = with_no_rows({other, method, nothing, {}});
    const std::string finding =
        worker->abuse(other + ", of another slot", worker->talk().frame(method, request.request), Expected::kFailure);
    if (!finding.empty()) return finding;
  }
  return {};
}

}  // namespace

std::vector<CheckCase> mailbox_cases() {
  const auto workers = std::make_shared<FrameAbusers>();
  return {
      for_each_method(workers, "header", "A frame with a wrong header fails.", judge_header),
      for_each_method(workers, "digest", "A frame whose digest does not fit fails.", judge_digest),
      for_each_method(workers, "places", "Columns and rooms outside their segments fail.", judge_places),
      for_each_method(workers, "stale", "Frames of another epoch or kind are dropped.", judge_stale),
      for_each_method(workers, "wake", "A wake without a new message harms nothing.", judge_wake),
      for_each_method(workers, "rows", "Columns that do not fit together are refused.",
                      [](FrameAbuser* worker) { return judge_requests(worker, with_uneven_rows(worker->question())); }),
      for_each_method(
          workers, "indices", "Indices beyond all rows are refused.",
          [](FrameAbuser* worker) { return judge_requests(worker, with_wild_indices(worker->question())); }),
      for_each_method(workers, "nothing", "A request without rows is answered or refused.",
                      [](FrameAbuser* worker) { return judge_requests(worker, {with_no_rows(worker->question())}); }),
      for_each_method(workers, "other-slot", "A method of another slot is unknown to it.", judge_other_slot),
  };
}

}  // namespace gravitas::check
