// Damaged replies: whatever the bit or the seed, whoever reads the reply notices it.
#include "plugin_sdk/host/fault_injection.h"

#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <string>
#include <vector>

#include "gravitas/stage/v1/call.pb.h"
#include "plugin_sdk/channel/mailbox.h"
#include "schemas/stage_frames.h"
#include "schemas/wire/byte_buffer.h"

namespace gravitas::host {
namespace {

constexpr const stage::MethodInfo& kMethod = stage::method_info(stage::Method::kSpacePairs);
constexpr std::uint64_t kEpoch = 7, kSequence = 300;

FaultInjection fault(const std::string& order) {
  std::string problem;
  std::optional<FaultOrder> parsed = parse_fault_order(order, &problem);
  EXPECT_TRUE(parsed.has_value()) << problem;
  return FaultInjection(parsed.value_or(FaultOrder(fault_kinds()[0])));
}

// A right reply in shared memory.
struct Frame {
  Frame() {
    header.magic = GRAVITAS_MAGIC;
    header.epoch = kEpoch;
    header.sequence = kSequence;
    header.kind = GRAVITAS_FRAME_REPLY;
    header.column_count = 1;
    header.digest = digest();
  }
  std::uint64_t digest() const {
    const void* data[] = {pairs.data()};
    return channel::frame_digest(header, columns, kMethod.reply, data);
  }
  void spoil(const std::string& order) {
    const gravitas_reply_column reply{pairs.data(), kRoom, pairs.size()};
    fault(order).spoil_frame(&header, columns, kMethod.reply, &reply);
  }
  // As a kernel takes it: where it is told to look, no further than the room, and by the digest.
  bool is_accepted() const {
    return header.magic == GRAVITAS_MAGIC && header.epoch == kEpoch && header.sequence == kSequence &&
           columns[0].offset == 0 && columns[0].capacity == kRoom && columns[0].count <= pairs.size() &&
           header.digest == digest();
  }

  static constexpr std::uint64_t kRoom = 64;
  gravitas_frame_header header{};
  std::vector<std::uint32_t> pairs = {0, 1, 0, 2, 300, 70000};
  std::array<gravitas_frame_column, 1> columns = {{{0, 6, kRoom}}};
};

TEST(SpoiledFrame, ARightOneIsAccepted) { EXPECT_TRUE(Frame().is_accepted()); }

TEST(SpoiledFrame, IsNotAcceptedWhateverBitIsTurned) {
  const std::uint64_t header_bits = 8 * sizeof(gravitas_frame_header), payload_bits = 8 * 6 * 4;
  for (const auto& [where, bits] : {std::pair("header", header_bits), std::pair("payload", payload_bits)}) {
    for (std::uint64_t bit = 0; bit < bits; ++bit) {
      Frame frame;
      frame.spoil(std::string("flip,where=") + where + ",bit=" + std::to_string(bit));
      EXPECT_FALSE(frame.is_accepted()) << where << " bit " << bit;
      // it is this bit, and turned back all is right
      frame.spoil(std::string("flip,where=") + where + ",bit=" + std::to_string(bit + bits));
      EXPECT_TRUE(frame.is_accepted()) << where << " bit " << bit;
    }
  }
}

TEST(SpoiledFrame, IsAddressedRightlyAndNotAcceptedWhateverIsScribbled) {
  for (int seed = 0; seed < 1000; ++seed) {
    Frame frame;
    frame.spoil("scribble,seed=" + std::to_string(seed));
    EXPECT_FALSE(frame.is_accepted()) << "seed " << seed;
    EXPECT_EQ(frame.header.magic, GRAVITAS_MAGIC);
    EXPECT_EQ(frame.header.epoch, kEpoch);
    EXPECT_EQ(frame.header.sequence, kSequence);
  }
}

TEST(SpoiledFrame, SaysOtherCounts) {
  Frame half, huge;
  half.spoil("truncate");
  EXPECT_EQ(half.columns[0].count, 3U);
  huge.spoil("oversize");
  EXPECT_GT(huge.columns[0].count, std::uint64_t{1} << 32);
  EXPECT_FALSE(half.is_accepted());
  EXPECT_FALSE(huge.is_accepted());
}

// A right reply as a message: columns, then the outcome.
using Pairs = std::vector<std::uint32_t>;

struct Message {
  explicit Message(Pairs with = {0, 1, 0, 2, 300, 70000}) : pairs(std::move(with)) {
    const gravitas_column column{pairs.data(), pairs.size()};
    stage::v1::Outcome outcome;
    outcome.set_epoch(kEpoch);
    outcome.set_sequence(kSequence);
    outcome.set_digest(wire::columns_digest(kMethod.reply, {&column, 1}));
    columns_size = wire::columns_size(kMethod.reply, {&column, 1});
    const grpc::ByteBuffer buffer = wire::to_byte_buffer({kMethod.reply, {&column, 1}, &outcome});
    const wire::FlatMessage flat(buffer);
    bytes.assign(reinterpret_cast<const char*>(flat.bytes().data()), flat.bytes().size());
  }
  void spoil(const std::string& order) { fault(order).spoil_message(&bytes, columns_size); }
  bool is_accepted() const {
    wire::ColumnsReader reader(kMethod.reply);
    stage::v1::Outcome outcome;
    if (!reader.parse(std::as_bytes(std::span(bytes))).empty() || !reader.header().has ||
        !outcome.ParseFromArray(reader.header().bytes.data(), static_cast<int>(reader.header().bytes.size())))
      return false;
    std::vector<std::uint32_t> read(reader.count(0));
    reader.copy(0, read.data());
    const gravitas_column column{read.data(), read.size()};
    return outcome.epoch() == kEpoch && outcome.sequence() == kSequence &&
           outcome.digest() == wire::columns_digest(kMethod.reply, {&column, 1});
  }

