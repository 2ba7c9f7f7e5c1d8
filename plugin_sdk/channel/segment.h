// A piece of memory shared between processes: an anonymous file with a fixed size, sealed so that neither side
// can shrink it under the other (that would be SIGBUS), mapped on both sides.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>

namespace gravitas::channel {

// The next multiple of `unit`.
constexpr std::size_t round_up(std::size_t value, std::size_t unit) { return (value + unit - 1) / unit * unit; }

enum class Access { kReadOnly, kReadWrite };

// Who may write the segment besides its creator.
enum class Sharing {
  kReadersOnly,  // sealed against new writable mappings: workers can only read
  kWriters
};

class Segment {
 public:
  Segment() = default;
  Segment(Segment&& other) noexcept { swap(other); }
  Segment& operator=(Segment&& other) noexcept {
    swap(other);
    return *this;
  }
  ~Segment();

  // A new segment of whole pages, at least one, zeroed and mapped for reading and writing. Throws std::system_error.
  static Segment create(const char* name, std::size_t size, Sharing sharing);
  // Maps a segment received from its creator and closes the descriptor. Throws std::system_error, also if the
  // file is smaller than `size`.
  static Segment map(int descriptor, std::size_t size, Access access);

  std::byte* data() const { return data_; }
  std::size_t size() const { return size_; }
  // Of one that was created here; -1 of one that was received.
  int descriptor() const { return descriptor_; }

 private:
  void swap(Segment& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    std::swap(descriptor_, other.descriptor_);
  }

  std::byte* data_ = nullptr;
  std::size_t size_ = 0;
  int descriptor_ = -1;
};

// What a segment is for, in the messages of a descriptor channel.
enum class SegmentRole : std::uint32_t { kKernelMailbox = 1, kWorkerMailbox = 2, kState = 3, kResponse = 4 };

struct SegmentMessage {
  SegmentRole role;
  std::uint32_t reserved;
  std::uint64_t generation;
  std::uint64_t size;
};

// Sends a segment's descriptor over a SEQPACKET socket. False if the peer is gone.
bool send_segment(int socket, const SegmentMessage& message, int descriptor);

// Receives the next segment. Returns its descriptor, or -1 if the peer is gone or sent something else.
int receive_segment(int socket, SegmentMessage* message);

}  // namespace gravitas::channel
