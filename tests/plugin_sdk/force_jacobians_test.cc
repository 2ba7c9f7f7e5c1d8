// The states that a force is asked about for differences lie where a host would put them.
#include "plugin_sdk/force_jacobians.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "plugin_sdk/message_columns.h"

namespace gravitas {
namespace {

using Method = stage::Method;

std::size_t beyond_alignment(const void* data) {
  return reinterpret_cast<std::uintptr_t>(data) % GRAVITAS_COLUMN_ALIGNMENT;
}

// Pulls each body to the origin, -2 x, and looks where its columns lie.
class Looking final : public ForcePlugin {
 public:
  void wrenches(const stage::ForceWrenchesRequest& request, const stage::ForceWrenchesReply& reply, Host&) override {
    const std::size_t rows = request.application().size() / 2;
    const auto wrench = reply.wrench().resize(6 * rows), impulse = reply.impulse().resize(6 * rows);
    const auto potential = reply.potential().resize(rows);
    const auto flags = reply.flags().resize(rows);
    for (const void* column :
         {static_cast<const void*>(request.position().data()), static_cast<const void*>(request.orientation().data()),
          static_cast<const void*>(request.linear_velocity().data()),
          static_cast<const void*>(request.angular_velocity().data()), static_cast<const void*>(wrench.data()),
          static_cast<const void*>(impulse.data()), static_cast<const void*>(potential.data()),
          static_cast<const void*>(flags.data())})
      if (beyond_alignment(column) != 0) ++misplaced;
    for (std::size_t i = 0; i < rows; ++i)
      for (std::size_t k = 0; k < 3; ++k)
        wrench[6 * i + k] = -2.0 * request.position()[3 * request.application()[2 * i + 1] + k];
  }
  int misplaced = 0;
};

TEST(DifferenceOwnStates, AsksAboutColumnsThatAreAligned) {
  MessageColumns asked(stage::method_info(Method::kForceJacobians).request);
  for (std::uint32_t body = 0; body < 3; ++body) {
    for (const char* column : {"position", "linear_velocity", "angular_velocity"})
      for (const double number : {0.25 * body, 1.0, -2.0}) asked.f64(column).push_back(number);
    for (const double number : {1.0, 0.0, 0.0, 0.0}) asked.f64("orientation").push_back(number);
    asked.f64("mass").push_back(1.0);
    asked.u32("application").insert(asked.u32("application").end(), {0, body});
  }
  MessageColumns answer(stage::method_info(Method::kForceJacobians).reply);
  std::vector<gravitas_reply_column> rooms = answer.rooms();
  for (gravitas_reply_column& room : rooms) room.count = 3 * 72;
  answer.resize(rooms);
  rooms = answer.rooms();
  const std::vector<gravitas_column> columns = asked.plain();
  const gravitas_host nobody{};
  Host host(&nobody);
  Looking force;
  difference_own_states(force, stage::ForceWrenchesRequest(columns.data()), stage::ForceJacobiansReply(rooms.data()),
                        host);
  EXPECT_EQ(force.misplaced, 0);
  answer.resize(rooms);
  ASSERT_EQ(answer.f64("block").size(), 3U * 72U);
  // the slope of a straight line, by rounding of numbers of 1 over steps of 1e-6
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(answer.f64("block")[72 * i + 12 * k + k], -2.0, 1e-9);
}

}  // namespace
}  // namespace gravitas
