#pragma once
// The studies as data: which motions they vary, over which values, and what the paper says of them.
//
// A comparison study makes every motion twice. The closed model gets a motion of its own; the approximate serial model
// gets one with the same costs, and that is lifted to the closed model (the paper's Appendix A): motor torques that make
// the closed model follow: node by node from inverse dynamics (lifted), and by the paper's own problem, one step of the
// dynamics after the other (stepped).
#include <string>
#include <vector>

#include "study/cases.h"

namespace bielle::study {

// The part of a motion that torques are taken from.
enum class Window {
  Whole,
  Steady  // steps without the first two and the last two; the whole motion when there are fewer than five
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
  double shown = 0;  // value whose motion is drawn over time, if it is among the values
};

const std::vector<Study>& getStudies();

// The joints whose motors are looked at.
struct ComparedJoints {
  std::vector<std::string> knees = {"knee_right", "knee_left"};       // angles are those of the first
  std::vector<std::string> ankles = {"ankley_right", "ankley_left"};  // one of each linkage
};

// Names within a case: its results are in the directories of these names.
constexpr const char *kClosed = "closed", *kSerial = "serial", *kLifted = "lifted", *kStepped = "stepped",
                     *kRatio = "ratio";

// Cases of one value.
Case makeClosedCase(const Study& study, double value, const std::string& robot);
Case makeSerialCase(const Study& study, double value, const std::string& robot);
Case makeRatioCase(const std::string& robot);  // of the first knee

// All cases of a study, in the order of its values: closed, serial, closed, ...
std::vector<Case> makeCases(const Study& study, const std::string& robot);

}  // namespace bielle::study
