#include "paper/figures.h"

#include <cmath>
#include <functional>
#include <tuple>

#include "bielle/model/names.h"

namespace bielle::paper {
namespace {

// A model of the comparison, with one name and colour in all figures.
struct Compared {
  const Performance Comparison::*motion;
  const char *title, *color;
};
constexpr Compared kClosedMotion = {&Comparison::closed, "closed", kClosedColor},
                   kLiftedMotion = {&Comparison::lifted, "serial, lifted", kLiftedColor},
                   kSerialMotion = {&Comparison::serial, "serial", kSerialColor};

using Number = std::function<double(const Performance&)>;

bool isWide(const std::vector<Curve>& curves) {
  double least = INFINITY, most = 0;
  for (const Curve& curve : curves)
    for (const auto& [x, y] : curve.points)
      if (std::isfinite(y)) least = std::min(least, y), most = std::max(most, y);
  return least > 0 && most > 20 * least;
}

// Over the values of the study. Cases that did not converge or were not lifted entirely interrupt the curves.
Plot makeSweeps(const StudyResult& result, const char* title, const char* label, const Number& get) {
  Plot plot{title, result.study.label, label};
  for (const Compared& model : {kClosedMotion, kLiftedMotion}) {
    Curve curve{model.title, model.color, {}, CurveStyle::LinesPoints};
    for (const Comparison& entry : result.comparisons) {
      const Performance& motion = entry.*model.motion;
      curve.points.emplace_back(entry.value, motion.success ? get(motion) : kMissing);
    }
    plot.curves.push_back(curve);
  }
  // Where the lift failed, the value of its partial result.
  Curve failed{"lift failed: until then", "#000000", {}, CurveStyle::Crosses};
  for (const Comparison& entry : result.comparisons)
    if (entry.serial.success && !entry.lifted.success) failed.points.emplace_back(entry.value, get(entry.lifted));
  plot.curves.push_back(failed);
  return plot;
}

Plot makeTorquePlot(const StudyResult& result, const char* title, double Load::*number) {
  const Number get = [number](const Performance& motion) { return motion.knee.*number; };
  Plot plot = makeSweeps(result, title, "torque [N m]", get);
  Curve serial{"serial, knee joint", kSerialColor, {}, CurveStyle::LinesPoints, true};
  for (const Comparison& entry : result.comparisons) serial.points.emplace_back(entry.value, get(entry.serial));
  plot.curves.insert(plot.curves.end() - 1, serial);
  if (isWide(plot.curves)) plot.scale = PlotScale::Logarithmic;
  return plot;
}

// One motion over time. \param read  a value of each node
Plot makeHistory(const Comparison& entry, const std::string& title, const char* label,
                 std::initializer_list<Compared> models, const std::function<VectorXd(const MotionRecord&)>& read) {
  Plot plot{title, "time [s]", label};
  for (const Compared& model : models)
    if (const auto& record = (entry.*model.motion).record)
      plot.curves.push_back({model.title, model.color, pairUp(record->time, read(*record))});
  return plot;
}

Plot makeTorqueHistory(const Comparison& entry, const std::vector<std::string>& motors, const char* title) {
  return makeHistory(entry, title, "torque [N m]", {kClosedMotion, kLiftedMotion}, [&](const MotionRecord& record) {
    VectorXd largest = VectorXd::Zero(record.u.rows());
    for (const std::string& motor : motors)
      largest = largest.cwiseMax(record.u.col(findColumn(record.u_names, motor)).cwiseAbs());
    return largest;
  });
}

Plot makeKneePlot(const Comparison& entry, const std::string& knee) {
  return makeHistory(entry, "Angle of " + knee, "angle [rad]", {kClosedMotion, kLiftedMotion, kSerialMotion},
                     [&](const MotionRecord& record) { return record.q.col(findColumn(record.q_names, knee)); });
}

// Feet seen from the side and the centre of mass over time, of both models.
std::vector<Plot> makePathPlots(const Comparison& entry, const Model& model) {
  std::vector<Plot> plots = {{"Feet, from the side", "x [m]", "z [m]"}};
  for (const Compared& one : {kClosedMotion, kLiftedMotion}) {
    const auto& record = (entry.*one.motion).record;
    const std::vector<RowMatrixXd> feet = record ? calcFeet(model, *record) : std::vector<RowMatrixXd>();
    for (size_t i = 0; i < feet.size(); ++i)
      plots[0].curves.push_back({std::string(one.title) + ", " + model.contacts()[i].name, one.color,
                                 pairUp(feet[i].col(0), feet[i].col(2)), CurveStyle::Lines, i > 0});
  }
  for (const auto& [title, label, axis] :
       {std::tuple{"height", "z [m]", 2}, {"forward", "x [m]", 0}, {"sideways", "y [m]", 1}})
    plots.push_back(makeHistory(entry, std::string("Centre of mass, ") + title, label, {kClosedMotion, kLiftedMotion},
                                [axis = axis](const MotionRecord& record) { return record.com.col(axis); }));
  return plots;
}

// One motion over time.
void addHistories(const StudyResult& result, const ComparedRobot& robot, std::vector<Figure>& figures) {
  for (const Comparison& entry : result.comparisons) {
    if (entry.value != result.study.shown && result.comparisons.size() > 1) continue;
    const std::string name = makeClosedCase(result.study, entry.value, "").name;
    const std::string stem = result.study.name + name.substr(name.find('-'), name.rfind('-') - name.find('-'));
    figures.push_back(
        {stem + "-paths", "Feet and centre of mass of both models", makePathPlots(entry, robot.robot.model)});
    figures.push_back(
        {stem + "-torques",
         "Largest torque of the motors of knees and ankles, and the angle of a knee",
         {makeTorqueHistory(entry, robot.knee_motors, "Knee motors"),
          makeTorqueHistory(entry, robot.ankle_motors, "Ankle motors"), makeKneePlot(entry, robot.joints.knees[0])}});
  }
}

void addRatio(const RatioFinding& ratio, std::vector<Figure>& figures) {
  Curve curve{ratio.joint, kClosedColor};
  for (size_t i = 0; i < ratio.ratio.size(); ++i)
    if (ratio.ratio[i] < 5 * ratio.start) curve.points.emplace_back(ratio.angle[i], ratio.ratio[i]);
  figures.push_back(
      {"ratio",
       "Reduction ratio of the knee, up to five times that of the starting posture",
       {{"Reduction ratio", "angle of " + ratio.joint + " [rad]", "motor speed / joint speed", {curve}}}});
}

}  // namespace

std::vector<Figure> makeFigures(const StudyResult& result, const ComparedRobot& robot) {
  std::vector<Figure> figures;
  const std::string& name = result.study.name;
  if (result.comparisons.size() > 1) {
    std::vector<Plot> plots = {makeTorquePlot(result, "Peak torque of the knee motors", &Load::peak),
                               makeTorquePlot(result, "Mean torque of the knee motors", &Load::mean)};
    if (result.study.motion == "walk")
      plots.insert(plots.begin(), makeSweeps(result, "Mean height of the centre of mass", "height [m]",
                                             [](const Performance& motion) { return motion.com_mean; }));
    figures.push_back({name, "Closed model against the lifted serial one", plots});
  }
  addHistories(result, robot, figures);
  if (result.study.motion.empty()) addRatio(result.ratio, figures);
  return figures;
}

}  // namespace bielle::paper
