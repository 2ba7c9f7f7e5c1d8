// The journal: what is read back, what a tear or an edit costs, whose it is.
#include "services/recorder/journal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "services/recorder/durable_file.h"
#include "tests/services/cli/program.h"

namespace gravitas {
namespace {

using harness::ScratchFolder;
using ::testing::HasSubstr;

const Hash kRun{11, 22};
constexpr std::size_t kJournalHeader = 40, kRecord = 36;

JournalEntry entry(std::uint32_t step) { return {step, {step * 1000003ULL, ~std::uint64_t{step}}}; }

void write_steps(const std::string& path, const JournalReading& known, std::uint32_t first, std::uint32_t last) {
  JournalWriter writer(path, kRun, known);
  for (std::uint32_t step = first; step <= last; ++step) writer.append(entry(step));
  writer.flush();
}

std::vector<std::uint32_t> steps_of(const JournalReading& reading) {
  std::vector<std::uint32_t> steps;
  for (const JournalEntry& one : reading.commits) {
    EXPECT_EQ(one.chain, entry(one.step).chain);
    steps.push_back(one.step);
  }
  return steps;
}

std::vector<std::uint32_t> range(std::uint32_t first, std::uint32_t last) {
  std::vector<std::uint32_t> steps;
  for (std::uint32_t step = first; step <= last; ++step) steps.push_back(step);
  return steps;
}

TEST(Journal, GivesBackTheStepsBeyondTheOneThatIsKnown) {
  const ScratchFolder folder;
  const std::string path = folder.path("j");
  write_steps(path, {}, 1, 20);
  const std::vector<std::byte> bytes = read_whole_file(path);
  EXPECT_EQ(bytes.size(), kJournalHeader + 20 * kRecord);
  EXPECT_EQ(steps_of(read_journal(bytes, kRun, 0)), range(1, 20));
  EXPECT_EQ(steps_of(read_journal(bytes, kRun, 12)), range(13, 20));
  EXPECT_TRUE(steps_of(read_journal(bytes, kRun, 20)).empty());
  const JournalReading reading = read_journal(bytes, kRun, 20);
  EXPECT_EQ(reading.last_step, 20U);
  EXPECT_EQ(reading.end, bytes.size());
  EXPECT_EQ(reading.note, "");
}

TEST(Journal, GoesOnBehindWhatWasReadWithoutRepeatingIt) {
  const ScratchFolder folder;
  const std::string path = folder.path("j");
  write_steps(path, {}, 1, 10);
  // resumed at step 6: 7 to 10 are made again, 11 is new
  write_steps(path, read_journal(read_whole_file(path), kRun, 6), 7, 12);
  EXPECT_EQ(steps_of(read_journal(read_whole_file(path), kRun, 0)), range(1, 12));
}

TEST(Journal, ATornTailIsLeftAsideAndOverwritten) {
  const ScratchFolder folder;
  const std::string path = folder.path("j");
  write_steps(path, {}, 1, 10);
  const std::vector<std::byte> whole = read_whole_file(path);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const JournalReading reading = read_journal(std::span(whole).first(size), kRun, 0);
    const std::size_t records = size < kJournalHeader ? 0 : (size - kJournalHeader) / kRecord;
    ASSERT_EQ(reading.commits.size(), records) << size;
    ASSERT_EQ(reading.note.empty(), size >= kJournalHeader && (size - kJournalHeader) % kRecord == 0) << size;
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(whole.data()), static_cast<std::streamsize>(size));
    write_steps(path, reading, static_cast<std::uint32_t>(records) + 1, 10);
    ASSERT_EQ(read_whole_file(path), whole) << size;
  }
}

TEST(Journal, NoFlippedBitPasses) {
  const ScratchFolder folder;
  const std::string path = folder.path("j");
  write_steps(path, {}, 1, 4);
  std::vector<std::byte> bytes = read_whole_file(path);
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    const std::byte mask{static_cast<unsigned char>(1U << bit % 8)};
    bytes[bit / 8] ^= mask;
    const JournalReading reading = read_journal(bytes, kRun, 0);
    const std::size_t sound = bit / 8 < kJournalHeader ? 0 : (bit / 8 - kJournalHeader) / kRecord;
    EXPECT_EQ(steps_of(reading), range(1, static_cast<std::uint32_t>(sound))) << bit;
    EXPECT_NE(reading.note, "") << bit;
    bytes[bit / 8] ^= mask;
  }
}

