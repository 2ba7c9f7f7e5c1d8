// The socket of a worker that listens at an address of this machine. The worker makes it before it gives up the right
// to make any (sandbox.h), and takes the connections itself; gRPC never sees the address.
#pragma once

#include <grpcpp/grpcpp.h>

#include <string>

namespace gravitas::host {

// Listens at the address (plugin_sdk/channel/address.h); the port 0 lets the system choose one. The socket at a
// "unix:PATH" that nobody listens at any more is replaced, any other file is not. Returns the socket, or -1 and why in `problem`.
int listen_at(const std::string& address, std::string* problem);

// The address with the port that the socket has.
std::string address_of(int listening, const std::string& address);

// Hands each connection to the server, in a thread that lives as long as the process.
void take_connections(int listening, grpc::Server* server);

}  // namespace gravitas::host
