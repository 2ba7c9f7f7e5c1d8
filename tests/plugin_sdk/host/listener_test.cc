// Where a worker listens: the file at a path is there when it can be connected to, and belongs to one worker.
#include "plugin_sdk/host/listener.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <fstream>
#include <string>
#include <thread>

#include "plugin_sdk/channel/address.h"

namespace gravitas::host {
namespace {

using ::testing::HasSubstr;

std::string path_of(const std::string& name) {
  return ::testing::TempDir() + "/gravitas_listener_" + name + std::to_string(getpid());
}

TEST(Listener, AFileIsThereWhenItCanBeConnectedTo) {
  const std::string path = path_of("early");
  std::string problem;
  for (int round = 0; round < 300; ++round) {
    int answer = ENOENT;
    std::atomic<bool> is_looking{false};
    std::thread looker([&] {
      while (answer == ENOENT) {
        is_looking = true;
        answer = channel::probe_unix(path);
      }
    });
    while (!is_looking) std::this_thread::yield();
    const int listening = listen_at("unix:" + path, &problem);
    EXPECT_GE(listening, 0) << problem;
    looker.join();
    EXPECT_EQ(answer, 0) << "in round " << round;
    close(listening);
    unlink(path.c_str());
  }
}

TEST(Listener, AFileThatNobodyListensAtIsReplacedAndOneInUseIsNot) {
  const std::string path = path_of("left");
  std::string problem;
  const int first = listen_at("unix:" + path, &problem);
  ASSERT_GE(first, 0) << problem;
  EXPECT_EQ(listen_at("unix:" + path, &problem), -1);
  EXPECT_THAT(problem, HasSubstr("Address already in use"));
  EXPECT_EQ(channel::probe_unix(path), 0);
  close(first);
  EXPECT_EQ(channel::probe_unix(path), ECONNREFUSED);
  const int second = listen_at("unix:" + path, &problem);
  EXPECT_GE(second, 0) << problem;
  EXPECT_EQ(channel::probe_unix(path), 0);
  close(second);
  unlink(path.c_str());
  EXPECT_NE(access((path + "." + std::to_string(getpid())).c_str(), F_OK), 0);
}

// It refuses connections, too.
TEST(Listener, AFileThatIsNoSocketStays) {
  const std::string path = path_of("file");
  std::ofstream(path) << "a scene";
  std::string problem;
  EXPECT_EQ(listen_at("unix:" + path, &problem), -1);
  EXPECT_THAT(problem, HasSubstr("Address already in use"));
  std::string text;
  std::getline(std::ifstream(path), text);
  EXPECT_EQ(text, "a scene");
  unlink(path.c_str());
}

}  // namespace
}  // namespace gravitas::host
