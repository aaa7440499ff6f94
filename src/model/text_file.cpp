#include "model/text_file.h"

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
  throw ModelError(path, "file", "it cannot be read", remedy);
}

}  // namespace bielle
