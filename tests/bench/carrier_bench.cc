// What one stage call costs on each carrier.
#include <benchmark/benchmark.h>

#include <ctime>
#include <memory>
#include <vector>

#include "kernel/arena.h"
#include "kernel/carrier/carrier.h"
#include "plugin_sdk/body.h"
#include "plugin_sdk/library.h"
#include "tests/kernel/world_builder.h"

namespace gravitas {
namespace {

using kernel::Arena;
using kernel::ColumnId;
using kernel::Hosting;

std::unique_ptr<kernel::Carrier> make_carrier(Hosting hosting, const std::string& library) {
  kernel::SlotDescription slot;
  std::string problem;
  slot.plugins = {{load_plugin_library(library, &problem).declaration, library, {}}};
  if (hosting == Hosting::kDirect) return make_direct_carrier(slot.plugins, 1);
  return (hosting == Hosting::kSharedMemory ? start_shared_memory_carrier(slot, 1) : start_grpc_carrier(slot, 1));
}

// A request of `rows` rows in every column that counts bodies, and room for the reply.
class Call {
 public:
  Call(stage::Method method, std::uint64_t rows) : method_(method) {
    const stage::MethodInfo& info = stage::method_info(method);
    const auto add = [&](const stage::ColumnInfo& column, std::vector<ColumnId>* ids) {
      const bool is_body = std::string(column.rows) == "body";
      const std::uint64_t count = column.rows_index == stage::kScalar ? 1 : is_body ? rows * column.components : 0;
      ids->push_back(arena_.add(column.type, count, std::max<std::uint64_t>(count, 16)));
    };
    for (const stage::ColumnInfo& column : info.request) add(column, &request_);
    for (const stage::ColumnInfo& column : info.reply) add(column, &reply_);
    arena_.seal();
  }

  double* f64(std::uint32_t column) { return reinterpret_cast<double*>(arena_.data(request_[column])); }
  std::uint32_t* u32(std::uint32_t column) { return reinterpret_cast<std::uint32_t*>(arena_.data(request_[column])); }

  void make(kernel::Carrier* carrier, benchmark::State* state) {
    const kernel::CallResult result = carrier->call({method_, 0, request_, reply_}, &arena_, nullptr);
    if (result.status != GRAVITAS_OK) state->SkipWithError(result.text.c_str());
  }

 private:
  stage::Method method_;
  Arena arena_;
  std::vector<ColumnId> request_, reply_;
};

// The pairs of one body: nothing to send and nothing to do.
void empty_call(benchmark::State& state, Hosting hosting) {
  Call call(stage::Method::kSpacePairs, 1);
  const auto carrier = make_carrier(hosting, harness::plugin_path("space_basic"));
  for (int i = 0; i < 100; ++i) call.make(carrier.get(), &state);
  for (auto _ : state) call.make(carrier.get(), &state);
}

// The same after a pause in which the worker has gone to sleep.
void sleeping_call(benchmark::State& state, Hosting hosting) {
  Call call(stage::Method::kSpacePairs, 1);
  const auto carrier = make_carrier(hosting, harness::plugin_path("space_basic"));
  for (auto _ : state) {
    const timespec pause = {0, 1'000'000};
    nanosleep(&pause, nullptr);
    const auto start = std::chrono::steady_clock::now();
    call.make(carrier.get(), &state);
    state.SetIterationTime(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
}

// Free motion of n bodies: 15 columns out, 6 back, about 350 bytes a body, of which a third stays as it is.
void integrate_call(benchmark::State& state, Hosting hosting) {
  using Request = stage::IntegratorIntegrateRequest;
  const auto bodies = static_cast<std::uint64_t>(state.range(0));
  Call call(stage::Method::kIntegratorIntegrate, bodies);
  *call.f64(Request::kTimeStep) = 0.01;
  *call.u32(Request::kWrenchIsConstant) = 1;
  for (std::uint64_t i = 0; i < bodies; ++i) {
    call.u32(Request::kFlags)[i] = kMovable;
    call.f64(Request::kInverseMass)[i] = 1.0;
    call.f64(Request::kOrientation)[4 * i] = 1.0;
    for (std::uint64_t k = 0; k < 3; ++k) {
      call.f64(Request::kInertia)[3 * i + k] = call.f64(Request::kInverseInertia)[3 * i + k] = 1.0;
      call.f64(Request::kLinearVelocity)[3 * i + k] = 0.1;
      call.f64(Request::kAngularVelocity)[3 * i + k] = 0.2;
    }
  }
  const auto carrier = make_carrier(hosting, harness::plugin_path("integrator_semi_implicit_euler"));
  // from call to call the state is another, as in a run: what has not changed need not travel again
  const auto make = [&] {
    for (const auto column :
         {Request::kPosition, Request::kOrientation, Request::kLinearVelocity, Request::kAngularVelocity})
      for (std::uint64_t i = 0; i < bodies; ++i) call.f64(column)[3 * i] += 1e-9;
    call.make(carrier.get(), &state);
  };
  for (int i = 0; i < 20; ++i) make();
  for (auto _ : state) make();
}

BENCHMARK_CAPTURE(empty_call, direct, Hosting::kDirect)->UseRealTime();
BENCHMARK_CAPTURE(empty_call, shm, Hosting::kSharedMemory)->UseRealTime();
BENCHMARK_CAPTURE(empty_call, grpc, Hosting::kGrpc)->UseRealTime();
BENCHMARK_CAPTURE(sleeping_call, shm, Hosting::kSharedMemory)->UseManualTime()->Iterations(300);
BENCHMARK_CAPTURE(sleeping_call, grpc, Hosting::kGrpc)->UseManualTime()->Iterations(300);
BENCHMARK_CAPTURE(integrate_call, direct, Hosting::kDirect)->Arg(1000)->Arg(10000)->UseRealTime();
BENCHMARK_CAPTURE(integrate_call, shm, Hosting::kSharedMemory)->Arg(1000)->Arg(10000)->UseRealTime();
BENCHMARK_CAPTURE(integrate_call, grpc, Hosting::kGrpc)->Arg(1000)->Arg(10000)->UseRealTime();

}  // namespace
}  // namespace gravitas
