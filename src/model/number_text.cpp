#include "model/number_text.h"

#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdio>

namespace bielle {

std::string formatNumber(double value, const char* format) {
  char text[64];
  std::snprintf(text, sizeof text, format, value);
  return text;
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
