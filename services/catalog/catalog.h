// Which plugins there are: name, slot, types and properties of every plugin library of a folder,
// and of those that a scene or a command line names. Libraries are never loaded into this process:
// a worker process is asked.
#pragma once

#include <deque>
#include <string>
#include <vector>

#include "plugin_sdk/plugin.h"

namespace gravitas {

struct InstalledPlugin {
  std::string library;  // absolute path, unless it is a command
  PluginDeclaration declaration;
  std::string command = {};
};

// A file that stands where plugins stand and is none that can be used.
struct BrokenLibrary {
  std::string library;
  std::string problem;
};

class Catalog {
 public:
  Catalog() = default;
  explicit Catalog(std::vector<InstalledPlugin> plugins);

  // All libraries (*.so) of a folder, in the order of their names. What cannot be used is in
  // broken(); if the folder or the worker cannot be used, so is that.
  static Catalog installed(const std::string& worker_path, const std::string& plugin_dir);

  // Adds a library by its path; it goes before those added earlier wherever names are equal. A
  // library that is in the catalogue already is asked again. Returns null and the reason if it
  // cannot be used. Precondition: made by installed(), else there is no worker to ask and the
  // answer is null.
  const InstalledPlugin* add_library(const std::string& path, std::string* problem);

  // The same for a shell command that starts a worker of one plugin.
  const InstalledPlugin* add_command(const std::string& command, std::string* problem);

  // The plugin of that name in the slot, or null. The pointers this class returns stay valid while
  // it lives.
  const InstalledPlugin* find_plugin(Slot slot, const std::string& name) const;
  // The plugin of the slot that serves a type of the scene language (a shape, force or joint), or
  // null.
  const InstalledPlugin* find_type(Slot slot, const std::string& type) const;
  // Those of the folder that serve a type, or that have a name, in the order of their finding: nothing but their files tells
  // which of several is meant.
  std::vector<const InstalledPlugin*> installed_for(Slot slot, const std::string& type) const;
  std::vector<const InstalledPlugin*> installed_as(Slot slot, const std::string& name) const;
  // Whether it is one of the folder, and was not added.
  bool is_of_folder(const InstalledPlugin* plugin) const;
  bool knows_library(const std::string& library) const;
  // The plugin of that name in any slot, or null.
  const InstalledPlugin* find(const std::string& name) const;

  // Names, sorted and without duplicates.
  std::vector<std::string> plugin_names(Slot slot) const;
  std::vector<std::string> type_names(Slot slot) const;

  // In the order of their finding.
  const std::deque<InstalledPlugin>& plugins() const { return plugins_; }
  const std::vector<BrokenLibrary>& broken() const { return broken_; }
  // `; not usable: a.so (why), …`, or empty: for an error about a name that is missing.
  std::string broken_text() const;

 private:
  void add(const std::string& library, const std::string& problem, PluginDeclaration declaration);

  std::string worker_path_;
  std::deque<InstalledPlugin> plugins_;
  std::size_t of_folder_ = 0;  // how many of them
  std::vector<BrokenLibrary> broken_;
};

// The declaration of a type that the plugin serves, or null.
const TypeDeclaration* find_type(const PluginDeclaration& declaration, const std::string& type);

}  // namespace gravitas
