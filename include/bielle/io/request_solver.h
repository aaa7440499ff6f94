#pragma once
/// \file From a request to a result: what `bielle solve` does, and `solve()` of the Python package.
#include <functional>
#include <optional>
#include <string>

#include "bielle/io/motion_registry.h"
#include "bielle/io/record.h"
#include "bielle/io/result.h"

namespace bielle {

struct RequestOptions {
  ProblemOptions problem;
  /// For objectives other than effort no cost is acceptable before it is stationary.
  FddpOptions solver = makeMotionSolverOptions();
  std::optional<MotionRecord> warm_start;  ///< a motion of the same robot to start from
};

struct RequestObserver {
  FddpObserver motion;                           ///< of every solve but these:
  FddpObserver part;                             ///< of the motions of a sequence, which are first solved one by one
  std::function<void(const std::string&)> tell;  ///< takes a line on what comes next or how it came out; or null
  std::function<void(const std::string&)> warn;  ///< likewise, on what was not hoped for; or null
};

/// Solves one request, once. A sequence starts from its motions, each solved by itself; a motion of another objective from
/// that of least effort, by which it is scaled; stages that turn out too long are halved (refineStages()), and where that
/// does not help, linkages stay farther from their dead points (avoidDeadPoints()). What is still too long then ends as Failed.
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
