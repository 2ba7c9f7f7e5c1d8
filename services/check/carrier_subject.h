// A plugin in a worker process as the subject of the kit: what it is asked goes through the kernel's own carriers, and
// the process may die of it. The next question then goes to a new one. Hosted direct, it has no deadline.
#pragma once

#include <array>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "kernel/arena.h"
#include "kernel/carrier/carrier.h"
#include "plugin_sdk/conformance/conformance.h"
#include "services/check/examinee.h"

namespace gravitas::check {

struct Patience {
  double deadline = 2.0;            // s, of a call from its last mark of progress
  double cap = 20.0;                // s, of a call whatever its marks
  double start = 10.0;              // s, to describe itself or to answer a greeting
  std::function<bool()> ends = {};  // asked before each call; absent: never
};

// Instead of an answer, where patience ends.
struct Interrupted {};

class CarrierSubject final : public conformance::Subject {
 public:
  // `fault_count` is counted up with faults().
  CarrierSubject(const Examinee& examinee, kernel::Hosting hosting, const Patience& patience, std::uint32_t threads,
                 std::uint32_t* fault_count);
  ~CarrierSubject() override;
  CarrierSubject(const CarrierSubject&) = delete;
  CarrierSubject& operator=(const CarrierSubject&) = delete;

  const PluginDeclaration& declaration() const override { return examinee_.declaration; }
  conformance::Answer ask(stage::Method method, const MessageColumns& request,
                          const conformance::DerivativeFunction& derivative = {}) override;
  conformance::Answer ask(const conformance::Question& question) {
    return ask(question.method, question.request, question.derivative);
  }

  // SIGKILL; the next question starts a new process.
  void kill();
  // Of the process at work, or -1.
  int process_id() const { return carrier_ ? carrier_->process_id() : -1; }
  kernel::Hosting hosting() const { return hosting_; }

  // How often there was no answer, and why the last time.
  std::uint32_t faults() const { return faults_; }
  const std::string& last_fault() const { return last_fault_; }
  // Of the process at work, how often it was asked.
  std::uint64_t calls() const { return carrier_ ? calls_ : 0; }
  // The last question was not answered, as its time was up.
  bool was_late() const { return was_late_; }
  // The last call in words; empty before the first.
  std::string last_call() const;

 private:
  class Derivatives;

  void start();
  void put(std::span<const kernel::ColumnId> columns, const MessageColumns& numbers,
           std::span<const stage::ColumnInfo> infos);
  MessageColumns take(std::span<const kernel::ColumnId> columns, std::span<const stage::ColumnInfo> infos) const;
  conformance::Answer call(stage::Method method, const MessageColumns& request, kernel::DerivativeSource* derivatives);
  void watch();
  void arm(double seconds);
  void count_fault(const std::string& why);

  const Examinee& examinee_;
  kernel::Hosting hosting_;
  Patience patience_;
  std::uint32_t threads_;
  std::uint32_t* fault_count_;
  kernel::Arena arena_;
  std::array<std::vector<kernel::ColumnId>, stage::kMethodCount> request_columns_, reply_columns_;
  std::unique_ptr<kernel::Carrier> carrier_;
  int pidfd_ = -1;
  std::uint64_t calls_ = 0;

  std::uint32_t faults_ = 0;
  std::string last_fault_;
  bool was_late_ = false;
  stage::Method last_method_{};
  std::unique_ptr<MessageColumns> last_request_;

  // ends a call that marks its progress for ever
  std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t armed_until_ = 0;  // CLOCK_MONOTONIC, ns; 0: no call is under way
  bool stopping_ = false, capped_ = false;
  std::thread watcher_;
};

}  // namespace gravitas::check
