// The compiler of the stage contracts: what its lint finds in good and bad schemas, what it refuses
// to generate from, what the schema hash depends on, and the header that this build was made with.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "schemas/stage_frames.h"
#include "tests/paths.h"

namespace gravitas {
namespace {

namespace fs = std::filesystem;
using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

const fs::path kSchemas = in_source("/schemas");

std::string read_file(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

void write_file(const fs::path& path, const std::string& text) {
  fs::create_directories(path.parent_path());
  std::ofstream(path) << text;
}

struct Outcome {
  int exit_code;
  std::string words;  // both of its outputs
};

Outcome frame_compiler(const std::string& arguments) {
  FILE* pipe = popen((in_shell(in_build("/bin/frame_compiler")) + " " + arguments + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return {-1, "popen failed"};
  Outcome outcome{0, ""};
  for (int c = fgetc(pipe); c != EOF; c = fgetc(pipe)) outcome.words += static_cast<char>(c);
  const int status = pclose(pipe);
  outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return outcome;
}

// A folder of protos of the test's own, gone at the end.
class FrameCompiler : public testing::Test {
 protected:
  FrameCompiler() {
    std::string name = (fs::temp_directory_path() / "gravitas_schemas_XXXXXX").string();
    if (mkdtemp(name.data()) != nullptr) folder_ = name;
  }
  ~FrameCompiler() override { fs::remove_all(folder_); }

  // A proto file with our options, and what the lint says about it.
  Outcome lint(const std::string& messages) {
    fs::create_directories(folder_ / "gravitas/options/v1");
    fs::copy_file(kSchemas / "gravitas/options/v1/options.proto", folder_ / "gravitas/options/v1/options.proto",
                  fs::copy_options::overwrite_existing);
    write_file(folder_ / "bad.proto",
               "syntax = \"proto3\";\npackage gravitas.bad.v1;\n"
               "import \"gravitas/options/v1/options.proto\";\n" +
                   messages);
    return frame_compiler("--proto-root " + folder_.string() + " --lint bad.proto");
  }

  // Generates from the schemas of the tree with `from` in `file` replaced by `to`.
  Outcome generate(const std::string& file = "", const std::string& from = "", const std::string& to = "") {
    fs::remove_all(folder_ / "gravitas");
    fs::copy(kSchemas / "gravitas", folder_ / "gravitas", fs::copy_options::recursive);
    if (!file.empty()) {
      const fs::path path = folder_ / "gravitas/stage/v1" / file;
      std::string text = read_file(path);
      const std::size_t place = text.find(from);
      EXPECT_NE(place, std::string::npos) << from << " is not in " << file;
      if (place != std::string::npos) text.replace(place, from.size(), to);
      write_file(path, text);
    }
    return frame_compiler("--proto-root " + folder_.string() + " --out " + header().string());
  }

  std::string generated_hash() const {
    std::smatch match;
    const std::string text = read_file(header());
    return std::regex_search(text, match, std::regex("kSchemaHash = (0x[0-9a-f]+)ULL")) ? match[1].str() : "none";
  }

  fs::path header() const { return folder_ / "stage_frames.h"; }

  fs::path folder_;
};

// ---- lint --------------------------------------------------------------------------------------

TEST_F(FrameCompiler, LintFindsNothingInTheSchemasOfTheTree) {
  std::string names;
  int count = 0;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(kSchemas)) {
    if (entry.path().extension() != ".proto") continue;
    names += " " + fs::relative(entry.path(), kSchemas).string();
    ++count;
  }
  ASSERT_GE(count, 12);
  const Outcome outcome = frame_compiler("--proto-root " + in_shell(kSchemas) + " --lint" + names);
  EXPECT_EQ(outcome.words, "");
  EXPECT_EQ(outcome.exit_code, 0);
}

TEST_F(FrameCompiler, LintWantsAUnitOnEveryNumber) {
  const Outcome outcome = lint(R"(
    message Parcel {
      double weight = 1;
      repeated uint32 stamp = 2 [(options.v1.rows) = "stamp"];
      string street = 3;
      bool fragile = 4;
      message Content { int32 count = 1; float price = 2 [(options.v1.unit) = "1"]; }
      Content content = 5;
    })");
  EXPECT_EQ(outcome.words,
            "gravitas.bad.v1.Parcel.weight: a number without a unit\n"
            "gravitas.bad.v1.Parcel.stamp: a number without a unit\n"
            "gravitas.bad.v1.Parcel.Content.count: a number without a unit\n");
  EXPECT_EQ(outcome.exit_code, 1);
}

TEST_F(FrameCompiler, LintWantsAFrameOnEveryVector) {
  const Outcome outcome = lint(R"(
    message Arrow {
      repeated double tip = 1 [(options.v1.unit) = "m", (options.v1.rows) = "arrow", (options.v1.components) = 3];
      repeated double list = 2 [(options.v1.unit) = "m", (options.v1.length) = 3];
      repeated double loose = 3 [(options.v1.unit) = "m"];
      repeated double length = 4 [(options.v1.unit) = "m", (options.v1.rows) = "arrow"];
      repeated uint32 ends = 5 [(options.v1.unit) = "index", (options.v1.rows) = "arrow", (options.v1.components) = 2];
      repeated double good = 6 [(options.v1.unit) = "m", (options.v1.frame) = "world", (options.v1.rows) = "arrow", (options.v1.components) = 3];
    })");
  EXPECT_EQ(outcome.words,
            "gravitas.bad.v1.Arrow.tip: a vector without a frame\n"
            "gravitas.bad.v1.Arrow.list: a vector without a frame\n"
            "gravitas.bad.v1.Arrow.loose: a vector without a frame\n");
  EXPECT_EQ(outcome.exit_code, 1);
}

TEST_F(FrameCompiler, LintAcceptsAGoodMessage) {
  const Outcome outcome = lint(R"(
    message Parcel { double weight = 1 [(options.v1.unit) = "kg"]; string street = 2; })");
  EXPECT_EQ(outcome.words, "");
  EXPECT_EQ(outcome.exit_code, 0);
}

TEST_F(FrameCompiler, LintSaysWhereAFileIsNoProto) {
  const Outcome outcome = lint("message Parcel {\n  double = 1;\n}");
  EXPECT_THAT(outcome.words, StartsWith("bad.proto:5:10: "));
  EXPECT_EQ(outcome.exit_code, 1);
  const Outcome missing = frame_compiler("--proto-root " + in_shell(kSchemas) + " --lint nothing/here.proto");
  EXPECT_THAT(missing.words, HasSubstr("nothing/here.proto"));
  EXPECT_EQ(missing.exit_code, 1);
}

TEST_F(FrameCompiler, AWrongCallShowsTheUsage) {
  for (const std::string arguments : {"", "--lint x.proto", "--proto-root /tmp"}) {
    const Outcome outcome = frame_compiler(arguments);
    EXPECT_THAT(outcome.words, StartsWith("usage: frame_compiler")) << arguments;
    EXPECT_EQ(outcome.exit_code, 2) << arguments;
  }
}

// ---- generation --------------------------------------------------------------------------------

constexpr const char* kNoColumn =
    ": a column is double, uint32 or uint64, repeated exactly if it names its rows, and numbered "
    "in order\n";

TEST_F(FrameCompiler, GeneratesTheHeaderOfThisBuild) {
  const Outcome outcome = generate();
  EXPECT_EQ(outcome.words, "");
  ASSERT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(read_file(header()), read_file(in_build("/generated/schemas/stage_frames.h")));
  std::ostringstream hash;
  hash << "0x" << std::hex << stage::kSchemaHash;
  EXPECT_EQ(generated_hash(), hash.str());
}

TEST_F(FrameCompiler, RefusesAColumnOutOfOrder) {
  const Outcome outcome = generate("space.proto", "repeated uint32 pair = 1",  //
                                   "repeated uint32 pair = 2");
  EXPECT_EQ(outcome.words, std::string("gravitas.stage.v1.SpacePairsReply.pair") + kNoColumn);
  EXPECT_EQ(outcome.exit_code, 1);
}

TEST_F(FrameCompiler, RefusesAColumnWithoutRows) {
  const Outcome outcome = generate("space.proto", "(options.v1.rows) = \"pair\", ", "");
  EXPECT_EQ(outcome.words, std::string("gravitas.stage.v1.SpacePairsReply.pair") + kNoColumn);
  EXPECT_EQ(outcome.exit_code, 1);
}

TEST_F(FrameCompiler, RefusesRowsOfASingleValue) {
  const Outcome outcome = generate("force.proto", "double time = 1 [(options.v1.unit) = \"s\"]",
                                   "double time = 1 [(options.v1.unit) = \"s\", "
                                   "(options.v1.rows) = \"body\"]");
  EXPECT_EQ(outcome.words, std::string("gravitas.stage.v1.ForceWrenchesRequest.time") + kNoColumn);
  EXPECT_EQ(outcome.exit_code, 1);
}

TEST_F(FrameCompiler, RefusesATypeThatIsNoColumn) {
  const Outcome outcome = generate("space.proto", "repeated uint32 flags = 3", "repeated sint32 flags = 3");
  EXPECT_EQ(outcome.words, std::string("gravitas.stage.v1.SpacePairsRequest.flags") + kNoColumn);
  EXPECT_EQ(outcome.exit_code, 1);
}

TEST_F(FrameCompiler, RefusesMoreColumnsThanAFrameHas) {
  std::string columns = "message SpacePairsReply {\n";
  for (int i = 1; i <= GRAVITAS_MAX_COLUMNS + 1; ++i)
    columns += "  uint32 c" + std::to_string(i) + " = " + std::to_string(i) + " [(options.v1.unit) = \"1\"];\n";
  const Outcome outcome = generate("space.proto", "message SpacePairsReply {", columns + "}\nmessage Unused {");
  EXPECT_EQ(outcome.words, "gravitas.stage.v1.SpacePairsReply: 49 columns, a frame has room for 48\n");
  EXPECT_EQ(outcome.exit_code, 1);
}

TEST_F(FrameCompiler, AFolderThatCannotBeWrittenIsAnError) {
  const Outcome outcome =
      frame_compiler("--proto-root " + in_shell(kSchemas) + " --out " + (folder_ / "no/such/folder.h").string());
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_FALSE(fs::exists(folder_ / "no"));
}

TEST_F(FrameCompiler, TheHashIsThatOfTheContractNotOfItsComments) {
  std::ostringstream text;
  text << "0x" << std::hex << stage::kSchemaHash;
  const std::string hash = text.str();
  ASSERT_EQ(generate("space.proto", "// Slot `space`", "// The slot `space`").exit_code, 0);
  EXPECT_EQ(generated_hash(), hash);

  struct Change {
    const char *file, *from, *to;
  };
  std::set<std::string> hashes = {hash};
  for (const Change& change : {
           Change{"space.proto", "repeated uint32 flags", "repeated uint64 flags"},
           Change{"space.proto", "double lower", "double lowest"},
           Change{"space.proto", "(options.v1.components) = 2", "(options.v1.components) = 3"},
           Change{"space.proto", "(options.v1.rows) = \"pair\"", "(options.v1.rows) = \"couple\""},
           Change{"force.proto", "(options.v1.unit) = \"kg\"", "(options.v1.unit) = \"g\""},
           Change{"solver.proto", "(options.v1.frame) = \"body\"", "(options.v1.frame) = \"world\""},
       }) {
    ASSERT_EQ(generate(change.file, change.from, change.to).exit_code, 0) << change.to;
    EXPECT_TRUE(hashes.insert(generated_hash()).second) << change.to << " changes nothing";
  }
}

// ---- the header of this build -------------------------------------------------------------------

std::vector<std::span<const stage::ColumnInfo>> messages_of(const stage::MethodInfo& method) {
  return {method.request, method.reply};
}

TEST(StageFrames, EveryMessageFitsAFrameAndNamesItsColumnsOnce) {
  EXPECT_EQ(std::size(stage::kMethods), stage::kMethodCount);
  for (const stage::MethodInfo& method : stage::kMethods) {
    for (const auto columns : messages_of(method)) {
      EXPECT_GE(columns.size(), 1U) << method.name;
      EXPECT_LE(columns.size(), std::size_t{GRAVITAS_MAX_COLUMNS}) << method.name;
      std::set<std::string> names;
      for (const stage::ColumnInfo& column : columns)
        EXPECT_TRUE(names.insert(column.name).second) << method.name << '.' << column.name;
    }
  }
}

TEST(StageFrames, EveryColumnHasAUnitAndEveryRowWordANumber) {
  for (const stage::MethodInfo& method : stage::kMethods) {
    for (const auto columns : messages_of(method)) {
      for (const stage::ColumnInfo& column : columns) {
        const std::string name = std::string(method.name) + '.' + column.name;
        EXPECT_STRNE(column.unit, "") << name;
        EXPECT_GE(column.components, 1U) << name;
        const bool is_scalar = column.rows_index == stage::kScalar;
        EXPECT_EQ(is_scalar, std::string(column.rows).empty()) << name;
        if (!is_scalar) {
          EXPECT_LT(column.rows_index, method.row_words) << name;
        }
        EXPECT_EQ(column.extra == 1, std::string(column.rows).ends_with("+1")) << name;
      }
    }
  }
}

TEST(StageFrames, ColumnsWithOneRowWordHaveOneNumber) {
  for (const stage::MethodInfo& method : stage::kMethods) {
    std::set<std::pair<std::string, int>> pairs;
    std::set<std::string> words;
    for (const auto columns : messages_of(method)) {
      for (const stage::ColumnInfo& column : columns) {
        if (column.rows_index == stage::kScalar) continue;
        std::string word = column.rows;
        if (column.extra == 1) word.resize(word.size() - 2);
        pairs.emplace(word, column.rows_index);
        words.insert(word);
      }
    }
    EXPECT_EQ(pairs.size(), words.size()) << method.name;
    EXPECT_EQ(words.size(), method.row_words) << method.name;
  }
}

TEST(StageFrames, MethodsAreNumberedAsTheyAreListed) {
  const auto name = [](stage::Method method) {
    return std::string(stage::kMethods[static_cast<std::uint32_t>(method)].name);
  };
  EXPECT_EQ(name(stage::Method::kSpacePairs), "Space.Pairs");
  EXPECT_EQ(name(stage::Method::kSpaceRays), "Space.Rays");
  EXPECT_EQ(name(stage::Method::kSpaceDebugGeometry), "Space.DebugGeometry");
  EXPECT_EQ(name(stage::Method::kCollisionManifolds), "Collision.Manifolds");
  EXPECT_EQ(name(stage::Method::kCollisionTimesOfImpact), "Collision.TimesOfImpact");
  EXPECT_EQ(name(stage::Method::kCollisionRays), "Collision.Rays");
  EXPECT_EQ(name(stage::Method::kCollisionDebugGeometry), "Collision.DebugGeometry");
  EXPECT_EQ(name(stage::Method::kConstraintBind), "Constraint.Bind");
  EXPECT_EQ(name(stage::Method::kConstraintDiscrepancies), "Constraint.Discrepancies");
  EXPECT_EQ(name(stage::Method::kConstraintCoordinates), "Constraint.Coordinates");
  EXPECT_EQ(name(stage::Method::kForceWrenches), "Force.Wrenches");
  EXPECT_EQ(name(stage::Method::kIntegratorIntegrate), "Integrator.Integrate");
  EXPECT_EQ(name(stage::Method::kIntegratorDerivative), "Integrator.Derivative");
  EXPECT_EQ(name(stage::Method::kSolverSolve), "Solver.Solve");
  EXPECT_EQ(name(stage::Method::kSolverReactions), "Solver.Reactions");
}

TEST(StageFrames, PackagesCarryAMajorVersionAndMatchTheirFolder) {
  int files = 0;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(kSchemas)) {
    if (entry.path().extension() != ".proto") continue;
    ++files;
    const std::string text = read_file(entry.path());
    std::smatch match;
    ASSERT_TRUE(std::regex_search(text, match, std::regex("\npackage ([a-z0-9_.]+);"))) << entry.path();
    const std::string package = match[1];
    EXPECT_TRUE(std::regex_match(package, std::regex("gravitas\\.[a-z_]+\\.v[1-9][0-9]*")))
        << entry.path() << ": " << package;
    std::string folder = fs::relative(entry.path().parent_path(), kSchemas).string();
    for (char& c : folder)
      if (c == '/') c = '.';
    EXPECT_EQ(package, folder) << entry.path();
  }
  EXPECT_GE(files, 12);
}

}  // namespace
}  // namespace gravitas
