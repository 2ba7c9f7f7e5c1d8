// What comes out is UTF-8 and shows all that was.
#include "plugin_sdk/printable.h"

#include <gtest/gtest.h>

#include <string>

namespace gravitas {
namespace {

TEST(Printable, LeavesWhatIsUtf8) {
  const std::string text = "a\tb\nK\xc3\xa4lte \xe2\x82\xac \xf0\x9f\x98\x80";
  EXPECT_EQ(printable(text), text);
  EXPECT_EQ(printable(""), "");
}

TEST(Printable, ShowsEveryOtherByteAsAQuestionMark) {
  EXPECT_EQ(printable("k\xfchl"), "k?hl");
  EXPECT_EQ(printable("\xc2\x9b[2J"), "??[2J");  // a control, which some terminals obey
  EXPECT_EQ(printable("cut: \xe2\x82"), "cut: ??");
  EXPECT_EQ(printable(std::string("\0\r\x7f\x1b[1m", 7)), "????[1m");
  // overlong, a surrogate, beyond the last character
  EXPECT_EQ(printable("\xc0\xaf \xed\xa0\x80 \xf4\x90\x80\x80"), "?? ??? ????");
}

}  // namespace
}  // namespace gravitas
