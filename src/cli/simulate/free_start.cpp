#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "bielle/model/names.h"
#include "cli/eval_state.h"
#include "cli/simulate/free.h"
#include "dynamics/loop_conflict.h"
#include "dynamics/whole_turns.h"
#include "model/listing.h"
#include "model/number_text.h"

namespace bielle::worlds {
namespace {

// The base of a robot with feet as high as puts the lowest sole on the ground.
void lift(const Model& model, VectorXd& q) {
  if (!model.hasFreeFlyer() || model.contacts().empty()) return;
  Workspace ws(model);
  updatePositions(model, ws, q);
  double lowest = std::numeric_limits<double>::infinity();
  for (const ContactFrame& contact : model.contacts()) {
    const SE3 X = getPlacement(ws, contact.body, contact.X_BF);
    const double depth = std::abs(X.R(2, 0)) * contact.half_length + std::abs(X.R(2, 1)) * contact.half_width;
    lowest = std::min(lowest, X.p.z() - depth);
  }
  q[2] -= lowest;
}

VectorXd makePosture(const Model& model, const std::string& name, const std::string& file) {
  const AssemblyResult result = name.empty()        ? findClosedConfiguration(model)
                                : name == "neutral" ? closeConfiguration(model, model.makeNeutral())
                                                    : assembleReference(model, name);
  if (result.status != NumericalStatus::Ok) throw makeClosingError(model, file, result);
  VectorXd q = result.q;
  if (name == "neutral") lift(model, q);
  return q;
}

// Far angles are rounded by more than loops may be open. Whole turns of a joint are left out where nothing counts them, as springs,
// ranges and couplers do.
void leaveOutTurns(const Model& model, const std::string& file, cli::EvalState& state) {
  constexpr double kFar = 1e5;  // rad
  for (int j : state.placed) {
    const Joint& joint = model.joints()[j];
    for (int k = 0; k < joint.nv; ++k) {
      if (!isAngle(joint.kind, k)) continue;
      double& angle = state.q[joint.idx_q + k];
      if (std::abs(angle) <= kFar) continue;
      if (countsTurns(model, joint.idx_v + k))
        throw InputError(file, "joint '" + joint.name + "'",
                         "its angle of " + formatNumber(angle) + " rad is rounded by more than loops may be open",
                         "give one within " + formatNumber(kFar) + " rad");
      const double rest = std::remainder(angle, 2 * M_PI);
      std::cerr << "bielle: warning: " << file << ": joint '" << joint.name << "': of its angle " << formatNumber(angle)
                << " rad whole turns are left out; it starts with " << formatNumber(rest) << "\n";
      angle = rest;
    }
  }
}

}  // namespace

FreeStart makeFreeStart(const Model& model, const SimulateArguments& arguments, const std::string& robot) {
  const VectorXd posture = makePosture(model, arguments.posture, robot);
  if (arguments.state.empty()) return {posture, VectorXd::Zero(model.nv()), VectorXd::Zero(model.nu())};
  const std::string file = arguments.state == "-" ? "standard input" : arguments.state;
  cli::EvalState state = cli::readState(model, arguments.state, posture);
  if (!state.contacts.empty())
    throw InputError(file, "key 'contacts'", "feet of a free motion stand where the ground holds them", "remove it");
  leaveOutTurns(model, file, state);
  cli::closeState(model, file, state);
  cli::closeMotion(model, file, state);
  return {state.q, state.v, state.u};
}

}  // namespace bielle::worlds
