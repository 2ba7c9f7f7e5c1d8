#include "services/check/process_use.h"

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <system_error>

namespace gravitas::check {
namespace {

std::uint32_t entries(const std::string& folder) {
  std::error_code error;
  std::uint32_t count = 0;
  for (std::filesystem::directory_iterator one(folder, error), end; !error && one != end; one.increment(error)) ++count;
  if (error) throw std::runtime_error(fmt::format("{} cannot be read: {}", folder, error.message()));
  return count;
}

}  // namespace

ProcessUse use_of(int process_id) {
  const std::string folder = fmt::format("/proc/{}", process_id);
  std::ifstream memory(folder + "/statm");
  std::uint64_t all = 0, resident = 0;
  if (!(memory >> all >> resident)) throw std::runtime_error(fmt::format("there is no process {}", process_id));
  return {resident * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE)), entries(folder + "/fd"),
          entries(folder + "/task")};
}

}  // namespace gravitas::check
