#pragma once
// The output of `bielle ratio` for a linkage: text, JSON, CSV and a figure.
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "bielle/dynamics/ratio.h"
#include "results/json_text.h"

namespace bielle::cli {

struct RatioReport {
  std::string robot;
  Linkage linkage;
  RatioSweep sweep;
  std::optional<RatioMap> map;  // of a linkage of mobility two
  double balance_error = 0;     // largest of calcBalanceError
};

Json describeReport(const RatioReport& report);
void printReport(std::ostream& out, const RatioReport& report);

// Writes ratio.csv, ratio.json, ratio.svg and, with a map, map.csv. Returns the paths, or notes on missing figures.
std::vector<std::string> writeReport(const std::string& directory, const RatioReport& report);

}  // namespace bielle::cli
