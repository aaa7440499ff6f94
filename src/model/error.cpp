#include "bielle/model/error.h"

namespace bielle {
namespace {

constexpr size_t kLongest = 1000;  // of one part; files may hold names of any length

// Names come from files: characters that could move a terminal's cursor or end the text are written as \xNN.
std::string makePrintable(const std::string& text) {
  static const char kDigits[] = "0123456789abcdef";
  std::string out;
  for (const char c : text) {
    if (out.size() > kLongest) return out + " ...";
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x20 && byte != 0x7f)
      out += c;
    else if (c == '\n' || c == '\t')
      out += ' ';
    else
      out += {'\\', 'x', kDigits[byte / 16], kDigits[byte % 16]};
  }
  return out;
}

}  // namespace

InputError::InputError(const std::string& source, const std::string& element, const std::string& problem,
                       const std::string& remedy)
    : std::runtime_error((source.empty() ? "" : makePrintable(source) + ": ") + makePrintable(element) + ": " +
                         makePrintable(problem) + (remedy.empty() ? "" : "; " + makePrintable(remedy))),
      parts_(std::make_shared<const Parts>(Parts{source, element, problem, remedy})) {}

}  // namespace bielle
