// A shipped plugin library as a host sees it, and the columns of its calls.
//
//   PluginUnderTest gravity("force_gravity");
//   MessageColumns request = PluginUnderTest::request_of(stage::Method::kForceWrenches);
//   request.f64("mass") = {2.0};
//   const MessageColumns reply = gravity.ask(stage::Method::kForceWrenches, request);
//   EXPECT_EQ(reply.f64("potential")[0], ...);
//
// Columns are named as in schemas/gravitas/stage/v1/. Every answer is checked for its structure.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "plugin_sdk/library.h"
#include "plugin_sdk/message_columns.h"
#include "plugin_sdk/thread_pool.h"
#include "schemas/stage_frames.h"

namespace gravitas::test {

// One instance of a plugin of lib/gravitas/.
class PluginUnderTest {
 public:
  // `name` as in lib/gravitas/<name>.so; the settings flattened. Throws if it cannot be had.
  explicit PluginUnderTest(const std::string& name, const std::vector<double>& settings = {});
  ~PluginUnderTest();
  PluginUnderTest(const PluginUnderTest&) = delete;
  PluginUnderTest& operator=(const PluginUnderTest&) = delete;

  const PluginDeclaration& declaration() const { return library_.declaration; }
  // An empty request of a method.
  static MessageColumns request_of(stage::Method method);
  // The answer; fails the test if there is none or its structure is wrong.
  MessageColumns ask(stage::Method method, const MessageColumns& request);
  // Why the plugin refuses the request; empty if it does not.
  std::string refusal(stage::Method method, const MessageColumns& request);

  // Answers Integrator.Derivative: the wrenches of all bodies. Null: it cannot be had.
  std::function<std::vector<double>(const stage::IntegratorDerivativeRequest&)> derivative;
  // In the last call.
  int derivatives_asked = 0;
  int marks = 0;

 private:
  std::int32_t call(stage::Method method, const MessageColumns& request, MessageColumns* reply, gravitas_error* error);

  PluginLibrary library_;
  void* instance_ = nullptr;
  ThreadPool threads_{1};
};

}  // namespace gravitas::test
