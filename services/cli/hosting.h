// `--hosting MODE` and `--hosting SLOT=MODE`.
#pragma once

#include <string>
#include <vector>

#include "services/run/session.h"

namespace gravitas::cli {

// Throws BadInput, naming what is allowed.
std::vector<HostingChoice> parse_hosting(const std::vector<std::string>& words,
                                         const std::vector<std::string>& attached = {});

}  // namespace gravitas::cli
