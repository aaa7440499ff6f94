#pragma once
// NumPy archives: a ZIP file of .npy arrays (NumPy's format 1.0), of float64 or of Unicode text.
#include <map>
#include <string>
#include <vector>

namespace bielle {

struct NpyArray {
  std::vector<size_t> shape;
  std::vector<double> numbers;     // row-major
  std::vector<std::string> texts;  // UTF-8; used when `is_text`
  bool is_text = false;
};
using NpyArrays = std::map<std::string, NpyArray>;

// The whole archive, as bytes.
std::string formatArchive(const NpyArrays& arrays);
// \throws InputError naming the file and what is wrong with it
NpyArrays readArchive(const std::string& path);

// One array, as bytes. `element` names it in errors.
std::string formatNpy(const NpyArray& array);
NpyArray parseNpy(const std::string& path, const std::string& element, const std::string& bytes);

}  // namespace bielle
