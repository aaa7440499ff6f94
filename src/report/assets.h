#pragma once
// The files a page is made of, carried by the library itself: ours and those of three.js and dygraphs.
#include <string>

namespace bielle {

// Content of a file by its name, e.g. "style.css". \throws std::out_of_range when there is none
const std::string& getAsset(const std::string& name);

}  // namespace bielle
