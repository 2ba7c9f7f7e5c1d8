// The catalogue, with a stand-in for the worker program: a script that writes what it is told to.
#include "services/catalog/catalog.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "plugin_sdk/host/description_message.h"
#include "services/catalog/describe_process.h"
#include "tests/paths.h"

namespace gravitas {
namespace {

namespace files = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

PluginDeclaration declare(Slot slot, const std::string& name, const std::vector<std::string>& types = {}) {
  PluginDeclaration declaration;
  declaration.name = name;
  declaration.version = "1";
  declaration.slot = slot;
  declaration.meaning = "Serves a test.";
  for (const std::string& type : types)
    declaration.types.push_back(
        {type, "A type.", {Property::number("Size", "m").above(0.0).required().means("How large.")}});
  return declaration;
}

class CatalogTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = files::temp_directory_path() / ("gravitas_catalog_" + std::to_string(::getpid()) + '_' +
                                              testing::UnitTest::GetInstance()->current_test_info()->name());
    files::create_directories(folder_ / "plugins");
  }
  void TearDown() override { files::remove_all(folder_); }

  // A program that runs these lines of shell.
  std::string program(const std::string& lines) const {
    const std::string path = (folder_ / "worker").string();
    std::ofstream(path) << "#!/bin/sh\n" << lines << '\n';
    ::chmod(path.c_str(), 0755);
    return path;
  }

  // A program that writes this answer, and its arguments to the file "arguments".
  std::string answering(const plugin::v1::Catalog& answer) const {
    std::ofstream(folder_ / "answer", std::ios::binary) << answer.SerializeAsString();
    return program("echo \"$@\" > " + (folder_ / "arguments").string() + "\ncat " + (folder_ / "answer").string());
  }

  std::string library(const std::string& name) const {
    const files::path path = folder_ / "plugins" / name;
    std::ofstream(path) << "no real library";
    return path.string();
  }

  std::string plugins() const { return (folder_ / "plugins").string(); }

  files::path folder_;
};

plugin::v1::Catalog answer_of(const std::vector<PluginDeclaration>& declarations) {
  plugin::v1::Catalog answer;
  for (const PluginDeclaration& declaration : declarations)
    *answer.add_entries()->mutable_description() = host::to_message(declaration);
  return answer;
}

TEST_F(CatalogTest, AsksOnceAboutAllLibrariesInOrder) {
  const std::string b = library("b.so"), a = library("a.so");
  library("notes.txt");
  const std::string worker =
      answering(answer_of({declare(Slot::kForce, "Winds", {"Wind", "Gust"}), declare(Slot::kSolver, "Sequential")}));
  const Catalog catalog = Catalog::installed(worker, plugins());
  EXPECT_THAT(catalog.broken(), IsEmpty());
  ASSERT_EQ(catalog.plugins().size(), 2U);
  EXPECT_EQ(catalog.plugins()[0].library, a);
  EXPECT_EQ(catalog.plugins()[1].library, b);
  std::string arguments;
  std::getline(std::ifstream(folder_ / "arguments"), arguments);
  EXPECT_EQ(arguments, "--describe " + a + ' ' + b);
}

// How many pages the children of this process that have ended brought in: more after each of them.
long pages_of_children() {
  rusage use{};
  getrusage(RUSAGE_CHILDREN, &use);
  return use.ru_minflt;
}

TEST_F(CatalogTest, AsksNobodyAgainAsLongAsNoFileChanges) {
  const std::string worker = in_build("/bin/gravitas-worker"), plugins = in_build("/lib/gravitas");
  const Catalog first = Catalog::installed(worker, plugins);
  const long asked = pages_of_children();
  const Catalog second = Catalog::installed(worker, plugins);
  EXPECT_EQ(pages_of_children(), asked);
  ASSERT_EQ(second.plugins().size(), first.plugins().size());
  for (std::size_t i = 0; i < first.plugins().size(); ++i) {
    EXPECT_EQ(second.plugins()[i].library, first.plugins()[i].library);
    EXPECT_EQ(host::to_message(second.plugins()[i].declaration).SerializeAsString(),
              host::to_message(first.plugins()[i].declaration).SerializeAsString());
  }
}

// Files of this moment may change within the same stamp of time.
TEST_F(CatalogTest, AsksAgainAboutFilesOfThisMoment) {
  library("a.so");
  const std::string worker = answering(answer_of({declare(Slot::kSolver, "Before")}));
  EXPECT_NE(Catalog::installed(worker, plugins()).find("Before"), nullptr);
  answering(answer_of({declare(Slot::kSolver, "Behind")}));
  EXPECT_NE(Catalog::installed(worker, plugins()).find("Behind"), nullptr);
}

