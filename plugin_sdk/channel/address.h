// Addresses at which a worker may be reached without encryption: this machine's own.
#pragma once

#include <string>
#include <string_view>

namespace gravitas::channel {

// True for "unix:PATH", "127.N.N.N:PORT", "localhost:PORT" and "[::1]:PORT".
bool is_local_address(std::string_view address);

// Connects to such an address and returns the descriptor; -1 with errno. Precondition: is_local_address().
int connect_to(const std::string& address);

}  // namespace gravitas::channel
