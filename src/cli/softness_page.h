#pragma once
// What `bielle softness` found, as settings and as a page.
#include <string>
#include <vector>

#include "formats/mjcf_softness.h"
#include "results/json_text.h"

namespace bielle::cli {

// What closes loops to within an error.
struct SoftnessAdvice {
  double within = 0;  // m and rad
  SoftSettings settings;
  double time_step = 0;  // s
  double gap = 0;        // then the largest, m or rad
};

// \param rows  of all loops
SoftnessAdvice advise(const std::vector<Json>& rows, double within, double time_step);
std::string formatMjcf(const SoftnessAdvice& advice);

// Writes softness.html, with a plot of each loop if gnuplot is installed.
void writeSoftnessPage(const std::string& directory, const std::string& title, const std::vector<Json>& rows,
                       const SoftnessAdvice& advice);

}  // namespace bielle::cli
