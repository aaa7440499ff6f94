#pragma once
// The files that make up a page, embedded in the library: ours and those of three.js and dygraphs.
#include <string>

namespace bielle {

// Content of a file by its name, e.g. "style.css". \throws std::out_of_range when there is none
const std::string& getAsset(const std::string& name);

}  // namespace bielle
