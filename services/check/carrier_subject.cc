#include "services/check/carrier_subject.h"

#include <fmt/format.h>
#include <signal.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <utility>

#include "kernel/fault.h"
#include "plugin_sdk/channel/mailbox.h"
#include "plugin_sdk/checks.h"
#include "services/check/answer_text.h"

namespace gravitas::check {

using conformance::Answer;
using conformance::DerivativeFunction;
using kernel::ColumnId;

namespace {

// A plugin may ask for more room as often as its reply has parts that it learns of in turn, not for ever.
constexpr int kMostRounds = 16;
constexpr std::uint64_t kMostElements = std::uint64_t{1} << 28;
constexpr std::uint64_t kFirstRoom = 64;
constexpr std::chrono::milliseconds kLook{20};

constexpr auto kIntegrate = static_cast<std::size_t>(stage::Method::kIntegratorIntegrate);
constexpr auto kDerivativeMethod = static_cast<std::size_t>(stage::Method::kIntegratorDerivative);

}  // namespace

// Answers the derivatives of a question from its function.
class CarrierSubject::Derivatives final : public kernel::DerivativeSource {
 public:
  Derivatives(CarrierSubject* subject, const DerivativeFunction& function) : subject_(*subject), function_(function) {}

  std::span<const ColumnId> trial_columns() const override { return subject_.request_columns_[kDerivativeMethod]; }
  std::span<const ColumnId> answer_columns() const override { return subject_.reply_columns_[kDerivativeMethod]; }
  void evaluate() override {
    const std::span<const stage::ColumnInfo> infos = stage::kMethods[kDerivativeMethod].request;
    const MessageColumns trial = subject_.take(trial_columns(), infos);
    const std::vector<gravitas_column> columns = trial.plain();
    const MessageColumns answer = function_(stage::IntegratorDerivativeRequest(columns.data())).columns();
    subject_.put(answer_columns(), answer, stage::kMethods[kDerivativeMethod].reply);
  }

  // Room for a trial state of as many bodies as are asked for.
  void make_room(std::uint64_t bodies) const {
    const std::span<const stage::ColumnInfo> infos = stage::kMethods[kDerivativeMethod].request;
    kernel::Arena& arena = subject_.arena_;
    for (std::size_t i = 0; i < infos.size(); ++i) {
      const std::uint64_t count = infos[i].rows_index == stage::kScalar ? 1 : bodies * infos[i].components;
      arena.grow(trial_columns()[i], count);
      arena.set_count(trial_columns()[i], count);
    }
    arena.grow(answer_columns()[0], 6 * bodies);
  }

