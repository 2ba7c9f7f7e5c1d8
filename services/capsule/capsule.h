// A capsule: the calls of one slot, recorded in a run, that a plugin can be asked again alone.
//
//   header: magic 8 | version 4 | 0 4 | schema hash of the stage messages 8         little-endian
//   record: size 4 | message recorder.v1.CapsuleRecord | check 8
//
// A check is XXH3-64 of the message, seeded with the check before it. A record that is not whole ends the capsule: what
// came before it can be used. Since a plugin is a pure function, each call can be asked alone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <fstream>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "gravitas/recorder/v1/capsule.pb.h"
#include "kernel/arena.h"
#include "kernel/carrier/carrier.h"
#include "plugin_sdk/message_columns.h"
#include "services/recorder/output_file.h"

namespace gravitas::capsule {

// Writes while hosts are asked, from whatever thread.
class Writer {
 public:
  // Throws as OutputFile does. What ends without a call leaves no new file.
  Writer(const std::string& path, const recorder::v1::CapsuleHeader& header,
         OutputFile::Allowed allowed = OutputFile::Allowed::kAny);

  ~Writer() { file_.discard(); }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  // Index of the plugin in the capsule.
  std::uint32_t add_plugin(const kernel::PluginChoice& plugin);
  // Throws std::system_error when the disk is full.
  void add_call(const recorder::v1::CapsuleCall& call);
  // All calls are in the file; without any, what stood there still is. Throws likewise.
  void close();
  std::uint32_t calls() const;

 private:
  std::string framed(const recorder::v1::CapsuleRecord& record);
  void put(const recorder::v1::CapsuleRecord& record);

  mutable std::mutex mutex_;
  OutputFile file_;
  std::uint64_t check_ = 0;
  std::string start_;  // until it is written, before the first record
  std::uint32_t plugins_ = 0, calls_ = 0;
};

// Reads any bytes.
class Reader {
 public:
  // Throws BadInput if the file is no capsule of this schema.
  explicit Reader(const std::string& path);

  const recorder::v1::CapsuleHeader& header() const { return header_; }
  const std::vector<recorder::v1::CapsulePlugin>& plugins() const { return plugins_; }
  // False at the end. Throws BadInput if a record contradicts its schema.
  bool next(recorder::v1::CapsuleCall* call);
  // Why the capsule ended before its file; empty: it did not.
  const std::string& note() const { return note_; }

 private:
  bool read(recorder::v1::CapsuleRecord* record);
  void check(const recorder::v1::CapsuleCall& call) const;

  const std::string path_;
  std::ifstream file_;
  std::uint64_t left_ = 0;  // bytes
  std::uint64_t check_ = 0;
  recorder::v1::CapsuleHeader header_;
  std::vector<recorder::v1::CapsulePlugin> plugins_;
  std::string note_;
};

// The method of that name ("Solver.Solve"); null if there is none.
const stage::MethodInfo* method_named(std::string_view name);

using ColumnBytes = google::protobuf::RepeatedPtrField<std::string>;

void copy_columns(const kernel::Arena& arena, std::span<const kernel::ColumnId> columns,
                  std::span<const stage::ColumnInfo> infos, ColumnBytes* to);
MessageColumns columns_of(const ColumnBytes& bytes, std::span<const stage::ColumnInfo> infos);

// The request of a call that is about to be made.
recorder::v1::CapsuleCall begin_call(const kernel::StageCall& call, const kernel::Arena& arena);

}  // namespace gravitas::capsule
