// `gravitas new`: a plugin project outside of this tree, which builds, conforms, and has a test, a scene and a README.
//
//   templates/every_kind/   what projects in C++ share: CMakeLists.txt, README.md, known_result.h
//   templates/<slot>/       the plugin of that slot, a small one that works: plugin.cc, my_name.h, its test and its scene
//   templates/python_every_kind/, templates/python_<slot>/   the same in Python; the scene is that of <slot>
//
// A template is a file as it is: MyName in it becomes the plugin's name, my_name that of its files, and words between two @
// what the slot and this installation make of them. They are read from the tree that the program was built in, whose SDK the
// project needs anyway.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "services/catalog/catalog.h"

namespace gravitas::scaffold {

struct ProjectOptions {
  std::string kind;      // a slot's name
  std::string name;      // of the plugin, and of the type that it serves
  std::string folder;    // empty: file_style(name), here
  std::string language;  // "c++" or "python"
};

struct Project {
  std::filesystem::path folder;
  std::vector<std::string> files;  // in it, sorted
};

// MyWind: my_wind, as files and folders are named; KDTree: kd_tree.
std::string file_style(const std::string& name);

// Writes the project, all of it or nothing. Throws BadInput for a kind, name, language or folder that cannot be: a name is
// of letters, digits and '_', and none that a plugin or type of the catalogue has; a folder is empty, or not there, and
// takes files. Throws std::system_error where a template cannot be read.
Project write_project(const ProjectOptions& options, const Catalog& installed);

}  // namespace gravitas::scaffold
