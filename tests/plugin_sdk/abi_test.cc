// Sizes of the structures that a plugin and its host share: a change here needs another
// GRAVITAS_ABI_VERSION.
#include "plugin_sdk/abi.h"

#include <gtest/gtest.h>

#include <cstddef>

namespace {

TEST(Abi, StructuresHaveTheSizesOfVersionTwo) {
  ASSERT_EQ(GRAVITAS_ABI_VERSION, 2);
  EXPECT_EQ(sizeof(gravitas_property), 96U);
  EXPECT_EQ(sizeof(gravitas_type), 48U);
  EXPECT_EQ(sizeof(gravitas_coordinate), 24U);
  EXPECT_EQ(sizeof(gravitas_description), 88U);
  EXPECT_EQ(sizeof(gravitas_host), 32U);
  EXPECT_EQ(sizeof(gravitas_error), 512U);
  EXPECT_EQ(sizeof(gravitas_plugin_table), 64U);
}

// What a loader reads before it knows whether the rest is as it believes.
TEST(Abi, TheVersionsStandFirstInTheTable) {
  EXPECT_EQ(offsetof(gravitas_plugin_table, magic), 0U);
  EXPECT_EQ(offsetof(gravitas_plugin_table, abi_version), 8U);
  EXPECT_EQ(offsetof(gravitas_plugin_table, layout_version), 12U);
  EXPECT_EQ(offsetof(gravitas_plugin_table, schema_hash), 16U);
}

}  // namespace
