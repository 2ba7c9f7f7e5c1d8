// What swaps make of a slot between two steps, and of the calls that are watched.
#include "kernel/swap.h"

#include <algorithm>
#include <utility>

#include "kernel/slot.h"
#include "plugin_sdk/channel/mailbox.h"

namespace gravitas::kernel {
namespace {

// A candidate in shadow gets this many times the longest call of the slot so far, and this at least, so that one that
// hangs holds up the run no longer than that, once.
constexpr std::uint64_t kShadowFactor = 10, kShadowNs = 100'000'000;
// Calls. What a plugin keeps of earlier ones would else be the same where it is asked again.
constexpr std::uint32_t kTwiceEvery = 16;

double microseconds(std::uint64_t since) { return 1e-3 * static_cast<double>(channel::now_ns() - since); }

}  // namespace

void StageSlot::order_swap(SwapOrder order, std::uint32_t target, bool only_compare) {
  PendingSwap& swap = pending_.emplace_back();
  swap.host = routes_[target].host, swap.target = target, swap.only_compare = only_compare, swap.record = swaps_.size();
  SwapRecord& record = swaps_.emplace_back();
  record.slot = which_, record.step = order.step, record.only_compared = only_compare;
  record.from = description_.plugins[target].declaration.name, record.to = order.plugin.declaration.name;
  swap.order = std::move(order);
  std::ranges::stable_sort(pending_, {}, [](const PendingSwap& one) { return one.order.step; });
  needs_attention_ = true;
  // before the first step there is time
  if (step_ == 0) prepare_swaps();
}

bool StageSlot::call_off_swap(std::uint32_t step, std::uint32_t rank) {
  std::size_t record = 0;
  while (record < swaps_.size() && (swaps_[record].step != step || rank-- > 0)) ++record;
  const auto swap = std::ranges::find(pending_, record, &PendingSwap::record);
  if (swap == pending_.end()) return false;
  hosts_[swap->host]->retire(std::move(swap->spare));
  refuse(&*swap, "called off");
  pending_.erase(swap);
  update_watch();
  return true;
}

std::vector<SwapRecord> StageSlot::swaps() const {
  std::vector<SwapRecord> records = swaps_;
  for (const PendingSwap& swap : pending_) records[swap.record].shadow = swap.shadow.result();
  return records;
}

void StageSlot::set_rerun_every(std::uint32_t steps) {
  rerun_.every = steps;
  update_watch();
}

void StageSlot::attend() {
  // the first step is not held up by what it does not need
  if (step_ > 1)
    for (const std::shared_ptr<SlotHost>& host : hosts_) host->keep_standbys();
  if (!pending_.empty() || !probation_.empty()) advance_swaps();
}

// A host's next swap is prepared as soon as the one before it has cut over, since it starts from there; again, if the
// host has changed meanwhile, for another slot that shares it, or by a fallback.
void StageSlot::prepare_swaps() {
  std::vector<std::size_t> busy;
  for (PendingSwap& swap : pending_) {
    if (std::ranges::find(busy, swap.host) != busy.end()) continue;
    if (!swap.only_compare) busy.push_back(swap.host);
    const bool is_stale = !swap.only_compare && swap.revision != hosts_[swap.host]->revision();
    if ((swap.spare || swap.candidate) && !is_stale) continue;
    if (swap.candidate) hosts_[swap.host]->retire(std::move(swap.candidate));
    hosts_[swap.host]->retire(std::move(swap.spare));
    swap.revision = hosts_[swap.host]->revision();
    const SlotDescription& now = hosts_[swap.host]->description();
    const std::uint32_t row = routes_[swap.target].target;
    swap.next = now;
    PluginChoice& next = swap.next.plugins[row] = swap.order.plugin;
    next.fallback = now.plugins[row].fallback;
    if (swap.order.has_taken_over && next.fallback && is_same_plugin(*next.fallback, next)) next.fallback = nullptr;
    if (swap.order.hosting) swap.next.hosting = *swap.order.hosting;
    if (swap.order.plugin.is_elsewhere()) swap.next.hosting = Hosting::kGrpc;
    swap.next.end_attachment();
    name_pair(swap);
    swap.spare = hosts_[swap.host]->prepare(swap.next);
  }
}

// Who answers now, and who is to.
void StageSlot::name_pair(const PendingSwap& swap) {
  const SlotDescription& now = hosts_[swap.host]->description();
  const PluginChoice &from = now.plugins[routes_[swap.target].target], &to = swap.order.plugin;
  const bool are_builds = from.declaration.name == to.declaration.name && from.library != to.library;
  const auto shown = [&](const PluginChoice& plugin, const SlotDescription& host) {
    std::string where = are_builds ? plugin.library : "";
    if (swap.next.hosting != now.hosting)
      where += (where.empty() ? "" : ", ") + std::string(hosting_name(host.hosting));
    return plugin.declaration.name + (where.empty() ? "" : " (" + where + ")");
  };
  swaps_[swap.record].from = shown(from, now), swaps_[swap.record].to = shown(to, swap.next);
}

void StageSlot::count_anew(PendingSwap* comparison, bool is_other) {
  if (!comparison->spare && !comparison->candidate) return;
  SwapRecord before = swaps_[comparison->record];
  name_pair(*comparison);
  if (!is_other && swaps_[comparison->record].from == before.from) return;
  if (comparison->shadow.result().calls > 0) {
    before.shadow = comparison->shadow.result();
    swaps_.push_back(std::move(before));
    swaps_[comparison->record].since = step_;
  }
  comparison->shadow.count_anew();
}

void StageSlot::advance_swaps() {
  std::vector<Probation> over;
  for (const Probation& probation : probation_)
    if (step_ >= swaps_[probation.record].step + SlotHost::kProbation) over.push_back(probation);
  for (const Probation& probation : over) close_all_probations(probation.host, SwapState::kCommitted, {});
  // a cut-over makes room for the preparation of the next
  for (bool again = true; again;) {
    prepare_swaps();
    const auto done = std::ranges::find_if(pending_, [&](PendingSwap& swap) { return advance_swap(&swap); });
    again = done != pending_.end();
    if (again) pending_.erase(done);
  }
  update_watch();
}

// True when it is done with: cut over, or refused.
bool StageSlot::advance_swap(PendingSwap* swap) {
  if (!swap->spare && !swap->candidate) return false;
  const bool is_due = !swap->only_compare && step_ >= swap->order.step;
  SwapRecord& record = swaps_[swap->record];
  if (swap->spare && (is_due || swap->only_compare || swap->spare->is_done())) {
    const std::uint64_t start = channel::now_ns();
    const std::unique_ptr<Spare> spare = std::move(swap->spare);
    try {
      swap->candidate = spare->take();
    } catch (const StageFault& fault) {
      refuse(swap, "it could not be prepared: " + fault.text());
      return true;
    }
    if (!swap->only_compare) record.wait_us += microseconds(start);
    record.state = SwapState::kShadow;
  }
  if (!is_due) return false;
  if (!swap->candidate->is_alive()) {
    refuse(swap, "its process ended before the cut-over");
    return true;
  }
  cut_over(swap);
  return true;
}

void StageSlot::cut_over(PendingSwap* swap) {
  const std::uint64_t start = channel::now_ns();
  SlotHost& host = *hosts_[swap->host];
  if (host.is_on_probation()) close_all_probations(&host, SwapState::kCommitted, {});
  SwapRecord& record = swaps_[swap->record];
  record.state = swap->order.has_taken_over ? SwapState::kCommitted : SwapState::kProbation;
  record.step = step_, record.shadow = swap->shadow.result();
  host.cut_over(which_, std::move(swap->candidate), std::move(swap->next), swap->order.has_taken_over);
  if (!swap->order.has_taken_over) probation_.push_back({&host, swap->record});
  // who comes in is asked already: a comparison that is lost in that would be taken out from under this swap
  is_watched_ = false;
  let_all_adopt(host, "swap", swap->target);
  swaps_[swap->record].pause_us = microseconds(start);
}

void StageSlot::refuse(PendingSwap* swap, const std::string& reason) {
  SwapRecord& record = swaps_[swap->record];
  record.state = SwapState::kRefused, record.reason = reason, record.shadow = swap->shadow.result();
  if (swap->candidate) {
    swap->candidate->kill();
    hosts_[swap->host]->retire(std::move(swap->candidate));
  }
}

void StageSlot::close_all_probations(SlotHost* host, SwapState state, const std::string& reason) {
  for (StageSlot* slot : slots_) slot->close_probation(host, state, reason);
  if (state == SwapState::kCommitted) host->end_probation();
}

void StageSlot::close_probation(const SlotHost* host, SwapState state, const std::string& reason) {
  std::erase_if(probation_, [&](const Probation& one) {
    if (one.host != host) return false;
    swaps_[one.record].state = state, swaps_[one.record].reason = reason;
    return true;
  });
}

void StageSlot::update_watch() {
  const auto is_in_shadow = [&](const PendingSwap& swap) {
    return swap.candidate && swap.may_shadow && (swap.only_compare || step_ + kShadowSteps >= swap.order.step);
  };
  is_watched_ = rerun_.every > 0;
  for (PendingSwap& swap : pending_) is_watched_ |= swap.is_in_shadow = is_in_shadow(swap);
}

void StageSlot::watch(const StageCall& call, const CallTimes& times, Arena* arena, DerivativeSource* derivatives,
                      const std::function<void()>& recheck) {
  const std::size_t before = pending_.size();
  for (auto swap = pending_.begin(); swap != pending_.end();) {
    const bool is_lost = swap->is_in_shadow && swap->target == call.target &&
                         !watch_swap(&*swap, call, times, arena, derivatives, recheck);
    swap = is_lost ? pending_.erase(swap) : swap + 1;
  }
  if (pending_.size() < before) update_watch();
  if (rerun_.every > 0 && step_ % rerun_.every == 0) rerun(call, arena, derivatives, recheck);
}

// False if the swap is refused.
bool StageSlot::watch_swap(PendingSwap* swap, const StageCall& call, const CallTimes& first, Arena* arena,
                           DerivativeSource* derivatives, const std::function<void()>& recheck) {
  StageCall routed = call;
  routed.target = routes_[call.target].target;
  routed.is_compared = true;
  routed.deadline_ns = swap->only_compare ? 0 : std::max(kShadowNs, kShadowFactor * slow_calls_.longest());
  try {
    CallTimes second;
    swap->shadow.compare(call, arena, [&] {
      if (derivatives != nullptr) derivatives->begin_attempt(false);
      const std::uint64_t begin = lap_ns();
      call_with_room(swap->candidate.get(), routed, arena, derivatives, &second);
      second.whole = lap_between(begin, lap_ns());
      recheck();
    });
    const auto worked = [](const CallTimes& times) { return times.compute > 0 ? times.compute : times.whole; };
    swap->shadow.add_times(worked(first), worked(second));
    return true;
  } catch (const StageFault& fault) {
    if (!fault.plugin.empty()) throw;
    // an answer, where nobody goes on with it
    if (fault.kind == FaultKind::kRefusal && swap->only_compare) {
      swap->shadow.add_refusal(fault.text());
      return true;
    }
    if (fault.kind != FaultKind::kDeadline || swap->only_compare) {
      refuse(swap, "in shadow: " + fault.text());
      return false;
    }
    // slow is no reason to refuse; it was ended all the same, and goes on unseen until the cut-over
    complaints_.push_back("the swap to " + swap->order.plugin.declaration.name +
                          " goes on without a shadow: it takes over ten times as long");
    hosts_[swap->host]->retire(std::move(swap->candidate));
    swap->spare = hosts_[swap->host]->prepare(swap->next);
    swap->may_shadow = swap->is_in_shadow = false;
    return true;
  }
}

// The same request to another process of the same plugins: of two that differ one is wrong, and a third says which. Whom a
// nested call lets take over makes the step again: then answers differ for a good reason, and who was asked here for
// comparison, which is ours meanwhile, may have the plugins of before.
void StageSlot::rerun(const StageCall& call, Arena* arena, DerivativeSource* derivatives,
                      const std::function<void()>& recheck) {
  const std::size_t place = routes_[call.target].host;
  SlotHost& host = *hosts_[place];
  StageCall routed = call;
  routed.target = routes_[call.target].target;
  routed.is_compared = true;
  const auto revisions = [&] {
    std::uint32_t sum = 0;
    for (const StageSlot* slot : slots_)
      for (const std::shared_ptr<SlotHost>& one : slot->hosts_) sum += one->revision();
    return sum;
  };
  const std::uint32_t revision = host.revision(), revisions_before = revisions();
  rerun_.checkers.resize(hosts_.size());
  Checker& kept = rerun_.checkers[place];
  if (kept.is_lacking) return;
  std::unique_ptr<Carrier> checker = std::move(kept.process);
  // whether it gave other bytes
  const auto differs = [&] {
    Shadow shadow;
    for (int times = kept.asked++ % kTwiceEvery == 0 ? 2 : 1; times > 0 && !shadow.last_differed(); --times)
      shadow.compare(call, arena, [&] {
        CallTimes taken;
        if (derivatives != nullptr) derivatives->begin_attempt(false);
        call_with_room(checker.get(), routed, arena, derivatives, &taken);
        recheck();
      });
    return shadow.last_differed();
  };
  // `unknown` is what holds where nobody else can be asked
  const auto is_doubted = [&](bool unknown) {
    std::string why;
    for (int tries = 0; !checker && tries < 2; ++tries) {
      try {
        checker = host.prepare(host.description())->take();
      } catch (const StageFault& fault) {
        why = fault.text();
      }
    }
    if (!checker) {
      complaints_.push_back("no other process for a re-run, and none is looked for any more: " + why);
      kept.is_lacking = true;
      return unknown;
    }
    try {
      return differs();
    } catch (const StageFault& fault) {
      if (!fault.plugin.empty()) throw;
      checker->kill();
      host.retire(std::move(checker));
      if (fault.kind != FaultKind::kDeath && fault.kind != FaultKind::kDeadline) return true;
      complaints_.push_back("a re-run came to nothing: " + fault.text());
      return unknown;
    }
  };
  const auto keep = [&] {
    if (host.revision() != revision) return host.retire(std::move(checker));
    kept.process = std::move(checker);
  };
  if (!is_doubted(false)) return keep();
  if (checker) {
    checker->kill();
    host.retire(std::move(checker));
  }
  if (revisions() != revisions_before) return;
  const bool is_outvoted = is_doubted(true);
  keep();
  if (revisions() != revisions_before) return;
  if (is_outvoted)
    throw StageFault(FaultKind::kDisagreement, "re-run",
                     "another process answered the same request otherwise, and no third agreed");
  complaints_.emplace_back("another process answered the same request otherwise; a third agreed with the first");
}

}  // namespace gravitas::kernel
