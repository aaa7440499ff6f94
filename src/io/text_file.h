#pragma once
/// \file Text files, written to a temporary file and renamed when complete, like all results.
#include <string>

namespace bielle {

/// \throws ModelError naming the file and the reason it cannot be written
void writeTextFile(const std::string& path, const std::string& text);

}  // namespace bielle
