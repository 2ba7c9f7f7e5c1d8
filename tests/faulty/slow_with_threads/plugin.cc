// Answers the same with any number of threads, but with several of them too late.
#include <chrono>
#include <mutex>
#include <set>
#include <thread>

#include "tests/faulty/faulty_integrator.h"

namespace {

class SlowTogether final : public gravitas::IntegratorPlugin {
 public:
  static gravitas::PluginDeclaration declaration() {
    return {.name = "SlowTogether",
            .version = "1.0",
            .slot = gravitas::Slot::kIntegrator,
            .meaning = "Misbehaves on purpose.",
            .theta = 1.0};
  }
  explicit SlowTogether(gravitas::PropertyCursor) {}

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
    if (workers.size() > 1) std::this_thread::sleep_for(std::chrono::seconds(3));
  }
};

}  // namespace

GRAVITAS_PLUGIN(SlowTogether)
