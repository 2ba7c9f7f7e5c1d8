#include "plugin_sdk/conformance/library_subject.h"

#include <stdexcept>

#include "plugin_sdk/checks.h"
#include "plugin_sdk/conformance/inquiry.h"
#include "plugin_sdk/conformance/sample_values.h"

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
  gravitas_error error{};
  if (library_.table->create(numbers.data(), numbers.size(), &instance_, &error) != GRAVITAS_OK)
    throw std::runtime_error(path + " refuses its settings: " + error.text);
}

LibrarySubject::~LibrarySubject() { library_.table->destroy(instance_); }

Answer LibrarySubject::ask(stage::Method method, const MessageColumns& request, const DerivativeFunction& derivative) {
  Call call{&threads_, &derivative};
  const gravitas_host host = host_of(&call);
  const std::vector<gravitas_column> columns = request.plain();
  Answer answer{.status = GRAVITAS_OK, .text = {}, .fault = {}, .columns = empty_reply(method)};
  answer.columns.resize(known_room(method, request.counts()));
  for (int round = 0; round < kMostRounds; ++round) {
    std::vector<gravitas_reply_column> rooms = answer.columns.rooms();
    gravitas_error error{};
    answer.status = library_.table->call(instance_, static_cast<std::uint32_t>(method), columns.data(), rooms.data(),
                                         &host, &error);
    answer.text = error.text;
    if (answer.status != GRAVITAS_OK && answer.status != GRAVITAS_NEEDS_CAPACITY) return answer;
    for (const gravitas_reply_column& room : rooms) {
      if (room.count <= kMostColumnElements) continue;
      answer.fault = "it wants room for " + std::to_string(room.count) + " elements";
      return answer;
    }
    answer.columns.resize(rooms);
    if (answer.status != GRAVITAS_OK) continue;
    const std::string problem = check_rows(stage::method_info(method), request.counts(), answer.columns.counts());
    if (!problem.empty()) answer.fault = "its answer is wrong: " + problem;
    return answer;
  }
  answer.fault = "it wants more room each time it is asked";
  return answer;
}

}  // namespace gravitas::conformance
