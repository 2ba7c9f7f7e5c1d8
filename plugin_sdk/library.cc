#include "plugin_sdk/library.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/sendfile.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <map>
#include <mutex>
#include <utility>

#include "plugin_sdk/channel/digest.h"
#include "plugin_sdk/exit_guard.h"
#include "plugin_sdk/floating_point.h"
#include "plugin_sdk/printable.h"

namespace gravitas {
namespace {

void close_keeping_errno(int descriptor) {
  const int reason = errno;
  close(descriptor);
  errno = reason;
}

// A descriptor of a regular file, or -1 with the reason in errno.
int open_regular(const std::string& path) {
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  struct stat status {};
  if (file < 0 || (fstat(file, &status) == 0 && S_ISREG(status.st_mode))) return file;
  errno = S_ISDIR(status.st_mode) ? EISDIR : EINVAL;
  close_keeping_errno(file);
  return -1;
}

// A descriptor of an anonymous copy of the file, or -1 with the reason in errno.
int private_copy(const std::string& path) {
  const int source = open_regular(path);
  struct stat status;
  if (source < 0) return -1;
  if (fstat(source, &status) != 0) {
    close_keeping_errno(source);
    return -1;
  }
  int copy = memfd_create("gravitas plugin", MFD_CLOEXEC);
  off_t offset = 0;
  while (copy >= 0 && offset < status.st_size) {
    if (sendfile(copy, source, &offset, static_cast<std::size_t>(status.st_size - offset)) <= 0) {
      close_keeping_errno(copy);
      copy = -1;
    }
  }
  close_keeping_errno(source);
  return copy;
}

std::vector<std::string> printable_texts(const char* const* texts, std::uint64_t count) {
  std::vector<std::string> all;
  for (std::uint64_t i = 0; i < count; ++i) all.push_back(printable(texts[i]));
  return all;
}

std::vector<Property> read_properties(const gravitas_property* plain, std::uint64_t count) {
  std::vector<Property> properties;
  for (std::uint64_t i = 0; i < count; ++i) {
    const gravitas_property& p = plain[i];
    Property property;
    property.name = printable(p.name);
    property.kind = static_cast<PropertyKind>(p.kind);
    property.unit = printable(p.unit);
    property.frame = printable(p.frame);
    property.meaning = printable(p.meaning);
    property.minimum = p.minimum;
    property.maximum = p.maximum;
    property.exclusive_minimum = p.exclusive_minimum != 0;
    property.is_required = p.required != 0;
    property.is_live = p.live != 0;
    property.columns = p.columns;
    property.default_numbers.assign(p.default_numbers, p.default_numbers + p.default_count);
    property.choices = printable_texts(p.choices, p.choice_count);
    properties.push_back(std::move(property));
  }
  return properties;
}

// 0 if it could not be taken.
std::uint64_t content_digest(int descriptor) {
  struct stat status;
  if (fstat(descriptor, &status) != 0 || status.st_size == 0) return 0;
  const auto size = static_cast<std::size_t>(status.st_size);
  void* bytes = mmap(nullptr, size, PROT_READ, MAP_PRIVATE, descriptor, 0);
  if (bytes == MAP_FAILED) return 0;
  channel::Digest digest;
  digest.add(bytes, size);
  munmap(bytes, size);
  return digest.value();
}

// Loads what is in `file`, which errors call `path`.
void* load(const std::string& file, const std::string& path, std::string* problem) {
  void* handle = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (handle != nullptr) return handle;
  const char* reason = dlerror();
  *problem = "'" + path + "' is not a shared library that can be loaded: " + (reason != nullptr ? reason : "?");
  return nullptr;
}

PluginLibrary checked(void* handle, const std::string& path, std::string* problem) {
  const auto entry = reinterpret_cast<gravitas_plugin_function>(dlsym(handle, "gravitas_plugin"));
  if (entry == nullptr) {
    *problem = "'" + path + "' is not a plugin: it has no function gravitas_plugin";
    return {};
  }
  const gravitas_plugin_table* table = entry();
  if (table == nullptr || table->magic != GRAVITAS_MAGIC) {
    *problem = "'" + path + "' is not a plugin: gravitas_plugin() returns no table of this interface";
    return {};
  }
  if (table->abi_version != GRAVITAS_ABI_VERSION || table->layout_version != GRAVITAS_LAYOUT_VERSION) {
    *problem = "'" + path + "' was built for version " + std::to_string(table->abi_version) + "." +
               std::to_string(table->layout_version) + " of the plugin interface; this is " +
               std::to_string(GRAVITAS_ABI_VERSION) + "." + std::to_string(GRAVITAS_LAYOUT_VERSION);
    return {};
  }
  if (table->schema_hash != stage::kSchemaHash) {
    *problem = "'" + path + "' was built for another schema of the stage contracts: rebuild it against this plugin_sdk";
    return {};
  }
  if (table->description == nullptr && table->create != nullptr) {
    void* instance = nullptr;
    gravitas_error error{};
    if (table->create(nullptr, 0, &instance, &error) != GRAVITAS_OK) {
      *problem = "'" + path + "' does not say what it is: its declaration failed: " + error_text(error);
      return {};
    }
  }
  if (table->description == nullptr || table->create == nullptr || table->destroy == nullptr ||
      table->call == nullptr) {
    *problem = "'" + path + "' is not a whole plugin: its table lacks a description or a function";
    return {};
  }
  PluginLibrary library;
  library.table = table;
  library.declaration = read_declaration(*table->description);
  return library;
}

// The same, unless the library changed the floating-point environment while it was loaded: `control` is that of before, which
// is back after this.
PluginLibrary checked(void* handle, std::uint32_t control, const std::string& path, std::string* problem) {
  PluginLibrary library = checked(handle, path, problem);
  if (!restore_floating_point_control(control) || library.table == nullptr) return library;
  *problem = "'" + path +
             "' changes the floating-point environment of the process that loads it: it was probably linked with "
             "-ffast-math or -Ofast; link it without";
  return {};
}

}  // namespace

PluginDeclaration read_declaration(const gravitas_description& plain) {
  PluginDeclaration declaration;
  declaration.name = printable(plain.name);
  declaration.version = printable(plain.version);
  declaration.meaning = printable(plain.meaning);
  declaration.slot = static_cast<Slot>(plain.slot);
  declaration.capabilities = printable_texts(plain.capabilities, plain.capability_count);
  for (std::uint64_t i = 0; i < plain.type_count; ++i) {
    const gravitas_type& type = plain.types[i];
    declaration.types.push_back(
        {printable(type.name), printable(type.meaning), read_properties(type.properties, type.property_count)});
    for (std::uint64_t k = 0; k < type.coordinate_count; ++k) {
      const gravitas_coordinate& coordinate = type.coordinates[k];
      declaration.types.back().coordinates.push_back(
          {printable(coordinate.name), printable(coordinate.unit), printable(coordinate.meaning)});
    }
  }
  declaration.properties = read_properties(plain.properties, plain.property_count);
  declaration.theta = plain.theta;
  return declaration;
}

PluginLibrary load_plugin_library(const std::string& path, std::string* problem) {
  const int copy = private_copy(path);
  if (copy < 0) {
    *problem = "cannot read '" + path + "': " + std::strerror(errno);
    return {};
  }
  // the same content is loaded once: no library is ever unloaded, so each load more would be kept for ever
  static std::mutex mutex;
  static std::map<std::uint64_t, PluginLibrary> loaded;
  const std::lock_guard lock(mutex);
  const std::uint64_t content = content_digest(copy);
  if (const auto known = loaded.find(content); content != 0 && known != loaded.end()) {
    close(copy);
    return known->second;
  }
  const std::uint32_t control = floating_point_control();
  const ExitGuard guard(path.c_str());
  // the descriptor stays open: debuggers and sanitizers read symbols through this name, which for a debugger must not be one of its
  // own files (`self`), where it may wait for ever
  void* handle = load("/proc/" + std::to_string(getpid()) + "/fd/" + std::to_string(copy), path, problem);
  if (handle == nullptr) {
    close(copy);
    return {};
  }
  ExitGuard::listen_first();
  PluginLibrary library = checked(handle, control, path, problem);
  if (library.table != nullptr && content != 0) loaded.emplace(content, library);
  return library;
}

std::string error_text(const gravitas_error& error) {
  return printable({error.text, strnlen(error.text, sizeof error.text)});
}

std::string create_instance(const PluginLibrary& library, std::span<const double> settings, void** instance) {
  const std::uint32_t control = floating_point_control();
  gravitas_error error{};
  const ExitGuard guard(library.declaration.name.c_str());
  const std::int32_t status = library.table->create(settings.data(), settings.size(), instance, &error);
  const bool is_changed = restore_floating_point_control(control);
  if (status != GRAVITAS_OK) return error.text[0] == '\0' ? "it failed without a reason" : error_text(error);
  if (!is_changed) return {};
  destroy_instance(library, *instance);
  return "its constructor changed the floating-point environment";
}

std::int32_t call_instance(const PluginLibrary& library, void* instance, std::uint32_t method,
                           const gravitas_column* request, gravitas_reply_column* reply, const gravitas_host* host,
                           gravitas_error* error) {
  const ExitGuard guard(library.declaration.name.c_str());
  return library.table->call(instance, method, request, reply, host, error);
}

void destroy_instance(const PluginLibrary& library, void* instance) {
  const ExitGuard guard(library.declaration.name.c_str());
  const std::uint32_t control = floating_point_control();
  library.table->destroy(instance);
  restore_floating_point_control(control);
}

PluginLibrary look_into_plugin_library(const std::string& path, std::string* problem) {
  const int file = open_regular(path);
  if (file < 0) {
    *problem = "cannot read '" + path + "': " + std::strerror(errno);
    return {};
  }
  close(file);
  const std::uint32_t control = floating_point_control();
  // without a slash it would be looked for elsewhere
  void* handle = load(path.find('/') == std::string::npos ? "./" + path : path, path, problem);
  return handle == nullptr ? PluginLibrary() : checked(handle, control, path, problem);
}

}  // namespace gravitas