TEST(Journal, RecordsCannotBeExchangedOrRepeated) {
  const ScratchFolder folder;
  const std::string path = folder.path("j");
  write_steps(path, {}, 1, 4);
  std::vector<std::byte> bytes = read_whole_file(path);
  const auto record = [&](std::size_t i) {
    return bytes.begin() + static_cast<std::ptrdiff_t>(kJournalHeader + i * kRecord);
  };
  std::vector<std::byte> cut = bytes;
  cut.erase(cut.begin() + kJournalHeader + kRecord, cut.begin() + kJournalHeader + 2 * kRecord);
  EXPECT_EQ(steps_of(read_journal(cut, kRun, 0)), range(1, 1));
  std::swap_ranges(record(1), record(2), record(2));
  EXPECT_EQ(steps_of(read_journal(bytes, kRun, 0)), range(1, 1));
}

// Each once, and in the journal of another file, too.
TEST(Journal, OrdersStandUntilTheyAreCalledOff) {
  const ScratchFolder folder;
  const auto order = [](std::uint32_t step, const char* why) {
    recorder::v1::Decision message;
    message.set_step(step);
    message.set_plugin("Newton");
    message.set_why(why);
    return message;
  };
  {
    JournalWriter writer(folder.path("j"), kRun, {});
    for (const std::uint32_t step : {5U, 30U, 40U, 40U}) writer.append_order(order(step, kOrderOfSwap));
    writer.append_order(order(30, kCalledOff));
    writer.append_order(order(50, kOrderOfSetting));
  }
  const JournalReading reading = read_journal(read_whole_file(folder.path("j")), kRun, 10);
  JournalReading anew;
  anew.orders = reading.orders;
  { const JournalWriter other(folder.path("other"), kRun, anew); }
  for (const char* name : {"j", "other"}) {
    const JournalReading again = read_journal(read_whole_file(folder.path(name)), kRun, 10);
    EXPECT_EQ(again.note, "");
    ASSERT_EQ(again.orders.size(), 2U) << name;
    EXPECT_EQ(again.orders[0].step(), 40U);
    EXPECT_EQ(again.orders[1].step(), 50U);
    EXPECT_EQ(again.orders[1].why(), kOrderOfSetting);
  }
}

TEST(Journal, ThatOfAnotherRunIsNone) {
  const ScratchFolder folder;
  const std::string path = folder.path("j");
  write_steps(path, {}, 1, 4);
  const JournalReading reading = read_journal(read_whole_file(path), {11, 23}, 0);
  EXPECT_TRUE(reading.commits.empty());
  EXPECT_EQ(reading.end, 0U);
  EXPECT_THAT(reading.note, HasSubstr("another scene or build"));
}

TEST(Journal, IsWrittenByOneRunAtATime) {
  const ScratchFolder folder;
  const std::string path = folder.path("j");
  const JournalWriter first(path, kRun, {});
  try {
    const JournalWriter second(path, kRun, {});
    FAIL() << "two writers";
  } catch (const std::runtime_error& problem) {
    EXPECT_THAT(problem.what(), HasSubstr("another run is writing it"));
  }
}

TEST(Journal, NoticesThatItsFileWasRemovedOrReplaced) {
  const ScratchFolder folder;
  const std::string path = folder.path("j"), elsewhere = folder.path("k");
  for (const bool is_replaced : {false, true}) {
    JournalWriter writer(path, kRun, {});
    writer.append(entry(1));
    writer.flush();
    EXPECT_FALSE(writer.is_lost());
    // moved there, it has a name still, but another one
    std::filesystem::rename(path, elsewhere);
    if (is_replaced) std::ofstream(path) << "of somebody else";
    writer.append(entry(2));
    writer.flush();
    EXPECT_TRUE(writer.is_lost());
    std::filesystem::remove(path);
  }
}

TEST(Journal, WhatCannotBeWrittenIsSaid) {
  const ScratchFolder folder;
  EXPECT_THROW(JournalWriter(folder.path("none/j"), kRun, {}), std::system_error);
}

// A tear leaves nothing whole behind it; damage does, wherever in a record it is.
TEST(Journal, ABadRecordBeforeWholeOnesIsDamage) {
  const ScratchFolder folder;
  const std::string path = folder.path("j");
  write_steps(path, {}, 1, 4);
  std::vector<std::byte> bytes = read_whole_file(path);
  for (std::size_t place = kJournalHeader; place < bytes.size(); ++place) {
    bytes[place] ^= std::byte{1};
    const std::size_t record = (place - kJournalHeader) / kRecord;
    EXPECT_EQ(read_journal(bytes, kRun, 0).is_damaged, record < 3) << place;
    bytes[place] ^= std::byte{1};
  }
  for (std::size_t size = 0; size <= bytes.size(); ++size)
    EXPECT_FALSE(read_journal(std::span(bytes).first(size), kRun, 0).is_damaged) << size;
  // blocks of a file that were never written
  bytes.resize(bytes.size() + 4096);
  EXPECT_FALSE(read_journal(bytes, kRun, 0).is_damaged);
}

}  // namespace
}  // namespace gravitas
