// The repository as the structure checks see it: a list of text files, and what is wrong with them.
//
// A check is a plain function from a tree to findings. Each is run twice in the tests: on this
// repository, where it must find nothing, and on a small tree made to break the rule, where it must
// find exactly that. Otherwise a check that went blind would pass for ever.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace gravitas::structure {

/// The folders at the top of the repository that hold its parts.
inline constexpr std::string_view kRooms[] = {"schemas",  "plugin_sdk", "kernel", "workers",
                                              "services", "tests",      "deploy"};

/// A place that breaks a rule.
struct Finding {
  std::string path;    ///< relative to the root of the tree
  int line = 0;        ///< counted from 1; 0 when the file as a whole, or its absence, is meant
  std::string reason;  ///< what is wrong, in words for the person who has to mend it
};

/// A folder and the files in it that belong to the repository.
struct SourceTree {
  std::filesystem::path root;
  std::vector<std::string> files;  ///< relative to root, sorted, '/' as separator; each exists
};

/// The files that git tracks under `root`. Without git, or where it tracks nothing yet, every file
/// under `root` but those in build/ and .git/.
SourceTree tree_of_repository(const std::filesystem::path& root);

/// Every file under `root` but those in build/ and .git/.
SourceTree tree_of_folder(const std::filesystem::path& root);

/// The lines of a file of the tree, without their ends.
std::vector<std::string> lines_of(const SourceTree& tree, const std::string& path);

/// What `without_comments` does with the inside of "strings" and 'characters'.
enum class Literals { kKeep, kBlank };

/// C++ lines with every comment and raw string blanked out, and the other literals too if asked.
/// Lines and columns stay where they are. A backslash that joins two lines is not looked through.
std::vector<std::string> without_comments(const std::vector<std::string>& lines, Literals literals);

/// The first folder of a path, or the path itself where it has none.
std::string room_of(std::string_view path);

/// True for the sources and headers of C++.
bool is_cpp(std::string_view path);

/// One line per finding, "path:line: reason"; empty when there are none.
std::string report(const std::vector<Finding>& findings);

}  // namespace gravitas::structure
