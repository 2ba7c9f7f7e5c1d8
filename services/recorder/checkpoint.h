// The checkpoint file: a committed state from which a run goes on to the same chain of hashes.
//
//   magic 8 | version 4 | 0 4 | schema 8 | size of the message 8 | message | checksum 16        little-endian
//
// The message is recorder.v1.Checkpoint; `schema` is a digest of its schema, the checksum is XXH3-128 of all before it.
// A file that is cut short, damaged, edited, of another version, schema, build or scene is refused with the reason; one
// with a right checksum and wrong content is refused by Environment::restore(). No bytes make the reader crash, or
// allocate out of proportion to their number.
//
// Same build, same bits: a checkpoint of another build is refused. Hosting, threads and duration may differ.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "gravitas/recorder/v1/checkpoint.pb.h"
#include "kernel/environment.h"

namespace gravitas {

// The message of an environment's committed state. `identity`, `tally` and the decisions in force are the
// caller's.
recorder::v1::Checkpoint make_checkpoint(const kernel::Environment& environment, const recorder::v1::Identity& identity,
                                         const recorder::v1::Tally& tally,
                                         std::span<const recorder::v1::Decision> decisions = {});

// The bytes of the file. Throws std::length_error beyond 2 GiB, which a message cannot hold.
std::vector<std::byte> serialize_checkpoint(const recorder::v1::Checkpoint& checkpoint);

// The message in a file's bytes, which may be anything; nothing, and the reason in `problem`, if they are none.
std::optional<recorder::v1::Checkpoint> parse_checkpoint(std::span<const std::byte> bytes, std::string* problem);

// Why a checkpoint cannot be used by this build for a scene; empty if it can.
std::string find_obstacle(const recorder::v1::Checkpoint& checkpoint, const recorder::v1::Identity& scene);

// What Environment::restore() takes; its columns are those of the message.
kernel::SavedState saved_state_of(recorder::v1::Checkpoint* checkpoint);

}  // namespace gravitas
