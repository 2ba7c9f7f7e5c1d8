// Addresses at which a worker may be reached without encryption: this machine's own.
#pragma once

#include <netdb.h>
#include <sys/un.h>

#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace gravitas::channel {

// True for "unix:PATH", "127.N.N.N:PORT", "localhost:PORT" and "[::1]:PORT".
bool is_local_address(std::string_view address);

// Of a path; nothing, and ENAMETOOLONG, if it is too long.
std::optional<sockaddr_un> unix_address(const std::string& path);

// 0 if somebody listens on the socket at this path, if only with a full queue; else the error: ECONNREFUSED if the socket
// was left behind by somebody who is gone.
int probe_unix(const std::string& path);

// What a HOST:PORT stands for; null, and EADDRNOTAVAIL, if nothing.
using Resolved = std::unique_ptr<addrinfo, void (*)(addrinfo*)>;
Resolved resolve(const std::string& address);

// Connects to such an address and returns the descriptor; -1 with errno. Precondition: is_local_address().
int connect_to(const std::string& address);

// Makes a connected socket ready for gRPC: it does not block, and takes large messages whole as far as the system allows
// (in parts, the receiver is woken for each; measured: 2 to 5 % of a call with 10,000 bodies).
void prepare_for_grpc(int descriptor);

}  // namespace gravitas::channel
