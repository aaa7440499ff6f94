#include "design/page_data.h"

#include <algorithm>
#include <cmath>

#include "bielle/formats/robot_writer.h"
#include "design/figures.h"
#include "design/marks.h"
#include "model/number_text.h"
#include "results/mechanism_figure.h"

namespace bielle {
namespace {

constexpr size_t kMostCloudPoints = 400;  // of a cloud
constexpr double kLeastShown = 0.01;      // rad/s and N m: less is rest

Json packFinite(double value) { return std::isfinite(value) ? Json(value) : Json(); }

double roundShown(double value) { return parseNumber(formatNumber(value, "%.5g")).value_or(value); }

// Whether the margin from dead points is a constraint, which is shown as such.
bool isMarginBound(const DesignEvaluator& evaluator) {
  const auto& constraints = evaluator.constraints();
  return std::any_of(constraints.begin(), constraints.end(),
                     [](const DesignConstraint& c) { return c.measure == Measure::Margin; });
}

Json describeColumns(const DesignEvaluator& evaluator) {
  Json columns = Json::array();
  for (const ObjectiveTerm& term : evaluator.objective())
    columns.push_back({{"kind", "objective"}, {"name", describeTerm(term)}, {"unit", getUnit(term.measure)}});
  for (const DesignConstraint& c : evaluator.constraints())
    columns.push_back({{"kind", c.measure == Measure::Margin ? "margin" : "constraint"},
                       {"name", describeConstraint(c)},
                       {"unit", getUnit(c.measure)},
                       {"bound", std::string(c.at_least ? "≥ " : "≤ ") + formatNumber(c.bound, "%.4g")}});
  if (!isMarginBound(evaluator)) columns.push_back({{"kind", "margin"}, {"name", "margin"}, {"unit", ""}});
  for (const DesignVariable& v : evaluator.robot().variables()) {
    Json column = {{"kind", "variable"}, {"name", v.name}, {"unit", v.isChoice() || v.unit == "1" ? "" : v.unit}};
    if (!v.isChoice()) column["bound"] = formatNumber(v.lower, "%.4g") + " to " + formatNumber(v.upper, "%.4g");
    columns.push_back(column);
  }
  return columns;
}

// {"value", "mark"} of each column.
Json describeValues(const DesignEvaluator& evaluator, const ShownDesign& design) {
  const Evaluation& e = design.evaluation;
  Json values = Json::array();
  for (size_t i = 0; i < evaluator.objective().size(); ++i)
    values.push_back({{"value", i < e.terms.size() ? packFinite(e.terms[i]) : Json()}});
  for (size_t i = 0; i < evaluator.constraints().size(); ++i) {
    const bool has = i < e.constraints.size();
    values.push_back({{"value", has ? packFinite(e.constraints[i]) : Json()}});
    if (has && calcViolation(evaluator.constraints()[i], e.constraints[i]) > 0) values.back()["mark"] = "violated";
  }
  if (!isMarginBound(evaluator)) values.push_back({{"value", e.margin ? packFinite(*e.margin) : Json()}});
  const Parametrization& robot = evaluator.robot();
  for (size_t i = 0; i < robot.variables().size(); ++i) {
    const DesignVariable& v = robot.variables()[i];
    const double x = design.x[static_cast<Eigen::Index>(i)];
    if (!changesDesign(robot, design.x, i)) {
      values.push_back({{"value", Json()}});
      continue;
    }
    values.push_back({{"value", v.isChoice() ? Json(describeValue(v, x)) : Json(x)}});
    if (const std::string bound = findBound(v, x); !bound.empty()) values.back()["mark"] = bound + " bound";
  }
  return values;
}

std::string describeArchitecture(const Parametrization& robot, const VectorXd& x) {
  std::string text;
  for (size_t i = 0; i < robot.variables().size(); ++i)
    if (const DesignVariable& v = robot.variables()[i]; v.isArchitecture())
      text += (text.empty() ? "" : ", ") + v.name + " " + describeValue(v, x[static_cast<Eigen::Index>(i)]);
  return text;
}

Json describeMotions(const DesignEvaluator& evaluator, const ShownDesign& design, const Model& model) {
  Json motions = Json::array();
  for (size_t i = 0; i < design.evaluation.motions.size(); ++i) {
    const MotorTrace& trace = design.evaluation.motions[i].trace;
    Json clouds = Json::array();
    for (int m = 0; m < std::min<int>(model.nu(), static_cast<int>(trace.torque.rows())); ++m) {
      std::vector<std::pair<double, double>> points;
      for (size_t k = 0; k < trace.dt.size(); ++k)
        if (const Eigen::Index stage = static_cast<Eigen::Index>(k); trace.dt[k] > 0)
          points.emplace_back(trace.speed(m, stage), trace.torque(m, stage));
      clouds.push_back(describeCloud(model.motors()[static_cast<size_t>(m)], points));
    }
    const std::string result = i < design.results.size() ? design.results[i] : "";
    motions.push_back({{"name", describeMotion(evaluator.motions()[i])},
                       {"page", result.empty() ? Json() : Json(result + "/report.html")},
                       {"motors", clouds}});
  }
  return motions;
}

Json describeDesign(const DesignEvaluator& evaluator, const ShownDesign& design) {
  const Model model = makeWritten(evaluator.robot(), design.x);
  const std::string& name = design.name;
  const Json mechanism = describeMechanism(model);
  return {{"name", name},
          {"architecture", describeArchitecture(evaluator.robot(), design.x)},
          {"status", design.evaluation.status == DesignStatus::Feasible ? "" : design.evaluation.message},
          {"values", describeValues(evaluator, design)},
          {"svg", mechanism["svg"]},
          {"distances", mechanism["distances"]},
          {"directory", design.directory},
          {"files", {design.directory + "/" + name + ".yaml", design.directory + "/" + name + ".urdf"}},
          {"text", formatRobot(model).yaml},
          {"motions", describeMotions(evaluator, design, model)}};
}

}  // namespace

std::vector<std::pair<double, double>> listEnvelopeCorners(const Motor& motor, double most_speed, double most_torque) {
  const double u = std::min(motor.effort_limit, most_torque), w = std::min(motor.velocity_limit, most_speed);
  if (!motor.hasEnvelope()) return {{w, -u}, {w, u}, {-w, u}, {-w, -u}};
  // |a u + b w| <= U cuts the corners where the motor drives.
  const double a = motor.voltsPerEffort(), b = motor.voltsPerSpeed(), volts = motor.drive.voltage;
  const double end = std::min(w, volts / b);
  const double at_torque = std::clamp((volts - a * u) / b, -end, end), most = std::min(u, (volts - b * at_torque) / a),
               at_speed = std::min(u, (volts - b * end) / a);
  return {{end, -u}, {end, at_speed}, {at_torque, most}, {-end, u}, {-end, -at_speed}, {-at_torque, -most}};
}

Json describeCloud(const Motor& motor, const std::vector<std::pair<double, double>>& points) {
  double speed = kLeastShown, torque = kLeastShown;
  for (const auto& [w, u] : points) speed = std::max(speed, std::abs(w)), torque = std::max(torque, std::abs(u));
  Json corners = Json::array(), cloud = Json::array();
  for (const auto& [w, u] : listEnvelopeCorners(motor, 1.2 * speed, 1.2 * torque))
    corners.push_back({roundShown(w), roundShown(u)});
  const size_t stride = std::max<size_t>(1, (points.size() + kMostCloudPoints - 1) / kMostCloudPoints);
  for (size_t k = 0; k < points.size(); k += stride)
    cloud.push_back({roundShown(points[k].first), roundShown(points[k].second)});
  return {{"name", motor.name},
          {"type", motor.drive.type},
          {"envelope", corners},
          {"limited", std::isfinite(motor.effort_limit) || motor.hasEnvelope()},
          {"points", cloud}};
}

Json describeMechanism(const Model& model) {
  const MechanismFigure figure = makeMechanismFigure(model, makeDrawnPosture(model));
  MechanismPicture picture;
  picture.width = 540, picture.height = 450, picture.font = 13;
  Json distances = Json::array();
  for (const FigureDistance& d : figure.distances) distances.push_back({d.link, d.from, d.to, 1000 * d.length});
  return {{"svg", formatMechanism(figure, picture)}, {"distances", distances}};
}

Json describeDesignRun(const DesignEvaluator& evaluator, const DesignRun& run,
                       const std::vector<ShownDesign>& designs) {
  Json list = Json::array();
  int best = 0;
  for (size_t i = 0; i < designs.size(); ++i) {
    list.push_back(describeDesign(evaluator, designs[i]));
    if (i > 0 && designs[i].x == run.best) best = static_cast<int>(i);
  }
  return {{"title", "Design of " + evaluator.robot().startModel().name()},
          {"baseline", true},
          {"best", best},
          {"plot", "Front"},
          {"axes", run.front.empty() ? Json::array() : Json({0, 1})},
          {"columns", describeColumns(evaluator)},
          {"designs", list}};
}

}  // namespace bielle
