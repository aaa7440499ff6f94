#include "model/number_text.h"

#include <locale.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <limits>

namespace bielle {
namespace {

locale_t getClassic() {
  static const locale_t classic = newlocale(LC_ALL_MASK, "C", nullptr);
  return classic;
}

}  // namespace

std::string formatText(const char* format, ...) {
  const locale_t former = uselocale(getClassic());  // of this thread
  std::va_list arguments, again;
  va_start(arguments, format);
  va_copy(again, arguments);
  std::string text(static_cast<size_t>(std::max(std::vsnprintf(nullptr, 0, format, arguments), 0)), ' ');
  std::vsnprintf(text.data(), text.size() + 1, format, again);
  va_end(again);
  va_end(arguments);
  uselocale(former);
  return text;
}

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
std::string formatNumber(double value, const char* format) { return formatText(format, value); }
#pragma GCC diagnostic pop

std::string formatExact(double value) {
  if (!std::isfinite(value)) return "";
  value += 0.0;                                            // no negative zero
  const std::string plain = formatNumber(value, "%.15g");  // 100000, where the shortest text is 1e+05
  if (parseNumber(plain) == value) return plain;
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

std::optional<double> parseNumber(const std::string& text) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const bool is_signed = !text.empty() && (text[0] == '+' || text[0] == '-');
  const double sign = is_signed && text[0] == '-' ? -1 : 1;
  const std::string rest = text.substr(is_signed);
  if (rest == ".inf" || rest == ".Inf" || rest == ".INF") return sign * kInfinity;
  if (!is_signed && (rest == ".nan" || rest == ".NaN" || rest == ".NAN")) return std::nan("");
  if (rest.empty() || !(std::isdigit(static_cast<unsigned char>(rest[0])) || rest[0] == '.')) return {};
  double value = 0;
  const auto [stop, error] = std::from_chars(rest.data(), rest.data() + rest.size(), value);
  if (error == std::errc::invalid_argument || stop != rest.data() + rest.size()) return {};
  // Below the smallest number it is 0, above the largest one none.
  if (error == std::errc::result_out_of_range) value = strtod_l(rest.c_str(), nullptr, getClassic());
  if (std::isinf(value)) return {};
  return sign * value;
}

bool parseNumbers(const std::string& text, std::vector<double>& numbers) {
  const char *at = text.data(), *end = at + text.size();
  while (at != end) {
    if (std::isspace(static_cast<unsigned char>(*at))) {
      ++at;
      continue;
    }
    if (*at == '+') ++at;
    double value = 0;
    const auto [rest, error] = std::from_chars(at, end, value);
    if (error != std::errc() || !std::isfinite(value)) return false;
    if (rest != end && !std::isspace(static_cast<unsigned char>(*rest))) return false;
    numbers.push_back(value);
    at = rest;
  }
  return true;
}

}  // namespace bielle
