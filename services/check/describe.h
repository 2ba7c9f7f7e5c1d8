// Which plugin the command line means, and what it says of itself.
#pragma once

#include <string>

#include "services/check/examinee.h"

namespace gravitas::check {

// Finds the plugin that `argument` names: a library, a command, or the name of an installed plugin. Throws BadInput if
// it is none of them. What it says of itself is not asked yet.
Examinee find_examinee(const std::string& argument);

// Asks it, in a process of its own. Empty, or why there is no description.
std::string describe(const Examinee& examinee, double seconds, plugin::v1::Description* description);

// Fills in what it says of itself. A command that prints no description is no plugin: BadInput. A library has the
// entry point, so that it wants to be one: what is wrong with it is `problem`.
void complete(Examinee* examinee, bool is_quick);

}  // namespace gravitas::check
