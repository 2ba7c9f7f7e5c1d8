#include "services/scene/reader.h"

#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "plugin_sdk/near_miss.h"
#include "services/scene/assign.h"
#include "services/scene/grammar.h"
#include "services/scene/input_file.h"
#include "services/scene/parser.h"

namespace gravitas::scene {
namespace {

namespace pb = google::protobuf;

// Thrown when enough errors have been found.
struct EnoughErrors {};

class Reader {
 public:
  Reader(std::string_view text, std::uint32_t file, Diagnostics* diagnostics)
      : parser_(text, file), diagnostics_(diagnostics) {}

  // Reads the whole text into a scene or an addition. `present` goes from file to file.
  void read_all(pb::Message* block, std::uint64_t* present) {
    items(grammar_of(*block->GetDescriptor()), block, present, 0);
    if (parser_.current().kind == TokenKind::kClose)
      throw SyntaxError{parser_.current().position, "a \"}\" that closes nothing; allowed: Name { … }"};
  }

 private:
  // Items up to the closing brace or the end of the text, which stays the current token.
  void items(const BlockRule& rule, pb::Message* block, std::uint64_t* present, unsigned depth) {
    while (parser_.current().kind == TokenKind::kName) {
      const TextPosition position = parser_.current().position;
      const std::string_view name = parser_.current().name;
      parser_.advance();
      const TokenKind follows = parser_.current().kind;
      if (follows != TokenKind::kEquals && follows != TokenKind::kOpen) {
        throw SyntaxError{parser_.current().position, '"' + std::string(name) + "\" is followed by " +
                                                          shown(parser_.current()) + "; allowed: \"=\" or \"{\""};
      }
      const Entry* entry = rule.find(name);
      if (entry == nullptr) {
        unknown(rule, name, position, follows);
        parser_.skip_definition(depth);
      } else {
        item(rule, *entry, position, block, present, depth);
      }
      if (diagnostics_->full()) throw EnoughErrors{};
    }
    const TokenKind end = parser_.current().kind;
    if (end == TokenKind::kClose || (end == TokenKind::kEnd && depth == 0)) return;
    if (end == TokenKind::kEnd) {
      throw SyntaxError{parser_.current().position,
                        "the file ends inside the block " + open_block_text() + "; a \"}\" is missing"};
    }
    throw SyntaxError{parser_.current().position, "a name was expected, not " + shown(parser_.current()) +
                                                      "; allowed: Name = value, Name { … }, or \"}\""};
  }

  std::string open_block_text() const {
    return open_.empty() ? "" : open_.back().first + " opened in line " + std::to_string(open_.back().second.line);
  }

  // One name that the grammar knows, at the token after it.
  void item(const BlockRule& rule, const Entry& entry, const TextPosition& position, pb::Message* block,
            std::uint64_t* present, unsigned depth) {
    const bool is_brace = parser_.current().kind == TokenKind::kOpen;
    if (refused(rule, entry, position, *block, *present, is_brace)) return parser_.skip_definition(depth);
    *present |= std::uint64_t{1} << entry.index;
    if (entry.form == Form::kProperties) return properties(entry, position, block, depth);
    if (is_brace) return inner_block(entry, position, block, depth);
    parser_.advance();
    if (entry.is_block()) return shorthand(entry, position, block, depth);
    assign(rule, entry, parser_.value(depth), block, diagnostics_);
  }

  // Reports a name that cannot be taken here, whatever its value is.
  bool refused(const BlockRule& rule, const Entry& entry, const TextPosition& position, const pb::Message& block,
               std::uint64_t present, bool is_brace) {
    if (is_brace && !entry.is_block()) {
      diagnostics_->error(position, entry.name + " is a property, no block; allowed: " + entry.name + " = value");
    } else if (!is_brace && entry.is_block() && entry.shorthand == nullptr) {
      diagnostics_->error(position, entry.name + " is a block, no property; allowed: " + entry.name + " { … }");
    } else if ((present >> entry.index & 1U) != 0 && !entry.is_joined && !repeats(entry)) {
      // the first one has no place if it was refused
      const TextPosition first = first_place(rule, entry, block);
      diagnostics_->error(position, entry.name + " is given twice" +
                                        (first.known() ? ", first at " + diagnostics_->place_text(first) : "") +
                                        "; allowed: once");
    } else {
      return false;
    }
    return true;
  }

  static bool repeats(const Entry& entry) { return entry.form == Form::kBlock && entry.field->is_repeated(); }

