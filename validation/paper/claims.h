#pragma once
// The paper's claims about its comparison, beside our findings. Every verdict follows from numbers by the rule that its
// text states; it is "open" where there are no numbers.
#include <string>
#include <vector>

#include "paper/measures.h"

namespace bielle::paper {

// The reduction ratio along the range of a joint that contains the starting posture (branch 0 of ratio.json).
struct RatioFinding {
  std::string joint;
  std::vector<double> angle, ratio;       // in the order of the sweep; empty: there are no results
  std::vector<double> joint_dead_points;  // angles where the ratio is infinite, rad
  double start = kMissing;                // ratio at the starting posture
};
RatioFinding readRatio(const std::string& directory);

// The results of one study.
struct StudyResult {
  Study study;
  std::vector<Comparison> comparisons;
  RatioFinding ratio;  // of the study of the ratio
};

enum class Verdict { Agrees, Partly, Differs, Open };
const char* getName(Verdict verdict);

struct Claim {
  std::string section, text;  // of the paper
  Verdict verdict = Verdict::Open;
  std::string found;
};

std::vector<Claim> judgeClaims(const StudyResult& result, const Model& model);

}  // namespace bielle::paper
