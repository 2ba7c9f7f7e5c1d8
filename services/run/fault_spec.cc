#include "services/run/fault_spec.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <optional>
#include <string_view>
#include <vector>

#include "plugin_sdk/host/fault_kinds.h"
#include "plugin_sdk/near_miss.h"
#include "plugin_sdk/slots.h"
#include "schemas/stage_frames.h"
#include "services/run/session.h"

namespace gravitas {
namespace {

[[noreturn]] void refuse(const std::string& what, const std::string& why) {
  throw BadInput(fmt::format("{}: {}", what, why));
}

Slot slot_of(const std::string& name, const std::string& what) {
  std::vector<std::string> names;
  for (const Slot slot : kSlots) {
    if (name == slot_name(slot)) return slot;
    names.emplace_back(slot_name(slot));
  }
  refuse(what, fmt::format("there is no slot '{}': {}", name, allowed_names(name, names)));
}

std::vector<std::string_view> split(std::string_view text) {
  std::vector<std::string_view> parts;
  for (;;) {
    const std::size_t comma = text.find(',');
    parts.push_back(text.substr(0, comma));
    if (comma == std::string_view::npos) return parts;
    text.remove_prefix(comma + 1);
  }
}

// Takes `name=N` out of the arguments, once at most.
std::optional<std::uint32_t> take_count(std::vector<std::string_view>* arguments, std::string_view name,
                                        const std::string& what) {
  std::optional<std::uint32_t> found;
  const std::string key = std::string(name) + "=";
  for (const std::string_view argument : *arguments) {
    if (argument != name && !argument.starts_with(key)) continue;
    if (found) refuse(what, fmt::format("'{}' is given twice", name));
    const std::string_view text = argument.substr(std::min(key.size(), argument.size()));
    std::uint32_t number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc() || end != text.data() + text.size() || number < 1)
      refuse(what, fmt::format("'{}': allowed for {}: a whole number from 1 to 4294967295", argument, name));
    found = number;
  }
  std::erase_if(*arguments, [&](std::string_view one) { return one.starts_with(key); });
  return found;
}

// Of a reply of the slot; where rows are numbered, one of numbers.
void require_column(const host::FaultOrder& order, Slot slot, const std::string& what) {
  const std::string name(order.word("column"));
  const bool is_of_numbers =
      std::ranges::find(order.info().arguments, "row", &host::FaultArgument::name) != order.info().arguments.end();
  std::vector<std::string> names;
  for (const stage::MethodInfo& method : stage::kMethods) {
    std::string owner = std::string(method.name).substr(0, std::string_view(method.name).find('.'));
    owner[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(owner[0])));
    if (owner != slot_name(slot)) continue;
    for (const stage::ColumnInfo& column : method.reply)
      if ((!is_of_numbers || column.type == stage::ElementType::kF64) &&
          std::ranges::find(names, column.name) == names.end())
        names.emplace_back(column.name);
  }
  if (std::ranges::find(names, name) == names.end())
    refuse(what, fmt::format("replies of slot {} have no column '{}'{}: {}", slot_name(slot), name,
                             is_of_numbers ? " of numbers" : "", allowed_names(name, names)));
}

// Where no step is needed and none is given, it is 0.
kernel::FaultInjection parse(const std::string& option, const std::string& text, bool needs_step) {
  const std::string what = option + " " + text;
  const std::string form = fmt::format("; the form is {}", needs_step ? "SLOT:KIND@step=N[,ARGUMENT=VALUE]..."
                                                                      : "SLOT:KIND[@step=N][,ARGUMENT=VALUE]...");
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos) refuse(what, "no ':' behind the slot" + form);
  kernel::FaultInjection fault;
  fault.slot = slot_of(text.substr(0, colon), what);

  const std::string_view rest = std::string_view(text).substr(colon + 1);
  const std::size_t at = std::min(rest.find('@'), rest.size());
  const bool has_step = at < rest.size();
  if (!has_step && needs_step) refuse(what, "no '@step=N' behind the kind" + form);
  std::vector<std::string_view> order = split(rest.substr(0, at));
  if (has_step)
    for (const std::string_view argument : split(rest.substr(at + 1))) order.push_back(argument);

  const std::optional<std::uint32_t> step = take_count(&order, "step", what);
  if (!step && has_step) refuse(what, "no step=N behind '@'" + form);
  fault.times = take_count(&order, "times", what).value_or(1);
  for (const std::string_view part : order) fault.order += (fault.order.empty() ? "" : ",") + std::string(part);
  std::string problem;
  const std::optional<host::FaultOrder> read = host::parse_fault_order(fault.order, &problem);
  if (!read) refuse(what, problem);
  if (read->gives("column")) require_column(*read, fault.slot, what);
  fault.step = step.value_or(0);
  return fault;
}

}  // namespace

kernel::FaultInjection parse_fault(const std::string& text) { return parse("--fault", text, true); }

kernel::FaultInjection parse_inject(const std::string& text) { return parse("inject", text, false); }

void require_worker(const kernel::FaultInjection& fault, std::span<const kernel::SwapOrder> swaps) {
  const kernel::SwapOrder* last = nullptr;
  for (const kernel::SwapOrder& swap : swaps)
    if (swap.slot == fault.slot && swap.hosting && swap.step <= fault.step &&
        (last == nullptr || swap.step >= last->step))
      last = &swap;
  if (last != nullptr && *last->hosting == kernel::Hosting::kDirect)
    throw BadInput(
        fmt::format("fault {} in slot {}: from step {} on --swap has it hosted in the kernel's own process "
                    "(direct), which the fault would hit",
                    fault.order, slot_name(fault.slot), last->step));
}

std::string fault_help() {
  std::string text;
  std::string_view group;
  for (const host::FaultInfo& kind : host::fault_kinds()) {
    if (kind.group != group) text += fmt::format("{}\n", kind.group);
    group = kind.group;
    text += fmt::format("  {:<12} {}\n", kind.name, kind.meaning);
    for (const host::FaultArgument& argument : kind.arguments) {
      text += fmt::format("    {}: {}", argument.name, argument.meaning);
      std::string words;
      for (const std::string_view word : argument.words) words += (words.empty() ? "" : "|") + std::string(word);
      if (!words.empty()) text += fmt::format(", {}", words);
      if (!argument.standard.empty()) text += fmt::format(" [{}]", argument.standard);
      text += '\n';
    }
  }
  return text;
}

}  // namespace gravitas
