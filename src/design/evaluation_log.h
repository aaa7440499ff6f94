#pragma once
// The log of one search: evaluations in it are replayed, new ones are appended.
#include <deque>
#include <optional>
#include <string>

#include "design/run.h"
#include "results/line_log.h"

namespace bielle {

class EvaluationLog {
 public:
  // Opens and locks the file. \throws InputError when `header` is not its first line, another is no evaluation of a
  // design of the evaluator, another process has locked it, or it cannot be written
  EvaluationLog(const std::string& path, const std::string& header, const DesignEvaluator& evaluator);

  // The next evaluation of the log, if there is one. \throws InputError when it belongs to another design
  std::optional<LoggedEvaluation> replay(const std::string& stage, const VectorXd& x);
  // All that are left, at once.
  std::deque<LoggedEvaluation> takeAll() { return std::move(left_); }
  void append(const LoggedEvaluation& evaluation);

 private:
  LineLog log_;
  std::deque<LoggedEvaluation> left_;
};

}  // namespace bielle
