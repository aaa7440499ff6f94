#include "design/evaluation_log.h"

#include <cmath>
#include <limits>
#include <stdexcept>

#include "bielle/model/error.h"
#include "results/json_text.h"

namespace bielle {
namespace {

DesignStatus readStatus(const std::string& name) {
  for (DesignStatus status : {DesignStatus::Feasible, DesignStatus::LoopOpen, DesignStatus::MotionFailed,
                              DesignStatus::Violated, DesignStatus::GoalMissed})
    if (name == getName(status)) return status;
  throw std::runtime_error("there is no status '" + name + "'");
}

double readNumber(const Json& json) {
  const double number = json;
  if (!std::isfinite(number)) throw std::runtime_error("a number is not finite");
  return number;
}

VectorXd readVector(const Json& json) {
  std::vector<double> x;
  for (const Json& entry : json) x.push_back(readNumber(entry));
  return VectorXd::Map(x.data(), static_cast<Eigen::Index>(x.size()));
}

Json formatVector(const VectorXd& x) { return std::vector<double>(x.begin(), x.end()); }

MeasurePieces readPieces(const Json& json) {
  const VectorXd values = readVector(json.at("pieces"));
  const Json& rows = json.at("gradients");
  MatrixXd gradients(values.size(), values.size() ? static_cast<Eigen::Index>(rows.at(0).size()) : 0);
  for (Eigen::Index i = 0; i < gradients.rows(); ++i) {
    const VectorXd row = readVector(rows.at(i));
    if (row.size() != gradients.cols()) throw std::runtime_error("gradients have different sizes");
    gradients.row(i) = row.transpose();
  }
  return {values, gradients};
}

Json formatPieces(const MeasurePieces& pieces) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < pieces.gradients.rows(); ++i) rows.push_back(formatVector(pieces.gradients.row(i)));
  return {{"pieces", formatVector(pieces.values)}, {"gradients", rows}};
}

Json formatGoals(const std::vector<DesignGoal>& goals) {
  Json out = Json::array();
  for (const auto& [motion, outcome] : goals)
    out.push_back({{"motion", motion},
                   {"goal", outcome.goal.name},
                   {"kind", getName(outcome.goal.kind)},
                   {"requested", outcome.goal.requested},
                   {"tolerance", outcome.goal.tolerance},
                   {"achieved", outcome.achieved}});
  return out;
}

// What could not be measured is null.
std::vector<DesignGoal> readGoals(const Json& json) {
  std::vector<DesignGoal> goals;
  for (const Json& entry : json) {
    DesignGoal goal{entry.at("motion"), {}};
    goal.outcome.goal.name = entry.at("goal");
    goal.outcome.goal.kind = parseGoalKind(entry.at("kind"));
    goal.outcome.goal.requested = readNumber(entry.at("requested"));
    goal.outcome.goal.tolerance = readNumber(entry.at("tolerance"));
    const Json& achieved = entry.at("achieved");
    goal.outcome.achieved = achieved.is_null() ? std::numeric_limits<double>::quiet_NaN() : readNumber(achieved);
    goals.push_back(goal);
  }
  return goals;
}

}  // namespace

std::string formatEvaluation(const LoggedEvaluation& e) {
  Json json = {{"stage", e.stage}, {"x", formatVector(e.x)}, {"status", getName(e.status)},
               {"value", e.value}, {"seconds", e.seconds},   {"measures", e.measures}};
  if (!e.constraints.empty()) json["constraints"] = e.constraints;
  if (!e.goals.empty()) json["goals"] = formatGoals(e.goals);
  if (!e.message.empty()) json["message"] = e.message;
  if (e.margin) json["margin"] = *e.margin;
  if (!e.marks.empty()) json["marks"] = e.marks;
  if (!e.terms.empty()) json["limits"] = formatPieces(e.limits);
  for (const MeasurePieces& term : e.terms) json["terms"].push_back(formatPieces(term));
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

LoggedEvaluation readEvaluation(const std::string& line) {
  const Json json = parseJson(line);
  LoggedEvaluation out{json.at("stage"),
                       readVector(json.at("x")),
                       readStatus(json.at("status")),
                       readNumber(json.at("value")),
                       readNumber(json.at("seconds")),
                       {},
                       {},
                       {},
                       {},
                       {},
                       json.value("message", "")};
  for (const Json& measure : json.at("measures")) out.measures.push_back(readNumber(measure));
  if (json.contains("constraints"))
    for (const Json& measure : json.at("constraints")) out.constraints.push_back(readNumber(measure));
  if (json.contains("goals")) out.goals = readGoals(json.at("goals"));
  if (json.contains("margin")) out.margin = readNumber(json.at("margin"));
  if (json.contains("marks")) out.marks = json.at("marks").get<std::vector<std::string>>();
  if (!json.contains("terms")) return out;
  for (const Json& term : json.at("terms")) out.terms.push_back(readPieces(term));
  out.limits = readPieces(json.at("limits"));
  return out;
}

EvaluationLog::EvaluationLog(const std::string& path, const std::string& header, const DesignEvaluator& evaluator)
    : log_(path, header, "the log is of another design problem, robot or version") {
  int line = 1;
  for (const std::string& text : log_.lines()) {
    ++line;
    try {
      left_.push_back(readEvaluation(text));
      const std::string flaw = findFlaw(left_.back(), evaluator.robot().variables().size(),
                                        evaluator.objective().size(), evaluator.constraints().size());
      if (!flaw.empty()) throw std::runtime_error(flaw);
    } catch (const std::exception& error) {
      throw InputError(path, "line " + std::to_string(line), "it was changed or damaged: " + describeJsonError(error),
                       "remove the file to repeat the search");
    }
  }
}

std::optional<LoggedEvaluation> EvaluationLog::replay(const std::string& stage, const VectorXd& x) {
  if (left_.empty()) return std::nullopt;
  const LoggedEvaluation evaluation = left_.front();
  left_.pop_front();
  if (evaluation.stage != stage || evaluation.x != x)
    throw InputError(log_.path(), "log", "its evaluations do not belong to this search",
                     "remove the file to repeat the search");
  return evaluation;
}

void EvaluationLog::append(const LoggedEvaluation& e) { log_.append(formatEvaluation(e)); }

}  // namespace bielle
