// The same build gives the same bits: on every hosting, with any number of threads, in every repetition, and as
// committed in hashes.json. The committed hashes belong to the release preset; renew them with
//
//   GRAVITAS_WRITE_HASHES=1 build/release/bin/test_determinism
#include <fmt/format.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "services/run/session.h"
#include "tests/paths.h"
#include "tests/run_quietly.h"

namespace gravitas {
namespace {

namespace fs = std::filesystem;
using kernel::Environment;
using kernel::Hosting;

const std::string kHashes = in_source("/tests/determinism/hashes.json");
// whose hashes are committed
constexpr const char* kScenes[] = {
    "two_spheres_motor", "bounce", "sliding_boxes", "double_pendulum", "stack",     "thruster", "pile", "callbacks",
    "suspension",        "stops",  "taut",          "hinged",          "bump_stops"};
constexpr Slot kSlots[] = {Slot::kSpace, Slot::kCollision, Slot::kConstraint,
                           Slot::kForce, Slot::kSolver,    Slot::kIntegrator};

struct Hashes {
  std::string state, chain;
  bool operator==(const Hashes&) const = default;
};

void PrintTo(const Hashes& hashes, std::ostream* out) { *out << hashes.state << " / " << hashes.chain; }

constexpr const char* kFolders[] = {"/tests/determinism/", "/deploy/scenes/"};

// Ours and those that ship.
std::vector<std::string> all_scenes() {
  std::vector<std::string> names;
  for (const char* folder : kFolders)
    for (const fs::directory_entry& entry : fs::directory_iterator(in_source(folder)))
      if (entry.path().extension() == ".gravitas") names.push_back(entry.path().stem());
  std::ranges::sort(names);
  return names;
}

std::string path_of(const std::string& scene) {
  const std::string ours = in_source(kFolders[0]) + scene + ".gravitas";
  return fs::exists(ours) ? ours : in_source(kFolders[1]) + scene + ".gravitas";
}

// Of large scenes the start.
std::optional<std::uint32_t> most_steps(const std::string& scene) {
  if (scene == "pile1000") return 30;
  return std::nullopt;
}

// In workers the start of every scene: a step there costs up to a hundred in process.
std::uint32_t steps_in_workers(const std::string& scene) { return most_steps(scene).value_or(200); }

Hashes hashes_of(const std::string& scene, std::vector<HostingChoice> hosting, std::uint32_t threads = 1,
                 std::vector<std::string> overrides = {}, std::optional<std::uint32_t> steps = std::nullopt) {
  RunOptions options;
  options.scenes = {path_of(scene)};
  options.hosting = std::move(hosting);
  options.threads = threads;
  options.overrides = std::move(overrides);
  options.steps = steps;
  const RunResult result = harness::run_quietly(options);
  EXPECT_EQ(result.outcome, RunOutcome::kCompleted) << result.fault;
  EXPECT_EQ(result.report.faults_size(), 0);
  return {result.report.state_hash(), result.report.chain_hash()};
}

const std::vector<HostingChoice> kAllDirect = {{std::nullopt, Hosting::kDirect}};
const std::vector<HostingChoice> kAllWorkers = {{std::nullopt, Hosting::kSharedMemory}};
const std::vector<HostingChoice> kAllMessages = {{std::nullopt, Hosting::kGrpc}};

class SameBits : public ::testing::TestWithParam<std::string> {};

TEST_P(SameBits, InProcessAndInWorkersWithOneThreadOrTwoAndAgain) {
  const std::string scene = GetParam();
  const std::optional<std::uint32_t> whole = most_steps(scene);
  EXPECT_EQ(hashes_of(scene, kAllDirect, 2, {}, whole), hashes_of(scene, kAllDirect, 1, {}, whole)) << "two threads";

  const std::uint32_t steps = steps_in_workers(scene);
  const Hashes start = hashes_of(scene, kAllDirect, 1, {}, steps);
  EXPECT_EQ(hashes_of(scene, kAllDirect, 1, {}, steps), start) << "repeated";
  EXPECT_EQ(hashes_of(scene, kAllWorkers, 1, {}, steps), start) << "in workers";
  EXPECT_EQ(hashes_of(scene, kAllWorkers, 2, {}, steps), start) << "in workers with two threads";
  EXPECT_EQ(hashes_of(scene, kAllMessages, 1, {}, steps), start) << "in workers by gRPC";
}

// Each slot in one of three ways, another one in the next scene: a run in workers costs more to start than to step.
TEST_P(SameBits, WithOneSlotElsewhereThanTheOthers) {
  const std::string scene = GetParam();
  const std::uint32_t steps = most_steps(scene).value_or(30);
  const Hashes reference = hashes_of(scene, kAllDirect, 1, {}, steps);
  const std::vector<std::string> scenes = all_scenes();
  std::size_t way = static_cast<std::size_t>(std::ranges::find(scenes, scene) - scenes.begin());
  for (const Slot slot : kSlots) {
    switch (way++ % 3) {
      case 0:
        EXPECT_EQ(hashes_of(scene, {{std::nullopt, Hosting::kDirect}, {slot, Hosting::kSharedMemory}}, 1, {}, steps),
                  reference)
            << slot_name(slot) << " alone in a worker";
        break;
      case 1:
        EXPECT_EQ(hashes_of(scene, {{std::nullopt, Hosting::kSharedMemory}, {slot, Hosting::kDirect}}, 3, {}, steps),
                  reference)
            << slot_name(slot) << " alone in process";
        break;
      default:
        EXPECT_EQ(hashes_of(scene, {{std::nullopt, Hosting::kSharedMemory}, {slot, Hosting::kGrpc}}, 2, {}, steps),
                  reference)
            << slot_name(slot) << " alone by gRPC";
    }
  }
}

TEST_P(SameBits, WithEverySpace) {
  const std::string scene = GetParam();
  const std::optional<std::uint32_t> steps = most_steps(scene);
  const Hashes basic = hashes_of(scene, kAllDirect, 1, {"Space=Basic"}, steps);
  for (const std::string space : {"Grid", "KDTree", "SweepAndPrune", "DynamicBVH"})
    EXPECT_EQ(hashes_of(scene, kAllDirect, 1, {"Space=" + space}, steps), basic) << space;
}

INSTANTIATE_TEST_SUITE_P(Scenes, SameBits, ::testing::ValuesIn(all_scenes()),
                         [](const auto& one) { return one.param; });

std::map<std::string, Hashes> committed() {
  std::ifstream file(kHashes);
  std::stringstream text;
  text << file.rdbuf();
  google::protobuf::Struct table;
  EXPECT_TRUE(google::protobuf::util::JsonStringToMessage(text.str(), &table).ok()) << kHashes;
  std::map<std::string, Hashes> hashes;
  for (const auto& [scene, entry] : table.fields()) {
    const auto& fields = entry.struct_value().fields();
    hashes[scene] = {fields.at("state_hash").string_value(), fields.at("chain_hash").string_value()};
  }
  return hashes;
}

TEST(CommittedHashes, AreThoseOfThisBuild) {
  if (std::string(GRAVITAS_BUILD_ID).find("-Release-") == std::string::npos)
    GTEST_SKIP() << "the committed hashes belong to the release preset";
  std::map<std::string, Hashes> now;
  for (const char* scene : kScenes) now[scene] = hashes_of(scene, kAllDirect);
  if (std::getenv("GRAVITAS_WRITE_HASHES") != nullptr) {
    std::ofstream file(kHashes);
    std::string rows;
    for (const auto& [scene, hashes] : now)
      rows += fmt::format("{}  \"{}\": {{\"state_hash\": \"{}\", \"chain_hash\": \"{}\"}}", rows.empty() ? "" : ",\n",
                          scene, hashes.state, hashes.chain);
    file << "{\n" << rows << "\n}\n";
  }
  EXPECT_EQ(committed(), now)
      << "if results were meant to change: GRAVITAS_WRITE_HASHES=1 build/release/bin/test_determinism";
}

}  // namespace
}  // namespace gravitas
