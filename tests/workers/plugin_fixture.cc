#include "tests/workers/plugin_fixture.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "plugin_sdk/checks.h"
#include "plugin_sdk/derivative_question.h"
#include "tests/paths.h"

namespace gravitas::test {
namespace {

const stage::MethodInfo& info(stage::Method method) { return stage::method_info(method); }

}  // namespace

PluginUnderTest::PluginUnderTest(const std::string& name, const std::vector<double>& settings) {
  std::string problem;
  library_ = load_plugin_library(in_build("/lib/gravitas/") + name + ".so", &problem);
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
    const stage::IntegratorDerivativeRequest question(columns);
    // bodies without joints
    if (question.question() >= kFirstOfImpulses) return GRAVITAS_OK;
    for (const double number : self->derivative(question)) wrench.push(number);
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
