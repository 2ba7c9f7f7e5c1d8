// A declaration as a message and back.
#include "plugin_sdk/host/description_message.h"

#include <gtest/gtest.h>

#include <string>

#include "tests/plugin_sdk/declaration_equality.h"

namespace gravitas::host {
namespace {

TEST(DescriptionMessage, CarriesTheWholeDeclaration) {
  const PluginDeclaration given = test::full_declaration();
  const std::string bytes = to_message(given).SerializeAsString();
  plugin::v1::Description message;
  ASSERT_TRUE(message.ParseFromString(bytes));
  test::expect_equal(from_message(message), given);
  EXPECT_EQ(message.build_id(), GRAVITAS_BUILD_ID);
}

TEST(DescriptionMessage, NamesEverySlotAsTheSchemaDoes) {
  for (const auto& [slot, code] : {std::pair{Slot::kSpace, plugin::v1::SLOT_SPACE},
                                   {Slot::kCollision, plugin::v1::SLOT_COLLISION},
                                   {Slot::kConstraint, plugin::v1::SLOT_CONSTRAINT},
                                   {Slot::kForce, plugin::v1::SLOT_FORCE},
                                   {Slot::kSolver, plugin::v1::SLOT_SOLVER},
                                   {Slot::kIntegrator, plugin::v1::SLOT_INTEGRATOR}}) {
    PluginDeclaration declaration;
    declaration.slot = slot;
    EXPECT_EQ(to_message(declaration).slot(), code);
    EXPECT_EQ(from_message(to_message(declaration)).slot, slot);
  }
}

TEST(DescriptionMessage, NamesEveryKindAsTheSchemaDoes) {
  using Message = plugin::v1::Property;
  const auto code = [](PropertyKind kind) {
    PluginDeclaration declaration;
    declaration.properties.emplace_back().kind = kind;
    return to_message(declaration).properties(0).kind();
  };
  EXPECT_EQ(code(PropertyKind::kNumber), Message::KIND_NUMBER);
  EXPECT_EQ(code(PropertyKind::kInteger), Message::KIND_INTEGER);
  EXPECT_EQ(code(PropertyKind::kFlag), Message::KIND_FLAG);
  EXPECT_EQ(code(PropertyKind::kChoice), Message::KIND_CHOICE);
  EXPECT_EQ(code(PropertyKind::kVector), Message::KIND_VECTOR);
  EXPECT_EQ(code(PropertyKind::kQuaternion), Message::KIND_QUATERNION);
  EXPECT_EQ(code(PropertyKind::kTable), Message::KIND_TABLE);
  EXPECT_EQ(code(PropertyKind::kBody), Message::KIND_BODY);
}

// From a worker of a later version.
TEST(DescriptionMessage, AnUnknownSlotServesNothing) {
  plugin::v1::Description message;
  message.set_slot(static_cast<plugin::v1::Slot>(99));
  EXPECT_STREQ(slot_name(from_message(message).slot), "unknown");
  EXPECT_STREQ(slot_name(from_message(plugin::v1::Description()).slot), "unknown");
}

}  // namespace
}  // namespace gravitas::host
