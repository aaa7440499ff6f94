#include "formats/text_file.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "bielle/model/error.h"

namespace bielle {

std::string readTextFile(const std::string& path, const std::string& remedy) {
  std::error_code unknown;
  std::ifstream file(path, std::ios::binary);
  if (file.is_open() && !std::filesystem::is_directory(path, unknown)) try {
      return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    } catch (const std::ios_base::failure&) {  // thrown by the iterators when reading fails
    }
  throw InputError(path, "file", "it cannot be read", remedy);
}

// By the ranges of RFC 3629, section 4: no overlong forms, no surrogates, nothing beyond U+10FFFF.
size_t findNotUtf8(const std::string& text) {
  const auto get = [&text](size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u; };
  for (size_t i = 0; i < text.size();) {
    const unsigned lead = get(i), next = get(i + 1);
    const size_t length = lead < 0x80                   ? 1
                          : lead >= 0xc2 && lead < 0xe0 ? 2
                          : (lead & 0xf0) == 0xe0       ? 3
                          : lead >= 0xf0 && lead < 0xf5 ? 4
                                                        : 0;
    if (length == 0 || (lead == 0xe0 && next < 0xa0) || (lead == 0xed && next > 0x9f) ||
        (lead == 0xf0 && next < 0x90) || (lead == 0xf4 && next > 0x8f))
      return i;
    for (size_t k = 1; k < length; ++k)
      if ((get(i + k) & 0xc0) != 0x80) return i;
    i += length;
  }
  return std::string::npos;
}

void requireUtf8(const std::string& text, const std::string& path) {
  const size_t bad = findNotUtf8(text);
  if (bad == std::string::npos) return;
  char byte[8];
  std::snprintf(byte, sizeof byte, "0x%02x", static_cast<unsigned char>(text[bad]));
  const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(bad), '\n');
  throw InputError(path, "line " + std::to_string(line), std::string("its byte ") + byte + " is not UTF-8",
                   "save the file in UTF-8, as by `iconv -f latin1 -t utf-8`");
}

}  // namespace bielle
