#include "kernel/spare.h"

#include <system_error>

namespace gravitas::kernel {

Spare::Spare(SlotDescription host, std::uint32_t threads, const HostStarter& start) {
  try {
    thread_ = std::jthread([this, host = std::move(host), threads, start](const std::stop_token& stop) {
      std::unique_ptr<Carrier> carrier;
      std::optional<StageFault> fault;
      try {
        carrier = start(host, threads, stop);
      } catch (const StageFault& failed) {
        fault = failed;
      } catch (const std::exception& failed) {
        fault.emplace(FaultKind::kHandshake, "start", failed.what());
      }
      const std::lock_guard lock(mutex_);
      carrier_ = std::move(carrier);
      fault_ = std::move(fault);
      done_ = true;
      changed_.notify_all();
    });
  } catch (const std::system_error& lacking) {
    fault_.emplace(FaultKind::kHandshake, "start", std::string("no thread for it: ") + lacking.what());
    done_ = true;
  }
}

Spare::~Spare() {
  give_up();
  if (thread_.joinable()) thread_.join();
  if (carrier_) carrier_->kill();
}

void Spare::give_up() {
  thread_.request_stop();
  const std::lock_guard lock(mutex_);
  if (carrier_) carrier_->kill();
}

bool Spare::is_done() const {
  const std::lock_guard lock(mutex_);
  return done_;
}

std::string Spare::problem() const {
  const std::lock_guard lock(mutex_);
  if (fault_) return "could not be started: " + fault_->text();
  return carrier_ && !carrier_->is_alive() ? "has died" : "";
}

std::unique_ptr<Carrier> Spare::take() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return done_; });
  if (fault_) throw StageFault(*fault_);
  return std::move(carrier_);
}

}  // namespace gravitas::kernel
