// Loading a plugin library.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "plugin_sdk/plugin.h"

namespace gravitas {

// A loaded library. It is never unloaded: threads, thread-local storage and static objects of a plugin make
// that unsafe.
struct PluginLibrary {
  const gravitas_plugin_table* table = nullptr;
  PluginDeclaration declaration;
};

// Loads the library from a private copy (one path gives one handle in a process, and a file that is replaced
// under a running program must not change it; equal content is loaded once), checks magic, versions and schema hash, and reads its
// declaration. Running its constructors may do anything: a kernel does this for direct hosting only.
// On failure returns a library without table, and `problem` says why: not a readable file, no shared library,
// no plugin, made for another schema or version of the interface, a declaration that throws, a floating-point environment
// that it changed (which is restored).
PluginLibrary load_plugin_library(const std::string& path, std::string* problem);

// The same from the file itself, of which no copy is made: for a process that asks for each path once, and ends before
// any of the files may be replaced.
PluginLibrary look_into_plugin_library(const std::string& path, std::string* problem);

// Makes an instance of the library's plugin, with the numbers of its settings. Empty, or why there is none: it refused or
// failed, or its constructor changed the floating-point environment (which is restored), on which all later calls in this
// thread would depend.
std::string create_instance(const PluginLibrary& library, std::span<const double> settings, void** instance);
// Asks it, in this process: a program that guards its end (exit_guard.h) is told who is asked.
std::int32_t call_instance(const PluginLibrary& library, void* instance, std::uint32_t method,
                           const gravitas_column* request, gravitas_reply_column* reply, const gravitas_host* host,
                           gravitas_error* error);
// Leaves the floating-point environment as it is, whatever the destructor does.
void destroy_instance(const PluginLibrary& library, void* instance);

// What a plugin says went wrong. It may have written any bytes: a message takes UTF-8 only.
std::string error_text(const gravitas_error& error);

// The plain declaration of a table as C++ values, its texts printable.
PluginDeclaration read_declaration(const gravitas_description& description);

}  // namespace gravitas
