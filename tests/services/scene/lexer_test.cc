// Characters to tokens: what counts as one, where it stands, and what is no scene at all.
#include "services/scene/lexer.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace gravitas::scene {
namespace {

std::vector<Token> tokens(const std::string& text) {
  // the tokens point into the text
  static std::string kept;
  kept = text;
  Lexer lexer(kept, 0);
  std::vector<Token> all(1);
  for (lexer.next(&all.back()); all.back().kind != TokenKind::kEnd; lexer.next(&all.back())) all.emplace_back();
  return all;
}

// `line:column: text` of the error, or "" if there was none.
std::string error_of(const std::string& text) {
  try {
    tokens(text);
  } catch (const SyntaxError& error) {
    return std::to_string(error.position.line) + ':' + std::to_string(error.position.column) + ": " + error.text;
  }
  return "";
}

double number(const std::string& text) {
  const std::vector<Token> all = tokens(text);
  EXPECT_EQ(all.size(), 2U) << text;
  EXPECT_EQ(all[0].kind, TokenKind::kNumber) << text;
  return all[0].number;
}

TEST(Lexer, KnowsItsTokens) {
  const std::vector<Token> all = tokens("Name_1 = { -0.5, \"a b\" }");
  ASSERT_EQ(all.size(), 8U);
  EXPECT_EQ(all[0].name, "Name_1");
  EXPECT_EQ(all[1].kind, TokenKind::kEquals);
  EXPECT_EQ(all[2].kind, TokenKind::kOpen);
  EXPECT_EQ(all[3].number, -0.5);
  EXPECT_EQ(all[4].kind, TokenKind::kComma);
  EXPECT_EQ(all[5].text, "a b");
  EXPECT_EQ(all[6].kind, TokenKind::kClose);
}

TEST(Lexer, ReadsDecimalNumbers) {
  EXPECT_EQ(number("0"), 0.0);
  EXPECT_EQ(number("+1.5"), 1.5);
  EXPECT_EQ(number(".5"), 0.5);
  EXPECT_EQ(number("5."), 5.0);
  EXPECT_EQ(number("-1.5e-3"), -1.5e-3);
  EXPECT_EQ(number("2E+2"), 200.0);
  EXPECT_EQ(number("0.1"), 0.1);
  EXPECT_EQ(number("1.7976931348623157e308"), 1.7976931348623157e308);
  EXPECT_EQ(number("5e-324"), 5e-324);
  EXPECT_TRUE(std::signbit(number("-0")));
}

TEST(Lexer, RoundsNumbersTooSmallToZero) {
  EXPECT_EQ(number("1e-400"), 0.0);
  EXPECT_EQ(number("1e-99999999999999999999"), 0.0);
  EXPECT_EQ(number("0." + std::string(400, '0') + "1"), 0.0);
  EXPECT_EQ(number("0e999999"), 0.0);
}

TEST(Lexer, RefusesWhatIsNoNumber) {
  for (const char* text : {"0x10", "1.2.3", "1e", "1_000", "-", "1e+", ".", "-inf", "5m"})
    EXPECT_EQ(error_of(text),
              "1:1: \"" + std::string(text) + "\" is no number; allowed: decimal numbers such as 2, -0.5 or 1.5e-3");
}

TEST(Lexer, RefusesNumbersTooLarge) {
  for (const std::string& text : {std::string("1e309"), std::string("-1e999"), "1" + std::string(400, '0'),
                                  std::string("1e99999999999999999999"), "0.001e" + std::string("400")})
    EXPECT_EQ(error_of(text),
              "1:1: the number " + text + " is too large; allowed: magnitudes up to 1.7976931348623157e308");
}

TEST(Lexer, SkipsCommentsOutsideTexts) {
  const std::vector<Token> all = tokens("a // x\n# y { \" \n /* b\n * / */ c \"// # /* */\"");
  ASSERT_EQ(all.size(), 4U);
  EXPECT_EQ(all[0].name, "a");
  EXPECT_EQ(all[1].name, "c");
  EXPECT_EQ(all[1].position, (TextPosition{0, 4, 9}));
  EXPECT_EQ(all[2].text, "// # /* */");
}

TEST(Lexer, CountsCharactersNotBytes) {
  // U+00E9 has two bytes, U+1F600 four
  const std::vector<Token> all = tokens("\"\xC3\xA9\xF0\x9F\x98\x80\" a /* \xC3\xA9 */ b\n c");
  ASSERT_EQ(all.size(), 5U);
  EXPECT_EQ(all[0].text, "\xC3\xA9\xF0\x9F\x98\x80");
  EXPECT_EQ(all[1].position, (TextPosition{0, 1, 6}));
  EXPECT_EQ(all[2].position, (TextPosition{0, 1, 16}));
  EXPECT_EQ(all[3].position, (TextPosition{0, 2, 2}));
}

TEST(Lexer, SkipsAByteOrderMarkAndTakesAllLineEnds) {
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    const std::vector<Token> all = tokens(
        "\xEF\xBB\xBF"
        "a" +
        end + "\tb // to the end of this line alone" + end + "c /*" + end + "*/ d" + end);
    ASSERT_EQ(all.size(), 5U);
    EXPECT_EQ(all[0].position, (TextPosition{0, 1, 1}));
    EXPECT_EQ(all[1].position, (TextPosition{0, 2, 2}));
    EXPECT_EQ(all[2].position, (TextPosition{0, 3, 1}));
    EXPECT_EQ(all[3].position, (TextPosition{0, 4, 4}));
  }
}

