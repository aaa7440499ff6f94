#pragma once
/// \file A motion as Python holds it: with the model that its problem refers to, and what it was made of.
#include <memory>
#include <optional>

#include "bielle/motion/solve.h"
#include "residual.h"
#include "robot.h"

namespace bielle::python {

/// A motion by name, with its options: the input of `bielle solve`.
struct Request {
  std::string motion;                          // of the registry; of a sequence empty
  std::vector<std::string> sequence;           // names of its motions
  std::map<std::string, OptionValue> options;  // by name
  std::map<std::string, std::string> files;

  /// \throws InputError when motion, option or file do not exist
  MotionRequest make() const;
};

struct HeldMotion {
  std::shared_ptr<Model> model;
  std::optional<Request> request;  // either this
  std::optional<MotionPlan> plan;  // or that
  ProblemOptions options;
  Motion motion;
  bool is_remembered = false;  // rememberResiduals() knows those of its stages
};

/// A solution, whose motion is the one that was given unless it was made again.
struct HeldSolution {
  std::shared_ptr<HeldMotion> motion;
  Solution solution;
};

std::shared_ptr<HeldMotion> makeHeldMotion(std::shared_ptr<Model> model, const Request& request,
                                           const ProblemOptions& options);

/// A plan whose stages fit the model, with the schedule that its stages follow where it has none: those made from nothing.
/// \throws ValueError when stages are missing, belong to another model, or are not as many as in the schedule
MotionPlan completePlan(const Model& model, MotionPlan plan);

/// Lets `callback(iteration)` observe a solve that runs without the interpreter's lock, and signals end it: their
/// exceptions leave it. False from the callback stops it.
FddpObserver makeObserver(const py::object& callback);
// And passes what is doubtful to Python's warnings.
SolveObserver makeSolveObserver(const py::object& callback);

}  // namespace bielle::python
