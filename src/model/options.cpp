#include "bielle/model/options.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>
#include <sstream>
#include <type_traits>

#include "bielle/model/error.h"
#include "model/number_text.h"

namespace bielle {
namespace {

// The least number of letters to insert, remove or change (V. Levenshtein, 1966).
size_t calcDistance(const std::string& a, const std::string& b) {
  std::vector<size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (size_t i = 1; i <= a.size(); ++i) {
    size_t diagonal = std::exchange(row[0], i);
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t changed = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = std::exchange(row[j], std::min({row[j] + 1, row[j - 1] + 1, changed}));
    }
  }
  return row[b.size()];
}

template <typename T>
bool parse(const std::string& text, T& value) {
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  return error == std::errc() && stop == end;
}

std::string joinNames(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

// In the type of the option where that loses nothing.
OptionValue convert(const Option& option, const OptionValue& value) {
  if (const int* whole = std::get_if<int>(&value); whole && std::holds_alternative<double>(option.value))
    return static_cast<double>(*whole);
  if (const double* number = std::get_if<double>(&value); number && std::holds_alternative<int>(option.value))
    if (*number == std::floor(*number) && std::abs(*number) <= std::numeric_limits<int>::max())
      return static_cast<int>(*number);
  return value;
}

// As OptionFields lists those that may be missing or given more than once.
void readNumber(const std::string& text, std::optional<double>& value) {
  double number = 0;
  value.reset();
  if (parse(text, number)) value = number;
}
std::vector<std::string> readLines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

std::string describeKind(const Option& option) {
  if (!option.choices.empty()) return "one of its choices";
  if (std::holds_alternative<bool>(option.value)) return "true or false";
  if (std::holds_alternative<std::string>(option.value)) return "a text";
  return std::holds_alternative<int>(option.value) ? "a whole number" : "a number";
}

}  // namespace

std::string formatOption(const OptionValue& value) {
  if (const bool* flag = std::get_if<bool>(&value)) return *flag ? "true" : "false";
  if (const int* whole = std::get_if<int>(&value)) return std::to_string(*whole);
  if (const std::string* name = std::get_if<std::string>(&value)) return *name;
  return formatExact(std::get<double>(value));
}

OptionValue parseOption(const std::string& text) {
  if (text == "true" || text == "false") return text == "true";
  int whole = 0;
  double number = 0;
  if (parse(text, whole)) return whole;
  if (parse(text, number)) return number;
  return text;
}

std::string Option::describeValues() const {
  if (std::holds_alternative<bool>(value)) return "true or false";
  if (!choices.empty()) return joinNames(choices);
  if (std::isfinite(bounds.lower) && std::isfinite(bounds.upper))
    return bounds.open ? "above " + formatNumber(bounds.lower) + ", up to " + formatNumber(bounds.upper)
                       : formatNumber(bounds.lower) + " .. " + formatNumber(bounds.upper);
  if (std::isfinite(bounds.lower))
    return bounds.open ? "above " + formatNumber(bounds.lower) : formatNumber(bounds.lower) + " or more";
  return std::isfinite(bounds.upper) ? formatNumber(bounds.upper) + " or less" : "";
}

const Option* OptionSet::find(const std::string& name) const {
  const auto found = std::find_if(options_.begin(), options_.end(), [&](const Option& o) { return o.name == name; });
  return found == options_.end() ? nullptr : &*found;
}

const Option& OptionSet::get(const std::string& name) const {
  if (const Option* option = find(name)) return *option;
  std::vector<std::string> names;
  for (const Option& option : options_) names.push_back(option.name);
  const auto nearest = std::min_element(names.begin(), names.end(), [&](const std::string& a, const std::string& b) {
    return calcDistance(name, a) < calcDistance(name, b);
  });
  throw InputError(
      owner_, noun_ + " '" + name + "'", "there is no such " + noun_,
      names.empty() ? "leave it out" : "the nearest is '" + *nearest + "'; choose one of: " + joinNames(names));
}

Option& OptionSet::getMutable(const std::string& name) {
  return options_[static_cast<size_t>(&get(name) - options_.data())];
}

void OptionSet::fail(const Option& option, const std::string& problem) const {
  const std::string allowed = option.describeValues(),
                    unit = option.unit.empty() || option.unit == "1" ? "" : " [" + option.unit + "]";
  const std::string remedy = !option.choices.empty() ? "one of " + allowed
                             : option.unit.empty()   ? allowed
                                                     : describeKind(option) + (allowed.empty() ? "" : ", " + allowed);
  throw InputError(owner_, noun_ + " '" + option.name + "'", problem, "give " + remedy + unit);
}

void OptionSet::check(const Option& option, const OptionValue& value) const {
  if (value.index() != option.value.index())
    fail(option, "'" + formatOption(value) + "' is not " + describeKind(option));
  if (const std::string* name = std::get_if<std::string>(&value)) {
    if (!option.choices.empty() &&
        std::find(option.choices.begin(), option.choices.end(), *name) == option.choices.end())
      fail(option, "'" + *name + "' is not one of its choices");
    return;
  }
  if (std::holds_alternative<bool>(value)) return;
  const double number = std::holds_alternative<int>(value) ? std::get<int>(value) : std::get<double>(value);
  if (!std::isfinite(number)) fail(option, "it is not finite");
  const OptionBounds& bounds = option.bounds;
  if (bounds.lower == 0 && number < 0) fail(option, "it is negative");
  if (number < bounds.lower || number > bounds.upper || (bounds.open && number == bounds.lower))
    fail(option, formatNumber(number) + (option.unit == "1" ? "" : " " + option.unit) +
                     (std::isfinite(bounds.lower + bounds.upper) && !bounds.open ? " is outside " : " is not ") +
                     option.describeValues());
}

void OptionSet::set(const std::string& name, const OptionValue& value) {
  Option& option = getMutable(name);
  const OptionValue converted = convert(option, value);
  check(option, converted);
  option.value = converted;
}

void ReadFields::visit(const Option& option, const Member& member) {
  const Option* found = values_.find(option.name);
  if (!found) return;
  std::visit(
      [&](const auto& place) {
        using Place = std::decay_t<decltype(place)>;
        if constexpr (std::is_same_v<Place, std::function<void(const std::string&)>>)
          place(std::get<std::string>(found->value));
        else if constexpr (std::is_same_v<Place, unsigned*>)
          *place = static_cast<unsigned>(std::get<int>(found->value));
        else if constexpr (std::is_same_v<Place, std::optional<double>*>)
          readNumber(std::get<std::string>(found->value), *place);
        else if constexpr (std::is_same_v<Place, std::vector<std::string>*>)
          *place = readLines(std::get<std::string>(found->value));
        else
          *place = std::get<std::decay_t<decltype(*place)>>(found->value);
      },
      member);
}

OptionValues OptionSet::listValues() const {
  OptionValues values;
  for (const Option& option : options_) values.emplace_back(option.name, option.value);
  return values;
}

void OptionSet::check() const {
  for (const Option& option : options_) check(option, option.value);
}

}  // namespace bielle