TEST_F(CatalogTest, FindsByNameAndByType) {
  const Catalog catalog({{"/a.so", declare(Slot::kForce, "Winds", {"Wind", "Gust"})},
                         {"/b.so", declare(Slot::kSolver, "Sequential")},
                         {"/c.so", declare(Slot::kIntegrator, "Sequential")}});
  EXPECT_EQ(catalog.find_plugin(Slot::kSolver, "Sequential")->library, "/b.so");
  EXPECT_EQ(catalog.find_plugin(Slot::kSpace, "Sequential"), nullptr);
  EXPECT_EQ(catalog.find_type(Slot::kForce, "Gust")->library, "/a.so");
  EXPECT_EQ(catalog.find_type(Slot::kConstraint, "Gust"), nullptr);
  EXPECT_EQ(catalog.find("Winds")->library, "/a.so");
  EXPECT_EQ(catalog.find("None"), nullptr);
  EXPECT_THAT(catalog.plugin_names(Slot::kForce), ElementsAre("Winds"));
  EXPECT_THAT(catalog.type_names(Slot::kForce), ElementsAre("Gust", "Wind"));
  EXPECT_EQ(find_type(catalog.plugins()[0].declaration, "Wind")->properties.size(), 1U);
}

TEST_F(CatalogTest, KeepsWhatCannotBeUsedWithTheReason) {
  const std::string a = library("a.so");
  library("b.so");
  library("c.so");
  plugin::v1::Catalog answer = answer_of({declare(Slot::kForce, ""), declare(Slot::kSolver, "Good"), {}});
  answer.mutable_entries(2)->mutable_description()->set_name("Odd");
  answer.mutable_entries(2)->mutable_description()->set_slot(plugin::v1::SLOT_UNSPECIFIED);
  answer.mutable_entries(0)->set_problem("made for another schema");
  const Catalog catalog = Catalog::installed(answering(answer), plugins());
  EXPECT_EQ(catalog.plugins().size(), 1U);
  ASSERT_EQ(catalog.broken().size(), 2U);
  EXPECT_EQ(catalog.broken()[0].library, a);
  EXPECT_EQ(catalog.broken()[0].problem, "made for another schema");
  EXPECT_EQ(catalog.broken()[1].problem, "it declares a slot that this version does not have");
  EXPECT_THAT(catalog.broken_text(), HasSubstr("; not usable: " + a + " (made for another schema), "));
}

// As `gravitas check` refuses it, and in its words.
TEST_F(CatalogTest, RefusesWhatIsDeclaredBadly) {
  library("a.so");
  PluginDeclaration twice = declare(Slot::kForce, "Winds", {"Wind"});
  twice.types[0].properties.push_back(twice.types[0].properties[0]);
  Catalog catalog = Catalog::installed(answering(answer_of({twice})), plugins());
  EXPECT_THAT(catalog.plugins(), IsEmpty());
  ASSERT_EQ(catalog.broken().size(), 1U);
  EXPECT_EQ(catalog.broken()[0].problem, "Wind declares Size twice");
  std::string problem;
  EXPECT_EQ(catalog.add_library(library("a.so"), &problem), nullptr);
  EXPECT_EQ(problem, "Wind declares Size twice");
}

TEST_F(CatalogTest, TellsWhatTheFolderHasSeveralOf) {
  const Catalog catalog({{"/a.so", declare(Slot::kForce, "Winds", {"Wind"})},
                         {"/b.so", declare(Slot::kForce, "Gales", {"Wind", "Gust"})},
                         {"/c.so", declare(Slot::kForce, "Gales", {"Gale"})}});
  const auto files_of = [](const std::vector<const InstalledPlugin*>& found) {
    std::vector<std::string> libraries;
    for (const InstalledPlugin* plugin : found) libraries.push_back(plugin->library);
    return libraries;
  };
  EXPECT_THAT(files_of(catalog.installed_for(Slot::kForce, "Wind")), ElementsAre("/a.so", "/b.so"));
  EXPECT_THAT(files_of(catalog.installed_for(Slot::kForce, "Gust")), ElementsAre("/b.so"));
  EXPECT_THAT(files_of(catalog.installed_for(Slot::kSolver, "Wind")), IsEmpty());
  EXPECT_THAT(files_of(catalog.installed_as(Slot::kForce, "Gales")), ElementsAre("/b.so", "/c.so"));
  EXPECT_TRUE(catalog.is_of_folder(&catalog.plugins()[2]));
}

TEST_F(CatalogTest, SaysWhenNobodyCanBeAsked) {
  library("a.so");
  const auto problem = [&](const std::string& worker) {
    const Catalog catalog = Catalog::installed(worker, plugins());
    EXPECT_THAT(catalog.plugins(), IsEmpty());
    return catalog.broken().empty() ? "" : catalog.broken()[0].problem;
  };
  EXPECT_THAT(problem((folder_ / "none").string()), HasSubstr("could not be started: No such file"));
  EXPECT_THAT(problem(program("echo no >&2; exit 3")), HasSubstr("--describe ended with status 3: no"));
  EXPECT_THAT(problem(program("kill -9 $$")), HasSubstr("--describe was ended by signal 9"));
  EXPECT_THAT(problem(program("echo nonsense; echo more")),
              HasSubstr("--describe wrote no catalogue of 1 plugin: its standard output, which is the catalogue's "
                        "alone, begins with \"nonsense\""));
  EXPECT_THAT(problem(program("true")), HasSubstr("--describe wrote no catalogue of 1 plugin: it wrote nothing"));
  const Catalog nowhere = Catalog::installed("/bin/true", (folder_ / "none").string());
  EXPECT_THAT(nowhere.broken().at(0).problem, HasSubstr("the folder cannot be read"));
}