 private:
  CarrierSubject& subject_;
  const DerivativeFunction& function_;
};

CarrierSubject::CarrierSubject(const Examinee& examinee, kernel::Hosting hosting, const Patience& patience,
                               std::uint32_t threads, std::uint32_t* fault_count)
    : examinee_(examinee), hosting_(hosting), patience_(patience), threads_(threads), fault_count_(fault_count) {
  const auto add = [&](std::span<const stage::ColumnInfo> infos, std::vector<ColumnId>* to) {
    for (const stage::ColumnInfo& info : infos) to->push_back(arena_.add(info.type, 0, kFirstRoom));
  };
  for (std::size_t method = 0; method < stage::kMethodCount; ++method) {
    add(stage::kMethods[method].request, &request_columns_[method]);
    add(stage::kMethods[method].reply, &reply_columns_[method]);
  }
  arena_.seal();
  watcher_ = std::thread([this] { watch(); });
}

CarrierSubject::~CarrierSubject() {
  kill();
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  watcher_.join();
}

void CarrierSubject::watch() {
  std::unique_lock lock(mutex_);
  while (!changed_.wait_for(lock, kLook, [&] { return stopping_; })) {
    if (armed_until_ == 0 || channel::now_ns() < armed_until_) continue;
    armed_until_ = 0;
    if (pidfd_ < 0) continue;
    capped_ = true;
    syscall(SYS_pidfd_send_signal, pidfd_, SIGKILL, nullptr, 0);
  }
}

void CarrierSubject::arm(double seconds) {
  const std::lock_guard lock(mutex_);
  armed_until_ = seconds > 0.0 ? channel::now_ns() + static_cast<std::uint64_t>(seconds * 1e9) : 0;
}

void CarrierSubject::count_fault(const std::string& why) {
  last_fault_ = why;
  ++faults_;
  ++*fault_count_;
}

void CarrierSubject::start() {
  if (carrier_) return;
  const kernel::SlotDescription slot = examinee_.slot(hosting_, patience_.deadline);
  carrier_ = kernel::start_host(slot, threads_, {});
  calls_ = 0;
  if (hosting_ == kernel::Hosting::kDirect) return;
  const std::lock_guard lock(mutex_);
  pidfd_ = static_cast<int>(syscall(SYS_pidfd_open, carrier_->process_id(), 0));
}

void CarrierSubject::kill() {
  if (pidfd_ >= 0) {
    const std::lock_guard lock(mutex_);
    syscall(SYS_pidfd_send_signal, pidfd_, SIGKILL, nullptr, 0);
    close(pidfd_);
    pidfd_ = -1;
  }
  carrier_.reset();
}

void CarrierSubject::put(std::span<const ColumnId> columns, const MessageColumns& numbers,
                         std::span<const stage::ColumnInfo> infos) {
  const std::vector<gravitas_column> plain = numbers.plain();
  for (std::size_t i = 0; i < plain.size(); ++i) {
    arena_.grow(columns[i], plain[i].count);
    arena_.set_count(columns[i], plain[i].count);
    if (plain[i].count > 0)
      std::memcpy(arena_.data(columns[i]), plain[i].data, plain[i].count * stage::element_size(infos[i].type));
  }
}

MessageColumns CarrierSubject::take(std::span<const ColumnId> columns, std::span<const stage::ColumnInfo> infos) const {
  MessageColumns numbers(infos);
  std::vector<gravitas_reply_column> rooms = numbers.rooms();
  for (std::size_t i = 0; i < columns.size(); ++i) rooms[i].count = arena_.count(columns[i]);
  numbers.resize(rooms);
  rooms = numbers.rooms();
  for (std::size_t i = 0; i < columns.size(); ++i)
    if (rooms[i].capacity > 0)
      std::memcpy(rooms[i].data, arena_.data(columns[i]), rooms[i].capacity * stage::element_size(infos[i].type));
  return numbers;
}

std::string CarrierSubject::last_call() const {
  return last_request_ ? call_text(last_method_, *last_request_) : std::string();
}

Answer CarrierSubject::ask(stage::Method method, const MessageColumns& request, const DerivativeFunction& derivative) {
  if (patience_.ends && patience_.ends()) throw Interrupted();
  last_method_ = method;
  was_late_ = false;
  last_request_ = std::make_unique<MessageColumns>(request);
  Derivatives derivatives(this, derivative);
  const bool asks_back = static_cast<std::size_t>(method) == kIntegrate && derivative;
  if (asks_back) derivatives.make_room(request.u32("flags").size());
  try {
    Answer answer = call(method, request, asks_back ? &derivatives : nullptr);
    arm(0.0);
    if (!answer.fault.empty()) count_fault(answer.fault);
    return answer;
  } catch (const kernel::StageFault& fault) {
    arm(0.0);
    const std::lock_guard lock(mutex_);
    was_late_ = capped_ || fault.kind == kernel::FaultKind::kDeadline;
    count_fault(std::exchange(capped_, false)
                    ? fmt::format("no answer within {:g} s, whatever its marks of progress", patience_.cap)
                    : fault.text());
  } catch (...) {
    // the question's own code threw in the middle of a call
    arm(0.0);
    kill();
    throw;
  }
  kill();
  return {.status = GRAVITAS_OK,
          .text = {},
          .fault = last_fault_,
          .columns = MessageColumns(stage::method_info(method).reply)};
}

Answer CarrierSubject::call(stage::Method method, const MessageColumns& request,
                            kernel::DerivativeSource* derivatives) {
  const auto index = static_cast<std::size_t>(method);
  const stage::MethodInfo& info = stage::method_info(method);
  start();
  ++calls_;
  put(request_columns_[index], request, info.request);
  const kernel::StageCall stage_call{method, 0, request_columns_[index], reply_columns_[index]};
  Answer answer{.status = GRAVITAS_OK, .text = {}, .fault = {}, .columns = MessageColumns(info.reply)};
  for (int round = 0; round < kMostRounds; ++round) {
    arm(patience_.cap);
    const kernel::CallResult result = carrier_->call(stage_call, &arena_, derivatives);
    answer.status = result.status;
    answer.text = result.text;
    if (result.status == GRAVITAS_OK) {
      answer.columns = take(reply_columns_[index], info.reply);
      const std::string problem = check_rows(info, request.counts(), answer.columns.counts());
      if (!problem.empty()) answer.fault = "its answer is wrong: " + problem;
      return answer;
    }
    if (result.status != GRAVITAS_NEEDS_CAPACITY) return answer;
    // all counts first: what grows is copied by its count
    std::vector<std::uint64_t> wanted;
    for (const ColumnId column : reply_columns_[index]) {
      wanted.push_back(arena_.count(column));
      arena_.set_count(column, 0);
    }
    const std::uint64_t most = *std::ranges::max_element(wanted);
    if (most > kMostElements) {
      answer.fault = fmt::format("it wants room for {} elements", most);
      return answer;
    }
    for (std::size_t i = 0; i < wanted.size(); ++i) arena_.grow(reply_columns_[index][i], wanted[i]);
  }
  answer.fault = "it wants more room each time it is asked";
  return answer;
}

}  // namespace gravitas::check
