#pragma once
/// \file From a request to a result, as `bielle solve` and the Python function `solve()` do.
#include <functional>
#include <optional>
#include <string>

#include "bielle/io/motion_registry.h"
#include "bielle/io/record.h"
#include "bielle/io/result.h"

namespace bielle {

struct RequestOptions {
  ProblemOptions problem;
  /// For objectives other than effort, acceptable_decrease does not apply.
  FddpOptions solver = makeMotionSolverOptions();
  std::optional<MotionRecord> warm_start;  ///< a motion of the same robot to start from
};

struct RequestObserver {
  FddpObserver motion;                           ///< of every solve except those of parts
  FddpObserver part;                             ///< of the parts of a sequence, which are first solved separately
  std::function<void(const std::string&)> tell;  ///< receives lines of progress; may be null
  std::function<void(const std::string&)> warn;  ///< receives warnings; may be null
};

/// Solves one request, once. A sequence starts from its motions, each solved separately. A motion with another
/// objective starts from that of least effort, which also scales it. Stages that are too long are halved
/// (refineStages()); if that does not help, linkages are kept farther from their dead points (avoidDeadPoints()). A
/// result whose stages are still too long ends as Failed. How far linkages are from their dead points is told at the start, and
/// added to the message of a failure near one.
class RequestSolver {
 public:
  /// Makes the motion and its guess. \throws ModelError as makeRequested() and setGuess() do
  /// \param request, model  must outlive the solver
  RequestSolver(const MotionRequest& request, const Model& model, RequestOptions options,
                RequestObserver observer = {});

  MotionResult solve(const RunInfo& run);

 private:
  void startFromParts();
  void refuseLongStages(MotionResult& result) const;
  void tellDeadPoints() const;
  std::string describeDeadPoints(const MotionRecord& record) const;
  void startFromEffort(const FddpOptions& solver);
  void improve(Motion& motion, const FddpOptions& solver, const std::string& how, const RunInfo& run,
               MotionResult& result) const;
  void tell(const std::string& line) const;

  const MotionRequest& request_;
  const Model& model_;
  RequestOptions options_;  // its objective is least effort, until that motion was solved
  RequestObserver observer_;
  ObjectiveOptions objective_;
  Motion motion_;
};

}  // namespace bielle
