// What a worker process takes from itself before it loads a library: the ways out of the process, and more of the
// machine than its share. A plugin is somebody else's code, which runs as soon as its library is loaded, and need not
// be evil to fork, to write over a file or to eat all memory.
//
//   no_new_privs   no program that it could start has more rights
//   limits         address space, descriptors, no core files
//   descriptors    what it inherited by accident is closed
//   capabilities   those of root are dropped: no mount, no module, no clock, no reboot
//   Landlock       files: the libraries' folders and the system's are read, nothing is written
//   seccomp        system calls: no process is started, signalled or traced, no socket made ...
//
// The seccomp filter names what is refused and lets the rest pass. A list of what is allowed would refuse more, but which
// calls a plugin's libraries need (linear algebra, OpenMP, the next C library) is not known here, and one that is
// refused what it needs computes wrongly or not at all; files, the greater part, are Landlock's. What is refused fails
// with EPERM (Landlock: EACCES), so that a curious library goes on; clone3 does not exist (ENOSYS), since its flags
// cannot be looked at, and threads are made with clone. Left open: files of the folders that are read, its own
// descriptors (the kernel's sockets and segments), the processor (the kernel's deadlines are for that), and memory in
// files of memfd_create that are not mapped, which no limit counts.
//
// Nothing of it can be undone. Each part answers what is now enforced ("seccomp"), or why not ("no seccomp: ...").
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace gravitas::host {

inline constexpr std::uint64_t kDefaultMemoryLimit = std::uint64_t{4} << 30;  // bytes
inline constexpr std::uint64_t kDescriptorLimit = 256;

// Closes all descriptors but the standard ones and `kept`.
void close_inherited(const std::vector<int>& kept);

// The whole sandbox. Called in the first thread before there is another: Landlock binds the thread that asks and those
// that it starts. `libraries` are the files that will be loaded, `memory_limit` the address space in bytes.
std::vector<std::string> enter_sandbox(const std::vector<std::string>& libraries, std::uint64_t memory_limit);

// For a program that nothing is known of: no_new_privs, no core files, descriptors. It lasts over an exec.
std::vector<std::string> enter_bare_sandbox();

// Parts of the sandbox.
std::string restrict_files(const std::vector<std::string>& libraries);  // Landlock
std::string restrict_calls();                                           // seccomp, in all threads of the process

}  // namespace gravitas::host
