#pragma once
// Figures, drawn by gnuplot.
#include <string>

namespace bielle {

// Runs gnuplot on a script, which must not set terminal or output; the figure is written to a temporary file and
// renamed. False if gnuplot is not installed. \throws ModelError when gnuplot cannot draw or the file cannot be written
bool drawSvg(const std::string& path, const std::string& script, int width = 640, int height = 440);

// Free text as a string of gnuplot, quotes included (labels: with `noenhanced`).
std::string quoteGnuplot(const std::string& text);

}  // namespace bielle
