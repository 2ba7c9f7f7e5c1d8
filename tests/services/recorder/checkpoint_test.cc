// The checkpoint file: what goes in comes out, and no bytes but these are taken.
#include "services/recorder/checkpoint.h"

#include <gmock/gmock.h>
#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "plugin_sdk/channel/digest.h"
#include "services/recorder/identity.h"
#include "services/run/resumption.h"
#include "services/run/session.h"
#include "tests/services/cli/program.h"

namespace gravitas {
namespace {

using google::protobuf::util::MessageDifferencer;
using recorder::v1::Checkpoint;
using ::testing::HasSubstr;

constexpr std::size_t kHeader = 32, kChecksum = 16;

kernel::EnvironmentDescription description_of(const std::string& scene, std::vector<std::string> overrides = {}) {
  RunOptions options;
  options.scenes = {harness::shipped_scene(scene)};
  options.hosting = {{std::nullopt, kernel::Hosting::kDirect}};
  options.overrides = std::move(overrides);
  std::vector<std::string> warnings;
  return load(options, &warnings);
}

// The sample after 150 steps: contacts, a joint with a motor.
const Checkpoint& sample() {
  static const Checkpoint checkpoint = [] {
    const kernel::EnvironmentDescription description = description_of("two_spheres_motor");
    const std::unique_ptr<kernel::Environment> environment = start(description);
    for (int i = 0; i < 150; ++i) EXPECT_EQ(environment->step(), kernel::StepOutcome::kCommitted);
    recorder::v1::Tally tally;
    tally.set_collision_start(2);
    tally.set_penetration(1e-5);
    return make_checkpoint(*environment, identity_of(description), tally);
  }();
  return checkpoint;
}

// A frame around any message, with the checksum that fits: what somebody makes who edits with care.
std::vector<std::byte> sealed_again(std::vector<std::byte> bytes) {
  XXH128_canonical_t checksum;
  XXH128_canonicalFromHash(&checksum, XXH3_128bits(bytes.data(), bytes.size() - kChecksum));
  std::memcpy(bytes.data() + bytes.size() - kChecksum, checksum.digest, kChecksum);
  return bytes;
}

std::string refusal(std::span<const std::byte> bytes) {
  std::string problem;
  EXPECT_FALSE(parse_checkpoint(bytes, &problem).has_value());
  EXPECT_NE(problem, "");
  return problem;
}

// Weight is constant, a thrust that turns with its body is not.
TEST(Checkpoint, KnowsWhetherForcesAreAsked) {
  EXPECT_FALSE(sample().asks_forces());
  const kernel::EnvironmentDescription thruster = description_of("thruster");
  const Checkpoint asking = make_checkpoint(*start(thruster), identity_of(thruster), {});
  EXPECT_TRUE(asking.asks_forces());
  const kernel::EnvironmentDescription weight = description_of("two_spheres_motor");
  EXPECT_FALSE(start(answering_at(sample(), weight, {}).begun)->asks_forces());
  EXPECT_TRUE(start(answering_at(asking, weight, {}).begun)->asks_forces());
}

TEST(Checkpoint, ComesBackBitForBit) {
  const std::vector<std::byte> bytes = serialize_checkpoint(sample());
  std::string problem;
  std::optional<Checkpoint> read = parse_checkpoint(bytes, &problem);
  ASSERT_TRUE(read.has_value()) << problem;
  EXPECT_TRUE(MessageDifferencer::Equals(*read, sample()));
  EXPECT_EQ(read->step(), 150U);
  EXPECT_GT(read->state().contact_impulse_size(), 0);
  EXPECT_GT(read->state().discrepancy_impulse_size(), 0);

  const kernel::EnvironmentDescription description = description_of("two_spheres_motor");
  EXPECT_EQ(find_obstacle(*read, identity_of(description)), "");
  const std::unique_ptr<kernel::Environment> environment = start(description);
  EXPECT_EQ(environment->restore(saved_state_of(&*read)), "");
  EXPECT_EQ(environment->step_count(), 150U);
}

// A run that is left between an edit and the step after it.
TEST(Checkpoint, TellsWhetherItsStateIsThatOfAnEdit) {
  Checkpoint checkpoint = sample();
  EXPECT_FALSE(saved_state_of(&checkpoint).is_anew);
  checkpoint.add_edits()->set_step(checkpoint.step());
  EXPECT_FALSE(saved_state_of(&checkpoint).is_anew);
  checkpoint.add_edits()->set_step(checkpoint.step() + 1);
  EXPECT_TRUE(saved_state_of(&checkpoint).is_anew);
}

TEST(Checkpoint, NoFlippedBitPasses) {
  std::vector<std::byte> bytes = serialize_checkpoint(sample());
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    const std::byte mask{static_cast<unsigned char>(1U << bit % 8)};
    bytes[bit / 8] ^= mask;
    ASSERT_NE(refusal(bytes), "") << bit;
    bytes[bit / 8] ^= mask;
  }
}

TEST(Checkpoint, NoShorterOrLongerFilePasses) {
  std::vector<std::byte> bytes = serialize_checkpoint(sample());
  for (std::size_t size = 0; size < bytes.size(); ++size) ASSERT_NE(refusal(std::span(bytes).first(size)), "") << size;
  EXPECT_EQ(refusal({}), "it is empty");
  EXPECT_THAT(refusal(std::span(bytes).first(20)), HasSubstr("cut short"));
  EXPECT_THAT(refusal(std::span(bytes).first(bytes.size() - 1)), HasSubstr("cut short"));
  bytes.push_back(std::byte{0});
  EXPECT_THAT(refusal(bytes), HasSubstr("1 bytes longer"));
}

TEST(Checkpoint, EachRefusalSaysWhatItIs) {
  const std::vector<std::byte> bytes = serialize_checkpoint(sample());
  const auto with = [&](std::size_t place, unsigned char value) {
    std::vector<std::byte> other = bytes;
    other[place] = std::byte{value};
    return sealed_again(other);
  };
  EXPECT_THAT(refusal(with(0, 'x')), HasSubstr("not a checkpoint of Gravitas"));
  EXPECT_THAT(refusal(with(8, 0)), HasSubstr("format is version 0; this build reads version 2"));
  EXPECT_THAT(refusal(with(8, 1)), HasSubstr("format is version 1"));
  std::vector<std::byte> schema = bytes;
  schema[16] ^= std::byte{1};
  EXPECT_THAT(refusal(sealed_again(schema)), HasSubstr("schema is not that of this build"));
  EXPECT_THAT(refusal(with(31, 0x7f)), HasSubstr("size is impossible"));
  std::vector<std::byte> edited = bytes;
  edited[kHeader + 100] ^= std::byte{1};
  EXPECT_THAT(refusal(edited), HasSubstr("damaged or was edited"));
}

// A right checksum around a wrong message: never a crash, and restore() takes nothing that is not the state.
TEST(Checkpoint, AForgedMessageIsRefusedSomewhereOnTheWay) {
  const kernel::EnvironmentDescription description = description_of("two_spheres_motor");
  const recorder::v1::Identity scene = identity_of(description);
  const std::unique_ptr<kernel::Environment> environment = start(description);
  std::vector<std::byte> bytes = serialize_checkpoint(sample());
  int parsed = 0, unnoticed = 0;
  for (std::size_t place = kHeader; place < bytes.size() - kChecksum; ++place) {
    std::vector<std::byte> forged = bytes;
    forged[place] ^= std::byte{0x40};
    std::string problem;
    std::optional<Checkpoint> checkpoint = parse_checkpoint(sealed_again(forged), &problem);
    if (!checkpoint) continue;
    ++parsed;
    if (!find_obstacle(*checkpoint, scene).empty()) continue;
    checkpoint->set_step(0);  // a state that can be restored again and again: never the initial one
    checkpoint->set_step_length(0.0);
    EXPECT_NE(environment->restore(saved_state_of(&*checkpoint)), "") << place;
    ++unnoticed;
  }
  EXPECT_GT(parsed, 0);
  EXPECT_GT(unnoticed, 0);
}

TEST(Checkpoint, AnotherBuildIsNamedWithThisOne) {
  Checkpoint other = sample();
  other.set_build("0.0.9-Clang");
  const std::string obstacle = find_obstacle(other, other.identity());
  EXPECT_THAT(obstacle, HasSubstr("0.0.9-Clang"));
  EXPECT_THAT(obstacle, HasSubstr(GRAVITAS_BUILD_ID));
}

TEST(Checkpoint, ATallyThatCannotBeIsRefused) {
  for (const double number : {-1.0, std::numeric_limits<double>::quiet_NaN()}) {
    Checkpoint other = sample();
    other.mutable_tally()->set_penetration(number);
    EXPECT_THAT(refusal(serialize_checkpoint(other)), HasSubstr("tally"));
  }
}

struct Change {
  const char* name;
  std::string text;    // an override
  const char* reason;  // part of what is said; empty: the same run
};

void PrintTo(const Change& change, std::ostream* out) { *out << change.name; }

class Identity : public ::testing::TestWithParam<Change> {};

INSTANTIATE_TEST_SUITE_P(Of, Identity,
                         ::testing::Values(Change{"duration", "Simulator.Duration=99", ""}, Change{"hosting", "", ""},
                                           Change{"simulator", "Simulator=Continuous", "the simulator"},
                                           Change{"substeps", "Simulator.Substeps=2", "the simulator"},
                                           Change{"sleep", "Simulator.SleepTime=1", "SleepTime"},
                                           Change{"time_step", "Simulator.TimeStep=0.005", "time step (0.0"},
                                           Change{"position", "Body.Ball01.Position={0,7,0}", "bodies"},
                                           Change{"velocity", "Body.Ball01.LinearVelocity={1,0,0}", "bodies"},
                                           Change{"damping", "Body.Ball01.DampingCoefficient=0.25", "bodies"},
                                           Change{"integrator", "Integrator=SemiImplicitEuler", "slot integrator"},
                                           Change{"iterations", "Solver.Iterations=7", "slot solver"},
                                           Change{"space", "Space=Basic", "slot space"}),
                         [](const auto& which) { return std::string(which.param.name); });

TEST_P(Identity, IsWhatDeterminesTheTrajectory) {
  std::vector<std::string> overrides;
  if (!GetParam().text.empty()) overrides.push_back(GetParam().text);
  kernel::EnvironmentDescription description = description_of("two_spheres_motor", overrides);
  description.threads = 2;
  if (overrides.empty()) description.solver.hosting = kernel::Hosting::kSharedMemory;
  const std::string obstacle = find_obstacle(sample(), identity_of(description));
  if (*GetParam().reason == '\0') {
    EXPECT_EQ(obstacle, "");
  } else {
    EXPECT_THAT(obstacle, HasSubstr("another scene"));
    EXPECT_THAT(obstacle, HasSubstr(GetParam().reason));
  }
}

}  // namespace
}  // namespace gravitas
