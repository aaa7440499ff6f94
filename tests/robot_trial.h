#pragma once
// Any robot files must give either a usable model or one clear error.
#include <cmath>
#include <sstream>
#include <string>

#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "bielle/robots/robot_loader.h"

namespace bielle::testing {

enum class Trial { Valid, Refused, Wrong };
struct TrialResult {
  Trial trial = Trial::Valid;
  std::string message;  ///< the error, or the problem
};

// "place: element: problem; remedy" that names the directory or file, on one line of the command's output.
inline bool isClear(const std::string& error, const std::string& directory) {
  return error.rfind(directory, 0) == 0 && error.find(": ", directory.size()) != std::string::npos &&
         error.find("; ") != std::string::npos;
}

// Failures have a status, and numbers under a good status are finite.
inline std::string findWrong(const Model& model) {
  const VectorXd q = model.makeNeutral(), zero = VectorXd::Zero(model.nv());
  if (!q.allFinite() || model.mass() < 0 || !std::isfinite(model.mass())) return "the model is not finite";
  if (model.nv() > 300) return "";
  Workspace ws(model);
  ConstrainedWorkspace cws;
  const NumericalStatus status = updateConstrainedDynamics(model, ws, cws, makeConstraintSet(model), q, zero, zero);
  if (status != NumericalStatus::Ok) return "";
  if (!cws.a.allFinite() || !cws.lambda.allFinite()) return "accelerations or forces are not finite";
  return "";
}

inline TrialResult tryRobot(const std::string& directory) {
  try {
    const LoadedRobot robot = loadRobot(directory);
    const std::string wrong = findWrong(robot.model);
    return {wrong.empty() ? Trial::Valid : Trial::Wrong, wrong};
  } catch (const InputError& error) {
    const bool clear = isClear(error.what(), directory);
    return {clear ? Trial::Refused : Trial::Wrong, error.what()};
  } catch (const std::exception& error) {
    return {Trial::Wrong, std::string("another exception: ") + error.what()};
  }
}

}  // namespace bielle::testing