TEST(Lexer, ResolvesEscapes) {
  EXPECT_EQ(tokens(R"("\"\\\n\t")")[0].text, "\"\\\n\t");
  EXPECT_EQ(error_of(R"( "ab\x")"), R"(1:5: an unknown escape inside a text; allowed: \" \\ \n \t)");
  EXPECT_EQ(error_of("\"\\"), R"(1:2: an unknown escape inside a text; allowed: \" \\ \n \t)");
}

TEST(Lexer, RefusesTextsAndCommentsWithoutEnd) {
  constexpr const char* kText = "this text does not end; a text ends with a double quote on the line it begins on";
  EXPECT_EQ(error_of("a\n  \"b"), std::string("2:3: ") + kText);
  EXPECT_EQ(error_of("\"b\nc\""), std::string("1:1: ") + kText);
  EXPECT_EQ(error_of("\"b\rc\""), std::string("1:1: ") + kText);
  EXPECT_EQ(error_of("a /* b\n c"), "1:3: this comment does not end; a comment that begins with /* ends with */");
  EXPECT_EQ(error_of("/*/"), "1:1: this comment does not end; a comment that begins with /* ends with */");
}

TEST(Lexer, RefusesWhatIsNoText) {
  constexpr const char* kAllowed = "; allowed: names, numbers, texts in double quotes, { } = , and comments";
  EXPECT_EQ(error_of(std::string("a\0b", 3)), "1:2: a byte of value zero; a scene is a text file");
  EXPECT_EQ(error_of(std::string("# \0", 3)), "1:3: a byte of value zero; a scene is a text file");
  EXPECT_EQ(error_of(std::string("\"\0\"", 3)), "1:2: a byte of value zero; a scene is a text file");
  EXPECT_EQ(error_of("a \xFF"), "1:3: a byte that is no UTF-8; a scene is a text file in UTF-8");
  EXPECT_EQ(error_of("\"\xC3\""), "1:2: a byte that is no UTF-8 inside a text; a scene is a text file in UTF-8");
  EXPECT_EQ(error_of("\"\xED\xA0\x80\""),  // half of a surrogate pair
            "1:2: a byte that is no UTF-8 inside a text; a scene is a text file in UTF-8");
  EXPECT_EQ(error_of("a ; b"), std::string("1:3: unexpected character \";\" (U+003B)") + kAllowed);
  EXPECT_EQ(error_of("a \xC3\xA9"), std::string("1:3: unexpected character \"\xC3\xA9\" (U+00E9)") + kAllowed);
  EXPECT_EQ(error_of("a / b"), std::string("1:3: unexpected character \"/\" (U+002F)") + kAllowed);
  EXPECT_EQ(error_of("\"\x01\""), std::string("1:2: unexpected character (U+0001)") + kAllowed);
}

}  // namespace
}  // namespace gravitas::scene
