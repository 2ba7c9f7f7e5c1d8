#include "services/scene/parser.h"

#include <string>
#include <utility>

namespace gravitas::scene {

Parser::Parser(std::string_view text, std::uint32_t file, Words words) : lexer_(text, file), words_(words) {
  advance();
}

void Parser::check_depth(unsigned depth) const {
  if (depth >= kMaximumDepth) {
    throw SyntaxError{token_.position,
                      "braces are nested too deep; allowed: " + std::to_string(kMaximumDepth) + " levels"};
  }
}

PropertyValue Parser::value(unsigned depth) {
  PropertyValue value;
  value.position = token_.position;
  switch (token_.kind) {
    case TokenKind::kNumber:
      value.number = token_.number;
      break;
    case TokenKind::kText:
      value.kind = PropertyValue::Kind::kText;
      value.text = std::move(token_.text);
      break;
    case TokenKind::kOpen:
      return list(depth);
    case TokenKind::kName:
      if (token_.name == "true" || token_.name == "false") {
        value.kind = PropertyValue::Kind::kFlag;
        value.flag = token_.name == "true";
        break;
      }
      if (words_ == Words::kBare) {
        value.kind = PropertyValue::Kind::kText;
        value.text = token_.name;
        break;
      }
      throw SyntaxError{token_.position,
                        "a value was expected, not " + shown(token_) +
                            "; allowed: a number, a text in double quotes, true, false, a list { v, v }"};
    default:
      throw SyntaxError{token_.position,
                        "a value was expected, not " + shown(token_) +
                            "; allowed: a number, a text in double quotes, true, false, a list { v, v }"};
  }
  advance();
  return value;
}

PropertyValue Parser::list(unsigned depth) {
  check_depth(depth);
  PropertyValue result;
  result.kind = PropertyValue::Kind::kList;
  result.position = token_.position;
  advance();
  if (token_.kind == TokenKind::kClose) {
    advance();
    return result;
  }
  result.list.reserve(4);
  while (true) {
    result.list.push_back(value(depth + 1));
    if (token_.kind == TokenKind::kClose) break;
    if (token_.kind != TokenKind::kComma) {
      throw SyntaxError{token_.position,
                        "a list goes on with " + shown(token_) + "; allowed: a comma and the next element, or \"}\""};
    }
    advance();
    if (token_.kind == TokenKind::kClose)
      throw SyntaxError{token_.position, "an element is missing after the comma; allowed: a value"};
  }
  advance();
  return result;
}

void Parser::skip_definition(unsigned depth) {
  if (token_.kind == TokenKind::kOpen) return skip_block(depth);
  advance();
  value(depth);
}

void Parser::skip_block(unsigned depth) {
  check_depth(depth);
  const TextPosition start = token_.position;
  advance();
  while (token_.kind != TokenKind::kClose) {
    if (token_.kind == TokenKind::kEnd) {
      throw SyntaxError{token_.position, "the file ends inside the block opened in line " + std::to_string(start.line) +
                                             "; a \"}\" is missing"};
    }
    if (token_.kind != TokenKind::kName)
      throw SyntaxError{token_.position,
                        "a name was expected, not " + shown(token_) + "; allowed: Name = value, Name { … }, or \"}\""};
    advance();
    if (token_.kind != TokenKind::kOpen && token_.kind != TokenKind::kEquals)
      throw SyntaxError{token_.position, "a name is followed by " + shown(token_) + "; allowed: \"=\" or \"{\""};
    skip_definition(depth + 1);
  }
  advance();
}

PropertyValue bare_value(std::string_view text) {
  Parser parser(text, 0, Parser::Words::kBare);
  PropertyValue value = parser.value(0);
  if (parser.current().kind == TokenKind::kEnd) return value;
  throw SyntaxError{parser.current().position,
                    "after the value comes " + shown(parser.current()) + "; allowed: one value"};
}

}  // namespace gravitas::scene
