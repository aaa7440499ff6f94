#pragma once
// What was found: as a table, as JSON, and as a page that shows what is left of each column.
#include <iosfwd>
#include <string>
#include <vector>

#include "cli/identify_torques.h"
#include "results/json_text.h"

namespace bielle::cli {

struct Identified {
  const LinkageTask* task = nullptr;
  std::vector<GeometryNumber> geometry;
  std::vector<LinkageSensor> sensors;
  std::vector<LinkagePlay> plays;
  // Rows that are used, that have no configuration, and where play is at no stop that is known.
  int rows = 0, left_out = 0, unclear = 0;
  VectorXd time;                     // of the rows
  MatrixXd left_before, left_after;  // of the columns, rows x sensors
  Estimate estimate;
};

Json describe(const Identified& found);
Json describe(const IdentifiedLoads& found);
void print(std::ostream& out, const Identified& found);
void print(std::ostream& out, const IdentifiedLoads& found);
// The page report.html. Figures are drawn by gnuplot, if installed. Returns its path. \param loads  null: none
std::string writeIdentifyPage(const std::string& directory, const std::string& title,
                              const std::vector<Identified>& all, const IdentifiedLoads* loads);

}  // namespace bielle::cli
