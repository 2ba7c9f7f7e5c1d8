// Where a served run listens: a Unix socket in a folder that only its user can enter. Whoever can reach the socket
// controls the run; file permissions are the only guard.
#pragma once

#include <string>
#include <vector>

namespace gravitas::control {

// The place of a socket; the server that listens there makes the socket itself.
class ServerSocket {
 public:
  // Makes a folder `gravitas-serve-XXXXXX` (mode 0700) in $XDG_RUNTIME_DIR, or in /tmp where that is not set; or, if
  // `path` is not empty, takes that path. A socket that a server left behind there is removed. Throws BadInput if the
  // path is too long, or something stands there.
  explicit ServerSocket(const std::string& path);
  // Removes the socket, and the folder that was made.
  ~ServerSocket();
  ServerSocket(const ServerSocket&) = delete;
  ServerSocket& operator=(const ServerSocket&) = delete;

  const std::string& path() const { return path_; }

 private:
  std::string folder_;  // that was made; else empty
  std::string path_;
};

// Sockets of this user's servers that answer, sorted. Folders of others, and what dead servers left, are passed over.
std::vector<std::string> find_servers();

}  // namespace gravitas::control
