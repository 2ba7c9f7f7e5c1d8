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
#include <utility>

#include "services/recorder/durable_file.h"

namespace gravitas {
namespace {

constexpr std::array<unsigned char, 8> kJournalMagic = {0x89, 'G', 'R', 'V', 'J', '\r', '\n', 0x1a};
constexpr std::uint32_t kJournalVersion = 2;

// What waits in memory is written at this size, or when it has waited so long.
constexpr std::size_t kLargestBuffer = 64 * 1024;
constexpr std::chrono::milliseconds kLongestWait{50};

struct JournalHeader {
  std::array<unsigned char, 8> magic;
  std::uint32_t version, zero;
  Hash run;
  std::uint64_t check;
};
static_assert(sizeof(JournalHeader) == 40);

constexpr std::uint8_t kCommit = 1, kDecision = 2, kEdit = 3, kOrder = 4;

struct RecordHead {
  std::uint8_t kind;
  std::array<std::uint8_t, 3> zero;
  std::uint32_t size;  // of the payload
};
static_assert(sizeof(RecordHead) == 8);
constexpr std::size_t kCheckSize = sizeof(std::uint64_t);
constexpr std::uint32_t kLargestPayload = 1 << 30;

struct CommitPayload {
  std::uint32_t step;
  std::array<std::uint32_t, 4> chain;  // two numbers of 64 bits, their lower halves first
};
static_assert(sizeof(CommitPayload) == 20);

constexpr std::uint32_t low(std::uint64_t value) { return static_cast<std::uint32_t>(value); }
constexpr std::uint32_t high(std::uint64_t value) { return static_cast<std::uint32_t>(value >> 32); }
constexpr std::uint64_t word(const std::array<std::uint32_t, 4>& halves, std::size_t first) {
  return halves[first] | static_cast<std::uint64_t>(halves[first + 1]) << 32;
}

JournalHeader header_of(const Hash& run) {
  JournalHeader header{kJournalMagic, kJournalVersion, 0, run, 0};
  header.check = XXH3_64bits(&header, offsetof(JournalHeader, check));
  return header;
}

// Size of the record with which `bytes` begin, by what it says itself; 0: no whole one can be there.
std::size_t size_of_record(std::span<const std::byte> bytes) {
  RecordHead head;
  if (bytes.size() < sizeof head) return 0;
  std::memcpy(&head, bytes.data(), sizeof head);
  const std::size_t whole = sizeof head + std::size_t{head.size} + kCheckSize;
  const bool is_possible = head.zero == RecordHead{}.zero && head.size <= kLargestPayload && bytes.size() >= whole;
  return is_possible ? whole : 0;
}

std::uint64_t check_of(std::span<const std::byte> record, std::uint64_t before) {
  return XXH3_64bits_withSeed(record.data(), record.size() - kCheckSize, before);
}

std::uint64_t check_at(std::span<const std::byte> bytes, std::size_t place) {
  std::uint64_t check = 0;
  std::memcpy(&check, &bytes[place], kCheckSize);
  return check;
}

bool begins_with_record(std::span<const std::byte> bytes, std::uint64_t before) {
  const std::size_t whole = size_of_record(bytes);
  return whole > 0 && check_at(bytes, whole - kCheckSize) == check_of(bytes.first(whole), before);
}

// Whether a whole record follows the bad one with which `bytes` begin. The check that seeds its own stands before it, or
// is to be worked out where that is the bad one.
bool has_whole_record_behind(std::span<const std::byte> bytes, std::uint64_t before) {
  if (const std::size_t bad = size_of_record(bytes); bad > 0)
    if (begins_with_record(bytes.subspan(bad), check_of(bytes.first(bad), before))) return true;
  for (std::size_t place = kCheckSize; place < bytes.size(); ++place) {
    const auto kind = std::to_integer<std::uint8_t>(bytes[place]);
    if (kind < kCommit || kind > kOrder) continue;
    if (begins_with_record(bytes.subspan(place), check_at(bytes, place - kCheckSize))) return true;
  }
  return false;
}

bool is_same_order(recorder::v1::Decision a, recorder::v1::Decision b) {
  a.clear_why(), b.clear_why();
  return a.SerializeAsString() == b.SerializeAsString();
}

// False if the content is impossible.
bool take_record(std::uint8_t kind, std::span<const std::byte> payload, std::uint32_t after, JournalReading* reading) {
  if (kind == kDecision) {
    recorder::v1::Decision decision;
    if (!decision.ParseFromArray(payload.data(), static_cast<int>(payload.size()))) return false;
    if (decision.step() > after) reading->decisions.push_back(std::move(decision));
    return true;
  }
  if (kind == kEdit) {
    edit::v1::Edit edit;
    if (!edit.ParseFromArray(payload.data(), static_cast<int>(payload.size()))) return false;
    if (edit.step() > after) reading->edits.push_back(std::move(edit));
    return true;
  }
  if (kind == kOrder) {
    recorder::v1::Decision order;
    if (!order.ParseFromArray(payload.data(), static_cast<int>(payload.size()))) return false;
    std::erase_if(reading->orders, [&](const recorder::v1::Decision& one) { return is_same_order(one, order); });
    if (order.step() > after && order.why() != kCalledOff) reading->orders.push_back(std::move(order));
    return true;
  }
  CommitPayload commit;
  if (kind != kCommit || payload.size() != sizeof commit) return false;
  std::memcpy(&commit, payload.data(), sizeof commit);
  if (commit.step <= reading->last_step) return false;
  reading->last_step = commit.step;
  if (commit.step > after) reading->commits.push_back({commit.step, {word(commit.chain, 0), word(commit.chain, 2)}});
  return true;
}

}  // namespace

bool is_same_edit(const edit::v1::Edit& a, const edit::v1::Edit& b) {
  return a.step() == b.step() && std::ranges::equal(a.changes(), b.changes(), {}, &edit::v1::Change::SerializeAsString,
                                                    &edit::v1::Change::SerializeAsString);
}

JournalReading read_journal(std::span<const std::byte> bytes, const Hash& run, std::uint32_t after) {
  JournalReading reading;
  JournalHeader header;
  const JournalHeader expected = header_of(run);
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
  for (;;) {
    const std::span<const std::byte> rest = bytes.subspan(reading.end);
    if (!begins_with_record(rest, reading.check)) break;
    const std::size_t whole = size_of_record(rest);
    const auto payload = rest.first(whole - kCheckSize).subspan(sizeof(RecordHead));
    if (!take_record(std::to_integer<std::uint8_t>(rest[0]), payload, after, &reading)) break;
    reading.end += whole;
    reading.check = check_at(rest, whole - kCheckSize);
  }
  if (reading.end == bytes.size()) return reading;
  reading.is_damaged = has_whole_record_behind(bytes.subspan(reading.end), reading.check);
  reading.note = reading.is_damaged
                     ? fmt::format("the record at byte {} is damaged, and whole ones stand behind it", reading.end)
                     : fmt::format("its last {} bytes are no whole record", bytes.size() - reading.end);
  return reading;
}

JournalWriter::JournalWriter(const std::string& path, const Hash& run, const JournalReading& known)
    : path_(path), check_(known.check), last_step_(known.last_step), known_edits_(known.edits) {
  file_ = open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NONBLOCK, 0666);
  const auto fail = [&] {
    const std::system_error error(errno, std::generic_category(), "journal '" + path_ + "'");
    if (file_ >= 0) close(file_);
    throw error;
  };
  if (file_ < 0) fail();
  // where the file system has no locks there is none
  if (flock(file_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    close(file_);
    throw std::runtime_error("journal '" + path_ + "': another run is writing it");
  }
  if (ftruncate(file_, static_cast<off_t>(known.end)) != 0 || lseek(file_, 0, SEEK_END) < 0) fail();
  if (known.end > 0) return;
  const JournalHeader header = header_of(run);
  check_ = header.check;
  const auto* bytes = reinterpret_cast<const std::byte*>(&header);
  buffer_.assign(bytes, bytes + sizeof header);
  try {
    flush();
    for (const recorder::v1::Decision& order : known.orders) append_order(order);
  } catch (const std::system_error&) {
    close(file_);
    throw;
  }
}

JournalWriter::~JournalWriter() { close(file_); }

void JournalWriter::append(const JournalEntry& commit) {
  if (commit.step <= last_step_) return;
  last_step_ = commit.step;
  const CommitPayload payload{
      commit.step, {low(commit.chain.low), high(commit.chain.low), low(commit.chain.high), high(commit.chain.high)}};
  put(kCommit, std::as_bytes(std::span(&payload, 1)));
  if (buffer_.size() >= kLargestBuffer || Clock::now() - last_flush_ >= kLongestWait) flush();
}

void JournalWriter::append(const recorder::v1::Decision& decision) { put_message(kDecision, decision); }

void JournalWriter::append_order(const recorder::v1::Decision& order) { put_message(kOrder, order); }

void JournalWriter::append(const edit::v1::Edit& edit) {
  if (known_edits_.empty() || !is_same_edit(known_edits_.front(), edit)) return put_message(kEdit, edit);
  known_edits_.erase(known_edits_.begin());
}

void JournalWriter::put_message(std::uint8_t kind, const google::protobuf::Message& message) {
  const std::string payload = message.SerializeAsString();
  put(kind, std::as_bytes(std::span(payload)));
  flush();
}

void JournalWriter::put(std::uint8_t kind, std::span<const std::byte> payload) {
  const RecordHead head{kind, {}, static_cast<std::uint32_t>(payload.size())};
  const std::size_t begin = buffer_.size();
  const auto add = [&](std::span<const std::byte> bytes) { buffer_.insert(buffer_.end(), bytes.begin(), bytes.end()); };
  add(std::as_bytes(std::span(&head, 1)));
  add(payload);
  check_ = XXH3_64bits_withSeed(&buffer_[begin], buffer_.size() - begin, check_);
  add(std::as_bytes(std::span(&check_, 1)));
}

void JournalWriter::flush() {
  last_flush_ = Clock::now();
  const std::vector<std::byte> waiting = std::exchange(buffer_, {});
  write_all(file_, waiting, "journal '" + path_ + "'");
  is_lost_ = is_lost_ || has_lost_its_name(file_, path_);
}

}  // namespace gravitas
