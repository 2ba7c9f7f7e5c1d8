#include "plugin_sdk/conformance/library_subject.h"

#include <algorithm>
#include <cstring>
#include <stdexcept>

#include "plugin_sdk/answer_checks.h"
#include "plugin_sdk/checks.h"
#include "plugin_sdk/column_vector.h"
#include "plugin_sdk/conformance/inquiry.h"
#include "plugin_sdk/conformance/sample_values.h"
#include "plugin_sdk/floating_point.h"

namespace gravitas::conformance {
namespace {

// A plugin may ask for more room as often as its reply has parts that it learns of in turn, not for ever.
constexpr int kMostRounds = 16;
constexpr std::uint64_t kMostColumnElements = std::uint64_t{1} << 28;

struct Call {
  ThreadPool* threads;
  const DerivativeFunction* derivative;
};

gravitas_host host_of(Call* call) {
  gravitas_host host{};
  host.context = call;
  host.mark_progress = [](void*) {};
  host.parallel_for = [](void* context, std::uint64_t count, void (*body)(void*, std::uint64_t, std::uint64_t),
                         void* argument) { static_cast<Call*>(context)->threads->parallel_for(count, body, argument); };
  host.derivative = [](void* context, const gravitas_column* columns, gravitas_reply_column* answer) -> std::int32_t {
    const DerivativeFunction& derivative = *static_cast<Call*>(context)->derivative;
    if (!derivative) return GRAVITAS_CALLBACK_FAILED;
    const DerivativeAnswer came = derivative(stage::IntegratorDerivativeRequest(columns));
    const stage::IntegratorDerivativeReply reply(answer);
    for (const double number : came.wrench) reply.wrench().push(number);
    for (const std::uint32_t body : came.jacobian_body) reply.jacobian_body().push(body);
    for (const double number : came.jacobian) reply.jacobian().push(number);
    return GRAVITAS_OK;
  };
  return host;
}

// Room for the columns whose rows the request knows; how much the others take the plugin says.
std::vector<gravitas_reply_column> known_room(stage::Method method, const std::vector<std::uint64_t>& request_counts) {
  const stage::MethodInfo& info = stage::method_info(method);
  std::vector<gravitas_reply_column> room;
  for (const stage::ColumnInfo& column : info.reply) {
    std::uint64_t count = column.rows_index == stage::kScalar ? 1 : 0;
    for (std::size_t i = 0; i < info.request.size() && column.rows_index != stage::kScalar; ++i) {
      const stage::ColumnInfo& asked = info.request[i];
      if (asked.rows_index != column.rows_index) continue;
      const std::uint64_t rows = request_counts[i] / asked.components;
      count = (rows > asked.extra ? rows - asked.extra : 0) * column.components + column.extra;
    }
    room.push_back({nullptr, 0, count});
  }
  return room;
}

}  // namespace

LibrarySubject::LibrarySubject(const std::string& path, const std::optional<std::vector<double>>& settings,
                               std::uint32_t threads)
    : threads_(threads) {
  std::string problem;
  library_ = load_plugin_library(path, &problem);
  if (library_.table == nullptr) throw std::runtime_error(problem);
  const std::vector<double> numbers = settings ? *settings : default_settings(library_.declaration);
  problem = create_instance(library_, numbers, &instance_);
  if (!problem.empty()) throw std::runtime_error(path + " cannot be made: " + problem);
}

LibrarySubject::~LibrarySubject() { destroy_instance(library_, instance_); }

Answer LibrarySubject::ask(stage::Method method, const MessageColumns& request, const DerivativeFunction& derivative) {
  Call call{&threads_, &derivative};
  const gravitas_host host = host_of(&call);
  const stage::MethodInfo& info = stage::method_info(method);
  std::vector<gravitas_column> columns = request.plain();
  std::vector<ColumnVector<std::byte>> asked, filled(info.reply.size());
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const std::byte* bytes = static_cast<const std::byte*>(columns[i].data);
    asked.emplace_back(bytes, bytes + columns[i].count * stage::element_size(info.request[i].type));
    columns[i].data = asked.back().data();
  }
  std::vector<gravitas_reply_column> rooms = known_room(method, request.counts());
  Answer answer{.status = GRAVITAS_OK, .text = {}, .fault = {}, .columns = empty_reply(method)};
  for (int round = 0; round < kMostRounds; ++round) {
    for (std::size_t i = 0; i < rooms.size(); ++i) {
      filled[i].assign(rooms[i].count * stage::element_size(info.reply[i].type), std::byte{0});
      rooms[i] = {filled[i].data(), rooms[i].count, 0};
    }
    const std::uint32_t control = floating_point_control();
    gravitas_error error{};
    answer.status = call_instance(library_, instance_, static_cast<std::uint32_t>(method), columns.data(), rooms.data(),
                                  &host, &error);
    answer.text = error_text(error);
    if (restore_floating_point_control(control)) {
      answer.fault = "it changed the floating-point environment";
      return answer;
    }
    if (answer.status != GRAVITAS_OK && answer.status != GRAVITAS_NEEDS_CAPACITY) return answer;
    for (const gravitas_reply_column& room : rooms) {
      if (room.count <= kMostColumnElements) continue;
      answer.fault = "it wants room for " + std::to_string(room.count) + " elements";
      return answer;
    }
    if (answer.status != GRAVITAS_OK) continue;
    if (const std::string overfull = overfull_column(info.reply, rooms.data()); !overfull.empty()) {
      answer.fault = "its answer is wrong: " + overfull;
      return answer;
    }
    answer.columns.resize(rooms);
    const std::vector<gravitas_reply_column> came = answer.columns.rooms();
    for (std::size_t i = 0; i < came.size(); ++i) {
      const std::uint64_t elements = std::min(rooms[i].count, rooms[i].capacity);
      if (elements > 0) std::memcpy(came[i].data, filled[i].data(), elements * stage::element_size(info.reply[i].type));
    }
    const std::string problem = check_rows(info, request.counts(), answer.columns.counts());
    if (!problem.empty()) answer.fault = "its answer is wrong: " + problem;
    return answer;
  }
  answer.fault = "it wants more room each time it is asked";
  return answer;
}

}  // namespace gravitas::conformance