  static TextPosition first_place(const BlockRule& rule, const Entry& entry, const pb::Message& block) {
    const pb::Reflection& reflection = *block.GetReflection();
    if (entry.is_block()) {
      const pb::Message& inner = reflection.GetMessage(block, entry.field);
      const pb::FieldDescriptor* location = inner.GetDescriptor()->FindFieldByName("location");
      return place_of(static_cast<const v1::Location&>(inner.GetReflection()->GetMessage(inner, location)));
    }
    for (int i = 0; i < reflection.FieldSize(block, rule.places); i += 4) {
      const auto at = [&](int j) { return reflection.GetRepeatedUInt32(block, rule.places, i + j); };
      if (at(0) == static_cast<std::uint32_t>(entry.field->number())) return {at(1), at(2), at(3)};
    }
    return {};
  }

  void set_place(const TextPosition& position, pb::Message* block, const pb::FieldDescriptor* location) {
    auto* place = static_cast<v1::Location*>(block->GetReflection()->MutableMessage(block, location));
    // a joined block keeps its first place
    if (place->line() == 0) set_location(position, place);
  }

  // `Name { … }` at the brace.
  void inner_block(const Entry& entry, const TextPosition& position, pb::Message* block, unsigned depth) {
    parser_.check_depth(depth);
    parser_.advance();
    const pb::Reflection& reflection = *block->GetReflection();
    pb::Message* inner = entry.field->is_repeated() ? reflection.AddMessage(block, entry.field)
                                                    : reflection.MutableMessage(block, entry.field);
    set_place(position, inner, entry.block->location);
    open_.emplace_back(entry.name, position);
    std::uint64_t present = 0;
    items(*entry.block, inner, &present, depth + 1);
    finish(*entry.block, present, position, inner);
    open_.pop_back();
    parser_.advance();
  }

  // `Name = value` of a block, at the value.
  void shorthand(const Entry& entry, const TextPosition& position, pb::Message* block, unsigned depth) {
    pb::Message* inner = block->GetReflection()->MutableMessage(block, entry.field);
    set_place(position, inner, entry.block->location);
    PropertyValue value = parser_.value(depth);
    if (value.kind != PropertyValue::Kind::kText) {
      diagnostics_->error(value.position,
                          entry.name + " is " + shown(value) + "; allowed: a text in double quotes, or a block { … }");
      return;
    }
    assign(*entry.block, *entry.shorthand, std::move(value), inner, diagnostics_);
    fill_defaults(*entry.block, std::uint64_t{1} << entry.shorthand->index, inner, diagnostics_);
  }

  // A block of names that a plugin declares, at the token after its name.
  void properties(const Entry& entry, const TextPosition& position, pb::Message* block, unsigned depth) {
    parser_.check_depth(depth);
    parser_.advance();
    auto* properties = static_cast<v1::Properties*>(block->GetReflection()->MutableMessage(block, entry.field));
    set_location(position, properties->mutable_location());
    open_.emplace_back(entry.name, position);
    std::map<std::string_view, TextPosition> seen;
    while (parser_.current().kind == TokenKind::kName) {
      const TextPosition name_position = parser_.current().position;
      const std::string_view name = parser_.current().name;
      parser_.advance();
      if (parser_.current().kind != TokenKind::kEquals) {
        throw SyntaxError{parser_.current().position, '"' + std::string(name) + "\" is followed by " +
                                                          shown(parser_.current()) + "; allowed inside " + entry.name +
                                                          ": \"=\" and a value"};
      }
      parser_.advance();
      PropertyValue value = parser_.value(depth + 1);
      const auto [first, is_new] = seen.try_emplace(name, name_position);
      if (is_new) {
        v1::Property* property = properties->add_property();
        property->set_name(std::string(name));
        set_location(name_position, property->mutable_location());
        to_message(std::move(value), property->mutable_value());
      } else {
        diagnostics_->error(name_position, std::string(name) + " is given twice, first at " +
                                               diagnostics_->place_text(first->second) + "; allowed: once");
        if (diagnostics_->full()) throw EnoughErrors{};
      }
    }
    if (parser_.current().kind == TokenKind::kEnd) {
      throw SyntaxError{parser_.current().position,
                        "the file ends inside the block " + open_block_text() + "; a \"}\" is missing"};
    }
    if (parser_.current().kind != TokenKind::kClose) {
      throw SyntaxError{parser_.current().position, "a name was expected, not " + shown(parser_.current()) +
                                                        "; allowed inside " + entry.name + ": Name = value, or \"}\""};
    }
    open_.pop_back();
    parser_.advance();
  }

