#include "design/evaluation_log.h"

#include <cmath>
#include <stdexcept>

#include "bielle/model/error.h"
#include "io/json_text.h"

namespace bielle {
namespace {

DesignStatus readStatus(const std::string& name) {
  for (DesignStatus status :
       {DesignStatus::Feasible, DesignStatus::LoopOpen, DesignStatus::MotionFailed, DesignStatus::Violated})
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

}  // namespace

std::string formatEvaluation(const LoggedEvaluation& e) {
  Json json = {{"stage", e.stage}, {"x", formatVector(e.x)}, {"status", getName(e.status)},
               {"value", e.value}, {"seconds", e.seconds},   {"measures", e.measures}};
  if (!e.constraints.empty()) json["constraints"] = e.constraints;
  if (!e.terms.empty()) json["limits"] = formatPieces(e.limits);
  for (const MeasurePieces& term : e.terms) json["terms"].push_back(formatPieces(term));
  return json.dump();
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
                       {}};
  for (const Json& measure : json.at("measures")) out.measures.push_back(readNumber(measure));
  if (json.contains("constraints"))
    for (const Json& measure : json.at("constraints")) out.constraints.push_back(readNumber(measure));
  if (!json.contains("terms")) return out;
  for (const Json& term : json.at("terms")) out.terms.push_back(readPieces(term));
  out.limits = readPieces(json.at("limits"));
  return out;
}

EvaluationLog::EvaluationLog(const std::string& path, const std::string& header)
    : log_(path, header, "the log is of another design problem, robot or version") {
  int line = 1;
  for (const std::string& text : log_.getLines()) {
    ++line;
    try {
      left_.push_back(readEvaluation(text));
    } catch (const std::exception&) {
      throw ModelError(path, "line " + std::to_string(line), "it was changed or damaged",
                       "remove the file to repeat the search");
    }
  }
}

std::optional<LoggedEvaluation> EvaluationLog::replay(const std::string& stage, const VectorXd& x) {
  if (left_.empty()) return std::nullopt;
  const LoggedEvaluation evaluation = left_.front();
  left_.pop_front();
  if (evaluation.stage != stage || evaluation.x != x)
    throw ModelError(log_.getPath(), "log", "its evaluations do not belong to this search",
                     "remove the file to repeat the search");
  return evaluation;
}

void EvaluationLog::append(const LoggedEvaluation& e) { log_.append(formatEvaluation(e)); }

}  // namespace bielle
