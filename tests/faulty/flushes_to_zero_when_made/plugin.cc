// Switches the processor to flush-to-zero in its constructor, and so for all calls that follow in that thread.
#include <immintrin.h>

#include "tests/faulty/faulty_integrator.h"

namespace {

using namespace gravitas;

class Flushing final : public IntegratorPlugin {
 public:
  static PluginDeclaration declaration() { return faulty::declaration(); }
  explicit Flushing(PropertyCursor) { _mm_setcsr(_mm_getcsr() | 0x8040); }

  void integrate(const faulty::Request& request, const faulty::Reply& reply, Host&) override {
    faulty::stand_still(request, reply);
  }
};

}  // namespace

GRAVITAS_PLUGIN(Flushing)
