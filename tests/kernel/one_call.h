// A call to a carrier of its own, without an environment around it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "kernel/arena.h"
#include "kernel/carrier/carrier.h"
#include "plugin_sdk/body.h"
#include "plugin_sdk/library.h"
#include "tests/kernel/world_builder.h"

namespace gravitas::harness {

// Columns of so many bodies, all zero but for what is set. Columns of other rows are empty, single values are there.
// All calls go to one carrier, which knows one arena. Each column of the reply has room for `reply_room` elements at
// first.
class OneCall {
 public:
  explicit OneCall(stage::Method method, std::uint64_t bodies = 1, std::uint64_t reply_room = 64) : method_(method) {
    const auto add = [&](const stage::ColumnInfo& column, std::uint64_t room, std::vector<kernel::ColumnId>* ids) {
      const bool is_body = std::string_view(column.rows) == "body";
      const std::uint64_t count = column.rows_index == stage::kScalar ? 1 : is_body ? bodies * column.components : 0;
      ids->push_back(arena.add(column.type, count, std::max(count, room)));
    };
    for (const stage::ColumnInfo& column : info().request) add(column, 16, &request);
    for (const stage::ColumnInfo& column : info().reply) add(column, reply_room, &reply);
    for (const stage::ColumnInfo& column : stage::method_info(stage::Method::kIntegratorDerivative).request)
      add(column, 16, &trial);
    for (const stage::ColumnInfo& column : stage::method_info(stage::Method::kIntegratorDerivative).reply)
      add(column, 16, &derivative);
    arena.seal();
  }

  const stage::MethodInfo& info() const { return stage::method_info(method_); }
  double* f64(std::uint32_t column) { return reinterpret_cast<double*>(arena.data(request[column])); }
  std::uint32_t* u32(std::uint32_t column) { return reinterpret_cast<std::uint32_t*>(arena.data(request[column])); }
  std::uint64_t* u64(std::uint32_t column) { return reinterpret_cast<std::uint64_t*>(arena.data(request[column])); }

  kernel::CallResult make(kernel::Carrier* carrier, kernel::DerivativeSource* derivatives = nullptr,
                          std::string_view fault = {}, std::uint32_t attempt = 0) {
    return carrier->call({method_, 0, request, reply, fault, 0, attempt}, &arena, derivatives);
  }

  // The elements of a column of the reply.
  template <typename T>
  std::vector<T> answer(std::uint32_t column) const {
    std::vector<T> elements(arena.count(reply[column]));
    if (!elements.empty()) std::memcpy(elements.data(), arena.data(reply[column]), elements.size() * sizeof(T));
    return elements;
  }
  // The bytes of each column of the reply.
  std::vector<std::vector<std::byte>> answers() const {
    std::vector<std::vector<std::byte>> all;
    for (std::size_t i = 0; i < reply.size(); ++i) {
      const std::byte* data = arena.data(reply[i]);
      all.emplace_back(data, data + arena.count(reply[i]) * stage::element_size(info().reply[i].type));
    }
    return all;
  }

  kernel::Arena arena;
  std::vector<kernel::ColumnId> request, reply, trial, derivative;

 private:
  stage::Method method_;
};

// Bodies on their way, each number of the answer another one and none of them zero.
class Integration : public OneCall {
 public:
  using Reply = stage::IntegratorIntegrateReply;

  explicit Integration(std::uint32_t bodies = 3) : OneCall(stage::Method::kIntegratorIntegrate, bodies) {
    using Request = stage::IntegratorIntegrateRequest;
    *f64(Request::kTimeStep) = 0.01;
    *u32(Request::kWrenchIsConstant) = 1;
    for (std::uint32_t body = 0; body < bodies; ++body) {
      u32(Request::kFlags)[body] = kMovable;
      f64(Request::kInverseMass)[body] = 1.0;
      for (const std::uint32_t column : {Request::kInertia, Request::kInverseInertia})
        for (std::uint32_t k = 0; k < 3; ++k) f64(column)[3 * body + k] = 1.0;
      for (std::uint32_t k = 0; k < 4; ++k) f64(Request::kOrientation)[4 * body + k] = 0.5;
      for (const std::uint32_t column : {Request::kPosition, Request::kLinearVelocity, Request::kAngularVelocity})
        for (std::uint32_t k = 0; k < 3; ++k) f64(column)[3 * body + k] = 1.0 + column + 10.0 * body + k;
    }
  }
};

// Four boxes in a row, each of which reaches into the next.
class PairSearch : public OneCall {
 public:
  explicit PairSearch(std::uint64_t reply_room = 64, double gap = -0.1)
      : OneCall(stage::Method::kSpacePairs, 4, reply_room) {
    using Request = stage::SpacePairsRequest;
    for (std::uint32_t body = 0; body < 4; ++body) {
      u32(Request::kFlags)[body] = kMovable | kHasShape;
      u64(Request::kFilterGroup)[body] = u64(Request::kFilterMask)[body] = 1;
      for (std::uint32_t k = 0; k < 3; ++k) f64(Request::kUpper)[3 * body + k] = 1.0;
      f64(Request::kLower)[std::size_t{3} * body] = body * (1.0 + gap);
      f64(Request::kUpper)[std::size_t{3} * body] = body * (1.0 + gap) + 1.0;
    }
  }
  std::vector<std::uint32_t> pairs() const { return answer<std::uint32_t>(0); }
};

// A worker of one shipped library ("solver_sequential"), with a deadline in seconds.
inline std::unique_ptr<kernel::Carrier> start_worker(kernel::Hosting hosting, const std::string& library,
                                                     double deadline) {
  kernel::SlotDescription slot;
  std::string problem;
  slot.deadline = deadline;
  slot.plugins = {{load_plugin_library(plugin_path(library), &problem).declaration, plugin_path(library), {}}};
  return hosting == kernel::Hosting::kGrpc ? start_grpc_carrier(slot, 1) : start_shared_memory_carrier(slot, 1);
}

}  // namespace gravitas::harness
