#include "services/survey/asked_slot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <string_view>
#include <utility>

#include "plugin_sdk/checks.h"

namespace gravitas::survey {
namespace {

using kernel::FaultKind;
using kernel::StageFault;

// "Collision.Rays" is a method of slot collision.
bool is_of(const stage::MethodInfo& method, Slot slot) {
  std::string service(std::string_view(method.name).substr(0, std::string_view(method.name).find('.')));
  service[0] = static_cast<char>(service[0] - 'A' + 'a');
  return service == slot_name(slot);
}

void require(const AnswerProblem& problem) {
  if (problem.text.empty()) return;
  throw StageFault(problem.is_structure ? FaultKind::kBadStructure : FaultKind::kBadNumbers,
                   problem.is_structure ? "structure" : "numbers", "its answer is wrong: " + problem.text);
}

// What holds of every answer, as the kernel demands it.
void require_rows_and_numbers(const stage::MethodInfo& method, const MessageColumns& request,
                              const MessageColumns& reply) {
  require({true, check_rows(method, request.counts(), reply.counts())});
  for (const stage::ColumnInfo& column : method.reply) {
    if (column.type != stage::ElementType::kF64) continue;
    if (const std::size_t i = first_not_finite(reply.f64(column.name)); i != kNoRow)
      require({false, fmt::format("{} of row {} is not finite", column.name, i / column.components)});
  }
}

}  // namespace

AskedSlot::AskedSlot(Slot which, kernel::SlotDescription description, std::uint32_t threads,
                     kernel::HostStarter starter)
    : which_(which), description_(std::move(description)), threads_(threads), starter_(std::move(starter)) {
  description_.standbys = 0;
  // whoever debugs a worker of the run shall not find questions in it
  if (description_.attached) {
    description_.hosting = kernel::Hosting::kSharedMemory;
    for (kernel::PluginChoice& plugin : description_.plugins) plugin.address.clear();
    description_.end_attachment();
  }
  for (std::uint32_t i = 0; i < stage::kMethodCount; ++i) {
    const auto method = static_cast<stage::Method>(i);
    const stage::MethodInfo& info = stage::method_info(method);
    if (!is_of(info, which_)) continue;
    Columns& columns = columns_[method];
    const auto add = [&](std::span<const stage::ColumnInfo> infos, std::vector<kernel::ColumnId>* ids) {
      for (const stage::ColumnInfo& column : infos)
        ids->push_back(arena_.add(column.type, 0, column.rows_index == stage::kScalar ? 1 : 0));
    };
    add(info.request, &columns.request);
    add(info.reply, &columns.reply);
  }
  arena_.seal();
}

AskedSlot::~AskedSlot() { stop(); }

void AskedSlot::stop() {
  if (slot_) slot_->drain();
  slot_.reset();
}

bool AskedSlot::has_capability(std::string_view name) const {
  return !is_empty() && std::ranges::all_of(description_.plugins, [&](const kernel::PluginChoice& plugin) {
    return gravitas::has_capability(plugin.declaration, name);
  });
}

int AskedSlot::process_id() const { return slot_ && slot_->is_running() ? slot_->hosts()[0].process_id : 0; }

void AskedSlot::start() {
  slot_.emplace(which_, description_);
  kernel::StageSlot* const alone = &*slot_;
  alone->find_hosts({&alone, 1}, threads_, starter_);
  alone->start(this, &faults_);
  alone->finish_start();
}

void AskedSlot::replace(std::uint32_t target, const kernel::PluginChoice& plugin, const kernel::SlotDescription& host) {
  stop();
  description_.plugins.at(target) = plugin;
  if (target == 0) description_.hosting = host.hosting;
}

void AskedSlot::copy_in(const stage::MethodInfo& method, const MessageColumns& request,
                        std::span<const kernel::ColumnId> columns) {
  const std::vector<gravitas_column> plain = request.plain();
  for (std::size_t i = 0; i < columns.size(); ++i) {
    arena_.set_count(columns[i], 0);
    if (plain[i].count > arena_.capacity(columns[i])) arena_.grow(columns[i], plain[i].count);
  }
  for (std::size_t i = 0; i < columns.size(); ++i) {
    arena_.set_count(columns[i], plain[i].count);
    if (plain[i].count == 0) continue;
    std::memcpy(arena_.data(columns[i]), plain[i].data, plain[i].count * stage::element_size(method.request[i].type));
  }
}

MessageColumns AskedSlot::copy_out(const stage::MethodInfo& method, std::span<const kernel::ColumnId> columns) const {
  MessageColumns reply(method.reply);
  std::vector<gravitas_reply_column> rooms = reply.rooms();
  for (std::size_t i = 0; i < columns.size(); ++i) rooms[i].count = arena_.count(columns[i]);
  reply.resize(rooms);
  rooms = reply.rooms();
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const std::uint64_t count = arena_.count(columns[i]);
    if (count == 0) continue;
    std::memcpy(rooms[i].data, arena_.data(columns[i]), count * stage::element_size(method.reply[i].type));
  }
  return reply;
}

MessageColumns AskedSlot::ask(stage::Method method, std::uint32_t target, const MessageColumns& request,
                              const Check& check) {
  const Columns& columns = columns_.at(method);
  const stage::MethodInfo& info = stage::method_info(method);
  ++questions_;
  try {
    if (!slot_) start();
    for (kernel::FaultInjection& fault : std::exchange(faults_to_come_, {})) slot_->inject(std::move(fault));
    slot_->begin_step(questions_);
    copy_in(info, request, columns.request);
    for (const kernel::ColumnId column : columns.reply) arena_.set_count(column, 0);
    MessageColumns answer = slot_->ask({method, target, columns.request, columns.reply}, &arena_, nullptr,
                                       [&](const auto&, const kernel::CallTimes*) {
                                         MessageColumns reply = copy_out(info, columns.reply);
                                         require_rows_and_numbers(info, request, reply);
                                         if (check) require(check(reply));
                                         return reply;
                                       });
    if (std::exchange(is_substituted_, false)) stop();
    return answer;
  } catch (const StageFault& fault) {
    slot_.reset();
    throw NoAnswer(fmt::format("slot {}, plugin {}: {}", slot_name(which_),
                               fault.plugin.empty() ? description_.plugins[target].declaration.name : fault.plugin,
                               fault.text()));
  } catch (...) {
    slot_.reset();
    throw;
  }
}

}  // namespace gravitas::survey
