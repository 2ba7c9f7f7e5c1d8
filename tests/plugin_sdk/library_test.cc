// Loading plugin libraries, good and bad: a library that is none, or not for this build, is refused
// with a sentence that says why.
#include "plugin_sdk/library.h"

#include <dlfcn.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <link.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>

#include "plugin_sdk/floating_point.h"
#include "tests/paths.h"

namespace gravitas {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::StartsWith;

const std::string kHello = in_build("/lib/gravitas/hello.so");

std::string faulty(const std::string& name) { return in_build("/lib/gravitas-faulty/") + name + ".so"; }

// Why the library cannot be loaded.
std::string problem_of(const std::string& path) {
  std::string problem;
  const PluginLibrary library = load_plugin_library(path, &problem);
  EXPECT_EQ(library.table, nullptr);
  EXPECT_EQ(library.declaration.name, "");
  return problem;
}

// A file of the test's own, gone at the end.
class TemporaryFile {
 public:
  TemporaryFile() {
    std::string name = (fs::temp_directory_path() / "gravitas_library_XXXXXX").string();
    const int descriptor = mkstemp(name.data());
    if (descriptor >= 0) close(descriptor);
    path_ = name;
  }
  ~TemporaryFile() { fs::remove(path_); }
  void write(const std::string& text) const { std::ofstream(path_) << text; }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

TEST(PluginLibrary, LoadsAndDescribesAPlugin) {
  std::string problem;
  const PluginLibrary library = load_plugin_library(kHello, &problem);
  EXPECT_EQ(problem, "");
  ASSERT_NE(library.table, nullptr);
  EXPECT_EQ(library.table->schema_hash, stage::kSchemaHash);
  EXPECT_STREQ(library.table->build_id, GRAVITAS_BUILD_ID);
  EXPECT_EQ(library.declaration.name, "Hello");
  EXPECT_EQ(library.declaration.slot, Slot::kForce);
  ASSERT_EQ(library.declaration.types.size(), 1U);
  EXPECT_EQ(library.declaration.types[0].properties[0].name, "Push");
}

TEST(PluginLibrary, AFileThatIsReplacedDoesNotChangeALoadedPlugin) {
  const TemporaryFile file;
  fs::copy_file(kHello, file.path(), fs::copy_options::overwrite_existing);
  std::string problem;
  const PluginLibrary library = load_plugin_library(file.path(), &problem);
  ASSERT_NE(library.table, nullptr) << problem;
  file.write(std::string(fs::file_size(kHello), 'x'));
  void* instance = nullptr;
  gravitas_error error{};
  ASSERT_EQ(library.table->create(nullptr, 0, &instance, &error), GRAVITAS_OK) << error.text;
  library.table->destroy(instance);
  EXPECT_EQ(read_declaration(*library.table->description).name, "Hello");
}

// A debugger opens the name of a library itself: one under /proc/self was a file of its own, a pipe that it read for ever.
TEST(PluginLibrary, GoesByANameThatOtherProcessesCanOpen) {
  std::string problem;
  const PluginLibrary library = load_plugin_library(kHello, &problem);
  Dl_info info;
  ASSERT_NE(dladdr(library.table, &info), 0);
  EXPECT_THAT(info.dli_fname, StartsWith("/proc/" + std::to_string(getpid()) + "/fd/"));
  const std::string command = std::string("cmp -s '") + info.dli_fname + "' '" + kHello + "'";
  EXPECT_EQ(std::system(command.c_str()), 0);
}

TEST(PluginLibrary, RefusesWhatCannotBeRead) {
  EXPECT_EQ(problem_of("/no/such/library.so"), "cannot read '/no/such/library.so': No such file or directory");
  EXPECT_EQ(problem_of("/tmp"), "cannot read '/tmp': Is a directory");
  EXPECT_EQ(problem_of("/dev/null"), "cannot read '/dev/null': Invalid argument");
}

TEST(PluginLibrary, RefusesWhatIsNoSharedLibrary) {
  const TemporaryFile file;
  const std::string refusal = "'" + file.path() + "' is not a shared library that can be loaded: ";
  EXPECT_THAT(problem_of(file.path()), StartsWith(refusal));  // empty
  file.write("#!/bin/sh\n" + std::string(4096, '#'));
  EXPECT_THAT(problem_of(file.path()), StartsWith(refusal));
  EXPECT_THAT(problem_of(file.path()), HasSubstr("invalid ELF header"));
}

TEST(PluginLibrary, RefusesALibraryThatWasCutShort) {
  const TemporaryFile file;
  fs::copy_file(kHello, file.path(), fs::copy_options::overwrite_existing);
  fs::resize_file(file.path(), 200);
  EXPECT_THAT(problem_of(file.path()),
              StartsWith("'" + file.path() + "' is not a shared library that can be loaded: "));
}

TEST(PluginLibrary, RefusesALibraryThatIsNoPlugin) {
  void* handle = dlopen("libm.so.6", RTLD_NOW);
  ASSERT_NE(handle, nullptr);
  link_map* map = nullptr;
  ASSERT_EQ(dlinfo(handle, RTLD_DI_LINKMAP, &map), 0);
  const std::string path = map->l_name;
  EXPECT_EQ(problem_of(path), "'" + path + "' is not a plugin: it has no function gravitas_plugin");
}

TEST(PluginLibrary, RefusesAPluginWithoutATable) {
  for (const char* name : {"null_table", "wrong_magic"}) {
    const std::string path = faulty(name);
    EXPECT_EQ(problem_of(path), "'" + path +
                                    "' is not a plugin: gravitas_plugin() returns no "
                                    "table of this interface");
  }
}

TEST(PluginLibrary, RefusesAPluginForAnotherVersionOfTheInterface) {
  const std::string abi = faulty("wrong_abi_version"), layout = faulty("wrong_layout_version");
  EXPECT_EQ(problem_of(abi), "'" + abi + "' was built for version 3.2 of the plugin interface; this is 2.2");
  EXPECT_EQ(problem_of(layout), "'" + layout + "' was built for version 2.3 of the plugin interface; this is 2.2");
}

TEST(PluginLibrary, RefusesAPluginForOtherStageContracts) {
  const std::string path = faulty("wrong_schema_hash");
  EXPECT_EQ(problem_of(path), "'" + path +
                                  "' was built for another schema of the stage "
                                  "contracts: rebuild it against this plugin_sdk");
}

TEST(PluginLibrary, SaysWhatADeclarationThrows) {
  const std::string path = faulty("declaration_throws");
  EXPECT_EQ(problem_of(path),
            "'" + path + "' does not say what it is: its declaration failed: its table of types is missing");
}

TEST(PluginLibrary, RefusesOneThatChangesFloatingPointArithmeticAndPutsItBack) {
  const std::string path = faulty("flushes_to_zero_on_load");
  const std::uint32_t control = floating_point_control();
  EXPECT_EQ(problem_of(path), "'" + path +
                                  "' changes the floating-point environment of the process that loads it: it was "
                                  "probably linked with -ffast-math or -Ofast; link it without");
  EXPECT_EQ(floating_point_control(), control);
  std::string problem;
  EXPECT_EQ(look_into_plugin_library(path, &problem).table, nullptr);
  EXPECT_THAT(problem, HasSubstr("-ffast-math"));
  EXPECT_EQ(floating_point_control(), control);
}

TEST(PluginLibrary, LoadsEqualContentOnceAndKeepsNoMoreForTheSecondTime) {
  const auto open_files = [] {
    return std::distance(fs::directory_iterator("/proc/self/fd"), fs::directory_iterator());
  };
  std::string problem;
  const PluginLibrary first = load_plugin_library(kHello, &problem);
  const auto before = open_files();
  for (int i = 0; i < 100; ++i) ASSERT_EQ(load_plugin_library(kHello, &problem).table, first.table);
  EXPECT_EQ(open_files(), before);
}

constexpr std::uint32_t kFlushing = 0x8040;
int instances = 0;

// A library whose functions are these.
PluginLibrary library_of(decltype(gravitas_plugin_table::create) create,
                         decltype(gravitas_plugin_table::destroy) destroy) {
  static gravitas_plugin_table table;
  table.create = create;
  table.destroy = destroy;
  PluginLibrary library;
  library.table = &table;
  return library;
}

std::int32_t make_flushing(const double*, std::uint64_t, void** instance, gravitas_error*) {
  set_floating_point_control(floating_point_control() | kFlushing);
  *instance = &++instances;
  return GRAVITAS_OK;
}
std::int32_t refuse_flushing(const double*, std::uint64_t, void**, gravitas_error* error) {
  set_floating_point_control(floating_point_control() | kFlushing);
  std::memset(error->text, 0xff, sizeof error->text);
  return GRAVITAS_REFUSED;
}
void end_flushing(void*) {
  set_floating_point_control(floating_point_control() | kFlushing);
  --instances;
}

TEST(PluginInstance, ThatChangesTheFloatingPointEnvironmentIsNotMade) {
  const std::uint32_t control = floating_point_control();
  void* instance = nullptr;
  EXPECT_EQ(create_instance(library_of(make_flushing, end_flushing), {}, &instance),
            "its constructor changed the floating-point environment");
  EXPECT_EQ(floating_point_control(), control);
  EXPECT_EQ(instances, 0);
}

TEST(PluginInstance, SaysWhyItIsRefusedInWordsThatAMessageTakes) {
  const std::uint32_t control = floating_point_control();
  void* instance = nullptr;
  EXPECT_EQ(create_instance(library_of(refuse_flushing, end_flushing), {}, &instance), std::string(512, '?'));
  EXPECT_EQ(floating_point_control(), control);
  gravitas_error error{};
  std::strcpy(error.text, "zu k\xfchl");
  EXPECT_EQ(error_text(error), "zu k?hl");
}

TEST(PluginInstance, LeavesTheFloatingPointEnvironmentWhenItGoes) {
  const std::uint32_t control = floating_point_control();
  instances = 1;
  destroy_instance(library_of(make_flushing, end_flushing), &instances);
  EXPECT_EQ(instances, 0);
  EXPECT_EQ(floating_point_control(), control);
}

}  // namespace
}  // namespace gravitas
