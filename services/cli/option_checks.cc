#include "services/cli/option_checks.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <functional>
#include <system_error>

namespace gravitas::cli {
namespace {

// Takes what `is_allowed`; otherwise says what is.
CLI::Validator check_of(std::function<bool(const std::string&)> is_allowed, std::string allowed) {
  return CLI::Validator(
      [=](const std::string& text) {
        return is_allowed(text) ? std::string() : fmt::format("\"{}\"; allowed: {}", text, allowed);
      },
      "");
}

template <typename Number>
bool is_read(const std::string& text, Number* number) {
  return CLI::detail::lexical_cast(text, *number);
}

}  // namespace

CLI::Validator whole_number(std::uint64_t least, std::uint64_t most) {
  return check_of(
      [=](const std::string& text) {
        // in decimals alone: options are read as C reads numbers, 010 as eight, and one too large as the largest
        std::uint64_t number = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
        const bool is_decimal = text == "0" || !text.starts_with('0');
        return is_decimal && error == std::errc() && end == text.data() + text.size() && number >= least &&
               number <= most;
      },
      fmt::format("a whole number from {} to {}", least, most));
}

CLI::Validator any_number(const std::string& allowed) {
  return check_of(
      [](const std::string& text) {
        double number = 0.0;
        return is_read(text, &number);
      },
      allowed);
}

CLI::Validator number_from_zero() {
  return check_of(
      [](const std::string& text) {
        double number = 0.0;
        return is_read(text, &number) && std::isfinite(number) && number >= 0.0;
      },
      "a finite number >= 0");
}

CLI::Validator seconds_between(double least, double most) {
  return check_of(
      [=](const std::string& text) {
        double number = 0.0;
        // not a number is in no range
        return is_read(text, &number) && number >= least && number <= most;
      },
      fmt::format("a number of seconds from {} to {}", least, most));
}

CLI::Validator positive_seconds() {
  return check_of(
      [](const std::string& text) {
        double number = 0.0;
        return is_read(text, &number) && std::isfinite(number) && number > 0.0;
      },
      "a finite number of seconds > 0");
}

void refuse_meaningless_values(CLI::App* app) {
  for (CLI::Option* option : app->get_options()) {
    if (option->get_items_expected_max() == 0) continue;
    option->check(check_of(
        [](const std::string& text) { return !text.empty(); },
        option->get_positional() ? "a value that is not empty" : "a value that is not empty, or leave the option out"));
    option->check(
        check_of([](const std::string& text) { return text != "-"; },
                 "a name; /dev/stdin is standard input, /dev/stdout standard output, ./- a file of this name"));
  }
  for (CLI::App* command : app->get_subcommands(nullptr)) refuse_meaningless_values(command);
}

}  // namespace gravitas::cli
