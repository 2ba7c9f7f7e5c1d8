// The command that goes on from a checkpoint.
#pragma once

#include <string>
#include <vector>

#include "services/run/session.h"

namespace gravitas {

// `gravitas run` with the scene, how far, where plugins live (`hosting_words`) and what was ordered, not the files it wrote:
// edits and swaps that were made are known in the checkpoint.
std::string resume_command(const RunOptions& options, const std::vector<std::string>& hosting_words,
                           const std::string& checkpoint);

}  // namespace gravitas
