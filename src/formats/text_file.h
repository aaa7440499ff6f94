#pragma once
// Whole text files, read and written.
#include <string>

namespace bielle {

/// \throws InputError naming the file when it cannot be read
std::string readTextFile(const std::string& path, const std::string& remedy = "check the path and its permissions");

/// \throws InputError naming `path` and the line of the first byte that is not UTF-8, in which names are printed and passed on
void requireUtf8(const std::string& text, const std::string& path);
/// The place of the first byte that is not UTF-8; std::string::npos for none.
size_t findNotUtf8(const std::string& text);

/// Written to a temporary file and renamed when complete, like all results.
/// \throws InputError naming the file and the reason it cannot be written
void writeTextFile(const std::string& path, const std::string& text);

}  // namespace bielle
