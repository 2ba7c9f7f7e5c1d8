// What is wrong with a scene, for its author: where, what, and what is allowed.
//
// Every stage of reading (text, grammar, overrides, building) reports through one Diagnostics, so
// that several errors come out at once, in the order of their stages and places, and a flood of
// them is cut.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "gravitas/scene/v1/scene.pb.h"
#include "plugin_sdk/property_value.h"

namespace gravitas::scene {

struct SceneError {
  std::string file;  // as given by the caller, or "--set PATH=VALUE" for an override
  int line = 1;      // from 1
  int column = 1;    // from 1, in characters (Unicode code points; a tab is one); of an override: in
                     // PATH=VALUE
  std::string text;  // what is wrong; what is allowed
  bool is_warning = false;
};

// `file:line:column: error: text`, or `… warning: …`; for an override `--set PATH=VALUE: text`.
std::string to_string(const SceneError& error);

struct Problems {
  std::vector<SceneError> errors;
  std::vector<SceneError> warnings;

  bool ok() const { return errors.empty(); }
};

// The place of a block, and that of the value of a property (the block's own if it was not
// written).
TextPosition place_of(const v1::Location& location);

class Diagnostics {
 public:
  // Errors beyond this number are dropped, which the last one says: the first ones tell what is wrong. Warnings
  // beyond it are counted.
  static constexpr std::size_t kLimit = 20;

  // Names of files are those of scene.files(); the scene must outlive this.
  Diagnostics(const v1::Scene& scene, Problems* problems) : scene_(scene), problems_(problems) {}
  ~Diagnostics();
  Diagnostics(const Diagnostics&) = delete;
  Diagnostics& operator=(const Diagnostics&) = delete;

  void error(const TextPosition& position, std::string text);
  void warning(const TextPosition& position, std::string text);
  // Problems of plugin_sdk; those without a position are about `block`. `prefix` comes before every
  // text.
  void add(const std::vector<PropertyProblem>& problems, const TextPosition& block, const std::string& prefix);

  // No error was reported to this object.
  bool ok() const { return error_count_ == 0; }
  // No further error would be kept.
  bool full() const { return error_count_ >= kLimit; }
  // `file:line:column`, for a text that names a second place.
  std::string place_text(const TextPosition& position) const;

 private:
  SceneError at(const TextPosition& position, std::string text, bool is_warning) const;

  const v1::Scene& scene_;
  Problems* problems_;
  std::size_t error_count_ = 0;
  std::size_t warning_count_ = 0;
  TextPosition last_warning_;
};

}  // namespace gravitas::scene
