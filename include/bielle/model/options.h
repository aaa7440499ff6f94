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
#include <functional>
#include <limits>
#include <optional>
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

/// Visits the members of a struct of options, for its describe(). What comes of them is up to the visitor: below, options are
/// listed or set; results/option_flags.h makes flags of a command of them.
class OptionFields {
 public:
  virtual ~OptionFields() = default;

  void number(const std::string& name, double& member, const std::string& unit, const OptionBounds& bounds,
              const std::string& help) {
    pass({name, member, unit, bounds, help}, &member);
  }
  /// That may be missing, which its value in a list, a text, then tells by being empty.
  void number(const std::string& name, std::optional<double>& member, const std::string& unit,
              const OptionBounds& bounds, const std::string& help) {
    pass({name, member ? formatOption(*member) : std::string(), unit, bounds, help}, &member);
  }
  void integer(const std::string& name, int& member, const OptionBounds& bounds, const std::string& help) {
    pass({name, member, "1", bounds, help}, &member);
  }
  void integer(const std::string& name, unsigned& member, const std::string& help) {
    pass({name, static_cast<int>(member), "1", kNotNegative, help}, &member);
  }
  void flag(const std::string& name, bool& member, const std::string& help) {
    pass({name, member, "", {}, help}, &member);
  }
  void text(const std::string& name, std::string& member, const std::string& help) {
    pass({name, member, "", {}, help}, &member);
  }
  /// That may be given more than once; in a list, one a line.
  void texts(const std::string& name, std::vector<std::string>& member, const std::string& help) {
    std::string all;
    for (const std::string& each : member) all += each + "\n";
    pass({name, all, "", {}, help}, &member);
  }
  /// \param choices  names of the values 0, 1 and so on of the enumeration
  template <typename Enumeration>
  void choice(const std::string& name, Enumeration& member, const std::vector<std::string>& choices,
              const std::string& help) {
    pass({name, choices.at(static_cast<size_t>(member)), "", {}, help, choices}, makeSetter(member, choices));
  }
  /// That may be missing; its name is then empty.
  template <typename Enumeration>
  void choice(const std::string& name, std::optional<Enumeration>& member, const std::vector<std::string>& choices,
              const std::string& help) {
    const std::string chosen = member ? choices.at(static_cast<size_t>(*member)) : std::string();
    pass({name, chosen, "", {}, help, choices}, makeSetter(member, choices));
  }

  /// Passes over these from now on; over none if empty.
  void omit(std::set<std::string> names) { omitted_ = std::move(names); }
  /// Passes over all others from now on; over none if empty.
  void restrictTo(std::set<std::string> names) { selected_ = std::move(names); }

 protected:
  /// A member of the struct; of a choice what sets it by its name.
  using Member = std::variant<bool*, int*, unsigned*, double*, std::optional<double>*, std::string*,
                              std::vector<std::string>*, std::function<void(const std::string&)>>;
  virtual void visit(const Option& option, const Member& member) = 0;

 private:
  template <typename Chosen>
  static std::function<void(const std::string&)> makeSetter(Chosen& member, const std::vector<std::string>& choices) {
    return [&member, choices](const std::string& chosen) {
      for (size_t i = 0; i < choices.size(); ++i)
        if (choices[i] == chosen) setChoice(member, i);
    };
  }
  template <typename Enumeration>
  static void setChoice(Enumeration& member, size_t index) {
    member = static_cast<Enumeration>(index);
  }
  template <typename Enumeration>
  static void setChoice(std::optional<Enumeration>& member, size_t index) {
    member = static_cast<Enumeration>(index);
  }
  void pass(const Option& option, const Member& member) {
    if (!omitted_.count(option.name) && (selected_.empty() || selected_.count(option.name))) visit(option, member);
  }

  std::set<std::string> omitted_, selected_;
};

/// Adds the options to a set.
class ListedFields : public OptionFields {
 public:
  explicit ListedFields(OptionSet& list) : list_(list) {}

 private:
  void visit(const Option& option, const Member&) override { list_.add(option); }
  OptionSet& list_;
};

/// Sets the members that a set has, by their names.
class ReadFields : public OptionFields {
 public:
  explicit ReadFields(const OptionSet& values) : values_(values) {}

 private:
  void visit(const Option& option, const Member& member) override;
  const OptionSet& values_;
};

/// The options of a struct, with its values.
template <typename Options>
OptionSet listOptions(Options options, const std::string& noun = "option", const std::string& owner = "") {
  OptionSet list(noun, owner);
  ListedFields fields(list);
  describe(fields, options);
  return list;
}

/// The struct with the values of a set; what is not in the set stays.
template <typename Options>
Options readOptions(const OptionSet& values, Options options = {}) {
  ReadFields fields(values);
  describe(fields, options);
  return options;
}

}  // namespace bielle
