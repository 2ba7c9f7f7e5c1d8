#include "tests/workers/plugin_fixture.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "plugin_sdk/checks.h"

namespace gravitas::test {
namespace {

const stage::MethodInfo& info(stage::Method method) { return stage::kMethods[static_cast<std::uint32_t>(method)]; }

}  // namespace

MessageColumns::MessageColumns(std::span<const stage::ColumnInfo> infos) : infos_(infos) {
  for (const stage::ColumnInfo& column : infos) {
    const std::size_t size = column.rows_index == stage::kScalar ? 1 : 0;
    switch (column.type) {
      case stage::ElementType::kF64:
        columns_.emplace_back(std::vector<double>(size));
        break;
      case stage::ElementType::kU32:
        columns_.emplace_back(std::vector<std::uint32_t>(size));
        break;
      case stage::ElementType::kU64:
        columns_.emplace_back(std::vector<std::uint64_t>(size));
        break;
    }
  }
}

std::size_t MessageColumns::index(std::string_view name) const {
  for (std::size_t i = 0; i < infos_.size(); ++i)
    if (infos_[i].name == name) return i;
  throw std::logic_error("no column " + std::string(name));
}

std::vector<double>& MessageColumns::f64(std::string_view name) {
  return std::get<std::vector<double>>(columns_[index(name)]);
}
std::vector<std::uint32_t>& MessageColumns::u32(std::string_view name) {
  return std::get<std::vector<std::uint32_t>>(columns_[index(name)]);
}
std::vector<std::uint64_t>& MessageColumns::u64(std::string_view name) {
  return std::get<std::vector<std::uint64_t>>(columns_[index(name)]);
}
const std::vector<double>& MessageColumns::f64(std::string_view name) const {
  return std::get<std::vector<double>>(columns_[index(name)]);
}
const std::vector<std::uint32_t>& MessageColumns::u32(std::string_view name) const {
  return std::get<std::vector<std::uint32_t>>(columns_[index(name)]);
}
const std::vector<std::uint64_t>& MessageColumns::u64(std::string_view name) const {
  return std::get<std::vector<std::uint64_t>>(columns_[index(name)]);
}

std::vector<gravitas_column> MessageColumns::plain() const {
  std::vector<gravitas_column> columns;
  for (const Numbers& numbers : columns_) {
    std::visit([&](const auto& v) { columns.push_back({v.data(), v.size()}); }, numbers);
  }
  return columns;
}

std::vector<gravitas_reply_column> MessageColumns::rooms() {
  std::vector<gravitas_reply_column> columns;
  for (Numbers& numbers : columns_) {
    std::visit([&](auto& v) { columns.push_back({v.data(), v.size(), 0}); }, numbers);
  }
  return columns;
}

void MessageColumns::resize(std::span<const gravitas_reply_column> counts) {
  for (std::size_t i = 0; i < columns_.size(); ++i)
    std::visit([&](auto& v) { v.resize(counts[i].count); }, columns_[i]);
}

std::vector<std::uint64_t> MessageColumns::counts() const {
  std::vector<std::uint64_t> counts;
  for (const Numbers& numbers : columns_) std::visit([&](const auto& v) { counts.push_back(v.size()); }, numbers);
  return counts;
}

std::string MessageColumns::bytes() const {
  std::string bytes;
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    const std::size_t size = stage::element_size(infos_[i].type);
    std::visit(
        [&](const auto& v) {
          if (!v.empty()) bytes.append(reinterpret_cast<const char*>(v.data()), v.size() * size);
        },
        columns_[i]);
  }
  return bytes;
}

PluginUnderTest::PluginUnderTest(const std::string& name, const std::vector<double>& settings) {
  std::string problem;
  library_ = load_plugin_library(GRAVITAS_BINARY_DIR "/lib/gravitas/" + name + ".so", &problem);
  if (library_.table == nullptr) throw std::runtime_error(problem);
  gravitas_error error{};
  if (library_.table->create(settings.data(), settings.size(), &instance_, &error) != GRAVITAS_OK)
    throw std::runtime_error(error.text);
}

PluginUnderTest::~PluginUnderTest() { library_.table->destroy(instance_); }

MessageColumns PluginUnderTest::request_of(stage::Method method) { return MessageColumns(info(method).request); }

// Asks again with the room that the counts said it takes, as a host does.
std::int32_t PluginUnderTest::call(stage::Method method, const MessageColumns& request, MessageColumns* reply,
                                   gravitas_error* error) {
  gravitas_host host{};
  host.context = this;
  host.mark_progress = [](void* context) { ++static_cast<PluginUnderTest*>(context)->marks; };
  host.parallel_for = [](void* context, std::uint64_t count, void (*body)(void*, std::uint64_t, std::uint64_t),
                         void* argument) {
    static_cast<PluginUnderTest*>(context)->threads_.parallel_for(count, body, argument);
  };
  host.derivative = [](void* context, const gravitas_column* columns, gravitas_reply_column* answer) -> std::int32_t {
    auto* self = static_cast<PluginUnderTest*>(context);
    ++self->derivatives_asked;
    if (!self->derivative) return GRAVITAS_CALLBACK_FAILED;
    const stage::ReplyColumn<double> wrench(answer);
    for (const double number : self->derivative(stage::IntegratorDerivativeRequest(columns))) wrench.push(number);
    return GRAVITAS_OK;
  };

  const std::vector<gravitas_column> columns = request.plain();
  for (;;) {
    derivatives_asked = marks = 0;
    std::vector<gravitas_reply_column> rooms = reply->rooms();
    const std::int32_t status =
        library_.table->call(instance_, static_cast<std::uint32_t>(method), columns.data(), rooms.data(), &host, error);
    if (status != GRAVITAS_OK && status != GRAVITAS_NEEDS_CAPACITY) return status;
    reply->resize(rooms);
    if (status == GRAVITAS_OK) return status;
  }
}

MessageColumns PluginUnderTest::ask(stage::Method method, const MessageColumns& request) {
  MessageColumns reply(info(method).reply);
  gravitas_error error{};
  EXPECT_EQ(call(method, request, &reply, &error), GRAVITAS_OK) << error.text;
  EXPECT_EQ(check_rows(info(method), request.counts(), reply.counts()), "");
  return reply;
}

std::string PluginUnderTest::refusal(stage::Method method, const MessageColumns& request) {
  MessageColumns reply(info(method).reply);
  gravitas_error error{};
  const std::int32_t status = call(method, request, &reply, &error);
  EXPECT_TRUE(status == GRAVITAS_OK || status == GRAVITAS_REFUSED) << error.text;
  return status == GRAVITAS_REFUSED ? error.text : "";
}

}  // namespace gravitas::test
