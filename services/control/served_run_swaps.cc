// Orders that exchange a plugin while the run goes on: swaps, comparisons, settings.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>

#include "plugin_sdk/near_miss.h"
#include "plugin_sdk/property_value.h"
#include "plugin_sdk/slots.h"
#include "services/control/served_run.h"
#include "services/recorder/decision.h"
#include "services/run/exchange_spec.h"
#include "services/scene/parser.h"

namespace gravitas::control {
namespace {

bool is_pending(kernel::SwapState state) {
  return state == kernel::SwapState::kPreparing || state == kernel::SwapState::kShadow;
}

// Where the numbers of a property begin among the flattened ones, and how many they are.
std::pair<std::size_t, std::size_t> place_of(const kernel::PluginChoice& plugin, const Property& wanted) {
  std::size_t begin = 0;
  for (const Property& property : plugin.declaration.properties) {
    const std::size_t size = flat_size_of(property, std::span(plugin.settings).subspan(begin));
    if (&property == &wanted) return {begin, size};
    begin += size;
  }
  throw std::logic_error("a property of another plugin");
}

const Property* find_property(const kernel::PluginChoice& plugin, const std::string& name) {
  const auto found = std::ranges::find(plugin.declaration.properties, name, &Property::name);
  return found == plugin.declaration.properties.end() ? nullptr : &*found;
}

PropertyValue parse_value(const std::string& what, const std::string& text) {
  try {
    return scene::bare_value(text);
  } catch (const scene::SyntaxError& error) {
    throw BadInput(fmt::format("{}: {}", what, error.text));
  }
}

}  // namespace

api::SwapOrdered ServedRun::swap(const api::SwapRequest& request) {
  SwapSpec spec;
  const std::string word = request.slot() + "=" + request.plugin(), verb = request.compares() ? "compare" : "swap";
  spec.text = verb + " " + word;
  spec.slot = parse_slot(verb, word, request.slot());
  spec.plugin = request.plugin();
  if (spec.plugin.empty()) throw BadInput(spec.text + ": allowed: the name of a plugin, or the path of a library");
  if (!request.hosting().empty()) spec.hosting = parse_hosting_mode(verb, word, request.hosting());
  // the settings of the moment, else those of the scene
  const auto [active, scenes] = between_steps([this] { return std::pair(active_, slots_of(description_)); });
  // a library is asked in a process, which the steps do not wait for; the copy keeps its name from staying known
  Catalog catalog = catalog_;
  kernel::SwapOrder found = resolve_swap(spec, scenes, &catalog);
  const auto take_settings_of = [&](const kernel::PluginChoice& one) {
    if (has_same_properties(one.declaration, found.plugin.declaration)) found.plugin.settings = one.settings;
  };
  std::ranges::for_each(active.slot(spec.slot).plugins, take_settings_of);
  return between_steps([&] {
    found.step = next_step(spec.text, request.step());
    // what was set for then, too
    for (const Order& one : pending_orders())
      if (!one.compares() && one.swap.slot == found.slot && one.swap.step <= found.step)
        take_settings_of(one.swap.plugin);
    return order(std::move(found), request.compares() ? OrderKind::kComparison : OrderKind::kSwap);
  });
}

api::ServedSwap ServedRun::call_off(const api::CallOffRequest& request) {
  return between_steps([&] {
    const auto found = std::ranges::find(orders_, request.number(), &Order::number);
    if (found != orders_.end() && environment_->call_off_swap(found->swap.slot, found->swap.step, found->rank)) {
      note(*found, true);
      return swap_message(*found, environment_->swaps());
    }
    std::vector<std::uint32_t> pending;
    for (const Order& one : pending_orders()) pending.push_back(one.number);
    const std::string what = fmt::format("call-off {}: ", request.number());
    const std::string allowed = pending.empty() ? std::string("none is on its way, and nothing is compared")
                                                : fmt::format("allowed: {}", fmt::join(pending, ", "));
    for (const api::ServedSwap& one : swap_messages())
      if (one.number() == request.number())
        throw NotNow(fmt::format("{}this {} already; {}", what,
                                 one.compares() ? std::string("comparison has ended") : "swap is " + one.outcome(),
                                 allowed));
    throw BadInput(fmt::format("{}no swap or comparison has that number; {}", what, allowed));
  });
}

api::SwapOrdered ServedRun::set_property(const api::SetPropertyRequest& request) {
  const std::string word = request.slot() + "." + request.property() + "=" + request.value();
  const std::string what = "set " + word;
  std::string name = request.slot();
  if (!name.empty()) name[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(name[0])));
  const Slot slot = parse_slot("set", word, name);
  const PropertyValue value = parse_value(what, request.value());
  return between_steps([&] {
    kernel::SwapOrder exchange;
    exchange.slot = slot;
    exchange.plugin = choice_with(what, slot, request.property(), environment_->swaps());
    const Property& property = *find_property(exchange.plugin, request.property());
    if (!property.is_live)
      throw BadInput(what + ": it cannot be changed while the run goes on; start it with --set " + word);
    std::vector<double> numbers;
    std::vector<PropertyProblem> problems;
    if (!flatten_value(property, value, &numbers, &problems)) throw BadInput(what + ": " + problems.at(0).text);
    std::vector<double>& settings = exchange.plugin.settings;
    const auto [begin, size] = place_of(exchange.plugin, property);
    const auto place = settings.begin() + static_cast<std::ptrdiff_t>(begin);
    settings.insert(settings.erase(place, place + static_cast<std::ptrdiff_t>(size)), numbers.begin(), numbers.end());
    exchange.step = next_step(what, 0);
    return order(std::move(exchange), OrderKind::kSetting);
  });
}

