// C1 over gRPC: messages that no kernel sends are refused or fail; the worker lives, and answers the next good question
// as before.
#include <fmt/format.h>
#include <xxhash.h>

#include <chrono>
#include <map>
#include <memory>
#include <stdexcept>
#include <thread>
#include <utility>

#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/conformance/inquiry.h"
#include "services/check/abused_requests.h"
#include "services/check/answer_text.h"
#include "services/check/examination.h"
#include "services/check/stream_talk.h"

namespace gravitas::check {

using conformance::Level;
using conformance::Question;
using stage::v1::AssetChunk;
using stage::v1::Call;

namespace {

std::string reply_text(const StreamReply& reply) {
  if (reply.came) return outcome_text(reply.answer);
  return fmt::format("the stream ends with status {} ({})", static_cast<int>(reply.status.error_code()),
                     reply.status.error_message());
}

// One worker that is abused by the cases of a level, and its good answer to each method's question.
class AbusedWorker {
 public:
  AbusedWorker(Examination* examination, const Question& question)
      : question_(question), talk_(examination->examinee, examination->patience) {
    talk_.open(question.method);
    const StreamReply reply = talk_.ask(question, question.request);
    if (!reply.came || !reply.answer.ok()) throw std::runtime_error("before any abuse: " + reply_text(reply));
    good_ = reply.answer;
  }

  StreamTalk& talk() { return talk_; }
  std::string bytes(const Call& call) const { return bytes(question_.request, &call); }
  std::string bytes(const MessageColumns& request, const Call* call) const {
    return message_bytes(stage::method_info(question_.method).request, request, call);
  }

  // After `what`: the worker lives, and a good question on a new stream is answered as before.
  std::string after(const std::string& what) {
    try {
      talk_.open(question_.method);
      const StreamReply reply = talk_.ask(question_, question_.request);
      if (talk_.ending().empty() && reply.came) {
        const std::string differs = difference(question_.method, good_, reply.answer);
        return differs.empty() ? "" : fmt::format("after {}, the next good answer differs: {}", what, differs);
      }
    } catch (const std::runtime_error& problem) {
      if (alive_soon()) return fmt::format("after {}: {}", what, problem.what());
    }
    return alive_soon() ? fmt::format("after {}, a good question is not answered", what)
                        : fmt::format("it does not survive {}: {}", what, talk_.ending());
  }

  // Sends bytes that must not be answered with OK, then a good question.
  std::string abuse(const std::string& what, const std::string& message, const Call& call,
                    bool may_be_answered = false) {
    try {
      talk_.open(question_.method);
      talk_.send(message);
      const StreamReply reply = talk_.receive(question_, call);
      if (reply.came && reply.answer.status == GRAVITAS_OK && !may_be_answered)
        return fmt::format("{} is answered with OK", what);
      if (reply.came && reply.answer.status != GRAVITAS_OK && reply.answer.text.empty())
        return fmt::format("{} gets a {} without a reason", what, outcome_text(reply.answer));
    } catch (const std::runtime_error& problem) {
      if (alive_soon()) return fmt::format("{}: {}", what, problem.what());
    }
    return after(what);
  }

  const conformance::Answer& good() const { return good_; }

