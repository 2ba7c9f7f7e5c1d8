// Text of the scene language: read, overridden, built. What builds must be a description that the kernel accepts.
#include <filesystem>
#include <string>

#include "plugin_sdk/library.h"
#include "services/catalog/catalog.h"
#include "services/scene/build.h"
#include "services/scene/overrides.h"
#include "services/scene/reader.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/paths.h"

namespace gravitas::fuzz {
namespace {

// The shipped plugins; it asks no worker, so a scene that names a library or a command starts nothing.
std::vector<InstalledPlugin> shipped_plugins() {
  std::vector<InstalledPlugin> plugins;
  for (const auto& entry : std::filesystem::directory_iterator(in_build("/lib/gravitas"))) {
    std::string problem;
    if (entry.path().extension() == ".so")
      plugins.push_back({entry.path().string(), load_plugin_library(entry.path().string(), &problem).declaration});
  }
  return plugins;
}

}  // namespace

void scene(std::span<const std::byte> bytes) {
  static const std::vector<InstalledPlugin> plugins = shipped_plugins();
  std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  // what stands behind a NUL is an override
  std::string override_text;
  if (const std::size_t end = text.find('\0'); end != std::string::npos) {
    override_text = text.substr(end + 1);
    text.resize(end);
  }
  scene::Problems problems;
  scene::SceneDocument document;
  const scene::SceneText source{"scene", text};
  const bool is_good = scene::read_texts(std::span(&source, 1), &document, &problems);
  require(is_good == problems.ok(), "a scene is good exactly if it has no errors");
  for (const scene::SceneError& error : problems.errors) require(!scene::to_string(error).empty(), "errors have texts");
  if (!is_good) return;
  if (!override_text.empty() && !scene::apply_override(&document.scene(), override_text, &problems)) return;
  Catalog catalog(plugins);
  const auto description = scene::build(document.scene(), &catalog, &problems);
  require(description.has_value() == problems.ok(), "a scene that has no errors builds");
  if (description) require(description->validate().empty(), "what builds is a valid description");
}

}  // namespace gravitas::fuzz
