// Words come out of a shell as they went in.
#include "plugin_sdk/shell_word.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <string>

namespace gravitas {
namespace {

TEST(ShellWord, IsReadBackByAShell) {
  for (const std::string word : {"", "a b", "it's", "$HOME", "a;b|c&d", "\"quoted\" \\n", "plain/x.y", "*"}) {
    FILE* pipe = popen(("printf %s " + shell_word(word)).c_str(), "r");
    ASSERT_NE(pipe, nullptr);
    std::string text;
    for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) text += static_cast<char>(c);
    EXPECT_EQ(pclose(pipe), 0);
    EXPECT_EQ(text, word);
  }
  EXPECT_EQ(shell_word("plain/x.y"), "plain/x.y");
}

}  // namespace
}  // namespace gravitas
