#include "services/scene/obj_file.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

#include "services/scene/input_file.h"

#define TINYOBJLOADER_USE_DOUBLE
#define TINYOBJLOADER_IMPLEMENTATION
#include <tiny_obj_loader.h>

namespace gravitas::scene {
namespace {

constexpr const char* kBlanks = " \t";

// The next word of a line, which loses it; empty at the end.
std::string_view take_word(std::string_view* line) {
  line->remove_prefix(std::min(line->find_first_not_of(kBlanks), line->size()));
  const std::string_view word = line->substr(0, line->find_first_of(kBlanks));
  line->remove_prefix(word.size());
  return word;
}

// All of the text is one number.
template <typename Number>
bool is_read(std::string_view text, Number* number) {
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), *number);
  return error == std::errc() && end == text.data() + text.size();
}

// Vertices and faces line by line: the loader leaves out faces that it does not understand, and takes what is no number
// for one.
class LineCheck {
 public:
  // Empty, or `:LINE: ` and what is wrong there.
  std::string find_problem(std::string_view text) {
    std::string why;
    while (!text.empty() && why.empty()) {
      const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
      ++line_;
      why = problem_of(text.substr(0, end));
      text.remove_prefix(end);
      text.remove_prefix(text.starts_with("\r\n") ? 2 : std::min<std::size_t>(1, text.size()));
    }
    if (why.empty() && largest_ > vertices_) {
      line_ = line_of_largest_;
      why = index_problem(std::to_string(largest_));
    }
    return why.empty() ? "" : ':' + std::to_string(line_) + ": " + why;
  }

  // To the last bit, which the loader loses.
  std::vector<double> take_coordinates() { return std::move(coordinates_); }
  // That the faces give.
  std::size_t triangles() const { return triangles_; }

 private:
  std::string problem_of(std::string_view line) {
    const std::string_view kind = take_word(&line);
    if (kind == "v") return problem_of_vertex(line);
    return kind == "f" ? problem_of_face(line) : "";
  }

  std::string problem_of_vertex(std::string_view line) {
    for (int i = 0; i < 3; ++i) {
      const std::string_view word = take_word(&line);
      double number = 0.0;
      if (!is_read(word, &number) || !std::isfinite(number))
        return (word.empty() ? "a vertex has " + std::to_string(i) + " coordinates"
                             : "a coordinate is \"" + std::string(word) + '"') +
               "; allowed: v and three finite numbers";
      coordinates_.push_back(number);
    }
    ++vertices_;
    return "";
  }

  std::string problem_of_face(std::string_view line) {
    int corners = 0;
    for (std::string_view word = take_word(&line); !word.empty(); word = take_word(&line), ++corners) {
      std::int64_t index = 0;
      if (!is_read(word.substr(0, word.find('/')), &index) || index == 0 || index < -vertices_)
        return index_problem(word);
      if (index <= largest_) continue;
      largest_ = index;
      line_of_largest_ = line_;
    }
    if (corners < 3) return "a face has " + std::to_string(corners) + " corners; allowed: three or more";
    triangles_ += static_cast<std::size_t>(corners) - 2;
    return "";
  }

  std::string index_problem(std::string_view word) const {
    return "a corner is \"" + std::string(word) + "\"; allowed: a vertex from 1 to " + std::to_string(vertices_) +
           ", or from -1 to -" + std::to_string(vertices_) + " counted backwards";
  }

  std::int64_t line_ = 0, vertices_ = 0;
  std::size_t triangles_ = 0;
  std::vector<double> coordinates_;
  // of all indices, which may come before their vertices
  std::int64_t largest_ = 0, line_of_largest_ = 0;
};

}  // namespace

bool read_obj(const std::string& path, ObjMesh* mesh, std::string* why) {
  std::string text;
  if (!read_input_file(path, &text, why, InputKind::kOrdinary)) {
    *why = ": cannot be read: " + *why + "; allowed: an OBJ file";
    return false;
  }
  LineCheck check;
  *why = check.find_problem(text);
  if (!why->empty()) return false;
  std::istringstream file(std::move(text));
  tinyobj::attrib_t attributes;
  std::vector<tinyobj::shape_t> shapes;
  std::vector<tinyobj::material_t> materials;
  std::string warning;
  // without a reader of materials: they mean nothing here
  if (!tinyobj::LoadObj(&attributes, &shapes, &materials, &warning, why, &file, nullptr, true)) {
    while (!why->empty() && why->back() == '\n') why->pop_back();
    *why = why->empty() ? ": is no OBJ file" : ": " + *why;
    return false;
  }
  mesh->vertices = check.take_coordinates();
  for (const tinyobj::shape_t& shape : shapes)
    for (const tinyobj::index_t& index : shape.mesh.indices) mesh->triangles.push_back(index.vertex_index);
  if (mesh->triangles.empty()) *why = ": has no face; allowed: one or more";
  if (mesh->triangles.size() < 3 * check.triangles())
    *why =
        ": a face of more than four corners cannot be cut into triangles; allowed: plane ones that do not cross "
        "themselves";
  return why->empty();
}

}  // namespace gravitas::scene
