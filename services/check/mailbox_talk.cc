#include "services/check/mailbox_talk.h"

#include <fmt/format.h>

#include <array>
#include <cstring>
#include <stdexcept>

#include "kernel/fault.h"

namespace gravitas::check {

using channel::Segment;
using channel::SegmentRole;
using conformance::Answer;
using conformance::Question;

namespace {

constexpr std::uint64_t kGeneration = 1;
constexpr std::uint64_t kLookNs = 20'000'000;
const stage::MethodInfo& kDerivative = stage::method_info(stage::Method::kIntegratorDerivative);
// The state segment has the request's columns, and behind them those that a derivative is answered in.
const std::size_t kFirstOfAnswer = GRAVITAS_MAX_COLUMNS - kDerivative.reply.size();

}  // namespace

MailboxTalk::MailboxTalk(const Examinee& examinee, const Patience& patience, std::uint64_t elements)
    : deadline_(patience.deadline),
      // whole columns are aligned
      elements_((elements + 7) / 8 * 8),
      state_(Segment::create("check state", GRAVITAS_MAX_COLUMNS * elements_ * 8, channel::Sharing::kReadersOnly)),
      response_(Segment::create("check response", GRAVITAS_MAX_COLUMNS * elements_ * 8, channel::Sharing::kWriters)),
      link_(examinee.slot(kernel::Hosting::kSharedMemory, patience.deadline), 1, true, [] {}) {
  link_.finish();
  if (!boxes_.send(link_.descriptor_socket())) link_.report_death();
  const auto send = [&](SegmentRole role, const Segment& one) {
    if (!channel::send_segment(link_.descriptor_socket(), {role, 0, kGeneration, one.size()}, one.descriptor()))
      link_.report_death();
  };
  send(SegmentRole::kResponse, response_);
  send(SegmentRole::kState, state_);
}

gravitas_frame_column MailboxTalk::place(std::size_t column, std::uint64_t count) const {
  return {column * elements_ * 8, count, elements_};
}

Frame MailboxTalk::frame(stage::Method method, const MessageColumns& request) {
  const stage::MethodInfo& info = stage::method_info(method);
  Frame frame;
  frame.header.magic = GRAVITAS_MAGIC;
  frame.header.schema_hash = stage::kSchemaHash;
  frame.header.epoch = link_.epoch();
  frame.header.sequence = ++sequence_;
  frame.header.kind = GRAVITAS_FRAME_REQUEST;
  frame.header.method = static_cast<std::uint32_t>(method);
  frame.header.state_generation = frame.header.response_generation = kGeneration;
  frame.header.deadline_ns = channel::now_ns() + static_cast<std::uint64_t>(deadline_ * 1e9);

  const std::vector<gravitas_column> plain = request.plain();
  for (std::size_t i = 0; i < plain.size(); ++i) {
    frame.columns.push_back(place(i, plain[i].count));
    const std::size_t bytes = plain[i].count * stage::element_size(info.request[i].type);
    if (bytes > 0) std::memcpy(state_.data() + frame.columns[i].offset, plain[i].data, bytes);
  }
  std::size_t rooms = info.reply.size();
  if (method == stage::Method::kIntegratorIntegrate) rooms += kDerivative.request.size();
  for (std::size_t i = 0; i < rooms; ++i) frame.rooms.push_back(place(i, 0));
  frame.header.column_count = static_cast<std::uint32_t>(frame.columns.size());
  frame.header.reply_count = static_cast<std::uint32_t>(frame.rooms.size());
  frame.seal();
  return frame;
}

void MailboxTalk::post(const Frame& frame) {
  std::memcpy(boxes_.mine->columns, frame.columns.data(), frame.columns.size() * sizeof frame.columns[0]);
  std::memcpy(boxes_.mine->reply, frame.rooms.data(), frame.rooms.size() * sizeof frame.rooms[0]);
  std::memcpy(&boxes_.mine->header, &frame.header, sizeof frame.header);
  channel::post(boxes_.mine, boxes_.theirs);
}

void MailboxTalk::answer_derivative(const Question& question, const Frame& asked) {
  if (!question.derivative) throw std::runtime_error("it asks for a derivative, though none is offered");
  const std::size_t first_room = asked.rooms.size() - kDerivative.request.size();
  std::array<gravitas_column, GRAVITAS_MAX_COLUMNS> trial{};
  for (std::size_t i = 0; i < kDerivative.request.size(); ++i)
    trial[i] = {response_.data() + asked.rooms[first_room + i].offset,
                std::min(boxes_.theirs->columns[i].count, elements_)};
  const MessageColumns numbers = question.derivative(stage::IntegratorDerivativeRequest(trial.data())).columns();
  Frame answer;
  answer.header = asked.header;
  answer.header.kind = GRAVITAS_FRAME_ANSWER;
  answer.header.method = static_cast<std::uint32_t>(stage::Method::kIntegratorDerivative);
  answer.header.column_count = static_cast<std::uint32_t>(kDerivative.reply.size());
  answer.header.reply_count = 0;
  const std::vector<gravitas_column> plain = numbers.plain();
  for (std::size_t i = 0; i < plain.size(); ++i) {
    answer.columns.push_back(place(kFirstOfAnswer + i, plain[i].count));
    const std::size_t bytes = plain[i].count * stage::element_size(kDerivative.reply[i].type);
    if (bytes > 0) std::memcpy(state_.data() + answer.columns[i].offset, plain[i].data, bytes);
  }
  answer.seal();
  post(answer);
}

std::optional<Answer> MailboxTalk::receive(const Question& question, const Frame& frame, double seconds) {
  const std::uint64_t until = channel::now_ns() + static_cast<std::uint64_t>(seconds * 1e9);
  while (channel::now_ns() < until) {
    if (link_.has_ended() || seen_ == channel::kEnded) link_.report_death();
    if (channel::wait(boxes_.mine, boxes_.theirs, seen_, std::min(until, channel::now_ns() + kLookNs)) ==
        channel::Waited::kTimeout)
      continue;
    seen_ = boxes_.theirs->signal.load(std::memory_order_acquire);
    gravitas_frame_header header;
    std::memcpy(&header, &boxes_.theirs->header, sizeof header);
    if (header.kind == GRAVITAS_FRAME_CRASH) link_.report_death();
    if (header.sequence != frame.header.sequence || header.epoch != frame.header.epoch) continue;
    if (header.kind == GRAVITAS_FRAME_CALLBACK) {
      answer_derivative(question, frame);
      continue;
    }
    const stage::MethodInfo& method = stage::method_info(question.method);
    Answer answer{.status = header.status, .text = {}, .fault = {}, .columns = MessageColumns(method.reply)};
    if (header.status != GRAVITAS_OK) {
      answer.text.assign(boxes_.theirs->text, strnlen(boxes_.theirs->text, sizeof boxes_.theirs->text));
      return answer;
    }
    std::vector<gravitas_reply_column> rooms = answer.columns.rooms();
    for (std::size_t i = 0; i < rooms.size(); ++i)
      rooms[i].count = std::min(boxes_.theirs->columns[i].count, elements_);
    answer.columns.resize(rooms);
    rooms = answer.columns.rooms();
    for (std::size_t i = 0; i < rooms.size(); ++i)
      if (rooms[i].capacity > 0)
        std::memcpy(rooms[i].data, response_.data() + frame.rooms[i].offset,
                    rooms[i].capacity * stage::element_size(method.reply[i].type));
    return answer;
  }
  return std::nullopt;
}

Answer MailboxTalk::ask(const Question& question) {
  const Frame good = frame(question.method, question.request);
  post(good);
  const std::optional<Answer> answer = receive(question, good, deadline_);
  if (!answer) throw std::runtime_error(fmt::format("a good question is not answered within {:g} s", deadline_));
  return *answer;
}

}  // namespace gravitas::check