  Pairs pairs;
  std::size_t columns_size = 0;
  std::string bytes;
};

TEST(SpoiledMessage, ARightOneIsAccepted) {
  EXPECT_TRUE(Message().is_accepted());
  EXPECT_TRUE(Message(Pairs()).is_accepted());
}

TEST(SpoiledMessage, IsNotAcceptedWhateverBitOfItsColumnsIsTurned) {
  const std::uint64_t bits = 8 * Message().columns_size;
  for (std::uint64_t bit = 0; bit < bits; ++bit) {
    Message message;
    message.spoil("flip,bit=" + std::to_string(bit));
    EXPECT_FALSE(message.is_accepted()) << "bit " << bit;
    message.spoil("flip,bit=" + std::to_string(bit + bits));
    EXPECT_TRUE(message.is_accepted()) << "bit " << bit;
  }
}

TEST(SpoiledMessage, IsNotAcceptedWithAnotherDigest) {
  Message message;
  message.spoil("flip,where=header");
  EXPECT_FALSE(message.is_accepted());
  EXPECT_EQ(message.bytes.substr(0, message.bytes.size() - 8), Message().bytes.substr(0, message.bytes.size() - 8));
}

TEST(SpoiledMessage, IsNotAcceptedWhateverIsScribbled) {
  for (int seed = 0; seed < 1000; ++seed) {
    Message message, empty{Pairs()};
    message.spoil("scribble,seed=" + std::to_string(seed));
    EXPECT_FALSE(message.is_accepted()) << "seed " << seed;
    empty.spoil("scribble,seed=" + std::to_string(seed));
    EXPECT_FALSE(empty.is_accepted()) << "seed " << seed;
  }
}

TEST(SpoiledMessage, IsShorterOrSaysThatItIsLonger) {
  Message half, huge;
  half.spoil("truncate");
  EXPECT_EQ(half.bytes.size(), Message().bytes.size() / 2);
  EXPECT_FALSE(half.is_accepted());
  huge.spoil("oversize");
  EXPECT_FALSE(huge.is_accepted());
}

TEST(FaultInjection, ChangesEpochSequenceAndNumberOfRepliesWhereItIsOrderedTo) {
  EXPECT_EQ(fault("stale").epoch(9), 8U);
  EXPECT_EQ(fault("stale").sequence(9), 9U);
  EXPECT_EQ(fault("sequence").sequence(9), 8U);
  EXPECT_EQ(fault("sequence").epoch(9), 9U);
  EXPECT_EQ(fault("drop").copies(), 0);
  EXPECT_EQ(fault("duplicate").copies(), 2);
  EXPECT_EQ(fault("nan").copies(), 1);
}

}  // namespace
}  // namespace gravitas::host
