// The .npy format: magic, version, length of the header, a Python dictionary, then the data. Little-endian, as are the
// machines Bielle runs on.
#include <algorithm>
#include <codecvt>
#include <cstdint>
#include <cstring>
#include <limits>
#include <locale>
#include <optional>
#include <regex>

#include "bielle/model/error.h"
#include "results/npz.h"

namespace bielle {
namespace {

constexpr char kMagic[] = "\x93NUMPY\x01";  // with the terminating zero, the minor version
constexpr size_t kPrelude = 10, kAlignment = 64, kLongestHeader = 1024;

using Utf8 = std::wstring_convert<std::codecvt_utf8<char32_t>, char32_t>;
Utf8 makeUtf8() { return Utf8("?", U"?"); }  // replacement of bytes that are not UTF-8

// Number of elements; empty if it exceeds `most`.
std::optional<size_t> calcCount(const std::vector<size_t>& shape, size_t most) {
  if (std::find(shape.begin(), shape.end(), size_t{0}) != shape.end()) return 0;
  size_t count = 1;
  for (size_t n : shape) {
    if (count > most / n) return std::nullopt;
    count *= n;
  }
  return count;
}

std::string formatHeader(const std::string& type, const std::vector<size_t>& shape) {
  std::string text = "{'descr': '" + type + "', 'fortran_order': False, 'shape': (";
  for (size_t n : shape) text += std::to_string(n) + ",";
  text += "), }";
  text.resize((kPrelude + text.size() + kAlignment) / kAlignment * kAlignment - kPrelude - 1, ' ');
  text += "\n";
  const auto length = static_cast<uint16_t>(text.size());
  std::string header(kMagic, sizeof kMagic);
  header += static_cast<char>(length & 0xff);
  header += static_cast<char>(length >> 8);
  return header + text;
}

}  // namespace

std::string formatNpy(const NpyArray& array) {
  if (!array.is_text) {
    std::string bytes = formatHeader("<f8", array.shape);
    bytes.append(reinterpret_cast<const char*>(array.numbers.data()), array.numbers.size() * sizeof(double));
    return bytes;
  }
  std::vector<std::u32string> texts;
  size_t width = 1;
  for (const std::string& text : array.texts) {
    texts.push_back(makeUtf8().from_bytes(text));
    width = std::max(width, texts.back().size());
  }
  std::string bytes = formatHeader("<U" + std::to_string(width), array.shape);
  for (std::u32string& text : texts) {
    text.resize(width, U'\0');
    bytes.append(reinterpret_cast<const char*>(text.data()), width * sizeof(char32_t));
  }
  return bytes;
}

NpyArray parseNpy(const std::string& path, const std::string& element, const std::string& bytes) {
  const auto require = [&](bool ok, const std::string& problem) {
    if (!ok) throw InputError(path, element, problem, "give a trajectory that Bielle wrote");
  };
  require(bytes.size() >= kPrelude && bytes.compare(0, sizeof kMagic, kMagic, sizeof kMagic) == 0,
          "it is not an array in .npy format 1.0");
  const size_t length = static_cast<unsigned char>(bytes[8]) + 256u * static_cast<unsigned char>(bytes[9]);
  require(bytes.size() >= kPrelude + length, "it is truncated");
  require(length <= kLongestHeader, "its header is too long");  // std::regex recurses
  const std::string header = bytes.substr(kPrelude, length);
  static const std::regex pattern(
      R"(\{\s*'descr':\s*'<(f8|U\d{1,6})',\s*'fortran_order':\s*False,\s*'shape':\s*\(([\d, ]*)\),?\s*\}\s*)");
  std::smatch match;
  require(std::regex_match(header, match, pattern), "its header is not supported: " + header);
  NpyArray array;
  static const std::regex number(R"(\d{1,9})");
  const std::string shape = match[2];
  for (std::sregex_iterator it(shape.begin(), shape.end(), number), end; it != end; ++it)
    array.shape.push_back(std::stoul(it->str()));
  const std::string type = match[1];
  array.is_text = type[0] == 'U';
  const size_t width = array.is_text ? std::stoul(type.substr(1)) : 1;
  const size_t item = array.is_text ? sizeof(char32_t) * width : sizeof(double);
  const std::optional<size_t> elements = calcCount(array.shape, bytes.size());
  require(elements && bytes.size() - kPrelude - length == *elements * item, "its size does not match its shape");
  const size_t count = *elements;
  const char* data = bytes.data() + kPrelude + length;
  if (!array.is_text) {
    array.numbers.resize(count);
    if (count) std::memcpy(array.numbers.data(), data, count * item);
    return array;
  }
  for (size_t i = 0; i < count; ++i) {
    std::u32string text(width, U'\0');
    std::memcpy(text.data(), data + i * item, item);
    text.resize(std::min(text.find(U'\0'), width));
    array.texts.push_back(makeUtf8().to_bytes(text));
  }
  return array;
}

}  // namespace bielle
