#include "services/scene/lexer.h"

#include <array>
#include <charconv>
#include <cstddef>
#include <cstdio>

namespace gravitas::scene {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_word(char c) { return is_letter(c) || is_digit(c); }
bool continues_character(char c) { return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U; }

// One character of well-formed UTF-8: its length and code point; length 0 where the bytes are none.
struct CodePoint {
  std::size_t length = 0;
  std::uint32_t value = 0;
};

CodePoint decode(const char* cursor, const char* end) {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint32_t>(static_cast<unsigned char>(cursor[i])); };
  const std::uint32_t first = byte(0);
  if (first < 0x80U) return {1, first};
  const std::size_t length = first >= 0xF0U ? 4 : first >= 0xE0U ? 3 : 2;
  if (first < 0xC2U || first > 0xF4U || static_cast<std::size_t>(end - cursor) < length) return {};
  std::uint32_t value = first & (0x7FU >> length);
  for (std::size_t i = 1; i < length; ++i) {
    if (!continues_character(cursor[i])) return {};
    value = (value << 6U) | (byte(i) & 0x3FU);
  }
  constexpr std::array<std::uint32_t, 5> kLeast = {0, 0, 0x80, 0x800, 0x10000};
  const bool is_surrogate = value >= 0xD800U && value <= 0xDFFFU;
  if (value < kLeast[length] || value > 0x10FFFFU || is_surrogate) return {};
  return {length, value};
}

// Whether the digits of a number that does not fit a double stand for one that is too small (else
// too large).
bool is_underflow(std::string_view number) {
  const std::size_t mark = number.find_first_of("eE");
  const std::string_view digits = number.substr(0, mark);
  const std::size_t point = std::min(digits.find('.'), digits.size());
  const std::size_t leading = digits.find_first_of("123456789");
  if (leading == std::string_view::npos) return true;
  // the power of ten of the leading digit, but for the exponent
  long long power =
      leading < point ? static_cast<long long>(point - leading) - 1 : -static_cast<long long>(leading - point);
  if (mark != std::string_view::npos) {
    std::string_view exponent = number.substr(mark + 1);
    const bool is_negative = exponent.starts_with('-');
    if (is_negative || exponent.starts_with('+')) exponent.remove_prefix(1);
    long long value = 0;
    const auto read = std::from_chars(exponent.data(), exponent.data() + exponent.size(), value);
    constexpr long long kBeyondAll = 1'000'000'000'000LL;
    value = read.ec != std::errc() ? kBeyondAll : std::min(value, kBeyondAll);
    power += is_negative ? -value : value;
  }
  return power < 0;
}

}  // namespace

std::string shown(const Token& token) {
  switch (token.kind) {
    case TokenKind::kName:
      return "the word \"" + std::string(token.name) + '"';
    case TokenKind::kNumber:
      return "the number " + std::string(token.name);
    case TokenKind::kText:
      return "the text " + gravitas::shown(PropertyValue::of(token.text));
    case TokenKind::kOpen:
      return "\"{\"";
    case TokenKind::kClose:
      return "\"}\"";
    case TokenKind::kEquals:
      return "\"=\"";
    case TokenKind::kComma:
      return "a comma";
    case TokenKind::kEnd:
      return "the end of the file";
  }
  return "";
}

Lexer::Lexer(std::string_view text, std::uint32_t file)
    : cursor_(text.data()), end_(text.data() + text.size()), line_start_(text.data()), file_(file) {
  if (text.starts_with("\xEF\xBB\xBF")) line_start_ = cursor_ += 3;
}

TextPosition Lexer::position() const {
  return {file_, line_, static_cast<std::uint32_t>(cursor_ - line_start_) - continuation_bytes_ + 1};
}

// A line ends with LF, CR LF (at its LF), or CR alone.
bool Lexer::is_line_end() const {
  return *cursor_ == '\n' || (*cursor_ == '\r' && (end_ - cursor_ < 2 || cursor_[1] != '\n'));
}

void Lexer::start_line() {
  ++line_;
  line_start_ = cursor_;
  continuation_bytes_ = 0;
}

void Lexer::skip_line() {
  while (cursor_ != end_ && !is_line_end()) {
    if (*cursor_ == '\0') refuse_character();
    if (continues_character(*cursor_)) ++continuation_bytes_;
    ++cursor_;
  }
}

void Lexer::skip_block_comment() {
  const TextPosition start = position();
  cursor_ += 2;
  for (; cursor_ != end_; ++cursor_) {
    if (*cursor_ == '*' && end_ - cursor_ > 1 && cursor_[1] == '/') {
      cursor_ += 2;
      return;
    }
    if (*cursor_ == '\0') refuse_character();
    if (continues_character(*cursor_)) ++continuation_bytes_;
    if (is_line_end()) {
      ++line_;
      line_start_ = cursor_ + 1;
      continuation_bytes_ = 0;
    }
  }
  throw SyntaxError{start, "this comment does not end; a comment that begins with /* ends with */"};
}

void Lexer::skip_separators() {
  while (cursor_ != end_) {
    const char c = *cursor_;
    if (is_line_end()) {
      ++cursor_;
      start_line();
    } else if (c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f') {
      ++cursor_;
    } else if (c == '#' || (c == '/' && end_ - cursor_ > 1 && cursor_[1] == '/')) {
      skip_line();
    } else if (c == '/' && end_ - cursor_ > 1 && cursor_[1] == '*') {
      skip_block_comment();
    } else {
      return;
    }
  }
}

