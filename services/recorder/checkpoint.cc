#include "services/recorder/checkpoint.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.pb.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <variant>

#include "plugin_sdk/channel/digest.h"
#include "plugin_sdk/slots.h"
#include "services/recorder/identity.h"

namespace gravitas {
namespace {

namespace pb = google::protobuf;
using recorder::v1::Checkpoint;

// the first byte is no text, the line ends tell a copy that was made as text
constexpr std::array<unsigned char, 8> kMagic = {0x89, 'G', 'R', 'V', 'C', '\r', '\n', 0x1a};
constexpr std::uint32_t kVersion = 2;

struct Header {
  std::array<unsigned char, 8> magic;
  std::uint32_t version, zero;
  std::uint64_t schema, size;
};
static_assert(sizeof(Header) == 32);
constexpr std::size_t kChecksumSize = 16;

std::array<std::byte, kChecksumSize> checksum_of(std::span<const std::byte> bytes) {
  XXH128_canonical_t canonical;
  XXH128_canonicalFromHash(&canonical, XXH3_128bits(bytes.data(), bytes.size()));
  std::array<std::byte, kChecksumSize> checksum;
  std::memcpy(checksum.data(), canonical.digest, checksum.size());
  return checksum;
}

// Digest of the message's declaration, units included.
std::uint64_t schema_digest() {
  static const std::uint64_t value = [] {
    pb::FileDescriptorProto file;
    Checkpoint::descriptor()->file()->CopyTo(&file);
    const std::string text = file.SerializeAsString();
    channel::Digest digest;
    digest.add(text.data(), text.size());
    return digest.value();
  }();
  return value;
}

// Calls visit(name, column) for every column of the message, in the order of kernel/state.h.
template <typename Visit>
void visit_columns(recorder::v1::State* state, Visit&& visit) {
  visit("position", state->mutable_position());
  visit("orientation", state->mutable_orientation());
  visit("linear_velocity", state->mutable_linear_velocity());
  visit("angular_velocity", state->mutable_angular_velocity());
  visit("intact", state->mutable_intact());
  visit("plugin_state", state->mutable_plugin_state());
  visit("state_changed", state->mutable_state_changed());
  visit("contact_body", state->mutable_contact_body());
  visit("contact_feature", state->mutable_contact_feature());
  visit("contact_key", state->mutable_contact_key());
  visit("contact_impulse", state->mutable_contact_impulse());
  visit("contact_correction", state->mutable_contact_correction());
  visit("discrepancy_constraint", state->mutable_discrepancy_constraint());
  visit("discrepancy_impulse", state->mutable_discrepancy_impulse());
  visit("discrepancy_correction", state->mutable_discrepancy_correction());
  visit("touching", state->mutable_touching());
  visit("rested", state->mutable_rested());
  visit("rest_wrench", state->mutable_rest_wrench());
}

void set_hash(const Hash& hash, recorder::v1::Hash* message) {
  message->set_low(hash.low);
  message->set_high(hash.high);
}

Hash hash_of(const recorder::v1::Hash& message) { return {message.low(), message.high()}; }

bool is_possible(const recorder::v1::Tally& tally) {
  for (const double number : {tally.largest_kinetic_energy(), tally.largest_energy_deviation(), tally.penetration(),
                              tally.joint_error(), tally.overlap().depth()})
    if (!(number >= 0.0)) return false;  // infinite where squares of speeds overflow
  return std::ranges::all_of(tally.meetings(), [](const recorder::v1::Meeting& meeting) {
    return std::isfinite(meeting.time()) && std::isfinite(meeting.speed());
  });
}

}  // namespace

Checkpoint make_checkpoint(const kernel::Environment& environment, const recorder::v1::Identity& identity,
                           const recorder::v1::Tally& tally, std::span<const recorder::v1::Decision> decisions) {
  const kernel::SavedState saved = environment.saved_state();
  Checkpoint checkpoint;
  checkpoint.set_build(GRAVITAS_BUILD_ID);
  *checkpoint.mutable_identity() = identity;
  checkpoint.set_step(saved.step);
  checkpoint.set_step_length(saved.step_length);
  set_hash(saved.state_hash, checkpoint.mutable_state_hash());
  set_hash(saved.chain_hash, checkpoint.mutable_chain_hash());
  checkpoint.set_penetration(saved.figures.penetration);
  checkpoint.set_joint_error(saved.figures.joint_error);
  checkpoint.mutable_wake_orders()->Add(saved.wake_orders.begin(), saved.wake_orders.end());
  checkpoint.set_asks_forces(environment.asks_forces());
  std::size_t next = 0;
  visit_columns(checkpoint.mutable_state(), [&]<typename T>(const char* name, pb::RepeatedField<T>* column) {
    const kernel::SavedColumn& source = saved.columns.at(next++);
    if (source.name != name) throw std::logic_error(fmt::format("the schema has {} for {}", name, source.name));
    const auto numbers = std::get<std::span<const T>>(source.numbers);
    column->Reserve(static_cast<int>(numbers.size()));
    column->Add(numbers.begin(), numbers.end());
  });
  *checkpoint.mutable_tally() = tally;
  for (const recorder::v1::Decision& decision : decisions) *checkpoint.add_decisions() = decision;
  for (const auto& [slot, target, budget] : saved.budgets) {
    recorder::v1::Budget* message = checkpoint.add_budgets();
    message->set_slot(slot_name(slot));
    message->set_target(target);
    message->set_failures(budget.failures);
    message->set_failures_in_a_row(budget.failures_in_a_row);
    message->set_good_answers(budget.good_answers);
  }
  return checkpoint;
}

std::vector<std::byte> serialize_checkpoint(const Checkpoint& checkpoint) {
  const std::size_t size = checkpoint.ByteSizeLong();
  if (size > std::numeric_limits<int>::max())
    throw std::length_error(fmt::format("a checkpoint of {} bytes is beyond the 2 GiB that one can hold", size));
  const Header header{kMagic, kVersion, 0, schema_digest(), size};
  std::vector<std::byte> bytes(sizeof header + size + kChecksumSize);
  std::memcpy(bytes.data(), &header, sizeof header);
  checkpoint.SerializeWithCachedSizesToArray(reinterpret_cast<std::uint8_t*>(bytes.data() + sizeof header));
  const auto checksum = checksum_of(std::span(bytes).first(sizeof header + size));
  std::ranges::copy(checksum, bytes.end() - kChecksumSize);
  return bytes;
}

std::optional<Checkpoint> parse_checkpoint(std::span<const std::byte> bytes, std::string* problem) {
  const auto refuse = [&](std::string why) {
    *problem = std::move(why);
    return std::nullopt;
  };
  Header header;
  if (bytes.size() < sizeof header.magic || std::memcmp(bytes.data(), kMagic.data(), kMagic.size()) != 0)
    return refuse(bytes.empty() ? "it is empty" : "it is not a checkpoint of Gravitas");
  if (bytes.size() < sizeof header + kChecksumSize) return refuse("it is cut short: not even its header is whole");
  std::memcpy(&header, bytes.data(), sizeof header);
  if (header.version != kVersion)
    return refuse(fmt::format("its format is version {}; this build reads version {}", header.version, kVersion));
  if (header.schema != schema_digest()) return refuse("its schema is not that of this build");
  if (header.size > std::numeric_limits<int>::max()) return refuse("it is damaged: its size is impossible");
  const std::size_t size = sizeof header + header.size + kChecksumSize;
  if (bytes.size() < size) return refuse(fmt::format("it is cut short: {} of {} bytes", bytes.size(), size));
  if (bytes.size() > size) return refuse(fmt::format("it is {} bytes longer than it says", bytes.size() - size));
  const auto checksum = checksum_of(bytes.first(size - kChecksumSize));
  if (!std::ranges::equal(checksum, bytes.last(kChecksumSize)))
    return refuse("it is damaged or was edited: its checksum does not fit its content");
  Checkpoint checkpoint;
  if (!checkpoint.ParseFromArray(bytes.data() + sizeof header, static_cast<int>(header.size)))
    return refuse("its content is no checkpoint message");
  if (!is_possible(checkpoint.tally())) return refuse("its tally for the report has an impossible number");
  return checkpoint;
}

std::string find_obstacle(const Checkpoint& checkpoint, const recorder::v1::Identity& scene) {
  if (checkpoint.build() != GRAVITAS_BUILD_ID)
    return fmt::format("it was made by build {}, and this is build {}: only the same build gives the same bits",
                       checkpoint.build(), GRAVITAS_BUILD_ID);
  if (checkpoint.listener_decided())
    return "a listener decided about pairs of bodies in that run, and what it decided is not kept";
  const std::string difference = find_difference(checkpoint.identity(), scene);
  return difference.empty() ? "" : "it belongs to another scene, which differs in: " + difference;
}

kernel::SavedState saved_state_of(Checkpoint* checkpoint) {
  const std::uint32_t step = checkpoint->step();
  const bool was_edited =
      std::ranges::any_of(checkpoint->edits(), [&](const edit::v1::Edit& edit) { return edit.step() == step + 1; });
  kernel::SavedState saved{step,
                           checkpoint->step_length(),
                           step == 0 || was_edited,
                           hash_of(checkpoint->state_hash()),
                           hash_of(checkpoint->chain_hash()),
                           {checkpoint->penetration(), checkpoint->joint_error()},
                           {checkpoint->wake_orders().begin(), checkpoint->wake_orders().end()},
                           {}};
  visit_columns(checkpoint->mutable_state(), [&]<typename T>(const char* name, pb::RepeatedField<T>* column) {
    saved.columns.push_back({name, std::span<const T>(column->data(), static_cast<std::size_t>(column->size()))});
  });
  for (const recorder::v1::Budget& one : checkpoint->budgets())
    if (const std::optional<Slot> slot = find_slot(one.slot()))
      saved.budgets.push_back({*slot, one.target(), {one.failures(), one.failures_in_a_row(), one.good_answers()}});
  return saved;
}

}  // namespace gravitas
