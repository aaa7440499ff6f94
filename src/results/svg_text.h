#pragma once
// Pieces of SVG.
#include <string>

namespace bielle {

// Free text inside an element or an attribute.
std::string escapeXml(const std::string& text);

// Of `text` in a sans-serif font, px: no less than a browser takes.
double estimateWidth(const std::string& text, double font);

}  // namespace bielle
