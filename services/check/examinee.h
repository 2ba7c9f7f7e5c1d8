// The plugin that is examined, and where it may be hosted.
#pragma once

#include <string>
#include <vector>

#include "gravitas/plugin/v1/description.pb.h"
#include "kernel/description.h"
#include "plugin_sdk/plugin.h"

namespace gravitas::check {

struct Examinee {
  std::string argument;  // as the command line named it
  std::string library;   // path of a shared library; or
  std::string command;   // a shell command that starts a worker of this one plugin
  plugin::v1::Description description;
  PluginDeclaration declaration;
  std::vector<double> settings;  // the defaults of its properties
  std::string problem;           // why there is no description, though it wants to be a plugin

  bool is_command() const { return !command.empty(); }
  // Of a process of its own; a command is reached by gRPC only.
  std::vector<kernel::Hosting> carriers() const {
    if (is_command()) return {kernel::Hosting::kGrpc};
    return {kernel::Hosting::kSharedMemory, kernel::Hosting::kGrpc};
  }

  kernel::SlotDescription slot(kernel::Hosting hosting, double deadline) const {
    return {.hosting = hosting, .deadline = deadline, .plugins = {{declaration, library, settings, command, {}}}};
  }
};

}  // namespace gravitas::check
