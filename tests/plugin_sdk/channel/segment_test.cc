// Shared memory that neither side can shrink under the other, and that a reader cannot write; and
// the socket over which its descriptor travels.
#include "plugin_sdk/channel/segment.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <vector>

#ifndef F_SEAL_FUTURE_WRITE
#define F_SEAL_FUTURE_WRITE 0x0010
#endif

namespace gravitas::channel {
namespace {

constexpr std::size_t kSize = 8192;
constexpr int kAlwaysSealed = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL;

std::size_t open_descriptors() {
  const std::filesystem::directory_iterator all("/proc/self/fd");
  return static_cast<std::size_t>(std::distance(begin(all), end(all)));
}

// A connected pair of SEQPACKET sockets.
struct Sockets {
  Sockets() { EXPECT_EQ(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends), 0); }
  ~Sockets() {
    for (const int end : ends)
      if (end >= 0) close(end);
  }
  void hang_up(int end) {
    close(ends[end]);
    ends[end] = -1;
  }
  int ends[2] = {-1, -1};
};

// A packet of `size` bytes with a copy of the descriptor for each of `copies`.
bool send_packet(int socket, std::size_t size, int descriptor, std::size_t copies) {
  std::vector<char> bytes(size);
  iovec part = {bytes.data(), bytes.size()};
  alignas(cmsghdr) char control[CMSG_SPACE(4 * sizeof(int))] = {};
  msghdr packet = {};
  packet.msg_iov = &part;
  packet.msg_iovlen = 1;
  if (copies > 0) {
    packet.msg_control = control;
    packet.msg_controllen = CMSG_SPACE(copies * sizeof(int));
    cmsghdr* rights = CMSG_FIRSTHDR(&packet);
    rights->cmsg_level = SOL_SOCKET;
    rights->cmsg_type = SCM_RIGHTS;
    rights->cmsg_len = CMSG_LEN(copies * sizeof(int));
    for (std::size_t i = 0; i < copies; ++i)
      std::memcpy(CMSG_DATA(rights) + i * sizeof(int), &descriptor, sizeof descriptor);
  }
  return sendmsg(socket, &packet, MSG_NOSIGNAL) == static_cast<ssize_t>(size);
}

TEST(Segment, IsZeroedAndWritable) {
  const Segment segment = Segment::create("test", kSize, Sharing::kWriters);
  ASSERT_EQ(segment.size(), kSize);
  EXPECT_TRUE(std::all_of(segment.data(), segment.data() + kSize, [](std::byte b) { return b == std::byte{0}; }));
  segment.data()[kSize - 1] = std::byte{7};
  EXPECT_EQ(segment.data()[kSize - 1], std::byte{7});
}

TEST(Segment, BothSidesSeeOneMemory) {
  const Segment mine = Segment::create("test", kSize, Sharing::kWriters);
  const Segment theirs = Segment::map(dup(mine.descriptor()), kSize, Access::kReadWrite);
  EXPECT_NE(mine.data(), theirs.data());
  mine.data()[100] = std::byte{1};
  EXPECT_EQ(theirs.data()[100], std::byte{1});
  theirs.data()[100] = std::byte{2};
  EXPECT_EQ(mine.data()[100], std::byte{2});
}

TEST(Segment, CannotBeTruncatedByAnyone) {
  for (const Sharing sharing : {Sharing::kReadersOnly, Sharing::kWriters}) {
    const Segment segment = Segment::create("test", kSize, sharing);
    for (const off_t size : {0, 4096, 8191, 8193, 1 << 20}) {
      EXPECT_EQ(ftruncate(segment.descriptor(), size), -1) << size;
      EXPECT_EQ(errno, EPERM);
    }
    EXPECT_EQ(ftruncate(segment.descriptor(), kSize), 0);
  }
}

TEST(Segment, SealsAreTheAgreedOnesAndFinal) {
  const Segment writers = Segment::create("test", kSize, Sharing::kWriters);
  const Segment readers = Segment::create("test", kSize, Sharing::kReadersOnly);
  EXPECT_EQ(fcntl(writers.descriptor(), F_GET_SEALS), kAlwaysSealed);
  EXPECT_EQ(fcntl(readers.descriptor(), F_GET_SEALS), kAlwaysSealed | F_SEAL_FUTURE_WRITE);
  EXPECT_EQ(fcntl(writers.descriptor(), F_ADD_SEALS, F_SEAL_WRITE), -1);
  EXPECT_EQ(errno, EPERM);
}

TEST(Segment, ForReadersIsWrittenByItsCreatorOnly) {
  const Segment mine = Segment::create("test", kSize, Sharing::kReadersOnly);
  mine.data()[5] = std::byte{9};
  const Segment theirs = Segment::map(dup(mine.descriptor()), kSize, Access::kReadOnly);
  EXPECT_EQ(theirs.data()[5], std::byte{9});
  mine.data()[5] = std::byte{10};  // the first mapping goes on writing
  EXPECT_EQ(theirs.data()[5], std::byte{10});

  EXPECT_THROW(Segment::map(dup(mine.descriptor()), kSize, Access::kReadWrite), std::system_error);
  // nor by the ways round it: more rights for the mapping, or writing to the file
  EXPECT_EQ(mprotect(theirs.data(), kSize, PROT_READ | PROT_WRITE), -1);
  EXPECT_EQ(errno, EACCES);
  EXPECT_EQ(pwrite(mine.descriptor(), "x", 1, 5), -1);
  EXPECT_EQ(errno, EPERM);
  EXPECT_EQ(theirs.data()[5], std::byte{10});
}

TEST(Segment, SmallerThanAnnouncedIsRefused) {
  const Segment segment = Segment::create("test", kSize, Sharing::kWriters);
  const std::size_t before = open_descriptors();
  EXPECT_THROW(Segment::map(dup(segment.descriptor()), kSize + 1, Access::kReadOnly), std::system_error);
  EXPECT_THROW(Segment::map(-1, kSize, Access::kReadOnly), std::system_error);
  EXPECT_EQ(open_descriptors(), before);  // it took the descriptor over all the same
}

TEST(Segment, HasWholePages) {
  for (const std::size_t size : {0, 1, 4095, 4096}) {
    const Segment segment = Segment::create("test", size, Sharing::kWriters);
    EXPECT_EQ(segment.size(), 4096U) << size;
  }
  EXPECT_EQ(Segment::create("test", 4097, Sharing::kWriters).size(), 8192U);
}

TEST(Segment, LargerThanAnyMemoryIsRefused) {
  const std::size_t before = open_descriptors();
  EXPECT_THROW(Segment::create("test", std::size_t{1} << 62, Sharing::kWriters), std::system_error);
  EXPECT_EQ(open_descriptors(), before);
}

TEST(Segment, ClosesWhatItOwnsOnce) {
  const std::size_t before = open_descriptors();
  {
    Segment first = Segment::create("test", kSize, Sharing::kWriters);
    const std::byte* place = first.data();
    Segment second(std::move(first));
    EXPECT_EQ(second.data(), place);
    Segment third;
    third = std::move(second);
    EXPECT_EQ(third.data(), place);
    EXPECT_EQ(open_descriptors(), before + 1);
  }
  EXPECT_EQ(open_descriptors(), before);
}

// ---- descriptors over a socket ------------------------------------------------------------------

TEST(SegmentSocket, CarriesASegmentAndWhatItIsFor) {
  const Sockets sockets;
  const Segment mine = Segment::create("test", kSize, Sharing::kReadersOnly);
  mine.data()[0] = std::byte{42};
  ASSERT_TRUE(send_segment(sockets.ends[0], {SegmentRole::kState, 0, 3, mine.size()}, mine.descriptor()));
  SegmentMessage message{};
  const int descriptor = receive_segment(sockets.ends[1], &message);
  ASSERT_GE(descriptor, 0);
  EXPECT_EQ(message.role, SegmentRole::kState);
  EXPECT_EQ(message.generation, 3U);
  EXPECT_EQ(message.size, kSize);
  EXPECT_EQ(fcntl(descriptor, F_GETFD) & FD_CLOEXEC, FD_CLOEXEC);
  const Segment theirs = Segment::map(descriptor, message.size, Access::kReadOnly);
  EXPECT_EQ(theirs.data()[0], std::byte{42});
}

TEST(SegmentSocket, KeepsTheOrder) {
  const Sockets sockets;
  const Segment segment = Segment::create("test", kSize, Sharing::kWriters);
  for (std::uint64_t generation = 1; generation <= 5; ++generation)
    ASSERT_TRUE(send_segment(sockets.ends[0], {SegmentRole::kResponse, 0, generation, kSize}, segment.descriptor()));
  for (std::uint64_t generation = 1; generation <= 5; ++generation) {
    SegmentMessage message{};
    const int descriptor = receive_segment(sockets.ends[1], &message);
    ASSERT_GE(descriptor, 0);
    close(descriptor);
    EXPECT_EQ(message.generation, generation);
  }
}

TEST(SegmentSocket, APeerThatIsGoneIsSeen) {
  Sockets sockets;
  const Segment segment = Segment::create("test", kSize, Sharing::kWriters);
  sockets.hang_up(1);
  EXPECT_FALSE(send_segment(sockets.ends[0], {SegmentRole::kState, 0, 1, kSize}, segment.descriptor()));
  SegmentMessage message{};
  EXPECT_EQ(receive_segment(sockets.ends[0], &message), -1);
}

TEST(SegmentSocket, SomethingElseIsRefusedAndNothingLeaks) {
  const Sockets sockets;
  const Segment segment = Segment::create("test", kSize, Sharing::kWriters);
  const std::size_t before = open_descriptors();
  struct Packet {
    std::size_t size, copies;
  };
  for (const Packet& packet : {
           Packet{sizeof(SegmentMessage), 0},      // no descriptor
           Packet{sizeof(SegmentMessage) - 1, 1},  // too short
           Packet{sizeof(SegmentMessage) + 1, 1},  // too long
           Packet{1, 0},
           Packet{sizeof(SegmentMessage), 2},  // too many descriptors
           Packet{sizeof(SegmentMessage), 4},
       }) {
    ASSERT_TRUE(send_packet(sockets.ends[0], packet.size, segment.descriptor(), packet.copies));
    SegmentMessage message{};
    EXPECT_EQ(receive_segment(sockets.ends[1], &message), -1)
        << packet.size << " bytes, " << packet.copies << " descriptors";
    EXPECT_EQ(open_descriptors(), before) << packet.size << " bytes, " << packet.copies << " descriptors";
  }
  // the next good one is taken
  ASSERT_TRUE(send_segment(sockets.ends[0], {SegmentRole::kState, 0, 1, kSize}, segment.descriptor()));
  SegmentMessage message{};
  const int descriptor = receive_segment(sockets.ends[1], &message);
  EXPECT_GE(descriptor, 0);
  close(descriptor);
}

TEST(SegmentSocket, ADescriptorThatIsClosedCannotBeSent) {
  const Sockets sockets;
  EXPECT_FALSE(send_segment(sockets.ends[0], {SegmentRole::kState, 0, 1, kSize}, -1));
}

}  // namespace
}  // namespace gravitas::channel
