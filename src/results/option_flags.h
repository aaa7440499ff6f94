#pragma once
// The options of a struct (bielle/model/options.h) as options of a command: "time_step" is --time-step. Its members are set
// when the command is parsed. The help of a number shows its unit behind the first phrase.
#include <algorithm>

#include "bielle/model/options.h"
#include "results/number_option.h"

namespace bielle {

// Flags are written with hyphens.
inline std::string makeFlag(std::string name) {
  std::replace(name.begin(), name.end(), '_', '-');
  return "--" + name;
}

class OptionFlags : public OptionFields {
 public:
  explicit OptionFlags(CLI::App& app) : app_(app) {}

 private:
  static bool isBounded(const Option& option) {
    return std::isfinite(option.bounds.lower) && std::isfinite(option.bounds.upper);
  }
  static void check(CLI::Option& added, const Option& option) {
    if (isBounded(option))
      added.check(isWithin(option.bounds.lower, option.bounds.upper));
    else if (option.bounds.lower == 0)
      added.check(option.bounds.open ? isPositive() : isNotNegative());
  }
  static std::string makeHelp(const Option& option) {
    std::string help = option.help;
    const size_t end = std::min({help.find(';'), help.find(':'), help.find(" ("), help.size()});
    return help.insert(end, " [" + option.unit + "]");
  }
  template <typename Number>
  void addNumber(const Option& option, Number& member, bool has_default) {
    CLI::Option* added = app_.add_option(makeFlag(option.name), member, makeHelp(option));
    check(*added, option);
    if (has_default) added->capture_default_str();
  }
  void visit(const Option& option, const Member& member) override {
    std::visit([&](const auto& place) { add(option, place); }, member);
  }
  void add(const Option& option, bool* member) { app_.add_flag(makeFlag(option.name), *member, option.help); }
  void add(const Option& option, double* member) { addNumber(option, *member, true); }
  void add(const Option& option, std::optional<double>* member) { addNumber(option, *member, false); }
  void add(const Option& option, int* member) {
    CLI::Option* added = app_.add_option(makeFlag(option.name), *member, option.help)->capture_default_str();
    if (isBounded(option))
      added->check(CLI::Range(static_cast<int>(option.bounds.lower), static_cast<int>(option.bounds.upper)));
  }
  void add(const Option& option, unsigned* member) {
    app_.add_option(makeFlag(option.name), *member, option.help)->capture_default_str()->check(isCount());
  }
  void add(const Option& option, std::string* member) {
    CLI::Option* added = app_.add_option(makeFlag(option.name), *member, option.help);
    if (!member->empty()) added->capture_default_str();
  }
  void add(const Option& option, std::vector<std::string>* member) {
    app_.add_option(makeFlag(option.name), *member, option.help)->allow_extra_args(false);
  }
  void add(const Option& option, const std::function<void(const std::string&)>& choose) {
    CLI::Option* added = app_.add_option_function<std::string>(makeFlag(option.name), choose, option.help);
    added->check(CLI::IsMember(option.choices));
    if (const std::string& chosen = std::get<std::string>(option.value); !chosen.empty()) added->default_str(chosen);
  }

  CLI::App& app_;
};

// \param options  must be there when the command is parsed
template <typename Options>
void addFlags(Options& options, CLI::App& app) {
  OptionFlags fields(app);
  describe(fields, options);
}

}  // namespace bielle
