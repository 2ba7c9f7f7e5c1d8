#include "plugin_sdk/host/listener.h"

#include <grpcpp/server_posix.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <thread>

#include "plugin_sdk/channel/address.h"

namespace gravitas::host {
namespace {

// Pause when no connection can be taken, as for want of descriptors.
constexpr std::chrono::milliseconds kPause{50};

// A socket of the family, listening at the address; -1 with errno.
int listen_on(const sockaddr* address, socklen_t size) {
  const int listening = socket(address->sa_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (listening < 0) return -1;
  const int yes = 1;
  if (address->sa_family != AF_UNIX) {
    setsockopt(listening, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    // connections inherit it
    setsockopt(listening, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  }
  if (bind(listening, address, size) == 0 && listen(listening, SOMAXCONN) == 0) return listening;
  const int problem = errno;
  close(listening);
  errno = problem;
  return -1;
}

// Its file gets the name when somebody listens there already: whoever sees it can connect.
int listen_unix(const std::string& path) {
  const std::string unnamed = path + "." + std::to_string(getpid());
  const std::optional<sockaddr_un> address = channel::unix_address(unnamed);
  if (!address) return -1;
  unlink(unnamed.c_str());
  const int listening = listen_on(reinterpret_cast<const sockaddr*>(&*address), sizeof *address);
  if (listening < 0) return -1;
  bool is_named = link(unnamed.c_str(), path.c_str()) == 0;
  struct stat found {};
  if (!is_named && lstat(path.c_str(), &found) == 0) {
    // a socket may have been left behind by a worker that was killed; any other file is somebody's
    is_named = S_ISSOCK(found.st_mode) && channel::probe_unix(path) == ECONNREFUSED &&
               rename(unnamed.c_str(), path.c_str()) == 0;
    if (!is_named) errno = EADDRINUSE;
  } else if (!is_named) {
    // a file system without links
    is_named = rename(unnamed.c_str(), path.c_str()) == 0;
  }
  const int problem = errno;
  unlink(unnamed.c_str());
  if (is_named) return listening;
  close(listening);
  errno = problem;
  return -1;
}

int listen_tcp(const std::string& address) {
  const channel::Resolved found = channel::resolve(address);
  int listening = -1;
  for (const addrinfo* one = found.get(); one != nullptr && listening < 0; one = one->ai_next)
    listening = listen_on(one->ai_addr, one->ai_addrlen);
  return listening;
}

}  // namespace

int listen_at(const std::string& address, std::string* problem) {
  if (!channel::is_local_address(address)) {
    *problem = "--listen " + address +
               ": the connection is not encrypted, so only this machine is allowed: 127.0.0.1:PORT, [::1]:PORT or "
               "unix:PATH";
    return -1;
  }
  const int listening = address.starts_with("unix:") ? listen_unix(address.substr(5)) : listen_tcp(address);
  if (listening < 0)
    *problem = "cannot listen at " + address + ": " + std::strerror(errno) + ": is it a free address of this machine?";
  return listening;
}

std::string address_of(int listening, const std::string& address) {
  if (address.starts_with("unix:")) return address;
  sockaddr_storage bound{};
  socklen_t size = sizeof bound;
  getsockname(listening, reinterpret_cast<sockaddr*>(&bound), &size);
  const std::uint16_t port = bound.ss_family == AF_INET6 ? reinterpret_cast<const sockaddr_in6*>(&bound)->sin6_port
                                                         : reinterpret_cast<const sockaddr_in*>(&bound)->sin_port;
  return address.substr(0, address.rfind(':') + 1) + std::to_string(ntohs(port));
}

void take_connections(int listening, grpc::Server* server) {
  std::thread([=] {
    for (;;) {
      const int connection = accept4(listening, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
      if (connection >= 0) {
        grpc::AddInsecureChannelFromFd(server, connection);
      } else {
        std::this_thread::sleep_for(kPause);
      }
    }
  }).detach();
}

}  // namespace gravitas::host
