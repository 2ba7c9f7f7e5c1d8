// Two sides that talk through two mailboxes: no message is lost, a silence ends in time, and a
// message that was changed on its way is seen to be.
#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <cstring>
#include <memory>
#include <set>
#include <thread>
#include <vector>

#include "plugin_sdk/channel/mailboxes.h"
#include "schemas/stage_frames.h"

namespace gravitas::channel {
namespace {

constexpr std::uint64_t kMillisecond = 1'000'000;
// Longer than any scheduler makes a test wait.
constexpr std::uint64_t kLong = 60'000 * kMillisecond;

TEST(Mailbox, HasTheLayoutOfVersionTwo) {
  ASSERT_EQ(GRAVITAS_LAYOUT_VERSION, 2);
  EXPECT_EQ(offsetof(Mailbox, signal), 0U);
  EXPECT_EQ(offsetof(Mailbox, sleeping), 4U);
  EXPECT_EQ(offsetof(Mailbox, cpu), 8U);
  EXPECT_EQ(offsetof(Mailbox, header), 64U);
  EXPECT_EQ(offsetof(Mailbox, progress), 160U);
  EXPECT_EQ(offsetof(Mailbox, compute_ns), 168U);
  EXPECT_EQ(offsetof(Mailbox, columns), 176U);
  EXPECT_EQ(offsetof(Mailbox, reply), 176U + 48 * 24);
  EXPECT_EQ(offsetof(Mailbox, text), 176U + 2 * 48 * 24);
  EXPECT_EQ(sizeof(Mailbox), 3008U);
}

TEST(Mailbox, TwoThreadsTakeTurns) {
  constexpr std::uint64_t kRounds = 20'000;
  const Mailboxes boxes;
  std::uint64_t wrong_in_worker = 0;

  std::thread worker([&] {
    std::uint32_t seen = 0;
    for (std::uint64_t i = 1; i <= kRounds; ++i) {
      if (wait(boxes.theirs, boxes.mine, seen, now_ns() + kLong) != Waited::kMessage) ++wrong_in_worker;
      seen = boxes.mine->signal.load();
      if (boxes.mine->header.sequence != i) ++wrong_in_worker;
      boxes.theirs->header.sequence = i;
      boxes.theirs->columns[GRAVITAS_MAX_COLUMNS - 1].count = 2 * i;
      post(boxes.theirs, boxes.mine);
    }
  });

  std::uint64_t wrong = 0;
  std::uint32_t seen = 1;
  for (std::uint64_t i = 1; i <= kRounds; ++i) {
    boxes.mine->header.sequence = i;
    post(boxes.mine, boxes.theirs);
    if (wait(boxes.mine, boxes.theirs, seen, now_ns() + kLong) != Waited::kMessage) ++wrong;
    seen = boxes.theirs->signal.load();
    if (boxes.theirs->header.sequence != i || boxes.theirs->columns[GRAVITAS_MAX_COLUMNS - 1].count != 2 * i) ++wrong;
  }
  worker.join();
  EXPECT_EQ(wrong, 0U);
  EXPECT_EQ(wrong_in_worker, 0U);
  EXPECT_EQ(seen, kRounds + 1);
}

TEST(Mailbox, AMessageThatIsThereIsTakenAtOnce) {
  const Mailboxes boxes;
  post(boxes.theirs, boxes.mine);
  // even when the time is over already
  EXPECT_EQ(wait(boxes.mine, boxes.theirs, 1, 0), Waited::kMessage);
  EXPECT_EQ(boxes.theirs->signal.load(), 2U);
}

TEST(Mailbox, ASilenceEndsInTime) {
  const Mailboxes boxes;
  const std::uint64_t until = now_ns() + 5 * kMillisecond;
  EXPECT_EQ(wait(boxes.mine, boxes.theirs, 1, until), Waited::kTimeout);
  EXPECT_GE(now_ns() + kMillisecond, until);  // at most a millisecond early
  EXPECT_EQ(wait(boxes.mine, boxes.theirs, 1, 0), Waited::kTimeout);
  EXPECT_EQ(boxes.mine->sleeping.load(), 0U);
}

TEST(Mailbox, ALateMessageIsStillThere) {
  const Mailboxes boxes;
  EXPECT_EQ(wait(boxes.mine, boxes.theirs, 1, now_ns() + kMillisecond), Waited::kTimeout);
  post(boxes.theirs, boxes.mine);
  EXPECT_EQ(wait(boxes.mine, boxes.theirs, 1, now_ns() + kLong), Waited::kMessage);
}

TEST(Mailbox, ASleeperIsWoken) {
  const Mailboxes boxes;
  Waited waited = Waited::kTimeout;
  std::thread sleeper([&] { waited = wait(boxes.mine, boxes.theirs, 1, now_ns() + kLong); });
  // long after the sleeper has stopped spinning
  while (boxes.mine->sleeping.load() == 0) std::this_thread::yield();
  const std::uint64_t before = now_ns();
  post(boxes.theirs, boxes.mine);
  sleeper.join();
  EXPECT_EQ(waited, Waited::kMessage);
  EXPECT_LT(now_ns() - before, kLong);
  EXPECT_EQ(boxes.mine->sleeping.load(), 0U);
}

TEST(Mailbox, AWakeIsNoMessage) {
  const Mailboxes boxes;
  Waited waited = Waited::kMessage;
  std::thread sleeper([&] { waited = wait(boxes.mine, boxes.theirs, 1, now_ns() + 20 * kMillisecond); });
  while (boxes.mine->sleeping.load() == 0) std::this_thread::yield();
  for (int i = 0; i < 100; ++i) wake(boxes.theirs);
  sleeper.join();
  EXPECT_EQ(waited, Waited::kTimeout);
}

TEST(Mailbox, APostIsNeverTakenForAnEnd) {
  const Mailboxes boxes;
  boxes.theirs->signal = ~0U;
  post(boxes.theirs, boxes.mine);
  EXPECT_EQ(boxes.theirs->signal.load(), 1U);
}

// The kernel does so for a worker that died, if its threads did not.
TEST(Mailbox, AnEndThatIsWrittenForTheOtherSideEndsAWait) {
  const Mailboxes boxes;
  Waited waited = Waited::kTimeout;
  std::thread sleeper([&] { waited = wait(boxes.mine, boxes.theirs, 1, now_ns() + kLong); });
  while (boxes.mine->sleeping.load() == 0) std::this_thread::yield();
  say_ended(boxes.theirs);
  sleeper.join();
  EXPECT_EQ(waited, Waited::kMessage);
}

// ---- digest -------------------------------------------------------------------------------------

// A reply to Constraint.Bind: a column of u32 and one of f64.
struct Frame {
  gravitas_frame_header header{};
  std::array<gravitas_frame_column, 2> columns{};
  std::array<std::uint32_t, 3> begin = {0, 1, 2};
  std::array<double, 2> bound = {0.5, -0.25};

