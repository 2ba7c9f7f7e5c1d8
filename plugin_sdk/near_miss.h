// What to say about a name that is not known: which known name it was probably meant to be, and
// which names are allowed. Scene reader, property checks and command line all say it through these
// functions, so that a slip is answered in the same words everywhere.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace gravitas {

// The candidate with the fewest single-character slips (insertion, deletion, replacement, exchange
// of neighbours; upper and lower case count as equal) from `given`, the first of equals; empty if
// even that one needs more than a third of the longer name's characters (one is always allowed).
std::string nearest_name(std::string_view given, std::span<const std::string> candidates);

// `"A", "B", "C"` in the order given; beyond twelve names "… (37 in all)".
std::string quoted_names(std::span<const std::string> names);

// `did you mean "Radius"? Allowed: "Radius", "Height"`, without the question where nothing is near;
// `none is allowed here` where there is no candidate.
std::string allowed_names(std::string_view given, std::span<const std::string> candidates);

}  // namespace gravitas
