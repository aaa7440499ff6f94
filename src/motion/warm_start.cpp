#include <algorithm>
#include <cmath>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "bielle/model/names.h"
#include "bielle/motion/record.h"
#include "motion/mended_guess.h"

namespace bielle {
namespace {

// Row of `rows` at the same fraction as row i of `count`.
int matchRow(int i, int count, Eigen::Index rows) {
  if (count <= 1) return 0;
  return static_cast<int>(std::lround(static_cast<double>(i) * static_cast<double>(rows - 1) / (count - 1)));
}

void requireSame(const std::vector<std::string>& recorded, const std::vector<std::string>& names, const char* what) {
  if (recorded == names) return;
  size_t i = 0;
  while (i < std::min(recorded.size(), names.size()) && recorded[i] == names[i]) ++i;
  const auto get = [i](const std::vector<std::string>& list) { return i < list.size() ? "'" + list[i] + "'" : "none"; };
  throw InputError("", "warm start",
                   std::string("the recorded motion and the robot have different ") + what + ": number " +
                       std::to_string(i + 1) + " is " + get(recorded) + " there, and " + get(names) + " of the robot",
                   "give a result of the same robot");
}

void requireFinite(const RowMatrixXd& values, const std::vector<std::string>& names, const char* what) {
  for (Eigen::Index k = 0; k < values.rows(); ++k)
    for (Eigen::Index i = 0; i < values.cols(); ++i)
      if (!std::isfinite(values(k, i)))
        throw InputError("", "warm start",
                         std::string("the ") + what + " of " + names[static_cast<size_t>(i)] +
                             " is not finite in row " + std::to_string(k),
                         "give the result of a successful solve");
}

// From the feet of a phase, on average, to their places.
Vector3d calcWayToFeet(const Model& model, Workspace& ws, const ContactPhase& phase, const VectorXd& x) {
  Vector3d way = Vector3d::Zero();
  if (!model.hasFreeFlyer() || phase.contacts.empty()) return way;
  updatePlacements(model, ws, x.head(model.nq()));
  for (const ContactTarget& target : phase.contacts) {
    const ContactFrame& foot = model.contacts()[target.contact];
    way += target.X_WT.p - getPlacement(ws, foot.body, foot.X_BF).p;
  }
  return way / static_cast<double>(phase.contacts.size());
}

// Moves the base over the ground so that the feet are where the motion has them, unless they slip no farther than in a solved
// motion: states then stay consistent with velocities, and a solution stays one. Returns whether they slipped.
bool carryToFeet(const Motion& motion, std::vector<VectorXd>& xs) {
  constexpr double kSlip = 5e-4;  // m
  const Model& model = motion.problem->model();
  Workspace ws(model);
  std::vector<Vector3d> ways;
  double farthest = 0;
  for (size_t k = 0; k < xs.size(); ++k) {
    ways.push_back(calcWayToFeet(model, ws, motion.schedule.getPhase(static_cast<int>(k)), xs[k]));
    farthest = std::max(farthest, ways.back().norm());
  }
  if (farthest <= kSlip) return false;
  for (size_t k = 0; k < ways.size(); ++k)
    if (model.hasFreeFlyer()) xs[k].head<3>() += ways[k];
  return true;
}

// Time scales of phases of free duration, from a record of as many nodes.
void setTimeScales(const MotionRecord& record, const RobotProblem& problem, ShootingTrajectory& trajectory) {
  double scale = 1;
  for (int k = 0; k < problem.numStages(); ++k) {
    const StageSpec& spec = problem.spec(k);
    if (spec.timing.phase < 0) continue;
    VectorXd &x = trajectory.xs[k], &u = trajectory.us[k];
    if (u.size() > problem.model().nu()) {
      scale = std::clamp((record.time[k + 1] - record.time[k]) / spec.dt, spec.timing.lower, spec.timing.upper);
      u[u.size() - 1] = scale;
    } else {
      x[x.size() - 1] = scale;
    }
  }
}

}  // namespace

StartingPoint makeStart(const MotionRecord& record, const Motion& motion) {
  const Model& model = motion.problem->model();
  requireSame(record.q_names, makePositionNames(model), "coordinates");
  requireSame(record.v_names, makeVelocityNames(model), "velocities");
  requireSame(record.u_names, getNames(model.motors()), "motors");
  const Eigen::Index rows = record.q.rows();  // maybe more than times: steps are halved
  if (record.q.cols() != model.nq() || record.v.cols() != model.nv() || record.u.cols() != model.nu() ||
      record.v.rows() != rows || record.u.rows() != rows - 1)
    throw InputError("", "warm start", "the shapes of the recorded q, v and u do not match the robot",
                     "give one row per node, or per stage, and one column per name");
  if (rows < 2 || record.u.rows() < 1)
    throw InputError("", "warm start", "the recorded motion is empty", "give the result of a successful solve");
  requireFinite(record.q, record.q_names, "position");
  requireFinite(record.v, record.v_names, "velocity");
  requireFinite(record.u, record.u_names, "torque");
  const int nodes = motion.problem->numStages() + 1;
  StartingPoint start{motion.guess, record.multipliers};
  ShootingTrajectory& trajectory = start.trajectory;
  for (int k = 0; k < nodes; ++k) {
    const int row = matchRow(k, nodes, record.q.rows());
    VectorXd& x = trajectory.xs[k];
    x.head(model.nq()) = record.q.row(row).transpose();
    x.segment(model.nq(), model.nv()) = record.v.row(row).transpose();
    if (k + 1 < nodes)
      trajectory.us[k].head(model.nu()) = record.u.row(matchRow(k, nodes - 1, record.u.rows())).transpose();
  }
  if (carryToFeet(motion, trajectory.xs)) {
    leadPastDeadPoints(motion, trajectory.xs);
    standOnFeet(motion, trajectory.xs);
  }
  if (record.time.size() == nodes) setTimeScales(record, *motion.problem, trajectory);
  return start;
}

}  // namespace bielle
