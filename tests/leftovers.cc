// After each test of every program: no worker process, no mapped segment and no descriptor of one is left behind.
#include "services/campaign/leftovers.h"

#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <thread>
#include <vector>

namespace gravitas {
namespace {

class Leftovers final : public ::testing::EmptyTestEventListener {
  void OnTestEnd(const ::testing::TestInfo&) override {
    // what a dead worker's watcher holds goes when it has been told of the death
    std::vector<std::string> found = campaign::find_leftovers();
    for (int i = 0; i < 500 && !found.empty(); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
      found = campaign::find_leftovers();
    }
    for (const std::string& one : found) ADD_FAILURE() << one;
  }
};

const bool is_listening = [] {
  ::testing::UnitTest::GetInstance()->listeners().Append(new Leftovers);
  return true;
}();

}  // namespace
}  // namespace gravitas
