#pragma once
// The studies as data: the motions and values that they vary, and the paper's statements about them.
//
// A comparison study makes every motion twice, with the same costs: for the closed model and for the approximate serial
// model. The serial motion is lifted to the closed model (the paper's Appendix A), i.e. motor torques are found that
// make the closed model follow it: node by node from inverse dynamics (lifted), and by the paper's own problem, one
// step of the dynamics after the other (stepped).
#include <string>
#include <vector>

#include "tasks/cases.h"

namespace bielle::paper {

using tasks::Case;
using tasks::CaseOutcome;
using tasks::StepOutcome;

// The part of a motion from which torques are taken.
enum class Window {
  Whole,
  Steady  // steps without the first two and the last two; the whole motion if there are fewer than five
};

struct Study {
  std::string name, title;
  std::string section;    // of the paper
  std::string motion;     // of `bielle solve`; empty: the reduction ratio of a joint
  std::string parameter;  // option of the motion that is varied
  std::string label;      // of the parameter, with its unit
  std::vector<double> values;
  std::string stem;                   // of the names of its cases; studies that share it share cases
  std::vector<std::string> settings;  // further arguments of `bielle solve`
  Window window = Window::Whole;
  double shown = 0;        // value whose motion is drawn over time, if it is among the values
  bool is_papers = false;  // the paper's own walk, of `bielle-paper walk`
};

const std::vector<Study>& getStudies();

// The joints whose motors are compared.
struct ComparedJoints {
  std::vector<std::string> knees = {"knee_right", "knee_left"};       // angles are those of the first
  std::vector<std::string> ankles = {"ankley_right", "ankley_left"};  // one of each linkage
};

// Names within a case, of the directories of its results.
constexpr const char *kClosed = "closed", *kSerial = "serial", *kLifted = "lifted", *kStepped = "stepped",
                     *kRatio = "ratio";

// Cases of one value.
Case makeClosedCase(const Study& study, double value, const std::string& robot);
Case makeSerialCase(const Study& study, double value, const std::string& robot);
Case makeRatioCase(const std::string& robot);  // of the first knee

// All cases of a study, in the order of its values: closed, serial, closed, ...
std::vector<Case> makeCases(const Study& study, const std::string& robot);

}  // namespace bielle::paper