  Frame() {
    header.magic = GRAVITAS_MAGIC;
    columns[0] = {0, begin.size(), 8};
    columns[1] = {64, bound.size(), 8};
  }
  std::uint64_t digest(bool with_data = true) const {
    const std::array<const void*, 2> data = {begin.data(), bound.data()};
    return frame_digest(header, columns, stage::kConstraintBindReplyColumns, with_data ? data.data() : nullptr);
  }
};

template <typename T>
void flip(T* target, std::size_t bit) {
  auto* bytes = reinterpret_cast<unsigned char*>(target);
  bytes[bit / 8] = static_cast<unsigned char>(bytes[bit / 8] ^ (1U << (bit % 8)));
}

// Flips each bit of the part and expects a digest that was not there before.
template <typename T>
void expect_every_bit_counts(Frame* frame, T* part, const char* name, bool with_data = true) {
  std::set<std::uint64_t> digests = {frame->digest(with_data)};
  for (std::size_t bit = 0; bit < 8 * sizeof(T); ++bit) {
    flip(part, bit);
    EXPECT_TRUE(digests.insert(frame->digest(with_data)).second) << "bit " << bit << " of the " << name;
    flip(part, bit);
  }
  EXPECT_TRUE(digests.contains(frame->digest(with_data)));
}

TEST(FrameDigest, ChangesWithAnyBit) {
  Frame frame;
  // without data, which a count with a flipped bit would run beyond
  expect_every_bit_counts(&frame, &frame.columns, "columns", false);
  expect_every_bit_counts(&frame, &frame.begin, "first column's data");
  expect_every_bit_counts(&frame, &frame.bound, "second column's data");
  struct Head {
    unsigned char bytes[offsetof(gravitas_frame_header, digest)];
  };
  expect_every_bit_counts(&frame, reinterpret_cast<Head*>(&frame.header), "header");
}

TEST(FrameDigest, LeavesItselfOut) {
  Frame frame;
  const std::uint64_t before = frame.digest();
  frame.header.digest = before;
  EXPECT_EQ(frame.digest(), before);
}

TEST(FrameDigest, LeavesDataOutWhereThereAreNone) {
  Frame frame;
  const std::uint64_t before = frame.digest(false);
  EXPECT_NE(before, frame.digest(true));
  frame.bound[0] = 9.0;
  EXPECT_EQ(frame.digest(false), before);
  frame.columns[1].count = 1;
  EXPECT_NE(frame.digest(false), before);
}

TEST(FrameDigest, TakesTheElementsThatAreCounted) {
  Frame frame;
  frame.columns[0].count = 2;
  const std::uint64_t before = frame.digest();
  frame.begin[2] = 77;
  EXPECT_EQ(frame.digest(), before);
  frame.begin[1] = 77;
  EXPECT_NE(frame.digest(), before);
}

}  // namespace
}  // namespace gravitas::channel
