// Starting a process that has nothing of ours but what it is given, and how one ended.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace gravitas::channel {

// Starts `arguments[0]`, a path, in a process group of its own, with an empty standard input and `descriptors[i]` as its
// descriptor i + 1; all others are closed there, and stay open here. Signals are as a fresh program expects them.
// Returns 0, or the errno that says why not.
int spawn_process(const std::vector<std::string>& arguments, const std::vector<int>& descriptors, pid_t* pid);

// A pipe for its output, which it writes as if to a file: only our end does not wait. False, and errno, if there is none.
bool make_output_pipe(int* ours, int* theirs);

// Reaps a child: "ended by itself with exit code 3", "killed by signal 9 (Killed)"; empty if it has not ended.
std::string take_ending(int pidfd);

}  // namespace gravitas::channel
