#pragma once
/// \file The searches of a design problem, logged and resumable, and their results.
///
/// Every combination of choices is searched by itself, as often as the specification says.
/// Every search writes DIR/searchN.jsonl, N from 1: a line that describes the problem, then one line per evaluation,
/// flushed before the search continues. Searches are deterministic: an interrupted one is repeated with the evaluations
/// in its log and so resumes where it stopped. An incomplete line is dropped. The search for a front writes DIR/front.jsonl,
/// in which the evaluations of a generation are in the order in which they were ready.
#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "design/spec.h"

namespace bielle {

struct LoggedEvaluation {
  std::string stage;  ///< algorithm
  VectorXd x;
  DesignStatus status = DesignStatus::Feasible;
  double value = 0;
  double seconds = 0;                     ///< processor time at its end
  std::vector<MeasurePieces> terms = {};  ///< SlopedEvaluation, in stages that need gradients
  MeasurePieces limits = {};
  std::vector<double> measures = {};     ///< Evaluation::terms: if isMeasured(status), one for each of the objective
  std::vector<double> constraints = {};  ///< likewise, one for each constraint
  std::vector<DesignGoal> goals = {};    ///< likewise; without nodes and places
  std::string message = {};              ///< reason if infeasible
  std::optional<double> margin = {};     ///< Evaluation::margin
  std::vector<std::string> marks = {};   ///< listMarks() of marks.h
};

/// The evaluation of a design as a stage of a search needs it, with its gradients or without.
LoggedEvaluation evaluateDesign(const DesignEvaluator& evaluator, SearchAlgorithm stage, const VectorXd& x);

/// What is wrong with an evaluation that comes from elsewhere, for so many variables, objectives and constraints; empty
/// if nothing is.
std::string findFlaw(const LoggedEvaluation& evaluation, size_t variables, size_t objectives, size_t constraints);

/// Its line in a log.
std::string formatEvaluation(const LoggedEvaluation& evaluation);
/// \throws std::exception when the text is no such line, or one of its numbers is not finite
LoggedEvaluation readEvaluation(const std::string& line);

/// A place where designs are evaluated other than in the threads of the searches.
class DesignEvaluations {
 public:
  virtual ~DesignEvaluations() = default;
  /// As many threads as this will ask for designs, from now on.
  virtual void enter(int threads) = 0;
  /// What evaluateDesign gives. Called by all of them. \throws std::exception when there will be none
  virtual LoggedEvaluation evaluate(SearchAlgorithm stage, const VectorXd& x) = 0;
  /// One of them asks for no more; called once by each.
  virtual void leave() = 0;
};

struct DesignRunOptions {
  std::string directory;
  int jobs = 2;                              ///< searches, or designs of a front, at a time, one thread each
  DesignEvaluations* evaluations = nullptr;  ///< then all of them go on at a time
  std::function<void(const std::string& line)> progress;  ///< called by one thread at a time
};

/// One that no design found dominates, among several objectives.
struct FrontDesign {
  VectorXd x;
  std::vector<double> measures;  ///< as in LoggedEvaluation, here and below
  std::vector<DesignGoal> goals;
  std::vector<double> constraints;
  std::optional<double> margin;
};

struct DesignRun {
  std::vector<std::vector<LoggedEvaluation>> searches;
  VectorXd best;     ///< the feasible design with the least value; the start if none is better, or none is feasible
  double value = 0;  ///< its value
  Evaluation evaluation;  ///< of the best design, repeated
  /// Of the start and the best design, their motions by the usual steps of `bielle solve`, if that was asked for.
  std::optional<Evaluation> usual_start, usual;
  std::array<int, kDesignStatuses> counts{};  ///< evaluations by status
  int replayed = 0;                           ///< evaluations found in the logs
  double seconds = 0;                         ///< processor time of all evaluations, including those of earlier runs
  std::vector<FrontDesign> front;             ///< if one is requested, by increasing first measure
};

/// \throws InputError when a log belongs to another problem, is used by another process, or cannot be written
DesignRun runDesign(const DesignEvaluator& evaluator, const DesignSpec& spec, const DesignRunOptions& options);

/// The masses of a design's motors which are known from a catalogue and which no variable gives to its links, where
/// they count as included, kg.
double calcMassInLinks(const Parametrization& robot, const VectorXd& x);

/// Writes DIR/best (a robot), design.md (before and after), design_mechanism.svg (both mechanisms) and, if gnuplot is installed,
/// design.svg (values over the evaluations), design_front.svg and design_MOTION.svg (torques and speeds before and after).
/// The same run, resumed or not, writes the same bytes. Returns the paths. \throws InputError when a file cannot be
/// written
std::vector<std::string> writeDesign(const std::string& directory, const DesignEvaluator& evaluator,
                                     const DesignSpec& spec, const DesignRun& run);

}  // namespace bielle
