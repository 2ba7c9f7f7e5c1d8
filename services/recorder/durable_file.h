// Files that are whole or not there: a crash, a power cut or a full disk leaves the previous content.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <system_error>
#include <vector>

namespace gravitas {

// Writes all bytes to a file descriptor; throws std::system_error naming `what`.
void write_all(int file, std::span<const std::byte> bytes, const std::string& what);

// Whether an open ordinary file is no longer the one of that name: it was removed, moved or replaced.
bool has_lost_its_name(int file, const std::string& path);

// An error of the disk (full, broken) rather than of a name.
bool is_disk_error(const std::error_code& code);

// Of the file that replaces one: PATH.tmp.
std::string fresh_name_of(const std::string& path);

// Puts `bytes` into the place of the file: writes fresh_name_of(path), in the same folder, fsync, rename, fsync of the folder.
// On failure throws std::system_error naming the file; what was at `path` is still there, and PATH.tmp is gone.
void replace_file(const std::string& path, std::span<const std::byte> bytes);

// Writes a text where a damaged old one is no loss. Throws std::system_error naming `what` and the file.
void write_text_file(const std::string& path, const std::string& text, const std::string& what);

// All bytes of a regular file. Throws std::system_error, or std::runtime_error if it is no regular file.
std::vector<std::byte> read_whole_file(const std::string& path);

}  // namespace gravitas
