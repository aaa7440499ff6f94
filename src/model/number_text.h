#pragma once
// Numbers as text: with a decimal point, whatever the locales of the program that uses the library (Qt and Python set them).
#include <optional>
#include <sstream>
#include <string>
#include <vector>

namespace bielle {

// As printf writes it.
[[gnu::format(printf, 1, 2)]] std::string formatText(const char* format, ...);

// \param format  as of printf, for one double
std::string formatNumber(double value, const char* format = "%.6g");

// As few digits as read back to the same number, with no negative zero; empty if it is not finite.
std::string formatExact(double value);

// The number that the whole text is, with YAML's .inf and .nan; nothing else than digits, sign, point and exponent otherwise.
std::optional<double> parseNumber(const std::string& text);

/// Whether the text is made of finite numbers between white space, which are added to `numbers`.
bool parseNumbers(const std::string& text, std::vector<double>& numbers);

class TextStream : public std::ostringstream {
 public:
  TextStream() { imbue(std::locale::classic()); }
};

}  // namespace bielle