 private:
  // The end of a process may be known to its socket before it is to us.
  bool alive_soon() {
    for (int i = 0; i < 20 && talk_.ending().empty(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(2));
    return talk_.ending().empty();
  }

  const Question& question_;
  StreamTalk talk_;
  conformance::Answer good_{GRAVITAS_OK, {}, {}, conformance::empty_reply(question_.method)};
};

// One worker per method serves all cases, until one of them has a finding.
using AbusedWorkers = std::map<stage::Method, std::unique_ptr<AbusedWorker>>;
using JudgeStream = std::string (*)(AbusedWorker*, const Question&);

CheckCase for_each_method(const std::shared_ptr<AbusedWorkers>& workers, std::string name, std::string claim,
                          JudgeStream judge) {
  const auto judge_all = [workers, judge](Examination& examination) -> std::string {
    for (const Question* question : examination.one_of_each_method()) {
      // taken out, so that an exception ends it
      std::unique_ptr<AbusedWorker> worker = std::move((*workers)[question->method]);
      if (!worker) worker = std::make_unique<AbusedWorker>(&examination, *question);
      examination.blamed_call = call_text(question->method, question->request);
      const std::string finding = judge(worker.get(), *question);
      if (!finding.empty()) return finding;
      (*workers)[question->method] = std::move(worker);
    }
    return {};
  };
  return {Level::kWire, "stream/" + std::move(name), std::move(claim), judge_all};
}

std::string judge_truncated(AbusedWorker* worker, const Question& question) {
  const Call call = worker->talk().next_call(question, question.request);
  const std::string whole = worker->bytes(call);
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{1}, whole.size() / 4, whole.size() / 2, whole.size() - 1}) {
    const std::string finding = worker->abuse(fmt::format("a message cut after {} of {} bytes", size, whole.size()),
                                              whole.substr(0, size), call);
    if (!finding.empty()) return finding;
  }
  return {};
}

std::string judge_garbage(AbusedWorker* worker, const Question& question) {
  conformance::Draw draw(7);
  const Call call = worker->talk().next_call(question, question.request);
  for (const std::size_t size : {1, 13, 1000, 100000}) {
    std::string noise(size, '\0');
    for (char& byte : noise) byte = static_cast<char>(draw.bits());
    std::string finding = worker->abuse(fmt::format("{} random bytes", size), noise, call);
    // the same behind a good header, so that it is not refused for want of one
    if (finding.empty())
      finding = worker->abuse(fmt::format("{} random bytes behind a header", size),
                              worker->bytes(conformance::empty_request(question.method), &call) + noise, call);
    if (!finding.empty()) return finding;
  }
  return {};
}

std::string judge_lengths(AbusedWorker* worker, const Question& question) {
  const Call call = worker->talk().next_call(question, question.request);
  const std::string header = worker->bytes(conformance::empty_request(question.method), &call);
  // field 9 as a length: of 2^64 - 1 bytes, of a gigabyte, of a number without end, in eleven bytes
  const std::pair<const char*, std::string> bad[] = {
      {"a column of 2^64 - 1 bytes", "\x4a" + std::string(9, '\xff') + "\x01"},
      {"a column of a gigabyte that is not there", "\x4a\x80\x80\x80\x80\x04"},
      {"a length that does not end", "\x4a\x80"},
      {"a length of eleven bytes", "\x4a" + std::string(10, '\xff') + "\x01"},
      {"a tag of field zero", std::string("\x02\x00", 2)},
      {"a tag beyond all fields", std::string(9, '\xff') + "\x01"},
      {"an end of a group that was not begun", "\x4c"}};
  for (const auto& [what, bytes] : bad) {
    const std::string finding = worker->abuse(what, header + bytes, call);
    if (!finding.empty()) return finding;
  }
  return {};
}

std::string judge_types(AbusedWorker* worker, const Question& question) {
  Call call = worker->talk().next_call(question, question.request);
  const std::string good = worker->bytes(call);
  for (std::size_t field = 1; field <= stage::method_info(question.method).request.size(); ++field) {
    // one 32-bit number, which no column is made of
    std::string tag(1, static_cast<char>((field << 3 & 0x78) | 5));
    if (field >= 16) tag = {static_cast<char>((field << 3 & 0x7f) | 0x85), static_cast<char>(field >> 4)};
    const std::string finding =
        worker->abuse(fmt::format("field {} as a 32-bit number", field), good + tag + std::string(4, '\1'), call, true);
    if (!finding.empty()) return finding;
  }
  return worker->abuse("a header that is no message", worker->bytes(question.request, nullptr) + "\xaa\x06\x02\xff\xff",
                       call);
}

std::string judge_duplicate(AbusedWorker* worker, const Question& question) {
  StreamTalk& talk = worker->talk();
  const Call call = talk.next_call(question, question.request);
  talk.open(question.method);
  for (int time = 1; time <= 2; ++time) {
    talk.send(worker->bytes(call));
    const StreamReply reply = talk.receive(question, call);
    const std::string what = fmt::format("time {} with one sequence number", time);
    if (!reply.came) return fmt::format("{}: {}", what, reply_text(reply));
    if (reply.sequence != call.sequence() || reply.epoch != call.epoch())
      return fmt::format("{}: the reply is to sequence {} of epoch {}", what, reply.sequence, reply.epoch);
    const std::string differs = difference(question.method, worker->good(), reply.answer);
    if (!differs.empty()) return fmt::format("{}: {}", what, differs);
  }
  return worker->after("a request sent twice");
}

std::string judge_reordered(AbusedWorker* worker, const Question& question) {
  StreamTalk& talk = worker->talk();
  const Call first = talk.next_call(question, question.request), second = talk.next_call(question, question.request);
  talk.open(question.method);
  for (const Call& call : {second, first}) {
    talk.send(worker->bytes(call));
    const StreamReply reply = talk.receive(question, call);
    if (!reply.came) return reply_text(reply);
    if (reply.sequence != call.sequence())
      return fmt::format("asked with sequence {}, it replies to {}", call.sequence(), reply.sequence);
    const std::string differs = difference(question.method, worker->good(), reply.answer);
    if (!differs.empty()) return differs;
  }
  return worker->after("requests in the wrong order");
}

std::string judge_stale(AbusedWorker* worker, const Question& question) {
  Call call = worker->talk().next_call(question, question.request);
  for (const std::uint64_t epoch : {call.epoch() - 1, call.epoch() + 1, std::uint64_t{0}}) {
    call.set_epoch(epoch);
    const std::string finding = worker->abuse(
        fmt::format("a request of epoch {} instead of {}", epoch, worker->talk().epoch()), worker->bytes(call), call);
    if (!finding.empty()) return finding;
  }
  return {};
}

std::string judge_unknown_method(AbusedWorker* worker, const Question& question) {
  const Call call = worker->talk().next_call(question, question.request);
  for (const char* path : {"/gravitas.stage.v1.Space/Paris", "/", "/gravitas.stage.v1.Integrator/Derivative"}) {
    worker->talk().open(path);
    const StreamReply reply = worker->talk().receive(question, call);
    if (reply.came || reply.status.error_code() != grpc::StatusCode::UNIMPLEMENTED)
      return fmt::format("a stream of {}: {}, should end with UNIMPLEMENTED ({})", path, reply_text(reply),
                         static_cast<int>(grpc::StatusCode::UNIMPLEMENTED));
  }
  return worker->after("streams of methods that do not exist");
}

std::string judge_header(AbusedWorker* worker, const Question& question) {
  Call call = worker->talk().next_call(question, question.request);
  std::string finding = worker->abuse("a request without a call", worker->bytes(question.request, nullptr), call);
  if (!finding.empty()) return finding;
  call.set_target(1);
  return worker->abuse("a request to a plugin that is not there", worker->bytes(call), call);
}

// One that cannot compute digests ignores them: then the answer must be right.
std::string judge_digest(AbusedWorker* worker, const Question& question) {
  StreamTalk& talk = worker->talk();
  Call call = talk.next_call(question, question.request);
  call.set_digest(call.digest() ^ 1);
  talk.open(question.method);
  talk.send(worker->bytes(call));
  const StreamReply reply = talk.receive(question, call);
  if (reply.came && reply.answer.status == GRAVITAS_OK) {
    const std::string differs = difference(question.method, worker->good(), reply.answer);
    if (!differs.empty()) return "a wrong digest is ignored, and the answer differs: " + differs;
  }
  return worker->after("a wrong digest");
}

std::string judge_requests(AbusedWorker* worker, const Question& question, const std::vector<AbusedRequest>& abused) {
  for (const AbusedRequest& one : abused) {
    const Call call = worker->talk().next_call(question, one.request);
    const std::string finding = worker->abuse(one.what, worker->bytes(one.request, &call), call, one.may_be_answered);
    if (!finding.empty()) return finding;
  }
  return {};
}

std::string judge_assets(AbusedWorker* worker, const Question& question) {
  const stage::MethodInfo& method = stage::method_info(question.method);
  std::uint32_t field = 0;
  for (std::uint32_t i = 0; i < method.request.size(); ++i)
    if (method.request[i].asset) field = i + 1;
  if (field == 0) return {};

  Call call = worker->talk().next_call(question, question.request);
  AssetChunk chunk;
  const std::string data(64, 'x');
  chunk.set_hash(XXH3_64bits(data.data(), data.size()));
  chunk.set_size(data.size());
  chunk.set_data(data);
  const auto spoilt = [&](auto spoil) {
    AssetChunk copy = chunk;
    spoil(&copy);
    return asset_bytes(copy);
  };
  // each of a hash of its own: a worker remembers the size that it was told of one
  const std::pair<const char*, std::string> bad[] = {
      {"a part that starts in the middle", spoilt([](AssetChunk* c) { c->set_offset(8); })},
      {"an asset of 2^60 bytes",
       spoilt([](AssetChunk* c) { c->set_hash(c->hash() + 1), c->set_size(std::uint64_t{1} << 60); })},
      {"a part longer than its asset", spoilt([](AssetChunk* c) { c->set_hash(c->hash() + 2), c->set_size(8); })}};
  for (const auto& [what, bytes] : bad) {
    const std::string finding = worker->abuse(what, bytes, call);
    if (!finding.empty()) return finding;
  }
  // who cannot compute the hash takes it, and a good part is not answered
  worker->talk().open(question.method);
  worker->talk().send(spoilt([](AssetChunk* c) { c->set_hash(c->hash() + 3); }));
  if (std::string finding = worker->after("an asset with another content than its hash"); !finding.empty())
    return finding;
  const std::pair<std::uint32_t, const char*> uses[] = {
      {field, "an asset that was not sent"}, {0, "an asset for no column"}, {999, "an asset for column 999"}};
  for (const auto& [column, what] : uses) {
    Call wrong = call;
    wrong.set_digest(0);
    stage::v1::AssetUse* use = wrong.add_assets();
    use->set_column(column);
    use->set_hash(42);
    const std::string finding = worker->abuse(what, worker->bytes(wrong), wrong);
    if (!finding.empty()) return finding;
  }
  return {};
}

// The request without its columns, which the call says were kept.
MessageColumns without_columns(const Question& question, Call* call) {
  const stage::MethodInfo& method = stage::method_info(question.method);
  MessageColumns bare = question.request;
  for (std::uint32_t i = 0; i < method.request.size(); ++i) {
    if (method.request[i].rows_index == stage::kScalar) continue;
    call->add_kept(i + 1);
    set_count(&bare, i, 0);
  }
  return bare;
}

std::string judge_kept(AbusedWorker* worker, const Question& question) {
  StreamTalk& talk = worker->talk();
  Call call = talk.next_call(question, question.request);
  const MessageColumns bare = without_columns(question, &call);
  if (!talk.keeps_columns() || call.kept().empty()) return {};
  const std::string unsent = worker->abuse("columns kept that were never sent", worker->bytes(bare, &call), call);
  if (!unsent.empty()) return unsent;

  const auto ask_after_good = [&] {
    talk.open(question.method);
    talk.ask(question, question.request);
    call.set_sequence(talk.next_call(question, question.request).sequence());
    talk.send(worker->bytes(bare, &call));
    return talk.receive(question, call);
  };
  const StreamReply reply = ask_after_good();
  if (!reply.came) return reply_text(reply);
  const std::string differs = difference(question.method, worker->good(), reply.answer);
  if (!differs.empty()) return "with columns kept from the request before: " + differs;

  call.set_digest(call.digest() ^ 1);
  if (const StreamReply wrong = ask_after_good(); wrong.came && wrong.answer.status == GRAVITAS_OK)
    return "columns kept that are not those of the digest are answered with OK";
  return worker->after("columns kept with a wrong digest");
}

}  // namespace

