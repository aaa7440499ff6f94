#pragma once
// The log of one search: evaluations in it are replayed, new ones are appended.
#include <deque>
#include <optional>
#include <string>

#include "design/run.h"

namespace bielle {

class EvaluationLog {
 public:
  // Opens and locks the file. \throws ModelError when `header` is not its first line, another process has locked it, or
  // it cannot be written
  EvaluationLog(const std::string& path, const std::string& header);
  ~EvaluationLog();
  EvaluationLog(const EvaluationLog&) = delete;
  EvaluationLog& operator=(const EvaluationLog&) = delete;

  // The next evaluation of the log, if there is one. \throws ModelError when it belongs to another design
  std::optional<LoggedEvaluation> replay(const std::string& stage, const VectorXd& x);
  void append(const LoggedEvaluation& evaluation);

 private:
  void read(const std::string& header);
  void write(const std::string& line);

  std::string path_;
  int file_ = -1;
  std::deque<LoggedEvaluation> left_;
};

}  // namespace bielle
