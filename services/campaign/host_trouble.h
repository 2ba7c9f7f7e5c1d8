// Trouble that comes from the machine rather than from a worker, for as long as an object lives. None of it may show.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <thread>

namespace gravitas::campaign {

// A signal every 0.3 ms, whose handler does nothing: system calls of this process end with EINTR all the time.
class SignalStorm {
 public:
  SignalStorm();
  ~SignalStorm();
  SignalStorm(const SignalStorm&) = delete;
  SignalStorm& operator=(const SignalStorm&) = delete;

 private:
  std::jthread thread_;
};

// Environment variables of a proxy that is not there and of a locale with decimal commas, which workers inherit.
class ForeignSurroundings {
 public:
  ForeignSurroundings();
  ~ForeignSurroundings();
  ForeignSurroundings(const ForeignSurroundings&) = delete;
  ForeignSurroundings& operator=(const ForeignSurroundings&) = delete;

 private:
  std::map<std::string, std::optional<std::string>> before_;
};

// Lets a stopped process go on after so many seconds, if it is still there.
std::jthread continue_later(int process, double seconds);

}  // namespace gravitas::campaign