// A signal that its program was sent says nothing about libraries, of which each is looked at in a process of its own.
TEST_F(CatalogTest, AsksAgainWhereASignalEndedTheProgram) {
  for (const std::string signal : {"KILL", "TERM", "SEGV"}) {
    answering(answer_of({declare(Slot::kForce, "One", {"Push"})}));
    std::ifstream whole(folder_ / "worker");
    std::string lines((std::istreambuf_iterator<char>(whole)), {});
    const std::string first = (folder_ / ("first" + signal)).string();
    const std::string worker =
        program("[ -e " + first + " ] || { touch " + first + "; kill -" + signal + " $$; }\n" + lines);
    library("of_" + signal + ".so");
    const Catalog catalog = Catalog::installed(worker, plugins());
    EXPECT_THAT(catalog.broken(), IsEmpty()) << signal;
    EXPECT_NE(catalog.find("One"), nullptr) << signal;
    std::filesystem::remove(folder_ / "plugins" / ("of_" + signal + ".so"));
  }
}

TEST_F(CatalogTest, AnEmptyFolderIsAnEmptyCatalogue) {
  const Catalog catalog = Catalog::installed("/nowhere", plugins());
  EXPECT_THAT(catalog.plugins(), IsEmpty());
  EXPECT_THAT(catalog.broken(), IsEmpty());
  EXPECT_EQ(catalog.broken_text(), "");
}

TEST_F(CatalogTest, EndsAWorkerThatHangs) {
  plugin::v1::Catalog answer;
  std::string problem;
  const auto start = std::chrono::steady_clock::now();
  // one that keeps its output open, and one that closes it and stays
  for (const char* lines : {"sleep 1000", "exec >/dev/null 2>&1; sleep 1000"}) {
    EXPECT_FALSE(describe_libraries(program(lines), {"/a.so"}, std::chrono::milliseconds(50), &answer, &problem));
    EXPECT_THAT(problem, HasSubstr("did not end within 50 ms"));
  }
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(30));
}

TEST_F(CatalogTest, TakesLongAnswers) {
  // more than a pipe holds
  std::vector<std::string> types;
  for (int i = 0; i < 5000; ++i) types.push_back(std::string(40, 't') + std::to_string(i));
  const std::string worker = answering(answer_of({declare(Slot::kForce, "Many", types)}));
  library("a.so");
  const Catalog catalog = Catalog::installed(worker, plugins());
  ASSERT_EQ(catalog.plugins().size(), 1U);
  EXPECT_EQ(catalog.plugins()[0].declaration.types.size(), 5000U);
}

TEST_F(CatalogTest, AddsALibraryBeforeOthersOfItsName) {
  const std::string a = library("a.so");
  const std::string worker = answering(answer_of({declare(Slot::kSolver, "Sequential")}));
  Catalog catalog = Catalog::installed(worker, plugins());
  const files::path own = folder_ / "own.so";
  std::ofstream(own) << "no real library";
  std::string problem;
  const InstalledPlugin* added = catalog.add_library(own.string(), &problem);
  ASSERT_NE(added, nullptr) << problem;
  EXPECT_EQ(added->library, own.string());
  EXPECT_EQ(catalog.find_plugin(Slot::kSolver, "Sequential"), added);
  EXPECT_EQ(catalog.plugins()[0].library, a);
}

TEST_F(CatalogTest, RefusesLibrariesThatAreNone) {
  plugin::v1::Catalog answer = answer_of({declare(Slot::kSolver, "S")});
  answer.mutable_entries(0)->set_problem("it has no gravitas_plugin");
  Catalog catalog = Catalog::installed(answering(answer), plugins());
  std::string problem;
  EXPECT_EQ(catalog.add_library(library("a.so"), &problem), nullptr);
  EXPECT_EQ(problem, "it has no gravitas_plugin");
  EXPECT_EQ(catalog.add_library((folder_ / "none.so").string(), &problem), nullptr);
  EXPECT_THAT(problem, HasSubstr("it cannot be read: No such file"));
  EXPECT_EQ(catalog.add_library(plugins(), &problem), nullptr);
  EXPECT_EQ(problem, "it is no file");
  Catalog without_worker;
  EXPECT_EQ(without_worker.add_library(library("a.so"), &problem), nullptr);
  EXPECT_EQ(problem, "there is no worker program to ask about it");
}

}  // namespace
}  // namespace gravitas
