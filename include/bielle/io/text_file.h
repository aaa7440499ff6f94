#pragma once
/// \file Text files: read whole, written aside and renamed when they are whole, as all results are.
#include <string>

namespace bielle {

/// \throws ModelError naming the file and why it cannot be written
void writeTextFile(const std::string& path, const std::string& text);

/// \throws ModelError naming the file when it cannot be read
std::string readTextFile(const std::string& path, const std::string& remedy);

}  // namespace bielle
