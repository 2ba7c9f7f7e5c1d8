// Structure and numbers of answers, stage by stage: what holds whatever the method, at no more than a look at each row.
// The kernel demands it of every answer; physics_checks.h goes on from there.
//
// Preconditions: check_rows() and first_not_finite() of checks.h have passed. Each returns the first thing that is
// wrong, as a sentence that begins with the column's name; `text` is empty if all is well.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "plugin_sdk/abi.h"
#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/physics_checks.h"
#include "schemas/stage_frames.h"

namespace gravitas {

struct AnswerProblem {
  bool is_structure = false;  // ids, order, uniqueness; else a number
  std::string text;
};

// "column position is longer than its room: answered 600 numbers, room for 300".
std::string too_long(const stage::ColumnInfo& column, std::uint64_t count, std::uint64_t capacity);

// The same of the first column of a reply that is, before anything of it is read; empty: all fit.
std::string overfull_column(std::span<const stage::ColumnInfo> infos, const gravitas_reply_column* reply);

// Pairs (a, b): a < b, both with a shape, one movable (flags of body.h), ascending, each once.
AnswerProblem check_pairs(std::span<const std::uint32_t> pair, std::span<const std::uint32_t> flags);

// Contacts that are remembered from a step to the next, by their bodies (2 a row): two that can touch, ascending by
// (bodies, feature), each once; no negative correction.
AnswerProblem check_remembered_contacts(std::span<const std::uint32_t> body, std::span<const std::uint32_t> feature,
                                        std::span<const double> correction, std::span<const std::uint32_t> flags);

// Impacts of `pairs` pairs: at most one a pair, ascending; fractions in 0 … 1; unit normals.
AnswerProblem check_impact_rows(std::span<const std::uint32_t> pair, std::span<const double> fraction,
                                std::span<const double> normal, std::uint64_t pairs);

// Contacts of `pairs` pairs: ascending by (pair, feature), each once; unit normals.
AnswerProblem check_contact_rows(std::span<const std::uint32_t> pair, std::span<const std::uint32_t> feature,
                                 std::span<const double> normal, std::uint64_t pairs);

// Blocks of a Jacobian, by (wrench of body, state of body), in a column of that name: at most `most`, of bodies that exist.
AnswerProblem check_block_rows(const char* column, std::span<const std::uint32_t> block_body, std::uint64_t bodies,
                               std::uint64_t most);

// Flags of body.h that a force may give its wrenches.
AnswerProblem check_wrench_flags(std::span<const std::uint32_t> flags);

// Where each joint's part of `numbers` bound numbers begins, and where the last ends.
AnswerProblem check_bound_begin(std::span<const std::uint32_t> begin, std::uint64_t numbers);

// Discrepancies of joints that are intact (1), in the order of the joints; known modes, correction in 0 … 1, lower <=
// upper, nothing negative that cannot be, unit axes.
AnswerProblem check_discrepancy_rows(std::span<const std::uint32_t> constraint, std::span<const std::uint32_t> intact,
                                     const DiscrepancyColumns& rows);

// Multipliers: contacts push along unit directions, with no more friction of each kind than their material allows;
// one-sided axes too.
AnswerProblem check_multipliers(const SolutionColumns& answer, std::span<const double> material,
                                std::span<const std::uint32_t> mode);

}  // namespace gravitas
