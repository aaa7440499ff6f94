#include <algorithm>
#include <cmath>
#include <filesystem>

#include "bielle/dynamics/kinematics.h"
#include "bielle/io/names.h"
#include "bielle/io/result.h"
#include "bielle/model/error.h"

namespace fs = std::filesystem;

namespace bielle {
namespace {

// Row of `rows` at the same fraction as row i of `count`.
int matchRow(int i, int count, Eigen::Index rows) {
  if (count <= 1) return 0;
  return static_cast<int>(std::lround(static_cast<double>(i) * static_cast<double>(rows - 1) / (count - 1)));
}

void requireSame(const std::vector<std::string>& recorded, const std::vector<std::string>& names, const char* what) {
  if (recorded != names)
    throw ModelError("", "warm start", std::string("the recorded motion has other ") + what + " than the robot",
                     "give a result of the same robot");
}

// Moves the base over the ground so that the feet of a phase are, on average, at their places.
void carryToFeet(const Model& model, Workspace& ws, const ContactPhase& phase, VectorRef x) {
  if (!model.hasFreeFlyer() || phase.contacts.empty()) return;
  updatePlacements(model, ws, x.head(model.nq()));
  Vector3d error = Vector3d::Zero();
  for (const ContactTarget& target : phase.contacts) {
    const ContactFrame& foot = model.contacts()[target.contact];
    error += target.X_WT.p - getPlacement(ws, foot.body, foot.X_BF).p;
  }
  x.head<3>() += error / static_cast<double>(phase.contacts.size());
}

// Time scales of phases of free duration, from a record of as many nodes.
void setTimeScales(const MotionRecord& record, Motion& motion) {
  const RobotProblem& problem = *motion.problem;
  double scale = 1;
  for (int k = 0; k < problem.numStages(); ++k) {
    const StageSpec& spec = problem.spec(k);
    if (spec.timing.phase < 0) continue;
    VectorXd &x = motion.guess.xs[k], &u = motion.guess.us[k];
    if (u.size() > problem.model().nu()) {
      scale = std::clamp((record.time[k + 1] - record.time[k]) / spec.dt, spec.timing.lower, spec.timing.upper);
      u[u.size() - 1] = scale;
    } else {
      x[x.size() - 1] = scale;
    }
  }
}

}  // namespace

void setGuess(const MotionRecord& record, Motion& motion) {
  const Model& model = motion.problem->model();
  requireSame(record.q_names, makePositionNames(model), "coordinates");
  requireSame(record.v_names, makeVelocityNames(model), "velocities");
  requireSame(record.u_names, getNames(model.motors()), "motors");
  if (record.q.rows() < 2 || record.u.rows() < 1 || !record.q.allFinite() || !record.v.allFinite() ||
      !record.u.allFinite())
    throw ModelError("", "warm start", "the recorded motion is empty or has numbers that are not finite",
                     "give the result of a solve that went through");
  const int nodes = motion.problem->numStages() + 1;
  Workspace ws(model);
  for (int k = 0; k < nodes; ++k) {
    const int row = matchRow(k, nodes, record.q.rows());
    VectorXd& x = motion.guess.xs[k];
    x.head(model.nq()) = record.q.row(row).transpose();
    x.segment(model.nq(), model.nv()) = record.v.row(row).transpose();
    carryToFeet(model, ws, motion.schedule.getPhase(k), x);
    if (k + 1 < nodes)
      motion.guess.us[k].head(model.nu()) = record.u.row(matchRow(k, nodes - 1, record.u.rows())).transpose();
  }
  if (record.time.size() == nodes) setTimeScales(record, motion);
}

MotionRecord readResultRecord(const std::string& directory) {
  for (const char* name : {"trajectory.npz", "trajectory.csv"}) {
    const fs::path path = fs::path(directory) / name;
    std::error_code error;
    if (fs::exists(path, error)) return readRecord(path.string());
  }
  throw ModelError(directory, "directory", "there is neither trajectory.npz nor trajectory.csv in it",
                   "give the output directory of a solve");
}

}  // namespace bielle
