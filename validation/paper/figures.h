#pragma once
// The figures of a study.
#include <string>
#include <vector>

#include "paper/claims.h"
#include "results/plot.h"

namespace bielle::paper {

struct Figure {
  std::string name;  // of the file, without extension
  std::string caption;
  std::vector<Plot> plots;
};

std::vector<Figure> makeFigures(const StudyResult& result, const ComparedRobot& robot);

}  // namespace bielle::paper
