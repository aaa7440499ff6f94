#include "paper/studies.h"

#include "model/number_text.h"

namespace bielle::paper {
namespace {

// first, first + step, ... last; each the nearest double to its decimal number.
std::vector<double> makeRange(int first, int last, int step, double denominator) {
  std::vector<double> values;
  for (int i = first; i <= last; i += step) values.push_back(i / denominator);
  return values;
}

std::string makeName(const Study& study, double value, const char* model) {
  return study.stem + "-" + study.parameter + formatNumber(value, "-%.4g-") + model;
}

std::vector<std::string> makeSolve(const Study& study, double value, const std::string& robot, bool serial) {
  const std::string number = formatNumber(value, "%.12g");
  std::vector<std::string> arguments;
  if (study.is_papers) {
    arguments = {"walk", "--robot", robot, "--speed", number};
    if (serial) arguments.push_back("--serial");
  } else {
    arguments = {"solve",      study.motion, "--robot", robot,   "--set",   study.parameter + "=" + number,
                 "--threads",  "1",          "--step",  "euler", "--quiet", "--no-check",
                 "--no-report"};
    arguments.insert(arguments.end(), study.settings.begin(), study.settings.end());
    if (serial) arguments.insert(arguments.end(), {"--model", "serial"});
  }
  arguments.insert(arguments.end(), {"-o", std::string("@") + (serial ? kSerial : kClosed)});
  return arguments;
}

std::vector<std::string> makeLift(const Study& study, const char* output) {
  return {study.is_papers ? "lift-walk" : "lift", std::string("@") + kSerial, "-o", std::string("@") + output};
}

}  // namespace

const std::vector<Study>& getStudies() {
  // Eight steps, as in the paper: four are steady. Its walk, and ours, which asks for footholds instead of a velocity.
  const std::vector<std::string> ours = {"--steps", "8"};
  const std::vector<double> heights = makeRange(50, 120, 5, 100), speeds = makeRange(0, 12, 1, 10);
  const std::vector<double> stairs = makeRange(2, 10, 2, 100), flights = makeRange(20, 40, 5, 100);
  const char *height_label = "lowest height of the CoM / initial height", *speed_label = "speed [m/s]";
  const char* stair_label = "height of a stair [m]";
  static const std::vector<Study> studies = {
      {"squat", "Squats", "V-A.1", "squat", "depth", height_label, heights, "squat", {}, Window::Whole, 0.6},
      {"walk",
       "Walk on flat ground",
       "V-A.2",
       "walk",
       "speed",
       speed_label,
       {0.5},
       "walk",
       {},
       Window::Steady,
       0.5,
       true},
      {"speed",
       "Speed of the walk",
       "V-A.3",
       "walk",
       "speed",
       speed_label,
       speeds,
       "walk",
       {},
       Window::Steady,
       0.9,
       true},
      {"footholds", "Speed of the walk, on given footholds", "V-A.3", "walk", "speed", speed_label, speeds, "footholds",
       ours, Window::Steady, 0.9},
      {"stairs", "Stairs", "V-A.4", "stairs", "height", stair_label, stairs, "stairs", {}, Window::Whole, 0.06},
      {"jump", "Jump", "V-A.4", "jump", "flight", "time in the air [s]", flights, "jump", {}, Window::Whole, 0.3},
      {"ratio", "Reduction ratio", "IV-A", "", "", "", {}, "ratio", {}, Window::Whole, 0}};
  return studies;
}

Case makeClosedCase(const Study& study, double value, const std::string& robot) {
  return {makeName(study, value, "closed"), {makeSolve(study, value, robot, false)}, robot};
}

Case makeSerialCase(const Study& study, double value, const std::string& robot) {
  std::vector<std::string> stepped = makeLift(study, kStepped);
  stepped.insert(stepped.end(), {"--method", "nlopt"});
  return {makeName(study, value, "serial"),
          {makeSolve(study, value, robot, true), makeLift(study, kLifted), stepped},
          robot};
}

Case makeRatioCase(const std::string& robot) {
  return {"ratio", {{"ratio", robot, "--joint", ComparedJoints().knees[0], "-o", std::string("@") + kRatio}}, robot};
}

std::vector<Case> makeCases(const Study& study, const std::string& robot) {
  std::vector<Case> cases;
  if (study.motion.empty()) cases.push_back(makeRatioCase(robot));
  for (const double value : study.values) {
    cases.push_back(makeClosedCase(study, value, robot));
    cases.push_back(makeSerialCase(study, value, robot));
  }
  return cases;
}

}  // namespace bielle::paper