std::vector<CheckCase> stream_cases() {
  const auto workers = std::make_shared<AbusedWorkers>();
  const auto uneven = [](AbusedWorker* worker, const Question& question) {
    return judge_requests(worker, question, with_uneven_rows(question));
  };
  const auto wild = [](AbusedWorker* worker, const Question& question) {
    return judge_requests(worker, question, with_wild_indices(question));
  };
  const auto nothing = [](AbusedWorker* worker, const Question& question) {
    return judge_requests(worker, question, {with_no_rows(question)});
  };
  return {
      for_each_method(workers, "truncated", "A message that is cut short fails, and harms nothing.", judge_truncated),
      for_each_method(workers, "garbage", "Random bytes fail, and harm nothing.", judge_garbage),
      for_each_method(workers, "lengths", "Impossible lengths and tags fail, and harm nothing.", judge_lengths),
      for_each_method(workers, "types", "Fields of the wrong wire type harm nothing.", judge_types),
      for_each_method(workers, "duplicate", "A request that comes twice is answered twice, the same.", judge_duplicate),
      for_each_method(workers, "kept", "Columns kept are those of the stream's request before, or refused.",
                      judge_kept),
      for_each_method(workers, "reordered", "Each reply carries the sequence number of its request.", judge_reordered),
      for_each_method(workers, "stale", "A request of another incarnation is refused.", judge_stale),
      for_each_method(workers, "unknown-method", "A method that does not exist is UNIMPLEMENTED.",
                      judge_unknown_method),
      for_each_method(workers, "header", "A request without a call, or to no plugin, fails.", judge_header),
      for_each_method(workers, "digest", "A wrong digest is refused, or ignored.", judge_digest),
      for_each_method(workers, "rows", "Columns that do not fit together are refused.", uneven),
      for_each_method(workers, "indices", "Indices beyond all rows are refused.", wild),
      for_each_method(workers, "nothing", "A request without rows is answered or refused.", nothing),
      for_each_method(workers, "assets", "Assets that do not fit are refused.", judge_assets),
  };
}

}  // namespace gravitas::check
