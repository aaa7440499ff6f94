#include <algorithm>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "bielle/model/names.h"
#include "bielle/results/result.h"
#include "cli/softness_study.h"
#include "dynamics/largest_gaps.h"
#include "math/largest.h"
#include "model/number_text.h"

namespace bielle::cli {
namespace {

constexpr double kMostOpen = 1e-6;  // m or rad, of a motion of this mechanism

// Columns of a record by the names of the model's coordinates.
std::vector<int> matchColumns(const std::vector<std::string>& record, const std::vector<std::string>& model,
                              const std::string& directory, const std::string& file) {
  std::vector<int> columns;
  const auto require = [&](const std::vector<std::string>& names, const std::vector<std::string>& others,
                           const std::string& which) {
    for (const std::string& name : names)
      if (std::find(others.begin(), others.end(), name) == others.end())
        throw InputError(directory, "coordinate '" + name + "'", which,
                         "give a motion of this file: `bielle solve MOTION --robot " + file + "`");
  };
  require(model, record, file + " has it, the motion does not");
  require(record, model, "the motion has it, " + file + " does not");
  for (const std::string& name : model)
    columns.push_back(static_cast<int>(std::find(record.begin(), record.end(), name) - record.begin()));
  return columns;
}

VectorXd pick(const VectorXd& values, const std::vector<int>& columns) {
  VectorXd out(static_cast<Eigen::Index>(columns.size()));
  for (size_t k = 0; k < columns.size(); ++k) out[static_cast<Eigen::Index>(k)] = values[columns[k]];
  return out;
}

double calcLargestGap(const Model& model, const VectorXd& q) {
  Workspace ws(model);
  updatePositions(model, ws, q);
  const ClosureGap gap = calcLargestGaps(model, ws);
  return getLarger(gap.position, gap.angle);
}

// By coordinate, of the wrenches of the loops of the robot that moved.
VectorXd calcLoopForce(const Model& model, const VectorXd& q, const VectorXd& wrenches) {
  Workspace ws(model);
  updatePositions(model, ws, q);
  VectorXd force = VectorXd::Zero(model.nv());
  for (size_t c = 0; c < model.closures().size(); ++c) {
    const Closure& closure = model.closures()[c];
    MatrixXd J = MatrixXd::Zero(getRows(closure.kind), model.nv());
    calcClosureJacobian<double>(ws, closure, J);
    const Vector6d wrench = wrenches.segment<6>(6 * static_cast<Eigen::Index>(c));
    const bool is_scalar = closure.kind == ClosureKind::Coupler || closure.kind == ClosureKind::Distance;
    const VectorXd rows = is_scalar ? VectorXd(wrench.head<1>()) : VectorXd(selectRows<double>(closure, wrench));
    force += J.transpose() * rows;
  }
  return force;
}

}  // namespace

std::vector<SoftnessInstant> readInstants(const std::string& directory, const Model& model, const std::string& file) {
  const MotionRecord record = readResultRecord(directory);
  const LoadedRobot robot = loadRobotOf(directory);
  const std::vector<int> positions = matchColumns(record.q_names, makePositionNames(model), directory, file);
  const std::vector<int> velocities = matchColumns(record.v_names, makeVelocityNames(model), directory, file);
  const auto& q = record.has_midpoints ? record.q_mid : record.q;
  const auto& v = record.has_midpoints ? record.v_mid : record.v;
  std::vector<SoftnessInstant> instants;
  for (Eigen::Index k = 0; k < record.a.rows(); ++k) {
    const double step = record.time[k + 1] - record.time[k];
    if (step == 0) continue;
    SoftnessInstant instant;
    instant.time = record.time[k] + (record.has_midpoints ? step / 2 : 0);
    instant.q = pick(q.row(k).transpose(), positions);
    instant.v = pick(v.row(k).transpose(), velocities);
    instant.a = pick(record.a.row(k).transpose(), velocities);
    instant.force =
        pick(calcLoopForce(robot.model, q.row(k).transpose(), record.closure_wrenches.row(k).transpose()), velocities);
    if (const double gap = calcLargestGap(model, instant.q); !(gap < kMostOpen) || !instant.force.allFinite())
      throw InputError(directory, "time " + formatNumber(instant.time) + " s",
                       "there the loops of " + file + " are open by " + formatNumber(gap, "%.1e") +
                           ", or have no forces: the motion is of another mechanism, or was broken off",
                       "give a motion of this file: `bielle solve MOTION --robot " + file + "`");
    instants.push_back(std::move(instant));
  }
  return instants;
}

}  // namespace bielle::cli
