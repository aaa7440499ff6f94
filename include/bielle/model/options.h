#pragma once
/// \file Options by name: of motions and of generated robots, for the command line, Python and the files of results.
///
/// A struct of options has one description, a function that names its members:
///
///     void describe(OptionFields& fields, WalkOptions& o) {
///       fields.number("speed", o.speed, "m/s", {}, "speed of the steady steps");
///       fields.integer("steps", o.steps, {2, 200}, "number of steps");
///     }
///
/// listOptions() makes an OptionSet of it, a value of its own, and readOptions() the struct again.
#include <limits>
#include <set>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace bielle {

/// A choice is held by its name.
using OptionValue = std::variant<bool, int, double, std::string>;
using OptionValues = std::vector<std::pair<std::string, OptionValue>>;

/// "true", "2", "0.1", "left"; with as many digits as parseOption() needs to return the same value.
std::string formatOption(const OptionValue& value);
/// A truth value, a whole number or a number if it reads as one; otherwise a name.
OptionValue parseOption(const std::string& text);

/// What a number may be, besides finite.
struct OptionBounds {
  double lower = -std::numeric_limits<double>::infinity(), upper = std::numeric_limits<double>::infinity();
  bool open = false;  ///< without the lower bound itself
};
inline constexpr OptionBounds kNotNegative{0}, kPositive{0, std::numeric_limits<double>::infinity(), true};

struct Option {
  std::string name;
  OptionValue value;
  std::string unit;  ///< of a number, 1 if it has none; otherwise empty
  OptionBounds bounds;
  std::string help;
  std::vector<std::string> choices{};  ///< names, if it is a choice

  /// "0.1 .. 2", "above 0", "true or false", "left, right"; empty for any number.
  std::string describeValues() const;
};

/// Options in their order.
class OptionSet {
 public:
  /// \param noun  in messages   \param owner  whose options they are, the source of a InputError
  explicit OptionSet(std::string noun = "option", std::string owner = "")
      : noun_(std::move(noun)), owner_(std::move(owner)) {}

  std::vector<Option>::const_iterator begin() const { return options_.begin(); }
  std::vector<Option>::const_iterator end() const { return options_.end(); }

  /// Null if there is none of this name.
  const Option* find(const std::string& name) const;
  /// \throws InputError with the nearest name, and all
  const Option& get(const std::string& name) const;
  /// The value of an option of type T. \throws std::bad_variant_access for another type
  template <typename T>
  const T& get(const std::string& name) const {
    return std::get<T>(get(name).value);
  }

  void add(Option option) { options_.push_back(std::move(option)); }
  /// Takes a whole number for a number, and a number that is whole for an integer.
  /// \throws InputError naming the option and what is allowed, or as get() does
  void set(const std::string& name, const OptionValue& value);

  OptionValues listValues() const;
  /// \throws InputError naming the first option whose value is not allowed
  void check() const;

 private:
  [[noreturn]] void fail(const Option& option, const std::string& problem) const;
  void check(const Option& option, const OptionValue& value) const;
  Option& getMutable(const std::string& name);

  std::string noun_, owner_;
  std::vector<Option> options_;
};

/// Visits the members of a struct of options, for its describe(): lists them, or sets them.
class OptionFields {
 public:
  explicit OptionFields(OptionSet& list) : list_(&list) {}
  explicit OptionFields(const OptionSet& values) : values_(&values) {}

  void number(const std::string& name, double& member, const std::string& unit, const OptionBounds& bounds,
              const std::string& help) {
    visit({name, member, unit, bounds, help}, member);
  }
  void integer(const std::string& name, int& member, const OptionBounds& bounds, const std::string& help) {
    visit({name, member, "1", bounds, help}, member);
  }
  void flag(const std::string& name, bool& member, const std::string& help) {
    visit({name, member, "", {}, help}, member);
  }
  /// \param choices  names of the values 0, 1 and so on of the enumeration
  template <typename Enumeration>
  void choice(const std::string& name, Enumeration& member, const std::vector<std::string>& choices,
              const std::string& help) {
    std::string chosen = choices.at(static_cast<size_t>(member));
    visit({name, chosen, "", {}, help, choices}, chosen);
    for (size_t i = 0; i < choices.size(); ++i)
      if (choices[i] == chosen) member = static_cast<Enumeration>(i);
  }

  /// Passes over these from now on; over none if empty.
  void omit(std::set<std::string> names) { omitted_ = std::move(names); }
  /// Passes over all others from now on; over none if empty.
  void restrictTo(std::set<std::string> names) { selected_ = std::move(names); }

 private:
  template <typename T>
  void visit(const Option& option, T& member) {
    if (omitted_.count(option.name) || (!selected_.empty() && !selected_.count(option.name))) return;
    if (list_)
      list_->add(option);
    else if (values_->find(option.name))
      member = values_->get<T>(option.name);
  }

  OptionSet* list_ = nullptr;
  const OptionSet* values_ = nullptr;
  std::set<std::string> omitted_, selected_;
};

/// The options of a struct, with its values.
template <typename Options>
OptionSet listOptions(Options options, const std::string& noun = "option", const std::string& owner = "") {
  OptionSet list(noun, owner);
  OptionFields fields(list);
  describe(fields, options);
  return list;
}

/// The struct with the values of a set; what is not in the set stays.
template <typename Options>
Options readOptions(const OptionSet& values, Options options = {}) {
  OptionFields fields(values);
  describe(fields, options);
  return options;
}

}  // namespace bielle
