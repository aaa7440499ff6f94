#include "design/figures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "design/motor_change.h"

namespace bielle {
namespace {

constexpr double kGap = std::numeric_limits<double>::quiet_NaN();  // interrupts a line
constexpr size_t kMostMotors = 4;                                  // of one plot

// Values of feasible designs as points, the least so far as a line, one colour per search. Outliers are left out.
Plot makeCourse(const DesignEvaluator& evaluator, const DesignRun& run) {
  const double start = evaluator.start().value;
  Plot plot{"Value of the designs", "evaluation", "value"};
  for (size_t i = 0; i < run.searches.size(); ++i) {
    const char* color = getCurveColor(i);
    Curve values{"", color, {}, CurveStyle::Points};
    Curve best{"best of search " + std::to_string(i + 1), color};
    double least = start;
    for (const LoggedEvaluation& e : run.searches[i]) {
      const bool feasible = e.status == DesignStatus::Feasible;
      if (feasible) least = std::min(least, e.value);
      const double count = static_cast<double>(best.points.size() + 1);
      values.points.emplace_back(count, feasible && e.value < 1.5 * start ? e.value : kGap);
      best.points.emplace_back(count, least);
    }
    plot.curves.push_back(values);
    plot.curves.push_back(best);
  }
  return plot;
}

std::string describeAxis(const ObjectiveTerm& term) {
  const std::string unit = getUnit(term.measure);
  return describeTerm(term) + (unit.empty() ? "" : " [" + unit + "]");
}

// Two objectives: all feasible designs, the start and the front.
Plot makeFrontPlot(const DesignEvaluator& evaluator, const DesignRun& run, size_t x, size_t y) {
  const std::vector<ObjectiveTerm>& terms = evaluator.objective();
  Plot plot{"Front", describeAxis(terms[x]), describeAxis(terms[y])};
  Curve designs{"designs", kSerialColor, {}, CurveStyle::Points};
  const auto& front = run.front;
  const auto calcMost = [&](size_t k) {
    double most = evaluator.start().terms[k];
    for (const FrontDesign& design : front) most = std::max(most, design.measures[k]);
    return 1.2 * most;
  };
  const double most_x = calcMost(x), most_y = calcMost(y);  // designs far away would hide the front
  for (const LoggedEvaluation& e : run.searches.front())
    if (e.status == DesignStatus::Feasible && e.measures[x] <= most_x && e.measures[y] <= most_y)
      designs.points.emplace_back(e.measures[x], e.measures[y]);
  // Of more than two objectives, the front is no line.
  const bool line = terms.size() == 2;
  Curve best{"front", kLiftedColor, {}, line ? CurveStyle::LinesPoints : CurveStyle::Points};
  for (const FrontDesign& design : front) best.points.emplace_back(design.measures[x], design.measures[y]);
  const std::vector<double>& from = evaluator.start().terms;
  Curve start{"start", kClosedColor, {{from[x], from[y]}}, CurveStyle::Crosses};
  plot.curves = {designs, best, start};
  return plot;
}

// The motors of the objective that have the largest torques in this motion, in the order of the model.
std::vector<int> chooseMotors(const DesignEvaluator& evaluator, const MotionMeasures& before,
                              const MotionMeasures& after) {
  const Model& model = evaluator.robot().startModel();
  std::set<int> named;
  for (const ObjectiveTerm& term : evaluator.objective())
    for (int motor : findMotors(model, term.motors)) named.insert(motor);
  if (named.empty())
    for (int m = 0; m < model.nu(); ++m) named.insert(m);
  std::vector<int> motors(named.begin(), named.end());
  while (!motors.empty() && motors.back() >= static_cast<int>(after.motors.size())) motors.pop_back();  // other parts
  const auto peak = [&](int m) { return std::max(before.motors[m].peak_torque, after.motors[m].peak_torque); };
  std::stable_sort(motors.begin(), motors.end(), [&](int a, int b) { return peak(a) > peak(b); });
  motors.resize(std::min(motors.size(), kMostMotors));
  std::sort(motors.begin(), motors.end());
  return motors;
}

Curve makeCurve(const MotorTrace& trace, const MatrixXd& values, int motor, const std::string& title, size_t color,
                bool dashed) {
  Curve curve{title, getCurveColor(color), {}, CurveStyle::Lines, dashed};
  for (size_t k = 0; k < trace.time.size(); ++k)
    if (trace.dt[k] > 0) curve.points.emplace_back(trace.time[k], values(motor, static_cast<Eigen::Index>(k)));
  return curve;
}

std::string describeMeasure(Measure measure, const std::vector<std::string>& motors, const JointAngles& range) {
  std::string text = getName(measure);
  const std::vector<std::string>& names = isOfJoints(measure) ? range.joints : motors;
  for (const std::string& name : names) text += (&name == &names.front() ? " of " : ", ") + name;
  return text;
}

DesignFigure makeMotionFigure(const DesignEvaluator& evaluator, const std::string& name, const MotionMeasures& before,
                              const MotionMeasures& after) {
  Plot torque{"Motor torques", "time [s]", "torque [N m]"};
  Plot speed{"Motor speeds", "time [s]", "speed [rad/s]"};
  const std::vector<int> motors = chooseMotors(evaluator, before, after);
  for (size_t i = 0; i < motors.size(); ++i) {
    const std::string& motor = evaluator.robot().startModel().motors()[motors[i]].name;
    for (const auto& [measures, title, dashed] :
         {std::tuple{&before, "before: " + motor, true}, std::tuple{&after, "after: " + motor, false}}) {
      torque.curves.push_back(makeCurve(measures->trace, measures->trace.torque, motors[i], title, i, dashed));
      speed.curves.push_back(makeCurve(measures->trace, measures->trace.speed, motors[i], title, i, dashed));
    }
  }
  return {name, {torque, speed}};
}

}  // namespace

std::string describeTerm(const ObjectiveTerm& term) { return describeMeasure(term.measure, term.motors, term.range); }

std::string describeConstraint(const DesignConstraint& constraint) {
  return describeMeasure(constraint.measure, constraint.motors, constraint.range);
}

std::vector<DesignFigure> makeDesignFigures(const DesignEvaluator& evaluator, const DesignRun& run) {
  std::vector<DesignFigure> figures;
  if (run.counts[0] > 0) figures.push_back({"design", {makeCourse(evaluator, run)}});
  if (!run.front.empty()) {
    figures.push_back({"design_front", {}});
    for (size_t k = 1; k < evaluator.objective().size(); ++k)
      figures.back().plots.push_back(makeFrontPlot(evaluator, run, 0, k));
  }
  std::set<std::string> names;
  for (size_t i = 0; i < run.evaluation.motions.size(); ++i) {
    std::string name = "design_" + evaluator.motions()[i].name;
    if (!names.insert(name).second) name += "_" + std::to_string(i + 1);
    figures.push_back(makeMotionFigure(evaluator, name, evaluator.start().motions[i], run.evaluation.motions[i]));
  }
  return figures;
}

}  // namespace bielle
