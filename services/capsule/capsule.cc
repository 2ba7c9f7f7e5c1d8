#include "services/capsule/capsule.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

#include "services/run/session.h"

namespace gravitas::capsule {

namespace v1 = recorder::v1;

namespace {

// "GRAVCAPS" read as a big-endian number.
constexpr std::uint64_t kMagic = 0x4752415643415053;
constexpr std::uint32_t kVersion = 1;

struct FileHeader {
  std::uint64_t magic = kMagic;
  std::uint32_t version = kVersion;
  std::uint32_t zero = 0;
  std::uint64_t schema_hash = stage::kSchemaHash;
};

template <typename Number>
std::string_view text_of(const Number& number) {
  return {reinterpret_cast<const char*>(&number), sizeof number};
}

}  // namespace

const stage::MethodInfo* method_named(std::string_view name) {
  for (const stage::MethodInfo& method : stage::kMethods)
    if (method.name == name) return &method;
  return nullptr;
}

void copy_columns(const kernel::Arena& arena, std::span<const kernel::ColumnId> columns,
                  std::span<const stage::ColumnInfo> infos, ColumnBytes* to) {
  to->Clear();
  for (std::size_t i = 0; i < columns.size(); ++i)
    to->Add()->assign(reinterpret_cast<const char*>(arena.data(columns[i])),
                      arena.count(columns[i]) * stage::element_size(infos[i].type));
}

MessageColumns columns_of(const ColumnBytes& bytes, std::span<const stage::ColumnInfo> infos) {
  MessageColumns columns(infos);
  std::vector<gravitas_reply_column> rooms = columns.rooms();
  for (std::size_t i = 0; i < rooms.size(); ++i)
    rooms[i].count = bytes[static_cast<int>(i)].size() / stage::element_size(infos[i].type);
  columns.resize(rooms);
  rooms = columns.rooms();
  for (std::size_t i = 0; i < rooms.size(); ++i)
    if (rooms[i].capacity > 0)
      std::memcpy(rooms[i].data, bytes[static_cast<int>(i)].data(),
                  rooms[i].capacity * stage::element_size(infos[i].type));
  return columns;
}

v1::CapsuleCall begin_call(const kernel::StageCall& call, const kernel::Arena& arena) {
  v1::CapsuleCall record;
  record.set_method(call.info().name);
  copy_columns(arena, call.request, call.info().request, record.mutable_request());
  return record;
}

Writer::Writer(const std::string& path, const v1::CapsuleHeader& header, OutputFile::Allowed allowed)
    : file_("capsule", path, allowed) {
  v1::CapsuleRecord record;
  *record.mutable_header() = header;
  start_ = std::string(text_of(FileHeader())) + framed(record);
}

std::string Writer::framed(const v1::CapsuleRecord& record) {
  const std::string bytes = record.SerializeAsString();
  const auto size = static_cast<std::uint32_t>(bytes.size());
  check_ = XXH3_64bits_withSeed(bytes.data(), bytes.size(), check_);
  return std::string(text_of(size)) + bytes + std::string(text_of(check_));
}

void Writer::put(const v1::CapsuleRecord& record) { file_.write(std::exchange(start_, {}) + framed(record)); }

std::uint32_t Writer::add_plugin(const kernel::PluginChoice& plugin) {
  v1::CapsuleRecord record;
  v1::CapsulePlugin& one = *record.mutable_plugin();
  one.set_name(plugin.declaration.name);
  one.set_version(plugin.declaration.version);
  one.set_library(plugin.library);
  one.set_command(plugin.command);
  one.mutable_settings()->Assign(plugin.settings.begin(), plugin.settings.end());
  const std::lock_guard lock(mutex_);
  put(record);
  return plugins_++;
}

void Writer::add_call(const v1::CapsuleCall& call) {
  v1::CapsuleRecord record;
  *record.mutable_call() = call;
  const std::lock_guard lock(mutex_);
  put(record);
  ++calls_;
}

void Writer::close() {
  const std::lock_guard lock(mutex_);
  if (calls_ > 0) file_.close();
}

std::uint32_t Writer::calls() const {
  const std::lock_guard lock(mutex_);
  return calls_;
}

Reader::Reader(const std::string& path) : path_(path) {
  std::error_code problem;
  if (std::filesystem::exists(path, problem) && !std::filesystem::is_regular_file(path, problem))
    throw BadInput(fmt::format("capsule '{}': it is not an ordinary file", path));
  file_.open(path, std::ios::binary);
  if (!file_) throw BadInput(fmt::format("capsule '{}': {}", path, std::strerror(errno)));
  left_ = std::filesystem::file_size(path, problem);
  if (problem) throw BadInput(fmt::format("capsule '{}': {}", path, problem.message()));
  FileHeader start;
  file_.read(reinterpret_cast<char*>(&start), sizeof start);
  if (!file_ || start.magic != kMagic || start.zero != 0) throw BadInput(fmt::format("'{}' is no capsule", path));
  if (start.version != kVersion)
    throw BadInput(fmt::format("capsule '{}' has version {}; allowed: {}", path, start.version, kVersion));
  if (start.schema_hash != stage::kSchemaHash)
    throw BadInput(fmt::format("capsule '{}' was recorded with other stage messages (schema {:016x}, here {:016x})",
                               path, start.schema_hash, stage::kSchemaHash));
  left_ -= sizeof start;
  v1::CapsuleRecord record;
  if (!read(&record) || !record.has_header())
    throw BadInput(fmt::format("capsule '{}' has no header{}", path, note_.empty() ? "" : ": " + note_));
  header_ = std::move(*record.mutable_header());
}

bool Reader::read(v1::CapsuleRecord* record) {
  if (left_ == 0 || !note_.empty()) return false;
  std::uint32_t size = 0;
  std::uint64_t check = 0;
  const auto is_cut = [&](std::uint64_t bytes) {
    if (left_ >= bytes) return false;
    note_ = "it is cut short";
    return true;
  };
  if (is_cut(sizeof size)) return false;
  file_.read(reinterpret_cast<char*>(&size), sizeof size);
  left_ -= sizeof size;
  if (is_cut(std::uint64_t{size} + sizeof check)) return false;
  std::string bytes(size, '\0');
  file_.read(bytes.data(), size);
  file_.read(reinterpret_cast<char*>(&check), sizeof check);
  left_ -= size + sizeof check;
  check_ = XXH3_64bits_withSeed(bytes.data(), bytes.size(), check_);
  if (!file_ || check != check_ || !record->ParseFromString(bytes)) {
    note_ = "a record is damaged";
    return false;
  }
  return true;
}

bool Reader::next(v1::CapsuleCall* call) {
  v1::CapsuleRecord record;
  while (read(&record)) {
    if (record.has_plugin()) plugins_.push_back(std::move(*record.mutable_plugin()));
    if (!record.has_call()) continue;
    *call = std::move(*record.mutable_call());
    check(*call);
    return true;
  }
  return false;
}

void Reader::check(const v1::CapsuleCall& call) const {
  const auto refuse = [&](const std::string& why) { throw BadInput(fmt::format("capsule '{}': {}", path_, why)); };
  const stage::MethodInfo* method = method_named(call.method());
  if (method == nullptr) refuse("a call of a method that does not exist");
  if (call.plugin() >= plugins_.size()) refuse("a call of a plugin that it does not hold");
  const auto demand = [&](const ColumnBytes& bytes, std::span<const stage::ColumnInfo> infos, const char* what) {
    if (static_cast<std::size_t>(bytes.size()) != infos.size())
      refuse(fmt::format("a {} of another number of columns", what));
    for (std::size_t i = 0; i < infos.size(); ++i)
      if (bytes[static_cast<int>(i)].size() % stage::element_size(infos[i].type) != 0)
        refuse(fmt::format("a {} with half a number", what));
  };
  demand(call.request(), method->request, "request");
  if (call.fault().empty() && call.status() == GRAVITAS_OK) demand(call.reply(), method->reply, "reply");
  const stage::MethodInfo& derivative = stage::method_info(stage::Method::kIntegratorDerivative);
  for (const v1::CapsuleDerivative& one : call.derivatives()) {
    demand(one.trial(), derivative.request, "trial state");
    demand(one.answer(), derivative.reply, "derivative");
  }
}

}  // namespace gravitas::capsule
