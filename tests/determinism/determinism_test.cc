// The same build gives the same bits: on every hosting, with any number of threads, in every repetition, and as
// committed in hashes.json. The committed hashes belong to the release preset; renew them with
//
//   GRAVITAS_WRITE_HASHES=1 build/release/bin/test_determinism
#include <fmt/format.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>

#include "services/run/session.h"
#include "tests/paths.h"

namespace gravitas {
namespace {

using kernel::Environment;
using kernel::Hosting;

const std::string kHashes = in_source("/tests/determinism/hashes.json");
constexpr const char* kScenes[] = {"two_spheres_motor", "bounce", "sliding_boxes", "double_pendulum", "stack",
                                   "thruster",          "pile",   "callbacks",     "suspension"};
constexpr Slot kSlots[] = {Slot::kSpace, Slot::kCollision, Slot::kConstraint,
                           Slot::kForce, Slot::kSolver,    Slot::kIntegrator};

struct Hashes {
  std::string state, chain;
  bool operator==(const Hashes&) const = default;
};

void PrintTo(const Hashes& hashes, std::ostream* out) { *out << hashes.state << " / " << hashes.chain; }

std::string path_of(const std::string& scene) {
  const bool is_ours = scene == "pile" || scene == "callbacks" || scene == "suspension";
  return in_source(is_ours ? "/tests/determinism/" : "/deploy/scenes/") + scene + ".gravitas";
}

Hashes hashes_of(const std::string& scene, std::vector<HostingChoice> hosting, std::uint32_t threads = 1,
                 std::vector<std::string> overrides = {}, std::optional<std::uint32_t> steps = std::nullopt) {
  RunOptions options;
  options.scenes = {path_of(scene)};
  options.hosting = std::move(hosting);
  options.threads = threads;
  options.overrides = std::move(overrides);
  options.steps = steps;
  const RunResult result = run(
      options, [] { return false; }, [](const Progress&) {});
  EXPECT_EQ(result.outcome, RunOutcome::kCompleted) << result.fault;
  return {result.report.state_hash(), result.report.chain_hash()};
}

const std::vector<HostingChoice> kAllDirect = {{std::nullopt, Hosting::kDirect}};
const std::vector<HostingChoice> kAllWorkers = {{std::nullopt, Hosting::kSharedMemory}};
const std::vector<HostingChoice> kAllMessages = {{std::nullopt, Hosting::kGrpc}};

class SameBits : public ::testing::TestWithParam<const char*> {};

TEST_P(SameBits, InProcessAndInWorkersWithOneThreadOrTwoAndAgain) {
  const std::string scene = GetParam();
  const Hashes reference = hashes_of(scene, kAllDirect);
  EXPECT_EQ(hashes_of(scene, kAllDirect), reference) << "repeated";
  EXPECT_EQ(hashes_of(scene, kAllDirect, 2), reference) << "two threads";
  EXPECT_EQ(hashes_of(scene, kAllWorkers), reference) << "in workers";
  EXPECT_EQ(hashes_of(scene, kAllWorkers, 2), reference) << "in workers with two threads";
  EXPECT_EQ(hashes_of(scene, kAllMessages), reference) << "in workers by gRPC";
}

TEST_P(SameBits, WithOneSlotElsewhereThanTheOthers) {
  const std::string scene = GetParam();
  constexpr std::uint32_t kSteps = 60;
  const Hashes reference = hashes_of(scene, kAllDirect, 1, {}, kSteps);
  for (const Slot slot : kSlots) {
    EXPECT_EQ(hashes_of(scene, {{std::nullopt, Hosting::kDirect}, {slot, Hosting::kSharedMemory}}, 1, {}, kSteps),
              reference)
        << slot_name(slot) << " alone in a worker";
    EXPECT_EQ(hashes_of(scene, {{std::nullopt, Hosting::kSharedMemory}, {slot, Hosting::kDirect}}, 3, {}, kSteps),
              reference)
        << slot_name(slot) << " alone in process";
    EXPECT_EQ(hashes_of(scene, {{std::nullopt, Hosting::kSharedMemory}, {slot, Hosting::kGrpc}}, 2, {}, kSteps),
              reference)
        << slot_name(slot) << " alone by gRPC";
  }
}

TEST_P(SameBits, WithEverySpace) {
  const std::string scene = GetParam();
  EXPECT_EQ(hashes_of(scene, kAllDirect, 1, {"Space=Grid"}), hashes_of(scene, kAllDirect, 1, {"Space=Basic"}));
}

INSTANTIATE_TEST_SUITE_P(Scenes, SameBits, ::testing::ValuesIn(kScenes),
                         [](const auto& one) { return std::string(one.param); });

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
