#pragma once
// The files of a study: NAME.csv, SVG figures, NAME.md; and report.md over several studies.
#include <string>
#include <vector>

#include "paper/claims.h"

namespace bielle::paper {

// The files written for one study.
struct StudyPage {
  std::string text;                // Markdown, from a heading of the second level
  std::vector<std::string> files;  // paths
  std::vector<std::string> notes;  // figures that could not be drawn
};

// Writes the table, the figures and the page. \throws InputError when a file cannot be written
StudyPage writeStudy(const std::string& directory, const StudyResult& result, const ComparedRobot& robot);

// report.md: the pages under one heading. Returns its path.
std::string writeReport(const std::string& directory, const std::string& robot, const std::string& command,
                        const std::vector<StudyPage>& pages);

}  // namespace bielle::paper
