// What a command line says about changes of the scene.
#pragma once

#include <string>
#include <vector>

#include "gravitas/edit/v1/edit.pb.h"

namespace gravitas {

// `add FILE`, `remove PATH` or `set PATH=VALUE` (services/scene/change.h); the file is read now. Throws BadInput with what is
// allowed.
edit::v1::Change parse_change(const std::string& text);

// Words of --edit, `CHANGE@step=N`: an edit for each step, ascending, with its changes in the order of the words.
std::vector<edit::v1::Edit> parse_edits(const std::vector<std::string>& words);

}  // namespace gravitas
