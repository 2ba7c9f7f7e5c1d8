#include "services/scene/build_filter.h"

#include <algorithm>
#include <map>
#include <string>

#include "services/scene/filter_bits.h"

namespace gravitas::scene {
namespace {

using v1::Rule;

// The bodies of a term of a rule, by row.
using Members = std::vector<bool>;

// A pair is named if one body is in `first` and the other in `second`, or anywhere where `second` is empty.
struct CompiledRule {
  bool allow = true;
  Members first, second;
};

// The relation has a bit for every two kinds, and finding bits for it takes the more time.
constexpr std::size_t kMostKinds = 2048;

class FilterBuilder {
 public:
  FilterBuilder(const IdIndex& bodies, BuildContext* context)
      : bodies_(bodies),
        context_(*context),
        diagnostics_(*context->diagnostics),
        filter_(context->environment.collision_filter()),
        body_count_(context->description.bodies.size()) {
    const auto& blocks = context->environment.space().bodies().body();
    for (int i = 0; i < blocks.size(); ++i) {
      for (const std::string& group : blocks[i].collision_groups()) {
        Members& members = groups_[group];
        members.resize(body_count_);
        members[static_cast<std::size_t>(i)] = true;
      }
    }
  }

  void build() {
    if (!context_.environment.has_collision_filter()) return;
    // in the order in which they are asked
    for (const v1::Rules* rules : {&filter_.exceptions(), &filter_.rules()})
      for (const Rule& rule : rules->rule()) compile(rule);
    if (diagnostics_.ok()) set_bits();
  }

 private:
  // ---- from text to members

  void compile(const Rule& rule) {
    constexpr int kTerms[] = {Rule::kBodyFieldNumber, Rule::kBodiesFieldNumber, Rule::kGroupFieldNumber,
                              Rule::kGroupsFieldNumber};
    const auto is_there = [&](int term) { return is_written(rule, term); };
    if (std::ranges::count_if(kTerms, is_there) != 1) {
      diagnostics_.error(place_of(rule.location()),
                         "a Rule names its pairs by one of Body, Bodies, Group, Groups; here are " +
                             std::to_string(std::ranges::count_if(kTerms, is_there)));
      return;
    }
    const int term = *std::ranges::find_if(kTerms, is_there);
    const TextPosition place = place_of(rule, term);
    CompiledRule compiled{rule.allow(), {}, {}};
    switch (term) {
      case Rule::kBodyFieldNumber:
        compiled.first = body(rule.body(), "Body", place);
        break;
      case Rule::kBodiesFieldNumber:
        if (!are_two("Bodies", rule.bodies(), place)) return;
        if (rule.bodies(0) == rule.bodies(1)) {
          diagnostics_.error(place, "Bodies names \"" + rule.bodies(0) + "\" twice; required: two bodies");
          return;
        }
        compiled.first = body(rule.bodies(0), "Bodies", place);
        compiled.second = body(rule.bodies(1), "Bodies", place);
        break;
      case Rule::kGroupFieldNumber:
        compiled.first = group(rule.group(), "Group", place);
        break;
      default:
        if (!are_two("Groups", rule.groups(), place)) return;
        compiled.first = group(rule.groups(0), "Groups", place);
        compiled.second = group(rule.groups(1), "Groups", place);
    }
    rules_.push_back(std::move(compiled));
  }

  bool are_two(const std::string& name, const google::protobuf::RepeatedPtrField<std::string>& ids,
               const TextPosition& place) {
    if (ids.size() == 2) return true;
    diagnostics_.error(place, name + " is a list of " + std::to_string(ids.size()) + "; required: 2 names");
    return false;
  }

  Members body(const std::string& id, const std::string& property, const TextPosition& place) {
    Members members(body_count_);
    const std::uint32_t row = bodies_.find(id, property, place, &diagnostics_);
    if (row != kNone) members[row] = true;
    return members;
  }

