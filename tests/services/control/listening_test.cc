// Clients that listen to a served run, and ones that decide.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <future>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "tests/services/control/served.h"

namespace gravitas::control {
namespace {

using harness::kSteps;
using harness::quiet_chain;
using harness::refusal;
using harness::Served;
using ::testing::HasSubstr;

// What a client hears of the kinds while the run makes its steps, resets and makes them again.
TEST(ServedEvents, AreHeardInTheOrderOfTheRun) {
  Served served;
  std::promise<void> begun;
  std::vector<events::v1::Event> heard;
  std::thread listener([&] {
    ControlClient own(served.socket.path());
    api::EventsRequest request;
    for (const char* kind : {"collision_start", "collision_ongoing", "fault"}) request.add_kinds(kind);
    request.set_ongoing_rate(2.0);
    own.watch_events(
        request, [&] { begun.set_value(); },
        [&](const events::v1::Event& event) {
          heard.push_back(event);
          return heard.empty() || heard.back().kind() != "collision_ongoing" || heard.back().time() < 1.9;
        });
  });
  begun.get_future().wait();
  served.client.inject("solver:kill@step=50");
  served.to_the_end();
  listener.join();
  std::vector<std::string> kinds;
  for (const events::v1::Event& event : heard) kinds.push_back(event.kind());
  EXPECT_THAT(kinds, ::testing::Contains("collision_start"));
  EXPECT_THAT(kinds, ::testing::Contains("collision_ongoing"));
  EXPECT_EQ(std::ranges::count(kinds, "fault"), 1);
  EXPECT_THAT(kinds, ::testing::Not(::testing::Contains("collision_end")));
  for (std::size_t i = 1; i < heard.size(); ++i) EXPECT_GE(heard[i].step(), heard[i - 1].step());
  for (const events::v1::Event& event : heard) {
    if (event.kind() == "collision_ongoing") {
      EXPECT_NEAR(std::remainder(event.time(), 0.5), 0.0, 1.0 / 60.0);
    } else if (event.kind() == "fault") {
      EXPECT_EQ(event.step(), 50U);
    }
  }
  api::EventsRequest wrong;
  wrong.add_kinds("colision_start");
  const auto nothing = [](const events::v1::Event&) { return true; };
  EXPECT_THAT(refusal([&] {
                served.client.watch_events(
                    wrong, [] {}, nothing);
              }),
              HasSubstr("did you mean"));
  wrong.clear_kinds();
  wrong.set_ongoing_rate(-1.0);
  EXPECT_THAT(refusal([&] {
                served.client.watch_events(
                    wrong, [] {}, nothing);
              }),
              HasSubstr("a rate of -1 Hz"));
}

// Why listeners were left aside, heard in a thread of its own; what() waits for one.
class Heard {
 public:
  explicit Heard(const Served& served) {
    std::promise<void> begun;
    thread_ = std::thread([&begun, this, path = served.socket.path()] {
      api::EventsRequest request;
      request.add_kinds("listener");
      ControlClient(path).watch_events(
          request, [&] { begun.set_value(); },
          [&](const events::v1::Event& event) {
            text_.set_value(event.incident().text());
            return false;
          });
    });
    begun.get_future().wait();
  }
  ~Heard() { thread_.join(); }
  std::string what() { return text_.get_future().get(); }

 private:
  std::promise<std::string> text_;
  std::thread thread_;
};

// A client that decides about pairs in a thread of its own, until the server ends or leaves it aside.
class Decider {
 public:
  using Decide = std::function<std::optional<api::PairDecisions>(const api::PairQuestions&)>;
  Decider(const Served& served, double deadline, Decide decide) {
    std::promise<void> begun;
    thread_ = std::thread([&begun, this, path = served.socket.path(), deadline, decide] {
      ControlClient own(path);
      try {
        own.decide_pairs(
            deadline, [&] { begun.set_value(); }, decide);
      } catch (const ControlError& error) {
        end = error.what();
      }
    });
    begun.get_future().wait();
  }
  ~Decider() { join(); }
  void join() {
    if (thread_.joinable()) thread_.join();
  }
  std::string end;

 private:
  std::thread thread_;
};

api::PairDecisions all_forbidden(const api::PairQuestions& questions) {
  api::PairDecisions decisions;
  for (int i = 0; i < questions.pairs_size(); ++i) decisions.add_pairs()->set_forbidden(true);
  return decisions;
}

// The balls of the sample fall on the ground, and through it if a client says so; after a reset they are as before.
TEST(ServedListener, DecidesAboutPairs) {
  Served served;
  std::set<std::string> asked;
  std::atomic<bool> ends = false;
  {
    Decider decider(served, 30.0, [&](const api::PairQuestions& questions) -> std::optional<api::PairDecisions> {
      if (ends) return std::nullopt;
      for (const api::PairQuestion& question : questions.pairs()) {
        EXPECT_TRUE(asked.insert(question.body1() + ' ' + question.body2()).second);
        EXPECT_EQ(question.material_size(), 6);
      }
      return all_forbidden(questions);
    });
    Decider other(served, 1.0, [](const api::PairQuestions&) { return std::nullopt; });
    other.join();
    EXPECT_THAT(other.end, HasSubstr("another client decides about pairs"));
    EXPECT_NE(served.to_the_end().chain_hash(), quiet_chain());
    EXPECT_GE(asked.size(), 2U);
    served.client.reset();
    ends = true;
    Heard heard(served);
    served.client.step(kSteps);  // asked anew: the client ends
    EXPECT_THAT(heard.what(), HasSubstr("its client has gone"));
  }
  served.client.reset();
  EXPECT_EQ(served.to_the_end().chain_hash(), quiet_chain());
}

TEST(ServedListener, ThatStallsOrAnswersNonsenseIsLeftAside) {
  {
    Served served;
    std::promise<void> end;
    Decider decider(served, 0.05, [&](const api::PairQuestions&) -> std::optional<api::PairDecisions> {
      end.get_future().wait();
      return std::nullopt;
    });
    Heard heard(served);
    EXPECT_EQ(served.to_the_end().chain_hash(), quiet_chain());
    EXPECT_THAT(heard.what(), HasSubstr("no answer within 0.05 s"));
    end.set_value();
  }
  Served served;
  Decider decider(served, 30.0, [&](const api::PairQuestions&) { return api::PairDecisions(); });
  Heard heard(served);
  EXPECT_EQ(served.to_the_end().chain_hash(), quiet_chain());
  EXPECT_THAT(heard.what(), HasSubstr("it decided about 0 of "));
  decider.join();
  EXPECT_THAT(decider.end, HasSubstr("it decided about 0 of "));
  Decider late(served, 61.0, [](const api::PairQuestions&) { return std::nullopt; });
  late.join();
  EXPECT_THAT(late.end, HasSubstr("a deadline of 61 s; allowed"));
}

}  // namespace
}  // namespace gravitas::control
