#pragma once
// The figures of a study.
#include <string>
#include <vector>

#include "io/plot.h"
#include "study/claims.h"

namespace bielle::study {

struct Figure {
  std::string name;  // of the file, without extension
  std::string caption;
  std::vector<Plot> plots;
};

std::vector<Figure> makeFigures(const StudyResult& result, const ComparedRobot& robot);

}  // namespace bielle::study
