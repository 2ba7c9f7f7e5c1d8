// Reads the schemas and writes the column views of the stage contracts, so that the .proto files are the one
// place where a column is declared; refuses numeric fields without unit or frame.
//
//   frame_compiler --proto-root schemas --out stage_frames.h    generate
//   frame_compiler --proto-root schemas --hash                  print the schema hash
//   frame_compiler --proto-root schemas --lint FILE...          check units and frames, print findings, exit 1 if any
#include <google/protobuf/compiler/importer.h>
#include <google/protobuf/descriptor.h>

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "gravitas/options/v1/options.pb.h"
#include "schemas/frame/layout.h"

namespace {

namespace pb = google::protobuf;
namespace options = gravitas::options::v1;

// Options of a field with the extensions of options.proto readable: the importer leaves them as unknown fields.
pb::FieldOptions field_options(const pb::FieldDescriptor& field) {
  pb::FieldOptions parsed;
  parsed.ParseFromString(field.options().SerializeAsString());
  return parsed;
}

bool is_numeric(const pb::FieldDescriptor& field) {
  using Kind = pb::FieldDescriptor::CppType;
  const Kind kind = field.cpp_type();
  return kind != Kind::CPPTYPE_STRING && kind != Kind::CPPTYPE_MESSAGE && kind != Kind::CPPTYPE_ENUM &&
         kind != Kind::CPPTYPE_BOOL;
}

class ErrorPrinter : public pb::compiler::MultiFileErrorCollector {
 public:
  void AddError(const std::string& file, int line, int column, const std::string& text) override {
    std::cerr << file << ':' << line + 1 << ':' << column + 1 << ": " << text << '\n';
  }
};

// ---- lint ----------------------------------------------------------------------------------------------

void lint_message(const pb::Descriptor& message, std::vector<std::string>* findings) {
  for (int i = 0; i < message.field_count(); ++i) {
    const pb::FieldDescriptor& field = *message.field(i);
    if (!is_numeric(field)) continue;
    const pb::FieldOptions about = field_options(field);
    const std::string unit = about.GetExtension(options::unit);
    if (unit.empty()) findings->push_back(field.full_name() + ": a number without a unit");
    const bool is_real = field.cpp_type() == pb::FieldDescriptor::CPPTYPE_DOUBLE;
    const bool is_vector = about.GetExtension(options::components) > 1 || about.GetExtension(options::length) > 1 ||
                           (field.is_repeated() && about.GetExtension(options::rows).empty());
    if (is_real && is_vector && about.GetExtension(options::frame).empty())
      findings->push_back(field.full_name() + ": a vector without a frame");
  }
  for (int i = 0; i < message.nested_type_count(); ++i) lint_message(*message.nested_type(i), findings);
}

// ---- generation ----------------------------------------------------------------------------------------

struct Column {
  std::string name, element, rows, unit, frame;
  unsigned components = 1, rows_index = 255, extra = 0;
  bool is_scalar = false, asset = false;
};

std::string element_type(const pb::FieldDescriptor& field) {
  switch (field.type()) {
    case pb::FieldDescriptor::TYPE_DOUBLE:
      return "double";
    case pb::FieldDescriptor::TYPE_UINT32:
      return "std::uint32_t";
    case pb::FieldDescriptor::TYPE_UINT64:
      return "std::uint64_t";
    default:
      return "";
  }
}

std::string pascal_case(const std::string& snake) {
  std::string out;
  bool upper = true;
  for (const char c : snake) {
    if (c == '_') {
      upper = true;
    } else {
      out += upper ? static_cast<char>(std::toupper(static_cast<unsigned char>(c))) : c;
      upper = false;
    }
  }
  return out;
}

// Row words of one method, numbered in the order of their first appearance.
using RowNumbers = std::map<std::string, unsigned>;

bool read_columns(const pb::Descriptor& message, RowNumbers* rows, std::vector<Column>* columns) {
  for (int i = 0; i < message.field_count(); ++i) {
    const pb::FieldDescriptor& field = *message.field(i);
    // what travels beside the columns (call.proto)
    if (field.type() == pb::FieldDescriptor::TYPE_MESSAGE && !field.is_repeated()) continue;
    const pb::FieldOptions about = field_options(field);
    Column column;
    column.asset = about.GetExtension(options::asset);
    column.name = field.name();
    column.element = element_type(field);
    column.rows = about.GetExtension(options::rows);
    column.unit = about.GetExtension(options::unit);
    column.frame = about.GetExtension(options::frame);
    column.components = std::max(1U, about.GetExtension(options::components));
    column.is_scalar = !field.is_repeated();
    if (column.element.empty() || column.is_scalar != column.rows.empty() || field.number() != i + 1) {
      std::cerr << field.full_name() << ": a column is double, uint32 or uint64, repeated exactly if it names "
                << "its rows, and numbered in order\n";
      return false;
    }
    if (!column.is_scalar) {
      std::string word = column.rows;
      if (word.size() > 2 && word.ends_with("+1")) {
        column.extra = 1;
        word.resize(word.size() - 2);
      }
      column.rows_index = rows->try_emplace(word, static_cast<unsigned>(rows->size())).first->second;
    }
    columns->push_back(column);
  }
  if (columns->size() <= GRAVITAS_MAX_COLUMNS) return true;
  std::cerr << message.full_name() << ": " << columns->size() << " columns, a frame has room for "
            << GRAVITAS_MAX_COLUMNS << '\n';
  return false;
}

void write_info(std::ostream& out, const std::string& array, const std::vector<Column>& columns) {
  out << "inline constexpr ColumnInfo " << array << "[] = {\n";
  for (const Column& c : columns) {
    const char* type = c.element == "double" ? "kF64" : c.element == "std::uint32_t" ? "kU32" : "kU64";
    out << "    {\"" << c.name << "\", ElementType::" << type << ", " << c.components << ", " << c.rows_index << ", "
        << c.extra << ", " << (c.asset ? "true" : "false") << ", \"" << c.rows << "\", \"" << c.unit << "\", \""
        << c.frame << "\"},\n";
  }
  out << "};\n";
}

void write_column_enum(std::ostream& out, const std::vector<Column>& columns) {
  out << "  enum Column : std::uint32_t {";
  for (const Column& c : columns) out << "\n    k" << pascal_case(c.name) << ',';
  out << "\n    kColumnCount\n  };\n";
}

void write_request(std::ostream& out, const std::string& name, const std::vector<Column>& columns) {
  out << "class " << name << " {\n public:\n";
  write_column_enum(out, columns);
  out << "  explicit " << name << "(const gravitas_column* columns) : columns_(columns) {}\n";
  for (const Column& c : columns) {
    const std::string k = "columns_[k" + pascal_case(c.name) + "]";
    if (c.is_scalar) {
      out << "  " << c.element << ' ' << c.name << "() const { return *static_cast<const " << c.element << "*>(" << k
          << ".data); }\n";
    } else {
      out << "  std::span<const " << c.element << "> " << c.name << "() const { return {static_cast<const " << c.element
          << "*>(" << k << ".data), " << k << ".count}; }\n";
    }
  }
  out << "  // As the C interface has them, in the order of Column.\n"
         "  const gravitas_column* plain() const { return columns_; }\n";
  out << "\n private:\n  const gravitas_column* columns_;\n};\n\n";
}

void write_reply(std::ostream& out, const std::string& name, const std::vector<Column>& columns) {
  out << "class " << name << " {\n public:\n";
  write_column_enum(out, columns);
  out << "  explicit " << name << "(gravitas_reply_column* columns) : columns_(columns) {}\n";
  for (const Column& c : columns) {
    out << "  ReplyColumn<" << c.element << "> " << c.name << "() const { return ReplyColumn<" << c.element
        << ">(&columns_[k" << pascal_case(c.name) << "]); }\n";
  }
  out << "\n private:\n  gravitas_reply_column* columns_;\n};\n\n";
}

// FNV-1a, 64 bits.
std::uint64_t hash_text(const std::string& text, std::uint64_t hash) {
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
  return hash;
}

std::uint64_t schema_hash(const std::vector<const pb::FileDescriptor*>& files) {
  std::uint64_t hash = 0xcbf29ce484222325ULL;
  for (const pb::FileDescriptor* file : files) hash = hash_text(file->DebugString(), hash);
  return hash;
}

int generate(const std::vector<const pb::FileDescriptor*>& files, const std::string& out_path) {
  std::ostringstream classes, infos, methods, table;
  unsigned method_number = 0;
  std::set<std::string> written;
  for (const pb::FileDescriptor* file : files) {
    for (int s = 0; s < file->service_count(); ++s) {
      const pb::ServiceDescriptor& service = *file->service(s);
      for (int m = 0; m < service.method_count(); ++m) {
        const pb::MethodDescriptor& method = *service.method(m);
        const std::string name = service.name() + method.name();
        RowNumbers rows;
        std::vector<Column> request, reply;
        if (!read_columns(*method.input_type(), &rows, &request) || !read_columns(*method.output_type(), &rows, &reply))
          return 1;
        write_info(infos, "k" + name + "RequestColumns", request);
        write_info(infos, "k" + name + "ReplyColumns", reply);
        // two methods may ask with the same message
        if (written.insert(method.input_type()->name()).second)
          write_request(classes, method.input_type()->name(), request);
        write_reply(classes, method.output_type()->name(), reply);
        methods << "  k" << name << " = " << method_number++ << ",\n";
        table << "    {\"" << service.name() << '.' << method.name() << "\", \"/" << service.full_name() << '/'
              << method.name() << "\", k" << name << "RequestColumns, k" << name << "ReplyColumns, " << rows.size()
              << "},\n";
      }
    }
  }
  std::ofstream out(out_path);
  out << "// Written by schemas/frame_compiler.cc from schemas/gravitas/stage/v1/*.proto. Do not edit.\n#pragma "
         "once\n\n"
      << "#include <cstdint>\n#include <span>\n\n#include \"schemas/frame/column.h\"\n#include "
         "\"schemas/frame/layout.h\"\n\n"
      << "namespace gravitas::stage {\n\n"
      << "// Hash of the stage schemas: two sides with different hashes do not talk.\n"
      << "inline constexpr std::uint64_t kSchemaHash = 0x" << std::hex << schema_hash(files) << std::dec << "ULL;\n\n"
      << "enum class Method : std::uint32_t {\n"
      << methods.str() << "};\ninline constexpr std::uint32_t kMethodCount = " << method_number << ";\n\n"
      << infos.str() << "\ninline constexpr MethodInfo kMethods[] = {\n"
      << table.str() << "};\n\n"
      << "constexpr const MethodInfo& method_info(Method method) { return "
         "kMethods[static_cast<std::uint32_t>(method)]; }\n\n"
      << classes.str() << "}  // namespace gravitas::stage\n";
  return out.good() ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  std::string root, out;
  bool lint = false, hash = false;
  std::vector<std::string> names;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument == "--proto-root" && i + 1 < argc) {
      root = argv[++i];
    } else if (argument == "--out" && i + 1 < argc) {
      out = argv[++i];
    } else if (argument == "--lint") {
      lint = true;
    } else if (argument == "--hash") {
      hash = true;
    } else {
      names.push_back(argument);
    }
  }
  if (root.empty() || (out.empty() && !lint && !hash)) {
    std::cerr << "usage: frame_compiler --proto-root DIR (--out FILE | --hash | --lint PROTO...)\n";
    return 2;
  }
  if (!lint)
    names = {"gravitas/stage/v1/space.proto",      "gravitas/stage/v1/collision.proto",
             "gravitas/stage/v1/constraint.proto", "gravitas/stage/v1/force.proto",
             "gravitas/stage/v1/integrator.proto", "gravitas/stage/v1/solver.proto"};

  pb::compiler::DiskSourceTree tree;
  tree.MapPath("", root);
  tree.MapPath("", "/usr/include");
  ErrorPrinter errors;
  pb::compiler::Importer importer(&tree, &errors);
  std::vector<const pb::FileDescriptor*> files;
  for (const std::string& name : names) {
    const pb::FileDescriptor* file = importer.Import(name);
    if (file == nullptr) return 1;
    files.push_back(file);
  }
  if (hash) {
    std::cout << "0x" << std::hex << schema_hash(files) << '\n';
    return 0;
  }
  if (!lint) return generate(files, out);

  std::vector<std::string> findings;
  for (const pb::FileDescriptor* file : files)
    for (int i = 0; i < file->message_type_count(); ++i) lint_message(*file->message_type(i), &findings);
  for (const std::string& finding : findings) std::cout << finding << '\n';
  return findings.empty() ? 0 : 1;
}
