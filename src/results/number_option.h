#pragma once
// Numbers on command lines: finite, and within bounds that messages can show. CLI11's own ranges accept NaN, and print a
// bound that is the largest number with all its 309 digits.
#include <CLI/CLI.hpp>
#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "model/number_text.h"

namespace bielle {

// A check of an option. \param wanted  completes "it is not"   \param help  what the help shows
inline CLI::Validator makeNumberCheck(const std::function<bool(double)>& fits, const std::string& wanted,
                                      const std::string& help) {
  return CLI::Validator(
      [=](std::string& text) {
        double value = 0;
        const bool is_good = CLI::detail::lexical_cast(text, value) && std::isfinite(value) && fits(value);
        return is_good ? std::string() : "'" + text + "' is not " + wanted;
      },
      help);
}
inline CLI::Validator isFinite() {
  return makeNumberCheck([](double) { return true; }, "a finite number", "");
}
inline CLI::Validator isPositive() {
  return makeNumberCheck([](double value) { return value > 0; }, "a finite positive number", "POSITIVE");
}
inline CLI::Validator isNotNegative() {
  return makeNumberCheck([](double value) { return value >= 0; }, "a finite number, 0 or more", "NONNEGATIVE");
}
inline CLI::Validator isWithin(double lower, double upper) {
  const std::string low = formatNumber(lower), high = formatNumber(upper);
  return makeNumberCheck([=](double value) { return value >= lower && value <= upper; },
                         "a number from " + low + " to " + high, "FLOAT in [" + low + " - " + high + "]");
}
inline CLI::Validator isCount() {
  return CLI::Validator(
      [](std::string& text) {
        unsigned value = 0;
        const bool is_good =
            text.find_first_not_of("0123456789") == std::string::npos && CLI::detail::lexical_cast(text, value);
        return is_good ? std::string()
                       : "'" + text + "' is not a whole number from 0 to " +
                             std::to_string(std::numeric_limits<unsigned>::max());
      },
      "");
}

// Every option of a command and of its subcommands that is a number without bounds of its own is finite.
inline void requireFiniteNumbers(CLI::App& app) {
  for (CLI::Option* option : app.get_options())
    if (option->get_type_name() == "FLOAT") option->check(isFinite());
  for (CLI::App* command : app.get_subcommands([](CLI::App*) { return true; })) requireFiniteNumbers(*command);
}

}  // namespace bielle
