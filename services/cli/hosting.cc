#include "services/cli/hosting.h"

#include <fmt/format.h>

#include "plugin_sdk/channel/address.h"
#include "services/run/exchange_spec.h"

namespace gravitas::cli {
namespace {

HostingChoice parse_mode(const std::string& word, std::optional<Slot> slot, const std::string& mode) {
  if (mode.starts_with("grpc:")) {
    const std::string address = mode.substr(5);
    if (!slot)
      throw BadInput(fmt::format("--hosting {}: a worker at an address serves one slot: SLOT=grpc:ADDRESS", word));
    if (!channel::is_local_address(address))
      throw BadInput(
          fmt::format("--hosting {}: '{}' is no address of this machine; allowed, since the connection is "
                      "not encrypted: 127.0.0.1:PORT, [::1]:PORT, unix:PATH",
                      word, address));
    return {slot, kernel::Hosting::kGrpc, address};
  }
  return {slot, parse_hosting_mode("--hosting", word, mode), ""};
}

}  // namespace

std::vector<HostingChoice> parse_hosting(const std::vector<std::string>& words,
                                         const std::vector<std::string>& attached) {
  std::vector<HostingChoice> choices;
  for (const std::string& word : words) {
    const std::size_t equals = word.find('=');
    if (equals == std::string::npos) {
      choices.push_back(parse_mode(word, std::nullopt, word));
      continue;
    }
    choices.push_back(parse_mode(word, parse_slot("--hosting", word, word.substr(0, equals)), word.substr(equals + 1)));
  }
  for (const std::string& word : attached) {
    const std::size_t equals = word.find('=');
    const std::string address = equals == std::string::npos ? "" : word.substr(equals + 1);
    if (!channel::is_local_address(address))
      throw BadInput(
          fmt::format("--attach {}: allowed: SLOT=ADDRESS of a worker of this machine that listens: "
                      "127.0.0.1:PORT, [::1]:PORT or unix:PATH",
                      word));
    choices.push_back({parse_slot("--attach", word, word.substr(0, equals)), kernel::Hosting::kGrpc, address, true});
  }
  return choices;
}

}  // namespace gravitas::cli
