// Characters to tokens. Comments (`//`, `#`, `/* */`) and white space separate; positions count
// lines and characters (Unicode code points), as editors do.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "plugin_sdk/property_value.h"

namespace gravitas::scene {

enum class TokenKind : std::uint32_t { kName, kNumber, kText, kOpen, kClose, kEquals, kComma, kEnd };

struct Token {
  TokenKind kind = TokenKind::kEnd;
  TextPosition position;
  std::string_view name;  // of kName and kNumber: as written
  double number = 0.0;    // of kNumber
  std::string text;       // of kText: without quotes, escapes resolved
};

// Text that is no scene. Thrown by lexer and parser; the reader turns it into an error of the
// scene.
struct SyntaxError {
  TextPosition position;
  std::string text;
};

// `a name "Radius"`, `"}"`, `the end of the file`: a token as an error message shows it.
std::string shown(const Token& token);

class Lexer {
 public:
  // The text must outlive the lexer and its tokens. A UTF-8 byte order mark at its start is
  // skipped.
  Lexer(std::string_view text, std::uint32_t file);

  // Replaces *token by the next one, at the end of the text by kEnd for ever. Throws SyntaxError.
  void next(Token* token);

 private:
  TextPosition position() const;
  void skip_separators();
  void skip_line();
  void skip_block_comment();
  bool is_line_end() const;
  void start_line();
  void read_name(Token* token);
  void read_number(Token* token);
  void read_text(Token* token);
  char read_escape(const TextPosition& at);
  [[noreturn]] void refuse_character() const;

  const char* cursor_;
  const char* end_;
  const char* line_start_;
  std::uint32_t file_;
  std::uint32_t line_ = 1;
  // bytes of this line that continue a character
  std::uint32_t continuation_bytes_ = 0;
};

}  // namespace gravitas::scene
