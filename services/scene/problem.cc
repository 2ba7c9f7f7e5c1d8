#include "services/scene/problem.h"

#include <utility>

namespace gravitas::scene {

namespace {

// Of an override or a change, which has no lines.
bool is_one_word(const std::string& file) {
  return file.starts_with("--") || file.starts_with("set ") || file.starts_with("remove ");
}

}  // namespace

std::string to_string(const SceneError& error) {
  if (is_one_word(error.file)) return error.file + ": " + (error.is_warning ? "warning: " : "") + error.text;
  return error.file + ':' + std::to_string(error.line) + ':' + std::to_string(error.column) +
         (error.is_warning ? ": warning: " : ": error: ") + error.text;
}

TextPosition place_of(const v1::Location& location) { return {location.file(), location.line(), location.column()}; }

Diagnostics::~Diagnostics() {
  if (warning_count_ <= kLimit) return;
  problems_->warnings.push_back(
      at(last_warning_, std::to_string(warning_count_ - kLimit) + " more warnings, the last one here", true));
}

SceneError Diagnostics::at(const TextPosition& position, std::string text, bool is_warning) const {
  SceneError error;
  const int file = static_cast<int>(position.file);
  error.file = file < scene_.files_size() ? scene_.files(file) : "scene";
  if (position.known()) {
    error.line = static_cast<int>(position.line);
    error.column = static_cast<int>(position.column);
  }
  error.text = std::move(text);
  error.is_warning = is_warning;
  return error;
}

void Diagnostics::error(const TextPosition& position, std::string text) {
  if (full()) return;
  if (++error_count_ == kLimit) text += " (after " + std::to_string(kLimit) + " errors no more are looked for)";
  problems_->errors.push_back(at(position, std::move(text), false));
}

void Diagnostics::warning(const TextPosition& position, std::string text) {
  last_warning_ = position;
  if (warning_count_++ < kLimit) problems_->warnings.push_back(at(position, std::move(text), true));
}

void Diagnostics::add(const std::vector<PropertyProblem>& problems, const TextPosition& block,
                      const std::string& prefix) {
  for (const PropertyProblem& problem : problems) {
    const TextPosition& position = problem.position.known() ? problem.position : block;
    if (problem.is_warning) {
      warning(position, prefix + problem.text);
    } else {
      error(position, prefix + problem.text);
    }
  }
}

std::string Diagnostics::place_text(const TextPosition& position) const {
  const SceneError error = at(position, "", false);
  if (is_one_word(error.file)) return error.file;
  return error.file + ':' + std::to_string(error.line) + ':' + std::to_string(error.column);
}

}  // namespace gravitas::scene
