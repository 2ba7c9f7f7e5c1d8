#include "services/check/plugin_file.h"

#include <elf.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string_view>
#include <system_error>

namespace gravitas::check {
namespace {

constexpr const char* kEntryPoint = "gravitas_plugin";

// Structures of an ELF file, whose numbers may be anything.
class ElfFile {
 public:
  explicit ElfFile(std::string_view bytes) : bytes_(bytes) {
    is_elf_ = read(0, &header_) && std::memcmp(header_.e_ident, ELFMAG, SELFMAG) == 0 &&
              header_.e_ident[EI_CLASS] == ELFCLASS64;
  }

  bool is_elf() const { return is_elf_; }

  // It names the program that loads it, or is linked to a fixed address.
  bool is_program() const {
    if (header_.e_type == ET_EXEC) return true;
    for (unsigned i = 0; i < header_.e_phnum; ++i) {
      Elf64_Phdr part;
      if (read(header_.e_phoff + std::uint64_t{i} * sizeof part, &part) && part.p_type == PT_INTERP) return true;
    }
    return false;
  }

  // Its dynamic symbols define the name.
  bool exports(std::string_view name) const {
    for (unsigned i = 0; i < header_.e_shnum; ++i) {
      Elf64_Shdr symbols, names;
      if (!section(i, &symbols) || symbols.sh_type != SHT_DYNSYM || !section(symbols.sh_link, &names)) continue;
      for (std::uint64_t offset = 0; offset + sizeof(Elf64_Sym) <= symbols.sh_size; offset += sizeof(Elf64_Sym)) {
        Elf64_Sym symbol;
        if (!read(symbols.sh_offset + offset, &symbol)) break;
        if (symbol.st_shndx != SHN_UNDEF && text(names.sh_offset + symbol.st_name) == name) return true;
      }
    }
    return false;
  }

 private:
  template <typename T>
  bool read(std::uint64_t offset, T* to) const {
    if (offset > bytes_.size() || bytes_.size() - offset < sizeof(T)) return false;
    std::memcpy(to, bytes_.data() + offset, sizeof(T));
    return true;
  }
  bool section(std::uint64_t index, Elf64_Shdr* to) const {
    return index < header_.e_shnum && read(header_.e_shoff + index * sizeof(Elf64_Shdr), to);
  }
  std::string_view text(std::uint64_t offset) const {
    if (offset >= bytes_.size()) return {};
    const std::string_view rest = bytes_.substr(offset);
    return rest.substr(0, rest.find('\0'));
  }

  std::string_view bytes_;
  Elf64_Ehdr header_{};
  bool is_elf_ = false;
};

}  // namespace

FileKind kind_of_file(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return FileKind::kMissing;
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  if (!file) return FileKind::kMissing;
  const bool may_run = access(path.c_str(), X_OK) == 0;
  const ElfFile elf(bytes);
  if (!elf.is_elf()) return may_run && bytes.starts_with("#!") ? FileKind::kProgram : FileKind::kOther;
  if (elf.exports(kEntryPoint)) return FileKind::kPlugin;
  return elf.is_program() && may_run ? FileKind::kProgram : FileKind::kLibrary;
}

}  // namespace gravitas::check
