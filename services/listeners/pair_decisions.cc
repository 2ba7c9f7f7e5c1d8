#include "services/listeners/pair_decisions.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <condition_variable>
#include <exception>
#include <map>
#include <mutex>
#include <string_view>
#include <thread>
#include <utility>

#include "plugin_sdk/counted.h"

namespace gravitas {
namespace {

std::pair<std::uint32_t, std::uint32_t> pair_of(const PairQuestion& one) { return {one.a, one.b}; }

// As the scene has it.
std::array<double, kMaterialColumns> material_of(const kernel::Model& model, std::uint32_t a, std::uint32_t b) {
  std::array<double, kMaterialColumns> material;
  const std::size_t row = std::size_t{model.material[a]} * model.material_count + model.material[b];
  std::copy_n(&model.material_pairs[kMaterialColumns * row], kMaterialColumns, material.begin());
  return material;
}

// Why answers cannot be used; empty if they can.
std::string find_impossible(std::span<const PairQuestion> answers) {
  for (const PairQuestion& answer : answers) {
    for (const double number : answer.material)
      if (!std::isfinite(number) || number < 0.0)
        return fmt::format("its material of '{}' and '{}' has the number {}; allowed: finite ones >= 0", answer.id_a,
                           answer.id_b, number);
    if (answer.material[kRestitution] > 1.0)
      return fmt::format("its material of '{}' and '{}' has the restitution {}; allowed: 0 to 1", answer.id_a,
                         answer.id_b, answer.material[kRestitution]);
  }
  return {};
}

}  // namespace

struct PairDecisions::Desk {
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<PairQuestion> pairs;
  std::string problem;
  bool is_asked = false, is_answered = false, has_ended = false;

  static void serve(const std::shared_ptr<Desk>& desk, const std::shared_ptr<PairListener>& listener) {
    std::unique_lock lock(desk->mutex);
    for (;;) {
      desk->changed.wait(lock, [&] { return desk->is_asked || desk->has_ended; });
      if (desk->has_ended) return;
      desk->is_asked = false;
      std::vector<PairQuestion> pairs = desk->pairs;
      std::string problem;
      lock.unlock();
      try {
        listener->on_pairs(pairs);
      } catch (const std::exception& error) {
        problem = fmt::format("it threw: {}", error.what());
      } catch (...) {
        problem = "it threw";
      }
      lock.lock();
      if (problem.empty()) {
        // no more than decisions: of whom is not the listener's to say
        for (std::size_t i = 0; i < pairs.size(); ++i) {
          desk->pairs[i].may_collide = pairs[i].may_collide;
          desk->pairs[i].material = pairs[i].material;
        }
      }
      desk->problem = std::move(problem);
      desk->is_answered = true;
      desk->changed.notify_all();
    }
  }
};

void PairDecisions::listen(std::shared_ptr<PairListener> listener, double deadline) {
  leave();
  deadline_ = deadline;
  desk_ = std::make_shared<Desk>();
  std::thread(Desk::serve, desk_, std::move(listener)).detach();
}

void PairDecisions::leave() {
  const std::shared_ptr<Desk> desk = std::exchange(desk_, nullptr);
  if (!desk) return;
  const std::lock_guard lock(desk->mutex);
  desk->has_ended = true;
  desk->changed.notify_all();
}

void PairDecisions::leave_aside(const std::string& why) {
  leave();
  report_(fmt::format("the listener that decides about pairs is left aside: {}; the scene's own rules hold", why));
}

void PairDecisions::follow(const kernel::Model& before, const kernel::Model& after) {
  if (decided_.empty()) return;
  std::map<std::string_view, std::uint32_t> rows;
  for (std::uint32_t i = 0; i < after.body_count; ++i) rows[after.body_id[i]] = i;
  std::erase_if(decided_, [&](PairQuestion& one) {
    const auto a = rows.find(one.id_a), b = rows.find(one.id_b);
    if (a == rows.end() || b == rows.end()) return true;
    const std::uint32_t first = std::min(a->second, b->second), second = std::max(a->second, b->second);
    const bool is_as_before = material_of(before, one.a, one.b) == material_of(after, first, second);
    if (first != a->second) std::swap(one.id_a, one.id_b);
    one.a = first, one.b = second;
    return !is_as_before;
  });
  std::ranges::sort(decided_, {}, pair_of);
}

PairDecisions::Decisions::const_iterator PairDecisions::find(Decisions::const_iterator from, std::uint32_t a,
                                                             std::uint32_t b) const {
  const auto found = std::ranges::lower_bound(from, decided_.end(), std::pair{a, b}, {}, pair_of);
  return found != decided_.end() && pair_of(*found) == std::pair{a, b} ? found : decided_.end();
}

std::size_t PairDecisions::keep_allowed(const kernel::Environment& environment, std::span<std::uint32_t> pairs) {
  const kernel::Model& model = environment.model();
  std::vector<PairQuestion> questions;
  for (std::size_t i = 0; i < pairs.size() && is_listening(); i += 2) {
    const std::uint32_t a = pairs[i], b = pairs[i + 1];
    if (find(decided_.begin(), a, b) != decided_.end()) continue;
    questions.push_back({a, b, model.body_id[a], model.body_id[b], true, material_of(model, a, b)});
  }
  if (!questions.empty()) ask(std::move(questions));
  return leave_out_forbidden(pairs);
}

std::size_t PairDecisions::leave_out_forbidden(std::span<std::uint32_t> pairs) const {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < pairs.size(); i += 2) {
    const auto decision = find(decided_.begin(), pairs[i], pairs[i + 1]);
    if (decision != decided_.end() && !decision->may_collide) continue;
    pairs[kept++] = pairs[i];
    pairs[kept++] = pairs[i + 1];
  }
  return kept;
}

void PairDecisions::mix_materials(std::span<const std::uint32_t> bodies, std::span<double> rows) {
  for (std::size_t i = 0; i < bodies.size() / 2; ++i) {
    const auto decision = find(decided_.begin(), bodies[2 * i], bodies[2 * i + 1]);
    if (decision != decided_.end()) std::ranges::copy(decision->material, rows.subspan(kMaterialColumns * i).begin());
  }
}

void PairDecisions::ask(std::vector<PairQuestion> questions) {
  const std::shared_ptr<Desk> desk = desk_;
  std::string problem;
  {
    std::unique_lock lock(desk->mutex);
    desk->pairs = std::move(questions);
    desk->is_asked = true;
    desk->is_answered = false;
    desk->changed.notify_all();
    if (desk->changed.wait_for(lock, std::chrono::duration<double>(deadline_), [&] { return desk->is_answered; })) {
      problem = desk->problem;
      questions = std::move(desk->pairs);
    } else {
      problem = fmt::format("no answer within {:g} s about {}", deadline_, counted(desk->pairs.size(), "pair"));
    }
  }
  if (problem.empty()) problem = find_impossible(questions);
  if (!problem.empty()) return leave_aside(problem);
  const auto middle = static_cast<std::ptrdiff_t>(decided_.size());
  std::ranges::move(questions, std::back_inserter(decided_));
  std::ranges::inplace_merge(decided_, decided_.begin() + middle, {}, pair_of);
}

}  // namespace gravitas
