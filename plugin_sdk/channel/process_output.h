// What a process writes on its standard output and standard error, as lines, within bounds: one that writes without
// end is read on and counted, and neither waits for us nor fills our memory.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <vector>

namespace gravitas::channel {

enum class OutputStream : std::size_t { kStdout, kStderr };

// Not safe across threads.
class ProcessOutput {
 public:
  // Bytes that are held until they are taken, with what a line costs besides its text; each stream has half.
  static constexpr std::size_t kMostBytes = 65536;
  // A longer line is cut.
  static constexpr std::size_t kLongestLine = 4096;

  void add(OutputStream stream, std::string_view bytes);
  // The stream has ended: what stands behind its last line end is a line too.
  void end(OutputStream stream);

  // The lines since the last time, "stdout: TEXT" and "stderr: TEXT", in the order in which they were read. What found
  // no room is counted: "stdout: ... and 123456 more bytes dropped". What is neither printable nor UTF-8 is a '?'.
  std::vector<std::string> take();

  // The last line of standard error that is not blank, or the summary if a sanitizer wrote one; behind up to three indented
  // lines that lead to it, since these say where: `File "w.py", line 3 / f( / ^ / SyntaxError: …`. Taken or not.
  std::string last_words() const;

 private:
  struct Stream {
    std::string begun;  // a line without its end
    std::size_t held = 0;
    std::uint64_t dropped = 0;  // since a line found no room: all of them
  };
  void add_line(OutputStream stream);
  void note_last_words(const std::string& line);

  std::array<Stream, 2> streams_;
  std::vector<std::string> lines_;
  std::string last_words_;
  std::deque<std::string> indented_;  // before them
};

}  // namespace gravitas::channel
