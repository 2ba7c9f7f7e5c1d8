#include "services/recorder/journal.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <system_error>

#include "services/recorder/durable_file.h"

namespace gravitas {
namespace {

constexpr std::array<unsigned char, 8> kMagic = {0x89, 'G', 'R', 'V', 'J', '\r', '\n', 0x1a};
constexpr std::uint32_t kVersion = 1;

// What waits in memory is written at this size, or when it has waited so long.
constexpr std::size_t kLargestBuffer = 64 * 1024;
constexpr std::chrono::milliseconds kLongestWait{50};

struct Header {
  std::array<unsigned char, 8> magic;
  std::uint32_t version, zero;
  kernel::Hash run;
  std::uint64_t check;
};
static_assert(sizeof(Header) == 40);

enum class Kind : std::uint8_t { kCommit = 1 };

// Head and payload of a commit; a check of eight bytes follows.
struct CommitRecord {
  Kind kind;
  std::array<std::uint8_t, 3> zero;
  std::uint32_t size;
  std::uint32_t step;
  std::array<std::uint32_t, 4> chain;  // two numbers of 64 bits, their lower halves first
};
static_assert(sizeof(CommitRecord) == 28);
constexpr std::uint32_t kCommitSize = 20;
constexpr std::size_t kRecordSize = sizeof(CommitRecord) + sizeof(std::uint64_t);

constexpr std::uint32_t low(std::uint64_t value) { return static_cast<std::uint32_t>(value); }
constexpr std::uint32_t high(std::uint64_t value) { return static_cast<std::uint32_t>(value >> 32); }
constexpr std::uint64_t word(const std::array<std::uint32_t, 4>& halves, std::size_t first) {
  return halves[first] | static_cast<std::uint64_t>(halves[first + 1]) << 32;
}

Header header_of(const kernel::Hash& run) {
  Header header{kMagic, kVersion, 0, run, 0};
  header.check = XXH3_64bits(&header, offsetof(Header, check));
  return header;
}

std::uint64_t check_of(const CommitRecord& record, std::uint64_t previous) {
  return XXH3_64bits_withSeed(&record, sizeof record, previous);
}

}  // namespace

JournalReading read_journal(std::span<const std::byte> bytes, const kernel::Hash& run, std::uint32_t after) {
  JournalReading reading;
  Header header;
  const Header expected = header_of(run);
  if (bytes.size() < sizeof header) {
    reading.note = "it has no whole header";
    return reading;
  }
  std::memcpy(&header, bytes.data(), sizeof header);
  if (header.magic != expected.magic || header.version != expected.version || header.zero != expected.zero) {
    reading.note = "it is not a journal that this build reads";
    return reading;
  }
  if (!(header.run == run) || header.check != expected.check) {
    reading.note = "it belongs to another scene or build, or is damaged";
    return reading;
  }
  reading.end = sizeof header;
  reading.check = header.check;
  while (bytes.size() - reading.end >= kRecordSize) {
    CommitRecord record;
    std::uint64_t check = 0;
    std::memcpy(&record, bytes.data() + reading.end, sizeof record);
    std::memcpy(&check, bytes.data() + reading.end + sizeof record, sizeof check);
    if (record.kind != Kind::kCommit || record.size != kCommitSize || check != check_of(record, reading.check) ||
        record.step <= reading.last_step)
      break;
    reading.end += kRecordSize;
    reading.check = check;
    reading.last_step = record.step;
    if (record.step > after) reading.commits.push_back({record.step, {word(record.chain, 0), word(record.chain, 2)}});
  }
  if (reading.end < bytes.size())
    reading.note = fmt::format("its last {} bytes are no whole record", bytes.size() - reading.end);
  return reading;
}

JournalWriter::JournalWriter(const std::string& path, const kernel::Hash& run, const JournalReading& known)
    : path_(path), check_(known.check), last_step_(known.last_step) {
  file_ = open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NONBLOCK, 0666);
  const auto fail = [&] {
    const std::system_error error(errno, std::generic_category(), "journal '" + path_ + "'");
    if (file_ >= 0) close(file_);
    throw error;
  };
  if (file_ < 0) fail();
  if (flock(file_, LOCK_EX | LOCK_NB) != 0) {
    close(file_);
    throw std::runtime_error("journal '" + path_ + "': another run is writing it");
  }
  if (ftruncate(file_, static_cast<off_t>(known.end)) != 0 || lseek(file_, 0, SEEK_END) < 0) fail();
  if (known.end > 0) return;
  const Header header = header_of(run);
  check_ = header.check;
  const auto* bytes = reinterpret_cast<const std::byte*>(&header);
  buffer_.assign(bytes, bytes + sizeof header);
  try {
    flush();
  } catch (const std::system_error&) {
    close(file_);
    throw;
  }
}

JournalWriter::~JournalWriter() { close(file_); }

void JournalWriter::append(const JournalEntry& commit) {
  if (commit.step <= last_step_) return;
  last_step_ = commit.step;
  const CommitRecord record{
      Kind::kCommit,
      {},
      kCommitSize,
      commit.step,
      {low(commit.chain.low), high(commit.chain.low), low(commit.chain.high), high(commit.chain.high)}};
  check_ = check_of(record, check_);
  const auto put = [&](const auto& value) {
    const auto* bytes = reinterpret_cast<const std::byte*>(&value);
    buffer_.insert(buffer_.end(), bytes, bytes + sizeof value);
  };
  put(record);
  put(check_);
  if (buffer_.size() >= kLargestBuffer || Clock::now() - last_flush_ >= kLongestWait) flush();
}

void JournalWriter::flush() {
  last_flush_ = Clock::now();
  const std::vector<std::byte> waiting = std::exchange(buffer_, {});
  write_all(file_, waiting, "journal '" + path_ + "'");
}

}  // namespace gravitas