// The plugin of the slot that has the property: the one that comes with the next step, else the one that answers.
const kernel::PluginChoice& ServedRun::choice_with(const std::string& what, Slot slot, const std::string& property,
                                                   const std::vector<kernel::SwapRecord>& records) const {
  for (std::size_t i = orders_.size(); i-- > 0;) {
    const kernel::SwapOrder& swap = orders_[i].swap;
    if (!orders_[i].compares() && swap.slot == slot && swap.step <= environment_->step_count() + 1 &&
        find_property(swap.plugin, property) != nullptr && is_pending(record_of(orders_[i], records).state))
      return swap.plugin;
  }
  if (property.find('.') != std::string::npos)
    throw BadInput(
        fmt::format("{}: this changes settings of plugins, as in `set Solver.Iterations=50`; allowed for what "
                    "the scene says of a single force, joint or shape: gravitas ctl edit 'set PATH=VALUE'",
                    what));
  std::vector<std::string> names;
  for (const kernel::PluginChoice& plugin : active_.slot(slot).plugins) {
    if (find_property(plugin, property) != nullptr) return plugin;
    for (const Property& other : plugin.declaration.properties) names.push_back(other.name);
  }
  throw BadInput(fmt::format("{}: no plugin of slot {} has a property '{}'; {}", what, slot_name(slot), property,
                             allowed_names(property, names)));
}

const kernel::SwapRecord& ServedRun::record_of(const Order& order, const std::vector<kernel::SwapRecord>& records) {
  std::uint32_t rank = 0;
  for (const kernel::SwapRecord& record : records)
    if (record.slot == order.swap.slot && record.step == order.swap.step && rank++ == order.rank) return record;
  throw std::logic_error("a swap that was ordered is not known");
}

std::uint32_t ServedRun::rank_of(const kernel::SwapOrder& swap, const kernel::Environment& environment) {
  return static_cast<std::uint32_t>(std::ranges::count_if(environment.swaps(), [&](const kernel::SwapRecord& one) {
    return one.slot == swap.slot && one.step == swap.step;
  }));
}

std::vector<ServedRun::Order> ServedRun::pending_orders() const {
  const std::vector<kernel::SwapRecord> records = environment_->swaps();
  std::vector<Order> pending;
  for (const Order& one : orders_)
    if (is_pending(record_of(one, records).state)) pending.push_back(one);
  return pending;
}

api::SwapOrdered ServedRun::order(kernel::SwapOrder order, OrderKind kind) {
  // after those of a checkpoint for that step, which are no orders of here
  const std::uint32_t rank = rank_of(order, *environment_);
  try {
    environment_->order_swap(order, kind == OrderKind::kComparison);
  } catch (const std::invalid_argument& problem) {
    throw BadInput(problem.what());
  }
  api::SwapOrdered ordered;
  ordered.set_number(++last_order_);
  ordered.set_step(order.step);
  orders_.push_back({std::move(order), kind, last_order_, rank});
  note(orders_.back(), false);
  return ordered;
}

recorder::v1::Decision ServedRun::order_message(const Order& order) {
  return message_of(order.swap, order.kind == OrderKind::kSetting ? kOrderOfSetting : kOrderOfSwap);
}

void ServedRun::note(const Order& order, bool is_called_off) {
  if (order.compares()) return;
  recorder::v1::Decision message = order_message(order);
  if (is_called_off) message.set_why(kCalledOff);
  try {
    recorder_->note_order(message);
  } catch (const std::system_error& problem) {
    // a disk may be full
    fault_ = problem.what();
    keep_faulted_state();
  }
}

}  // namespace gravitas::control
