#pragma once
/// \file Text files: written aside and renamed when they are whole, as all results are.
#include <string>

namespace bielle {

/// \throws ModelError naming the file and why it cannot be written
void writeTextFile(const std::string& path, const std::string& text);

}  // namespace bielle
