#include "plugin_sdk/channel/address.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <string>

namespace gravitas::channel {
namespace {

// Closes what did not come about, and keeps errno.
int give_up(int descriptor) {
  const int problem = errno;
  if (descriptor >= 0) close(descriptor);
  errno = problem;
  return -1;
}

int connect_unix(const std::string& path) {
  const std::optional<sockaddr_un> address = unix_address(path);
  if (!address) return -1;
  const int descriptor = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (descriptor >= 0 && connect(descriptor, reinterpret_cast<const sockaddr*>(&*address), sizeof *address) == 0)
    return descriptor;
  return give_up(descriptor);
}

int connect_tcp(const std::string& address) {
  const Resolved found = resolve(address);
  int descriptor = -1;
  for (const addrinfo* one = found.get(); one != nullptr && descriptor < 0; one = one->ai_next) {
    descriptor = socket(one->ai_family, one->ai_socktype | SOCK_CLOEXEC, one->ai_protocol);
    if (descriptor >= 0 && connect(descriptor, one->ai_addr, one->ai_addrlen) != 0) descriptor = give_up(descriptor);
  }
  const int yes = 1;
  if (descriptor >= 0) setsockopt(descriptor, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  return descriptor;
}

}  // namespace

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

std::optional<sockaddr_un> unix_address(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) {
    errno = ENAMETOOLONG;
    return std::nullopt;
  }
  path.copy(address.sun_path, path.size());
  return address;
}

int probe_unix(const std::string& path) {
  const std::optional<sockaddr_un> address = unix_address(path);
  const int asking = address ? socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0) : -1;
  const bool reached =
      asking >= 0 && connect(asking, reinterpret_cast<const sockaddr*>(&*address), sizeof *address) == 0;
  const int problem = reached || errno == EAGAIN || errno == EINPROGRESS ? 0 : errno;
  if (asking >= 0) close(asking);
  return problem;
}

Resolved resolve(const std::string& address) {
  const std::size_t colon = address.rfind(':');
  std::string host = address.substr(0, colon);
  if (host.starts_with('[')) host = host.substr(1, host.size() - 2);
  addrinfo hints{}, *found = nullptr;
  hints.ai_socktype = SOCK_STREAM;
  const bool is_found = getaddrinfo(host.c_str(), address.substr(colon + 1).c_str(), &hints, &found) == 0;
  if (!is_found) errno = EADDRNOTAVAIL;
  return {is_found ? found : nullptr, freeaddrinfo};
}

int connect_to(const std::string& address) {
  return address.starts_with("unix:") ? connect_unix(address.substr(5)) : connect_tcp(address);
}

void prepare_for_grpc(int descriptor) {
  fcntl(descriptor, F_SETFL, fcntl(descriptor, F_GETFL) | O_NONBLOCK);
  const int room = 1 << 22;
  setsockopt(descriptor, SOL_SOCKET, SO_SNDBUF, &room, sizeof room);
}

}  // namespace gravitas::channel
