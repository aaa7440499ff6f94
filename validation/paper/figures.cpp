#include "paper/figures.h"

#include <cmath>
#include <functional>

#include "bielle/model/names.h"

namespace bielle::paper {
namespace {

using Getter = std::function<double(const Comparison&)>;

Curve makeSweep(const StudyResult& result, const char* title, const char* color, const Getter& get,
                bool dashed = false) {
  Curve curve{title, color, CurveStyle::LinesPoints, dashed, {}};
  for (const Comparison& entry : result.comparisons) curve.points.emplace_back(entry.value, get(entry));
  return curve;
}

// A case that did not converge or was not lifted entirely interrupts the curve.
double drawn(const Performance& motion, double value) { return motion.success ? value : kMissing; }

// Marks where the lift failed, at the value of its partial result.
Curve markFailures(const StudyResult& result, const Getter& get) {
  Curve curve{"lift failed: until then", "#000000", CurveStyle::Crosses, false, {}};
  for (const Comparison& entry : result.comparisons)
    if (entry.serial.success && !entry.lifted.success) curve.points.emplace_back(entry.value, get(entry));
  return curve;
}

bool isWide(const std::vector<Curve>& curves) {
  double least = INFINITY, most = 0;
  for (const Curve& curve : curves)
    for (const auto& [x, y] : curve.points)
      if (std::isfinite(y)) least = std::min(least, y), most = std::max(most, y);
  return least > 0 && most > 20 * least;
}

Plot makeTorquePlot(const StudyResult& result, const char* title, double Load::*number) {
  const Getter closed = [number](const Comparison& e) { return drawn(e.closed, e.closed.knee.*number); };
  const Getter partial = [number](const Comparison& e) { return e.lifted.knee.*number; };
  const Getter lifted = [&partial](const Comparison& e) { return drawn(e.lifted, partial(e)); };
  const Getter serial = [number](const Comparison& e) { return e.serial.knee.*number; };
  Plot plot{
      title,
      result.study.label,
      "torque [N m]",
      PlotScale::Free,
      {makeSweep(result, "closed", kClosedColor, closed), makeSweep(result, "serial, lifted", kLiftedColor, lifted),
       makeSweep(result, "serial, knee joint", kSerialColor, serial, true), markFailures(result, partial)}};
  if (isWide(plot.curves)) plot.scale = PlotScale::Logarithmic;
  return plot;
}

Plot makeHeightPlot(const StudyResult& result) {
  const Getter lifted = [](const Comparison& e) { return drawn(e.lifted, e.lifted.com_mean); };
  return {"Mean height of the centre of mass",
          result.study.label,
          "height [m]",
          PlotScale::Free,
          {makeSweep(result, "closed", kClosedColor,
                     [](const Comparison& e) { return drawn(e.closed, e.closed.com_mean); }),
           makeSweep(result, "serial, lifted", kLiftedColor, lifted),
           markFailures(result, [](const Comparison& e) { return e.lifted.com_mean; })}};
}

// Largest absolute value over the motors at every stage.
Curve makeTorqueCurve(const Performance& motion, const std::vector<std::string>& motors, const char* title,
                      const char* color) {
  Curve curve{title, color, CurveStyle::Lines, false, {}};
  if (!motion.record) return curve;
  for (int k = 0; k < motion.record->u.rows(); ++k) {
    double torque = kMissing;
    for (const std::string& motor : motors)
      torque = std::fmax(torque, std::abs(motion.record->u(k, findColumn(motion.record->u_names, motor))));
    curve.points.emplace_back(motion.record->time[k], torque);
  }
  return curve;
}

Plot makeTorqueHistory(const Comparison& entry, const std::vector<std::string>& motors, const char* title) {
  return {title,
          "time [s]",
          "torque [N m]",
          PlotScale::Free,
          {makeTorqueCurve(entry.closed, motors, "closed", kClosedColor),
           makeTorqueCurve(entry.lifted, motors, "serial, lifted", kLiftedColor)}};
}

Curve makeAngleCurve(const Performance& motion, const std::string& joint, const char* title, const char* color) {
  Curve curve{title, color, CurveStyle::Lines, false, {}};
  if (!motion.record) return curve;
  const int column = findColumn(motion.record->q_names, joint);
  for (int k = 0; k < motion.record->q.rows(); ++k)
    curve.points.emplace_back(motion.record->time[k], motion.record->q(k, column));
  return curve;
}

Plot makeKneePlot(const Comparison& entry, const ComparedRobot& robot) {
  const std::string& knee = robot.joints.knees[0];
  return {"Angle of " + knee,
          "time [s]",
          "angle [rad]",
          PlotScale::Free,
          {makeAngleCurve(entry.closed, knee, "closed", kClosedColor),
           makeAngleCurve(entry.lifted, knee, "serial, lifted", kLiftedColor),
           makeAngleCurve(entry.serial, knee, "serial", kSerialColor)}};
}

Curve makePath(const RowMatrixXd& path, int x, int y, const VectorXd* time, const std::string& title, const char* color,
               bool dashed = false) {
  Curve curve{title, color, CurveStyle::Lines, dashed, {}};
  for (int k = 0; k < path.rows(); ++k) curve.points.emplace_back(time ? (*time)[k] : path(k, x), path(k, y));
  return curve;
}

// Feet seen from the side and the centre of mass over time, of both models.
std::vector<Plot> makePathPlots(const Comparison& entry, const ComparedRobot& robot) {
  std::vector<Plot> plots = {{"Feet, from the side", "x [m]", "z [m]", PlotScale::Free, {}},
                             {"Centre of mass, height", "time [s]", "z [m]", PlotScale::Free, {}},
                             {"Centre of mass, forward", "time [s]", "x [m]", PlotScale::Free, {}},
                             {"Centre of mass, sideways", "time [s]", "y [m]", PlotScale::Free, {}}};
  const auto add = [&](const Performance& motion, const char* title, const char* color) {
    if (!motion.record) return;
    const std::vector<RowMatrixXd> feet = calcFeet(robot.robot.model, *motion.record);
    for (size_t i = 0; i < feet.size(); ++i)
      plots[0].curves.push_back(makePath(
          feet[i], 0, 2, nullptr, std::string(title) + ", " + robot.robot.model.contacts()[i].name, color, i > 0));
    for (const auto& [plot, axis] : {std::pair{1, 2}, {2, 0}, {3, 1}})
      plots[plot].curves.push_back(makePath(motion.record->com, 0, axis, &motion.record->time, title, color));
  };
  add(entry.closed, "closed", kClosedColor);
  add(entry.lifted, "serial, lifted", kLiftedColor);
  return plots;
}

// One motion over time.
void addHistories(const StudyResult& result, const ComparedRobot& robot, std::vector<Figure>& figures) {
  for (const Comparison& entry : result.comparisons) {
    if (entry.value != result.study.shown && result.comparisons.size() > 1) continue;
    const std::string name = makeClosedCase(result.study, entry.value, "").name;
    const std::string stem = result.study.name + name.substr(name.find('-'), name.rfind('-') - name.find('-'));
    figures.push_back({stem + "-paths", "Feet and centre of mass of both models", makePathPlots(entry, robot)});
    figures.push_back({stem + "-torques",
                       "Largest torque of the motors of knees and ankles, and the angle of a knee",
                       {makeTorqueHistory(entry, robot.knee_motors, "Knee motors"),
                        makeTorqueHistory(entry, robot.ankle_motors, "Ankle motors"), makeKneePlot(entry, robot)}});
  }
}

void addRatio(const RatioFinding& ratio, std::vector<Figure>& figures) {
  Curve curve{ratio.joint, kClosedColor, CurveStyle::Lines, false, {}};
  for (size_t i = 0; i < ratio.ratio.size(); ++i)
    if (ratio.ratio[i] < 5 * ratio.start) curve.points.emplace_back(ratio.angle[i], ratio.ratio[i]);
  figures.push_back({"ratio",
                     "Reduction ratio of the knee, up to five times that of the starting posture",
                     {{"Reduction ratio",
                       "angle of " + ratio.joint + " [rad]",
                       "motor speed / joint speed",
                       PlotScale::Free,
                       {curve}}}});
}

}  // namespace

std::vector<Figure> makeFigures(const StudyResult& result, const ComparedRobot& robot) {
  std::vector<Figure> figures;
  const std::string& name = result.study.name;
  if (result.comparisons.size() > 1) {
    std::vector<Plot> plots = {makeTorquePlot(result, "Peak torque of the knee motors", &Load::peak),
                               makeTorquePlot(result, "Mean torque of the knee motors", &Load::mean)};
    if (result.study.motion == "walk") plots.insert(plots.begin(), makeHeightPlot(result));
    figures.push_back({name, "Closed model against the lifted serial one", plots});
  }
  addHistories(result, robot, figures);
  if (result.study.motion.empty()) addRatio(result.ratio, figures);
  return figures;
}

}  // namespace bielle::paper
