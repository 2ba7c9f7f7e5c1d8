// What options refuse before anything is done, each with what it allows.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <limits>
#include <string>

namespace gravitas::cli {

// A whole number from `least` to `most`.
CLI::Validator whole_number(std::uint64_t least, std::uint64_t most = std::numeric_limits<std::uint32_t>::max());

// A number; `allowed` says of what, and which: "a number of seconds > 0". Its range is for the command to judge.
CLI::Validator any_number(const std::string& allowed);

// A finite number that is not negative.
CLI::Validator number_from_zero();

// A number of seconds from `least` to `most`.
CLI::Validator seconds_between(double least, double most);

// A number of seconds > 0.
CLI::Validator positive_seconds();

// No option of a command or its sub-commands takes an empty value, which would count as one that is left out, nor "-", which
// other programs take for a standard stream.
void refuse_meaningless_values(CLI::App* app);

}  // namespace gravitas::cli
