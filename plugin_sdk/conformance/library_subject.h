// A plugin library in this process as the subject of the kit: what an author's unit test examines.
//
//   LibrarySubject subject("build/lib/gravitas/force_gravity.so");
//   for (const Case& one : number_cases(subject.declaration())) EXPECT_EQ(one.judge(subject), "") << one.claim;
//
// A plugin that dies of a case takes the test along; `gravitas check` asks the same in a process of its own.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "plugin_sdk/conformance/conformance.h"
#include "plugin_sdk/library.h"
#include "plugin_sdk/thread_pool.h"

namespace gravitas::conformance {

class LibrarySubject final : public Subject {
 public:
  // Throws std::runtime_error if the library cannot be loaded, or no instance made of it. Settings are the flattened
  // properties of the plugin itself; without them those of a scene that says nothing.
  explicit LibrarySubject(const std::string& path, const std::optional<std::vector<double>>& settings = {},
                          std::uint32_t threads = 1);
  ~LibrarySubject() override;
  LibrarySubject(const LibrarySubject&) = delete;
  LibrarySubject& operator=(const LibrarySubject&) = delete;

  const PluginDeclaration& declaration() const override { return library_.declaration; }
  Answer ask(stage::Method method, const MessageColumns& request, const DerivativeFunction& derivative = {}) override;

 private:
  PluginLibrary library_;
  void* instance_ = nullptr;
  ThreadPool threads_;
};

}  // namespace gravitas::conformance
