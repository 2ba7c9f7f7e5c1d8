#include "plugin_sdk/channel/segment.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#ifndef F_SEAL_FUTURE_WRITE
#define F_SEAL_FUTURE_WRITE 0x0010
#endif

namespace gravitas::channel {
namespace {

[[noreturn]] void fail(const char* what) { throw std::system_error(errno, std::generic_category(), what); }

}  // namespace

Segment::~Segment() {
  if (data_ != nullptr) munmap(data_, size_);
  if (descriptor_ >= 0) close(descriptor_);
}

Segment Segment::create(const char* name, std::size_t size, Sharing sharing) {
  constexpr std::size_t kPage = 4096;
  size = round_up(std::max(size, std::size_t{1}), kPage);
  Segment segment;
  segment.descriptor_ = memfd_create(name, MFD_CLOEXEC | MFD_ALLOW_SEALING);
  if (segment.descriptor_ < 0) fail("memfd_create");
  if (ftruncate(segment.descriptor_, static_cast<off_t>(size)) != 0) fail("ftruncate of shared memory");
  void* data = mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED, segment.descriptor_, 0);
  if (data == MAP_FAILED) fail("mmap of shared memory");
  segment.data_ = static_cast<std::byte*>(data);
  segment.size_ = size;
  const int readers = sharing == Sharing::kReadersOnly ? F_SEAL_FUTURE_WRITE : 0;
  if (fcntl(segment.descriptor_, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | readers | F_SEAL_SEAL) != 0)
    fail("sealing of shared memory");
  return segment;
}

Segment Segment::map(int descriptor, std::size_t size, Access access) {
  Segment segment;
  segment.descriptor_ = descriptor;
  struct stat status;
  if (fstat(descriptor, &status) != 0) fail("fstat of shared memory");
  if (static_cast<std::size_t>(status.st_size) < size) {
    errno = EMSGSIZE;
    fail("shared memory smaller than announced");
  }
  const int protection = access == Access::kReadOnly ? PROT_READ : PROT_READ | PROT_WRITE;
  void* data = mmap(nullptr, size, protection, MAP_SHARED, descriptor, 0);
  if (data == MAP_FAILED) fail("mmap of shared memory");
  segment.data_ = static_cast<std::byte*>(data);
  segment.size_ = size;
  close(std::exchange(segment.descriptor_, -1));
  return segment;
}

bool send_segment(int socket, const SegmentMessage& message, int descriptor) {
  iovec part = {const_cast<SegmentMessage*>(&message), sizeof message};
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int))] = {};
  msghdr packet = {};
  packet.msg_iov = &part;
  packet.msg_iovlen = 1;
  packet.msg_control = control;
  packet.msg_controllen = sizeof control;
  cmsghdr* rights = CMSG_FIRSTHDR(&packet);
  rights->cmsg_level = SOL_SOCKET;
  rights->cmsg_type = SCM_RIGHTS;
  rights->cmsg_len = CMSG_LEN(sizeof(int));
  std::memcpy(CMSG_DATA(rights), &descriptor, sizeof descriptor);
  ssize_t sent = 0;
  do {
    sent = sendmsg(socket, &packet, MSG_NOSIGNAL);
  } while (sent < 0 && errno == EINTR);
  return sent == static_cast<ssize_t>(sizeof message);
}

int receive_segment(int socket, SegmentMessage* message) {
  iovec part = {message, sizeof *message};
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int))] = {};
  msghdr packet = {};
  packet.msg_iov = &part;
  packet.msg_iovlen = 1;
  packet.msg_control = control;
  packet.msg_controllen = sizeof control;
  ssize_t received = 0;
  do {
    received = recvmsg(socket, &packet, MSG_CMSG_CLOEXEC);
  } while (received < 0 && errno == EINTR);
  const cmsghdr* rights = received > 0 ? CMSG_FIRSTHDR(&packet) : nullptr;
  if (rights == nullptr || rights->cmsg_level != SOL_SOCKET || rights->cmsg_type != SCM_RIGHTS) return -1;

  // the room for one descriptor is padded, so that two may have come
  int descriptors[CMSG_SPACE(sizeof(int)) / sizeof(int)] = {};
  const std::size_t bytes = rights->cmsg_len - CMSG_LEN(0), count = bytes / sizeof(int);
  std::memcpy(descriptors, CMSG_DATA(rights), bytes);
  const bool whole = (packet.msg_flags & (MSG_TRUNC | MSG_CTRUNC)) == 0;
  if (whole && count == 1 && received == static_cast<ssize_t>(sizeof *message)) return descriptors[0];
  for (std::size_t i = 0; i < count; ++i) close(descriptors[i]);
  return -1;
}

}  // namespace gravitas::channel
