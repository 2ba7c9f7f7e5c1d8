#include "plugin_sdk/counted.h"

#include <gtest/gtest.h>

namespace gravitas {
namespace {

TEST(Counted, OneIsNotMany) {
  EXPECT_EQ(counted(0, "step"), "0 steps");
  EXPECT_EQ(counted(1, "step"), "1 step");
  EXPECT_EQ(counted(2, "step"), "2 steps");
  EXPECT_EQ(counted(1, "body", "bodies"), "1 body");
  EXPECT_EQ(counted(3, "body", "bodies"), "3 bodies");
}

}  // namespace
}  // namespace gravitas
