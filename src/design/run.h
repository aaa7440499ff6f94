#pragma once
/// \file The searches of a design problem, logged and resumable, and their results.
///
/// Every search writes DIR/searchN.jsonl, N from 1: a line that describes the problem, then one line per evaluation,
/// flushed before the search continues. Searches are deterministic: an interrupted one is repeated with the evaluations
/// in its log and so resumes where it stopped. An incomplete line is dropped.
#include <array>
#include <functional>
#include <string>
#include <vector>

#include "design/spec.h"

namespace bielle {

struct LoggedEvaluation {
  std::string stage;  ///< algorithm
  VectorXd x;
  DesignStatus status = DesignStatus::Feasible;
  double value = 0;
  double seconds = 0;                ///< processor time at its end
  std::vector<MeasurePieces> terms;  ///< SlopedEvaluation, in stages that need gradients
  MeasurePieces limits;
};

/// The evaluation of a design as a stage of a search needs it, with its gradients or without.
LoggedEvaluation evaluateDesign(const DesignEvaluator& evaluator, SearchAlgorithm stage, const VectorXd& x);

/// Its line in a log.
std::string formatEvaluation(const LoggedEvaluation& evaluation);
/// \throws std::exception when the text is no such line, or one of its numbers is not finite
LoggedEvaluation readEvaluation(const std::string& line);

/// A place where designs are evaluated other than in the threads of the searches.
class DesignEvaluations {
 public:
  virtual ~DesignEvaluations() = default;
  /// What evaluateDesign gives. Called by the threads of all searches. \throws std::exception when there will be none
  virtual LoggedEvaluation evaluate(SearchAlgorithm stage, const VectorXd& x) = 0;
  /// A search has ended; called once by each.
  virtual void leave() = 0;
};

struct DesignRunOptions {
  std::string directory;
  int jobs = 2;                                           ///< searches at a time, one thread each
  DesignEvaluations* evaluations = nullptr;               ///< then all searches go on at a time
  std::function<void(const std::string& line)> progress;  ///< called by one thread at a time
};

struct DesignRun {
  std::vector<std::vector<LoggedEvaluation>> searches;
  VectorXd best;                ///< the feasible design with the least value; the start if none is better
  double value = 0;             ///< its value
  Evaluation evaluation;        ///< of the best design, repeated
  std::array<int, 3> counts{};  ///< evaluations by status
  int replayed = 0;             ///< evaluations found in the logs
  double seconds = 0;           ///< processor time of all evaluations, including those of earlier runs
};

/// \throws ModelError when a log belongs to another problem, is used by another process, or cannot be written
DesignRun runDesign(const DesignEvaluator& evaluator, const DesignSpec& spec, const DesignRunOptions& options);

/// Writes DIR/best (a robot), design.md (before and after) and, if gnuplot is installed, design.svg (values over the
/// evaluations), design_MOTION.svg (torques and speeds before and after) and design_mechanism.svg (both mechanisms).
/// The same run, resumed or not, writes the same bytes. Returns the paths. \throws ModelError when a file cannot be
/// written
std::vector<std::string> writeDesign(const std::string& directory, const DesignEvaluator& evaluator,
                                     const DesignSpec& spec, const DesignRun& run);

}  // namespace bielle
