#pragma once
// Reading of whole text files.
#include <string>

namespace bielle {

/// \throws ModelError naming the file when it cannot be read
std::string readTextFile(const std::string& path, const std::string& remedy = "check the path and its permissions");

}  // namespace bielle
