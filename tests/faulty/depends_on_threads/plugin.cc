// Answers with the number of threads that worked for it.
#include <chrono>
#include <mutex>
#include <set>
#include <thread>

#include "tests/faulty/faulty_integrator.h"

namespace {

class Counting final : public gravitas::IntegratorPlugin {
 public:
  static gravitas::PluginDeclaration declaration() {
    return {.name = "Counting",
            .version = "1.0",
            .slot = gravitas::Slot::kIntegrator,
            .meaning = "Misbehaves on purpose.",
            .theta = 1.0};
  }
  explicit Counting(gravitas::PropertyCursor) {}

  void integrate(const gravitas::faulty::Request& request, const gravitas::faulty::Reply& reply,
                 gravitas::Host& host) override {
    gravitas::faulty::stand_still(request, reply);
    std::mutex mutex;
    std::set<std::thread::id> workers;
    host.parallel_for(1000, [&](std::uint64_t, std::uint64_t) {
      // long enough for the other threads to come
      std::this_thread::sleep_for(std::chrono::microseconds(200));
      const std::lock_guard lock(mutex);
      workers.insert(std::this_thread::get_id());
    });
    reply.error_estimate().set(static_cast<double>(workers.size()));
  }
};

}  // namespace

GRAVITAS_PLUGIN(Counting)
