// C0: a plugin says who it is, is well declared, starts, and refuses with a reason what is not for it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernel/control_session.h"
#include "plugin_sdk/channel/mailbox.h"
#include "plugin_sdk/declaration_check.h"
#include "plugin_sdk/property_value.h"
#include "services/check/bare_worker.h"
#include "services/check/describe.h"
#include "services/check/examination.h"

namespace gravitas::check {

using conformance::Level;
using control::v1::Hello;

namespace {

// ---- greetings

constexpr std::uint64_t kEpoch = 0xC0C0;

Hello hello_for(const Examinee& examinee, const std::vector<double>& settings) {
  Hello hello = kernel::hello_of_this_kernel();
  hello.set_epoch(kEpoch);
  hello.set_nonce(channel::now_ns());
  hello.set_threads(1);
  control::v1::PluginSettings* plugin = hello.add_plugins();
  plugin->set_plugin(examinee.declaration.name);
  plugin->mutable_numbers()->Add(settings.begin(), settings.end());
  return hello;
}

// Empty if a fresh worker refuses the greeting with a reason.
std::string demand_refusal(const Examination& examination, const Hello& hello, const std::string& what) {
  const double seconds = examination.patience.start;
  const Greeted greeted = BareWorker(examination.examinee, seconds).greet(hello, seconds);
  if (greeted.outcome == Greeted::kReady) return fmt::format("{} is accepted", what);
  if (greeted.outcome != Greeted::kRefused) return fmt::format("{}: {}", what, greeted.text);
  return greeted.text.empty() ? fmt::format("{} is refused without a reason", what) : "";
}

std::string judge_same_description(Examination& examination) {
  plugin::v1::Description again;
  const std::string problem = describe(examination.examinee, examination.patience.start, &again);
  if (!problem.empty()) return "asked a second time: " + problem;
  const bool is_same = again.SerializeAsString() == examination.examinee.description.SerializeAsString();
  return is_same ? "" : "it describes itself differently the second time";
}

std::string judge_start(Examination& examination) {
  const Examinee& examinee = examination.examinee;
  const double seconds = examination.patience.start;
  const Hello hello = hello_for(examinee, examinee.settings);
  const Greeted greeted = BareWorker(examinee, seconds).greet(hello, seconds);
  if (greeted.outcome != Greeted::kReady || !greeted.text.empty())
    return fmt::format("it does not get ready with its defaults: {}", greeted.text);
  const control::v1::Welcome& welcome = greeted.welcome;
  if (welcome.magic() != GRAVITAS_MAGIC) return "its Welcome has another magic number";
  if (welcome.protocol() < hello.protocol_minimum() || welcome.protocol() > hello.protocol_maximum())
    return fmt::format("its Welcome names protocol {}, which was not offered", welcome.protocol());
  if (welcome.schema_hash() != hello.schema_hash()) return "its Welcome has another schema hash";
  if (welcome.epoch() != hello.epoch() || welcome.nonce() != hello.nonce())
    return "its Welcome does not repeat epoch and nonce of the greeting";
  if (welcome.plugins_size() != 1) return fmt::format("its Welcome names {} plugins, not one", welcome.plugins_size());
  if (welcome.plugins(0).SerializeAsString() != examinee.description.SerializeAsString())
    return "its Welcome describes another plugin than --describe does";
  return {};
}

// ---- settings

// Values that a property does not take.
std::vector<double> forbidden_values(const Property& p) {
  std::vector<double> values = {std::numeric_limits<double>::infinity()};
  if (p.is_required || !p.default_numbers.empty()) values.push_back(std::numeric_limits<double>::quiet_NaN());
  // the nearest that it does not take: of whole numbers a whole one
  const double least = p.kind == PropertyKind::kInteger ? 1.0 : 0.0;
  const double below = std::min(p.minimum - least, std::nextafter(p.minimum, -HUGE_VAL));
  if (std::isfinite(p.minimum)) values.push_back(p.exclusive_minimum ? p.minimum : below);
  if (std::isfinite(p.maximum)) values.push_back(std::max(p.maximum + least, std::nextafter(p.maximum, HUGE_VAL)));
  const double half = std::max(p.minimum, 0.0) + 0.5;
  if (p.kind == PropertyKind::kInteger && half != std::floor(half)) values.push_back(half);
  if (p.kind == PropertyKind::kFlag) values.push_back(2.0);
  if (p.kind == PropertyKind::kChoice) values.push_back(static_cast<double>(p.choices.size()));
  if (p.kind == PropertyKind::kBody) values.push_back(-1.0);
  // beside three numbers of any size: not unit
  if (p.kind == PropertyKind::kQuaternion) values.push_back(2.0);
  return values;
}

std::string judge_number_of_settings(Examination& examination) {
  const Examinee& examinee = examination.examinee;
  std::vector<double> numbers = examinee.settings;
  numbers.push_back(1.0);
  std::string finding =
      demand_refusal(examination, hello_for(examinee, numbers), "a number more than its properties take");
  if (!finding.empty() || examinee.settings.empty()) return finding;
  numbers.resize(examinee.settings.size() - 1);
  return demand_refusal(examination, hello_for(examinee, numbers), "a number less than its properties take");
}

std::string judge_settings(Examination& examination) {
  const Examinee& examinee = examination.examinee;
  std::size_t at = 0;
  for (const Property& p : examinee.declaration.properties) {
    // in a table: its number of rows
    const std::size_t size = flat_size_of(p, std::span(examinee.settings).subspan(at));
    std::vector<double> forbidden =
        p.kind == PropertyKind::kTable ? std::vector<double>{-1.0, 0.5} : forbidden_values(p);
    if (examination.options.quick) forbidden = {forbidden.back()};
    for (const double value : forbidden) {
      std::vector<double> numbers = examinee.settings;
      numbers[at] = value;
      const std::string what = fmt::format("{} = {} (allowed: {})", p.name, number_text(value), allowed_values(p));
      const std::string finding = demand_refusal(examination, hello_for(examinee, numbers), what);
      if (!finding.empty()) return finding;
    }
    at += size;
  }
  return {};
}

CheckCase refuses(std::string name, const std::string& what, void (*spoil)(Hello*)) {
  const auto judge = [what, spoil](Examination& examination) {
    Hello hello = hello_for(examination.examinee, examination.examinee.settings);
    spoil(&hello);
    return demand_refusal(examination, hello, what);
  };
  return {Level::kHandshake, "handshake/" + std::move(name), "It refuses, with a reason, " + what + ".", judge};
}

}  // namespace

std::vector<CheckCase> handshake_cases() {
  const auto declaration = [](Examination& examination) { return check_declaration(examination.examinee.declaration); };
  return {
      {Level::kHandshake, "handshake/declaration", "Names, bounds, defaults and types of its declaration fit together.",
       declaration, false, true},
      {Level::kHandshake, "handshake/description", "It describes itself the same each time.", judge_same_description,
       false, true},
      {Level::kHandshake, "handshake/start", "It gets ready with its defaults, and is the plugin it said it was.",
       judge_start, false, true},
      refuses("magic", "a greeting with another magic number", [](Hello* hello) { hello->set_magic(1); }),
      refuses("protocol", "a greeting in protocols that it does not speak",
              [](Hello* hello) {
                hello->set_protocol_minimum(1000);
                hello->set_protocol_maximum(1001);
              }),
      refuses("schema", "a greeting from another schema",
              [](Hello* hello) { hello->set_schema_hash(hello->schema_hash() ^ 1); }),
      refuses("no-plugin", "a greeting that asks for no plugin", [](Hello* hello) { hello->clear_plugins(); }),
      refuses("two-plugins", "a greeting that asks for two plugins",
              [](Hello* hello) {
                const control::v1::PluginSettings copy = hello->plugins(0);
                *hello->add_plugins() = copy;
              }),
      refuses("other-plugin", "a greeting that asks for another plugin",
              [](Hello* hello) { hello->mutable_plugins(0)->mutable_plugin()->append("?"); }),
      {Level::kHandshake, "handshake/number-of-settings", "It refuses more or fewer numbers than its properties take.",
       judge_number_of_settings},
      {Level::kHandshake, "handshake/settings", "It refuses settings that its declaration does not allow.",
       judge_settings},
  };
}

}  // namespace gravitas::check