  // What can be said when a block is complete.
  void finish(const BlockRule& rule, std::uint64_t present, const TextPosition& position, pb::Message* block) {
    for (const Entry& entry : rule.entries) {
      if (!entry.is_required || (present >> entry.index & 1U) != 0) continue;
      const std::string what = entry.form == Form::kText ? "a text" : allowed_values(entry.declared);
      diagnostics_->error(position, open_.back().first + " without " + entry.name + "; required: " + what);
    }
    fill_defaults(rule, present, block, diagnostics_);
  }

  void unknown(const BlockRule& rule, std::string_view name, const TextPosition& position, TokenKind follows) {
    const char* kind = follows == TokenKind::kOpen ? "block" : "property";
    std::string text = std::string("unknown ") + kind + " \"" + std::string(name) + "\"";
    if (!open_.empty()) text += " in " + open_.back().first;
    // a name that is right one level deeper is no slip of spelling
    for (const Entry& entry : rule.entries) {
      if (entry.block == nullptr || entry.block->find(name) == nullptr) continue;
      diagnostics_->error(position, text + "; it belongs into " + entry.name + " { … }");
      return;
    }
    for (const Entry& entry : rule.entries) {
      if (entry.form != Form::kProperties || !nearest_name(name, rule.names).empty()) continue;
      diagnostics_->error(position, text + "; " + allowed_names(name, rule.names) +
                                        "; properties of its type go into " + entry.name + " { … }");
      return;
    }
    diagnostics_->error(position, text + "; " + allowed_names(name, rule.names));
  }

  Parser parser_;
  Diagnostics* diagnostics_;
  // blocks around the current token
  std::vector<std::pair<std::string, TextPosition>> open_;
};

// Reads one text after another into one scene.
class SceneReading {
 public:
  SceneReading(v1::Scene* scene, Problems* problems) : scene_(scene), diagnostics_(*scene, problems) {}

  std::uint32_t add_file(const std::string& name) {
    scene_->add_files(name);
    return static_cast<std::uint32_t>(scene_->files_size() - 1);
  }

  void read(std::string_view text, std::uint32_t file) {
    if (diagnostics_.full()) return;
    if (file == 0) set_location({0, 1, 1}, scene_->mutable_location());
    try {
      Reader(text, file, &diagnostics_).read_all(scene_, &present_);
    } catch (const SyntaxError& error) {
      diagnostics_.error(error.position, error.text);
    } catch (const EnoughErrors&) {
      // the errors found are reported already
    }
  }

  bool finish() {
    fill_defaults(scene_grammar(), present_, scene_, &diagnostics_);
    return diagnostics_.ok();
  }

  Diagnostics& diagnostics() { return diagnostics_; }

 private:
  v1::Scene* scene_;
  Diagnostics diagnostics_;
  std::uint64_t present_ = 0;
};

constexpr const char* kQuoteOverrides =
    "; a --set with braces is quoted, or the shell splits it: --set 'Body.Ball.Position={0,1,0}'";

// What is left of an override whose braces, or blanks between them, the shell has split: `Body.Ball.Position=1`, `0}`.
bool is_split_override(std::string_view path) {
  return path.find('=') != std::string_view::npos || path.ends_with(',') || path.ends_with('}');
}

}  // namespace

bool read_texts(std::span<const SceneText> texts, SceneDocument* document, Problems* problems) {
  SceneReading reading(&document->scene(), problems);
  for (const SceneText& text : texts) reading.read(text.text, reading.add_file(text.name));
  return reading.finish();
}

bool read_addition(const SceneText& text, v1::Scene* scene, v1::Addition* addition, Problems* problems) {
  Diagnostics diagnostics(*scene, problems);
  scene->add_files(text.name);
  std::uint64_t present = 0;
  try {
    Reader(text.text, static_cast<std::uint32_t>(scene->files_size() - 1), &diagnostics).read_all(addition, &present);
  } catch (const SyntaxError& error) {
    diagnostics.error(error.position, error.text);
  } catch (const EnoughErrors&) {
    // the errors found are reported already
  }
  return diagnostics.ok();
}

bool read_files(std::span<const std::string> paths, SceneDocument* document, Problems* problems) {
  SceneReading reading(&document->scene(), problems);
  for (const std::string& path : paths) {
    const std::uint32_t file = reading.add_file(path);
    std::string text, why;
    if (read_input_file(path, &text, &why)) {
      reading.read(text, file);
    } else {
      reading.diagnostics().error({file, 1, 1}, "cannot be read: " + why + "; a scene is a readable text file" +
                                                    (is_split_override(path) ? kQuoteOverrides : ""));
    }
  }
  return reading.finish();
}

}  // namespace gravitas::scene