  Members group(const std::string& name, const std::string& property, const TextPosition& place) {
    if (const auto found = groups_.find(name); found != groups_.end()) return found->second;
    std::vector<std::string> names;
    for (const auto& [known, members] : groups_) names.push_back(known);
    diagnostics_.error(place, property + " names no group of any body's CollisionGroups: \"" + name + "\"; " +
                                  allowed_names(name, names));
    return Members(body_count_);
  }

  // ---- from members to bits

  // Bodies that all rules treat alike are of one kind.
  void find_kinds() {
    std::map<std::string, std::uint32_t> known;
    kind_of_.assign(body_count_, kNone);
    for (std::uint32_t i = 0; i < body_count_; ++i) {
      if ((context_.description.bodies[i].flags & kHasShape) == 0) continue;
      std::string key;
      for (const CompiledRule& rule : rules_) {
        key += rule.first[i] ? '1' : '0';
        if (!rule.second.empty()) key += rule.second[i] ? '1' : '0';
      }
      const auto [entry, is_new] = known.try_emplace(key, static_cast<std::uint32_t>(kinds_.size()));
      if (is_new) kinds_.push_back({i, 0});
      kind_of_[i] = entry->second;
      ++kinds_[entry->second].bodies;
    }
  }

  // Kinds whose bodies are members; all where there is no list.
  std::vector<std::uint32_t> kinds_in(const Members& members) const {
    std::vector<std::uint32_t> kinds;
    for (std::uint32_t k = 0; k < kinds_.size(); ++k)
      if (members.empty() || members[kinds_[k].example]) kinds.push_back(k);
    return kinds;
  }

  KindRelation allowed_kinds() const {
    KindRelation allowed(kinds_.size());
    for (std::uint32_t k = 0; k < kinds_.size(); ++k)
      for (std::uint32_t m = 0; m < kinds_.size(); ++m) allowed.set(k, m, filter_.default_allow());
    // the first that names a pair comes last, and stays
    for (auto rule = rules_.rbegin(); rule != rules_.rend(); ++rule) {
      const std::vector<std::uint32_t> second = kinds_in(rule->second);
      for (const std::uint32_t k : kinds_in(rule->first))
        for (const std::uint32_t m : second) allowed.set(k, m, rule->allow), allowed.set(m, k, rule->allow);
    }
    return allowed;
  }

  void set_bits() {
    find_kinds();
    std::vector<FilterBits> bits;
    if (kinds_.size() <= kMostKinds) {
      const KindRelation allowed = allowed_kinds();
      KindRelation needed = allowed, harmless = allowed;
      for (std::uint32_t k = 0; k < kinds_.size(); ++k) {
        // a body alone of its kind never meets it
        if (kinds_[k].bodies == 1) needed.set(k, k, false), harmless.set(k, k, true);
      }
      bits = find_filter_bits(needed, harmless);
    }
    if (bits.empty() && !kinds_.empty()) {
      diagnostics_.error(place_of(filter_.location()),
                         "the CollisionFilter tells " + std::to_string(kinds_.size()) + " kinds of bodies apart, " +
                             (kinds_.size() > kMostKinds ? "more than " + std::to_string(kMostKinds)
                                                         : "in a way that 64 bits cannot hold") +
                             "; allowed: fewer kinds, such as rules about groups instead of single bodies");
      return;
    }
    for (std::uint32_t i = 0; i < body_count_; ++i) {
      if (kind_of_[i] == kNone) continue;
      context_.description.bodies[i].filter_group = bits[kind_of_[i]].group;
      context_.description.bodies[i].filter_mask = bits[kind_of_[i]].mask;
    }
  }

  struct Kind {
    std::uint32_t example;  // a body
    std::uint32_t bodies;   // how many
  };

  const IdIndex& bodies_;
  BuildContext& context_;
  Diagnostics& diagnostics_;
  const v1::CollisionFilter& filter_;
  std::size_t body_count_;
  std::map<std::string, Members> groups_;
  std::vector<CompiledRule> rules_;
  std::vector<std::uint32_t> kind_of_;  // by body; kNone without a shape
  std::vector<Kind> kinds_;
};

}  // namespace

void build_filter(const IdIndex& bodies, BuildContext* context) { FilterBuilder(bodies, context).build(); }

}  // namespace gravitas::scene
