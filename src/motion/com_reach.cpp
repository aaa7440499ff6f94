#include "motion/com_reach.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"

namespace bielle {
namespace {

constexpr double kLongest = 0.2, kShortest = 1e-3;  // norm of a step, rad or m

// The way of a dof from q to its limit in a direction.
double getRoom(const Model& model, ConstVectorRef q, int dof, bool upwards) {
  const Joint& joint = model.joints()[model.dofs()[dof].joint];
  if (joint.nv != 1 || joint.nq != 1) return std::numeric_limits<double>::infinity();
  return upwards ? model.upperLimits()[dof] - q[joint.idx_q] : q[joint.idx_q] - model.lowerLimits()[dof];
}

// The steepest closed motion per unit length that raises the centre of mass, or lowers it; dofs at limits that it would pass stand.
VectorXd findDirection(const Model& model, const Workspace& ws, const ConstraintSet& constraints, ConstVectorRef q,
                       double sign, double& slope) {
  constexpr double kAtLimit = 1e-4;  // rad or m
  MatrixXd J = MatrixXd::Zero(constraints.rows, model.nv());
  for (size_t c = 0; c < constraints.closures.size(); ++c)
    calcClosureJacobian(ws, constraints.closures[c],
                        J.middleRows(constraints.offsets[c], getRows(constraints.closures[c].kind)));
  Eigen::Matrix3Xd C(3, model.nv());
  calcComJacobian(model, ws, C);
  VectorXd gradient = sign * C.row(2).transpose();
  for (int round = 0; round <= model.nv(); ++round) {
    Eigen::CompleteOrthogonalDecomposition<MatrixXd> decomposition;
    decomposition.setThreshold(1e-8);
    decomposition.compute(J);
    const VectorXd d = gradient - decomposition.solve(J * gradient);
    bool stopped = false;
    for (int k = 0; k < model.nv(); ++k)
      if (std::abs(d[k]) > 1e-9 && getRoom(model, q, k, d[k] > 0) < kAtLimit) {
        gradient[k] = 0;
        J.col(k).setZero();
        stopped = true;
      }
    slope = d.norm();
    if (!stopped) return d;
  }
  slope = 0;
  return VectorXd::Zero(model.nv());
}

}  // namespace

double calcReachedComHeight(const Model& model, const ConstraintSet& constraints, const std::vector<FrameTarget>& feet,
                            ConstVectorRef q0, double target) {
  constexpr int kMost = 100;
  Workspace ws(model);
  const auto calcHeight = [&](const VectorXd& q) {
    updatePositions(model, ws, q);
    return calcCom(model, ws).z();
  };
  AssemblyOptions options;
  options.step = AssemblyStep::Shortest;
  options.tolerance = 1e-9, options.max_iterations = 20, options.continuation_steps = 0;
  VectorXd q = q0;
  double height = calcHeight(q), length = kLongest;
  const double sign = target > height ? 1 : -1;
  for (int i = 0; i < kMost && sign * (target - height) > 0 && length > kShortest; ++i) {
    double slope = 0;
    updatePositions(model, ws, q);
    updateMassMatrix(model, ws);
    const VectorXd d = findDirection(model, ws, constraints, q, sign, slope);
    if (slope < 1e-6) break;
    double step = length / slope;
    for (int k = 0; k < model.nv(); ++k)
      if (d[k] != 0) step = std::min(step, getRoom(model, q, k, d[k] > 0) / std::abs(d[k]));
    AssemblyProblem problem;
    problem.q_ref = model.integrate(q, step * d);
    problem.frames = feet;
    const AssemblyResult next = assemble(model, problem, options);
    const double reached = next.status == NumericalStatus::Ok ? calcHeight(next.q) : height;
    if (sign * (reached - height) > 0) {
      q = next.q, height = reached;
      length = std::min(1.5 * length, kLongest);
    } else {
      length /= 2;
    }
  }
  return sign * (height - target) > 0 ? target : height;
}

}  // namespace bielle
