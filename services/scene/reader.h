// Scene text to the Scene message: the first half of loading. What is checked here is what the
// grammar (schemas/gravitas/scene/v1/scene.proto) says about single names: known, of the right
// kind, in range, given once, not missing. What needs the whole scene or the plugins (ids, shapes,
// masses, plugins) is build.h's.
//
// Positions count lines and characters (Unicode code points) from 1; a tab is one character. A
// UTF-8 byte order mark is skipped; a line ends with LF or CR LF. Names that this version does not
// support are refused where leaving them out would change a result. Syntax errors end the reading
// of their file; other errors do not, up to Diagnostics::kLimit of them.
#pragma once

#include <google/protobuf/arena.h>

#include <span>
#include <string>

#include "gravitas/scene/v1/scene.pb.h"
#include "services/scene/problem.h"

namespace gravitas::scene {

// A scene and the memory it lives in.
class SceneDocument {
 public:
  SceneDocument() : scene_(google::protobuf::Arena::CreateMessage<v1::Scene>(&arena_)) {}
  SceneDocument(const SceneDocument&) = delete;
  SceneDocument& operator=(const SceneDocument&) = delete;

  v1::Scene& scene() { return *scene_; }
  const v1::Scene& scene() const { return *scene_; }

 private:
  google::protobuf::Arena arena_;
  v1::Scene* scene_;
};

// A text and the name by which errors call it.
struct SceneText {
  std::string name;
  std::string text;
};

// Reads texts as one scene: blocks that hold lists (Geometries, Materials, Forces, Plugins, …) may
// stand in several of them and are joined in order. Precondition: a fresh document. Returns true if
// there was no error; otherwise the document holds what could be read and must not be built from.
// Defaults of the grammar are filled in.
bool read_texts(std::span<const SceneText> texts, SceneDocument* document, Problems* problems);

// The same from files. A file that cannot be read is an error at its line 1, column 1.
bool read_files(std::span<const std::string> paths, SceneDocument* document, Problems* problems);

// Reads what an edit adds to a scene; positions refer to files of the scene, of which it becomes one.
bool read_addition(const SceneText& text, v1::Scene* scene, v1::Addition* addition, Problems* problems);

}  // namespace gravitas::scene
