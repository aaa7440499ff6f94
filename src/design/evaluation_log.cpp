#include "design/evaluation_log.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>

#include "bielle/model/error.h"
#include "io/aside_file.h"
#include "io/json_text.h"

namespace bielle {
namespace {

DesignStatus readStatus(const std::string& name) {
  for (DesignStatus status : {DesignStatus::LoopOpen, DesignStatus::MotionFailed})
    if (name == getName(status)) return status;
  return DesignStatus::Feasible;
}

VectorXd readVector(const Json& json) {
  const std::vector<double> x = json;
  return VectorXd::Map(x.data(), static_cast<Eigen::Index>(x.size()));
}

Json formatVector(const VectorXd& x) { return std::vector<double>(x.begin(), x.end()); }

MeasurePieces readPieces(const Json& json) {
  const VectorXd values = readVector(json.at("pieces"));
  const Json& rows = json.at("gradients");
  MatrixXd gradients(values.size(), values.size() ? static_cast<Eigen::Index>(rows.at(0).size()) : 0);
  for (Eigen::Index i = 0; i < gradients.rows(); ++i) gradients.row(i) = readVector(rows.at(i)).transpose();
  return {values, gradients};
}

Json formatPieces(const MeasurePieces& pieces) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < pieces.gradients.rows(); ++i) rows.push_back(formatVector(pieces.gradients.row(i)));
  return {{"pieces", formatVector(pieces.values)}, {"gradients", rows}};
}

LoggedEvaluation readLine(const std::string& line) {
  const Json json = Json::parse(line);
  LoggedEvaluation out{json.at("stage"),
                       readVector(json.at("x")),
                       readStatus(json.at("status")),
                       json.at("value"),
                       json.at("seconds"),
                       {},
                       {}};
  if (!json.contains("terms")) return out;
  for (const Json& term : json.at("terms")) out.terms.push_back(readPieces(term));
  out.limits = readPieces(json.at("limits"));
  return out;
}

}  // namespace

EvaluationLog::EvaluationLog(const std::string& path, const std::string& header) : path_(path) {
  file_ = open(path.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (file_ < 0) failToWrite(path, std::strerror(errno));
  try {
    if (flock(file_, LOCK_EX | LOCK_NB) != 0)
      throw ModelError(path, "log", "another process is at work there", "wait for it, or give another directory");
    read(header);
  } catch (...) {
    close(file_);
    throw;
  }
}

EvaluationLog::~EvaluationLog() { close(file_); }

void EvaluationLog::read(const std::string& header) {
  std::ifstream stream(path_, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  const size_t whole = text.rfind('\n') == std::string::npos ? 0 : text.rfind('\n') + 1;
  if (whole < text.size() && ftruncate(file_, static_cast<off_t>(whole)) != 0) failToWrite(path_, std::strerror(errno));
  text.resize(whole);
  if (text.empty()) {
    write(header);
    return;
  }
  size_t begin = 0;
  for (int line = 1; begin < text.size(); ++line) {
    const size_t end = text.find('\n', begin);
    const std::string content = text.substr(begin, end - begin);
    begin = end + 1;
    if (line == 1 && content != header)
      throw ModelError(path_, "line 1", "the log is of another design problem, robot or version",
                       "give another directory, or remove this one");
    if (line == 1) continue;
    try {
      left_.push_back(readLine(content));
    } catch (const Json::exception&) {
      throw ModelError(path_, "line " + std::to_string(line), "it is not as it was written",
                       "remove the file: the search is done anew");
    }
  }
}

void EvaluationLog::write(const std::string& line) {
  const std::string text = line + "\n";
  size_t done = 0;
  while (done < text.size()) {
    const ssize_t count = ::write(file_, text.data() + done, text.size() - done);
    if (count < 0 && errno != EINTR) failToWrite(path_, std::strerror(errno));
    if (count > 0) done += static_cast<size_t>(count);
  }
}

std::optional<LoggedEvaluation> EvaluationLog::replay(const std::string& stage, const VectorXd& x) {
  if (left_.empty()) return std::nullopt;
  const LoggedEvaluation evaluation = left_.front();
  left_.pop_front();
  if (evaluation.stage != stage || evaluation.x != x)
    throw ModelError(path_, "log", "its evaluations are not those of this search",
                     "remove the file: the search is done anew");
  return evaluation;
}

void EvaluationLog::append(const LoggedEvaluation& e) {
  Json json = {{"stage", e.stage},
               {"x", formatVector(e.x)},
               {"status", getName(e.status)},
               {"value", e.value},
               {"seconds", e.seconds}};
  if (!e.terms.empty()) json["limits"] = formatPieces(e.limits);
  for (const MeasurePieces& term : e.terms) json["terms"].push_back(formatPieces(term));
  write(json.dump());
}

}  // namespace bielle
