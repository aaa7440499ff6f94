#pragma once
// Whole text files, read and written.
#include <map>
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

/// A directory of these files, by name, written beside its place and moved there when complete: whole or not at all. One that
/// holds nothing but files of these names is replaced.
/// \throws InputError naming the directory, where it holds others or cannot be written
void writeTextDirectory(const std::string& path, const std::map<std::string, std::string>& files);

}  // namespace bielle