void Lexer::refuse_character() const {
  constexpr const char* kAllowed = "; allowed: names, numbers, texts in double quotes, { } = , and comments";
  if (*cursor_ == '\0') throw SyntaxError{position(), "a byte of value zero; a scene is a text file"};
  const CodePoint code = decode(cursor_, end_);
  if (code.length == 0) throw SyntaxError{position(), "a byte that is no UTF-8; a scene is a text file in UTF-8"};
  std::array<char, 16> number{};
  std::snprintf(number.data(), number.size(), "U+%04X", code.value);
  const bool is_visible = code.value > 0x20U && code.value != 0x7FU;
  const std::string character = is_visible ? '"' + std::string(cursor_, code.length) + "\" " : "";
  throw SyntaxError{position(), "unexpected character " + character + '(' + number.data() + ')' + kAllowed};
}

void Lexer::next(Token* token) {
  skip_separators();
  token->position = position();
  if (cursor_ == end_) {
    token->kind = TokenKind::kEnd;
    return;
  }
  const char c = *cursor_;
  if (is_letter(c)) return read_name(token);
  if (is_digit(c) || c == '+' || c == '-' || c == '.') return read_number(token);
  if (c == '"') return read_text(token);
  if (c == '{') {
    token->kind = TokenKind::kOpen;
  } else if (c == '}') {
    token->kind = TokenKind::kClose;
  } else if (c == '=') {
    token->kind = TokenKind::kEquals;
  } else if (c == ',') {
    token->kind = TokenKind::kComma;
  } else {
    refuse_character();
  }
  ++cursor_;
}

void Lexer::read_name(Token* token) {
  const char* start = cursor_;
  while (cursor_ != end_ && is_word(*cursor_)) ++cursor_;
  token->kind = TokenKind::kName;
  token->name = {start, static_cast<std::size_t>(cursor_ - start)};
}

void Lexer::read_number(Token* token) {
  const char* start = cursor_;
  // everything that could be meant as one number, so that 0x10 or 1.2.3 is refused as a whole
  while (cursor_ != end_ && (is_word(*cursor_) || *cursor_ == '.' || *cursor_ == '+' || *cursor_ == '-')) {
    const bool is_sign = *cursor_ == '+' || *cursor_ == '-';
    if (is_sign && cursor_ != start && cursor_[-1] != 'e' && cursor_[-1] != 'E') break;
    ++cursor_;
  }
  token->kind = TokenKind::kNumber;
  token->name = {start, static_cast<std::size_t>(cursor_ - start)};
  std::string_view digits = token->name;
  if (digits.starts_with('+')) digits.remove_prefix(1);
  const std::string_view unsigned_digits = digits.starts_with('-') ? digits.substr(1) : digits;
  const bool starts_well = !unsigned_digits.empty() && (is_digit(unsigned_digits[0]) || unsigned_digits[0] == '.') &&
                           !(token->name.starts_with('+') && digits.starts_with('-'));
  const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), token->number);
  if (!starts_well || read.ec == std::errc::invalid_argument || read.ptr != digits.data() + digits.size()) {
    throw SyntaxError{token->position, '"' + std::string(token->name) +
                                           "\" is no number; allowed: decimal numbers such as 2, -0.5 or 1.5e-3"};
  }
  if (read.ec != std::errc::result_out_of_range) return;
  if (!is_underflow(unsigned_digits)) {
    throw SyntaxError{token->position, "the number " + std::string(token->name) +
                                           " is too large; allowed: magnitudes up to 1.7976931348623157e308"};
  }
  token->number = digits.starts_with('-') ? -0.0 : 0.0;
}

void Lexer::read_text(Token* token) {
  token->kind = TokenKind::kText;
  token->text.clear();
  ++cursor_;
  while (true) {
    if (cursor_ == end_ || is_line_end()) {
      throw SyntaxError{token->position,
                        "this text does not end; a text ends with a double quote on the line it begins on"};
    }
    const TextPosition here = position();
    const char c = *cursor_;
    if (c == '"') break;
    if (c == '\\') {
      token->text += read_escape(here);
      continue;
    }
    const CodePoint code = decode(cursor_, end_);
    if (code.length == 0)
      throw SyntaxError{here, "a byte that is no UTF-8 inside a text; a scene is a text file in UTF-8"};
    if ((code.value < 0x20U && c != '\t' && c != '\r') || code.value == 0x7FU) refuse_character();
    token->text.append(cursor_, code.length);
    cursor_ += code.length;
    continuation_bytes_ += static_cast<std::uint32_t>(code.length - 1);
  }
  ++cursor_;
}

char Lexer::read_escape(const TextPosition& at) {
  ++cursor_;
  const char c = cursor_ == end_ ? '\0' : *cursor_;
  constexpr std::string_view kEscapes = "\"\\nt", kMeanings = "\"\\\n\t";
  const std::size_t which = c == '\0' ? std::string_view::npos : kEscapes.find(c);
  if (which == std::string_view::npos)
    throw SyntaxError{at, R"(an unknown escape inside a text; allowed: \" \\ \n \t)"};
  ++cursor_;
  return kMeanings[which];
}

}  // namespace gravitas::scene
