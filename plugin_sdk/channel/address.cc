#include "plugin_sdk/channel/address.h"

#include <arpa/inet.h>

#include <algorithm>
#include <cctype>
#include <string>

namespace gravitas::channel {

bool is_local_address(std::string_view address) {
  if (address.starts_with("unix:")) return address.size() > 5;
  const std::size_t colon = address.rfind(':');
  if (colon == std::string_view::npos) return false;
  const std::string_view port = address.substr(colon + 1);
  const auto is_digit = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; };
  if (port.empty() || port.size() > 5 || !std::ranges::all_of(port, is_digit) || std::stoi(std::string(port)) > 65535)
    return false;
  const std::string host(address.substr(0, colon));
  if (host == "localhost" || host == "[::1]") return true;
  in_addr number{};
  return inet_pton(AF_INET, host.c_str(), &number) == 1 && (ntohl(number.s_addr) >> 24) == 127;
}

}  // namespace gravitas::channel
