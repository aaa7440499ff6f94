// Values in the text form of USD.
#include <algorithm>
#include <charconv>

#include "formats/usda.h"

namespace bielle {

std::optional<std::vector<double>> parseUsdNumbers(std::string_view value) {
  std::vector<double> out;
  for (size_t i = 0; i < value.size();) {
    const char c = value[i];
    if (c == '(' || c == ')' || c == '[' || c == ']' || c == ',' || c == ' ' || c == '\n' || c == '\t' || c == '\r') {
      ++i;
      continue;
    }
    if (c == '#') {
      i = std::min(value.find('\n', i), value.size());
      continue;
    }
    double number = 0;
    const char* begin = value.data() + i + (c == '+');
    const auto [end, error] = std::from_chars(begin, value.data() + value.size(), number);
    if (error != std::errc()) return {};
    out.push_back(number);
    i = static_cast<size_t>(end - value.data());
  }
  return out;
}

std::optional<bool> parseUsdBool(std::string_view value) {
  if (value == "1" || value == "true") return true;
  if (value == "0" || value == "false") return false;
  return {};
}

std::vector<std::string> listUsdStrings(std::string_view value, char quote) {
  std::vector<std::string> out;
  const auto isOpening = [quote](char c) { return c == quote || (quote == '"' && c == '\''); };
  for (size_t i = 0; i < value.size(); ++i) {
    if (value[i] == '#') i = std::min(value.find('\n', i), value.size() - 1);  // a comment
    if (!isOpening(value[i])) continue;
    const char closing = quote == '<' ? '>' : value[i];
    const bool is_long = quote != '<' && value.substr(i, 3) == std::string(3, closing);
    i += is_long ? 3 : 1;
    std::string text;
    for (; i < value.size(); ++i) {
      if (value[i] == closing && (!is_long || value.substr(i, 3) == std::string(3, closing))) break;
      if (value[i] == '\\' && quote != '<' && i + 1 < value.size()) ++i;
      text += value[i];
    }
    if (is_long) i += 2;
    out.push_back(std::move(text));
  }
  return out;
}

std::string quoteUsd(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c == '\n' ? ' ' : c;
  }
  return out + "\"";
}

std::string makeUsdName(const std::string& name) {
  std::string out;
  for (const char c : name) {
    const bool is_letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_',
               is_digit = c >= '0' && c <= '9';
    if (out.empty() && is_digit) out = "_";
    out += is_letter || is_digit ? c : '_';
  }
  return out.empty() ? "_" : out;
}

}  // namespace bielle
