// Who listens at an address is handed on from environment to environment, and let go by the last.
#include "services/run/handed_hosts.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>

namespace gravitas {
namespace {

struct Told {
  int started = 0, drained = 0;
};

class Connection final : public kernel::Carrier {
 public:
  explicit Connection(Told* told) : told_(*told) { ++told_.started; }
  kernel::CallResult call(const kernel::StageCall&, kernel::Arena*, kernel::DerivativeSource*) override { return {}; }
  void drain() override { ++told_.drained; }
  void kill() override { is_alive_ = false; }
  bool is_alive() const override { return is_alive_; }
  int process_id() const override { return 0; }
  kernel::Hosting hosting() const override { return kernel::Hosting::kGrpc; }

 private:
  Told& told_;
  bool is_alive_ = true;
};

kernel::SlotDescription at(const std::string& address, double setting = 1.0) {
  kernel::SlotDescription slot;
  slot.plugins.emplace_back();
  slot.plugins[0].address = address, slot.plugins[0].settings = {setting};
  return slot;
}

class Handed : public ::testing::Test {
 protected:
  Told told_;
  const HandedHosts hosts_{
      [this](const kernel::SlotDescription&, std::uint32_t, std::stop_token) -> std::unique_ptr<kernel::Carrier> {
        return std::make_unique<Connection>(&told_);
      }};
  const kernel::HostStarter first_ = hosts_.for_environment(), second_ = hosts_.for_environment();
};

TEST_F(Handed, OneAtAnAddressIsSharedAndDrainedByTheLast) {
  std::unique_ptr<kernel::Carrier> before = first_(at("unix:/w"), 1, {});
  const std::unique_ptr<kernel::Carrier> after = second_(at("unix:/w"), 1, {});
  EXPECT_EQ(told_.started, 1);
  before->drain();
  before.reset();
  EXPECT_EQ(told_.drained, 0);
  after->drain();
  EXPECT_EQ(told_.drained, 1);
}

// A second one is to be another process, and one that is gone is no one's.
TEST_F(Handed, NoEnvironmentHasOneTwiceNorOneThatIsGone) {
  const std::unique_ptr<kernel::Carrier> one = first_(at("unix:/w"), 1, {}), other = first_(at("unix:/w"), 1, {});
  EXPECT_EQ(told_.started, 2);
  one->kill(), other->kill();
  const std::unique_ptr<kernel::Carrier> after = second_(at("unix:/w"), 1, {});
  EXPECT_EQ(told_.started, 3);
}

TEST_F(Handed, OthersAreNotShared) {
  const std::unique_ptr<kernel::Carrier> one = first_(at("unix:/w"), 1, {}), ours = first_(at(""), 1, {});
  const std::unique_ptr<kernel::Carrier> elsewhere = second_(at("unix:/v"), 1, {}),
                                         set = second_(at("unix:/w", 2.0), 1, {}),
                                         threads = second_(at("unix:/w"), 2, {}), ours_too = second_(at(""), 1, {});
  EXPECT_EQ(told_.started, 6);
}

}  // namespace
}  // namespace gravitas
