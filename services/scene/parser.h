// Tokens to values. What a block may hold is the reader's business; this knows only how values are
// written and how to pass over what nobody understood.
#pragma once

#include <cstdint>
#include <string_view>

#include "plugin_sdk/property_value.h"
#include "services/scene/lexer.h"

namespace gravitas::scene {

// Braces, of blocks and lists together, that may be open at once.
inline constexpr unsigned kMaximumDepth = 64;

class Parser {
 public:
  // kBare: a word without quotes is a text, as a person writes on a command line.
  enum class Words : std::uint32_t { kQuoted, kBare };

  Parser(std::string_view text, std::uint32_t file, Words words = Words::kQuoted);

  const Token& current() const { return token_; }
  void advance() { lexer_.next(&token_); }

  // Reads a value at the current token: a number, a text, true, false, or a list `{ v, v, … }`.
  // `depth` braces are open around it. Throws SyntaxError.
  PropertyValue value(unsigned depth);

  // Passes over `= value` or `{ … }` at the current token, whatever names stand in it. Throws
  // SyntaxError.
  void skip_definition(unsigned depth);

  // Enters a brace: refuses one too many.
  void check_depth(unsigned depth) const;

 private:
  PropertyValue list(unsigned depth);
  void skip_block(unsigned depth);

  Lexer lexer_;
  Token token_;
  Words words_;
};

// One value as a person writes it on a command line, and nothing else. Throws SyntaxError.
PropertyValue bare_value(std::string_view text);

}  // namespace gravitas::scene
