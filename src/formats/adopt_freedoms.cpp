#include "formats/adopt_freedoms.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <set>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "math/decompositions.h"

namespace bielle {
namespace {

constexpr double kIndependent = 1e-5;  // least part of a direction that is not in those before it

// A closed configuration beside q, where straight legs are bent and linkages are not flat.
VectorXd findBeside(const Model& model, ConstVectorRef q) {
  const AssemblyResult beside =
      closeConfiguration(model, model.integrate(q, 0.05 * VectorXd::LinSpaced(model.nv(), -0.7, 1.1)));
  return beside.status == NumericalStatus::Ok ? beside.q : VectorXd(q);
}

// An orthonormal basis of the motions that the closures allow, nv rows. \param ws  at the configuration
MatrixXd calcMotions(const Model& model, const Workspace& ws) {
  const ConstraintSet set = makeConstraintSet(model);
  MatrixXd J = MatrixXd::Zero(std::max(1, set.rows), model.nv());
  for (size_t c = 0; c < set.closures.size(); ++c)
    calcClosureJacobian(ws, set.closures[c], J.middleRows(set.offsets[c], getRows(set.closures[c].kind)));
  const Eigen::JacobiSVD<MatrixXd> svd(J, Eigen::ComputeFullV);
  const VectorXd& s = svd.singularValues();
  return svd.matrixV().rightCols(model.nv() - (s.array() > kIndependent * s[0]).count());
}

Eigen::Index countIndependent(const MatrixXd& columns) {
  const VectorXd s = Eigen::JacobiSVD<MatrixXd>(columns).singularValues();
  return (s.array() > kIndependent * s[0]).count();
}

// In the order in which they are preferred for motors.
std::vector<int> sortForMotors(const Model& model, const std::vector<FoundFoot>& feet) {
  std::set<int> carrying, in_loops;  // bodies/joints; dofs
  for (const FoundFoot& foot : feet)
    for (int i = foot.body; i > 0; i = model.joints()[static_cast<size_t>(i)].parent) carrying.insert(i);
  for (const LoopCluster& cluster : model.clusters())
    if (std::any_of(cluster.closures.begin(), cluster.closures.end(),
                    [&model](int c) { return model.closures()[static_cast<size_t>(c)].kind != ClosureKind::Coupler; }))
      in_loops.insert(cluster.dofs.begin(), cluster.dofs.end());
  std::vector<int> order;
  std::vector<std::pair<int, bool>> ranks(model.joints().size());
  for (int i = 1; i < model.numBodies(); ++i) {
    const Joint& joint = model.joints()[static_cast<size_t>(i)];
    ranks[static_cast<size_t>(i)] = {ranks[static_cast<size_t>(joint.parent)].first + 1,
                                     carrying.count(i) || !in_loops.count(joint.idx_v)};
    if (joint.nv == 1) order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&ranks](int a, int b) { return ranks[static_cast<size_t>(a)] < ranks[static_cast<size_t>(b)]; });
  return order;
}

}  // namespace

std::vector<Motor> guessMotors(const Model& model, ConstVectorRef q, const std::vector<FoundFoot>& feet,
                               const std::map<std::string, double>& efforts) {
  Workspace ws(model);
  updatePositions(model, ws, findBeside(model, q));
  const MatrixXd motions = calcMotions(model, ws);
  MatrixXd taken(motions.cols(), 0);  // what free bases and the motors so far determine, orthonormal
  const auto take = [&](int dof) {
    VectorXd row = motions.row(dof).transpose();
    const double length = row.norm();
    for (int i = 0; i < 2; ++i) row -= taken * (taken.transpose() * row);  // again, for what rounding leaves
    if (!(row.norm() > kIndependent * length)) return false;
    taken.conservativeResize(Eigen::NoChange, taken.cols() + 1);
    taken.rightCols(1) = row.normalized();
    return true;
  };
  for (const Joint& joint : model.joints())
    for (int k = 0; k < joint.nv && joint.kind == JointKind::FreeFlyer; ++k) take(joint.idx_v + k);
  std::set<int> sprung;
  for (const JointForce& force : model.jointForces())
    if (force.stiffness != 0) sprung.insert(force.joint);
  std::vector<Motor> motors;
  for (const int j : sortForMotors(model, feet)) {
    const Joint& joint = model.joints()[static_cast<size_t>(j)];
    if (sprung.count(j) || !take(joint.idx_v)) continue;
    Motor motor;
    motor.name = joint.name;
    motor.joint = j;
    motor.dof = joint.idx_v;
    if (const auto effort = efforts.find(joint.name); effort != efforts.end()) motor.effort_limit = effort->second;
    motor.velocity_limit = model.velocityLimits()[joint.idx_v];
    motors.push_back(motor);
  }
  std::sort(motors.begin(), motors.end(), [](const Motor& a, const Motor& b) { return a.joint < b.joint; });
  return motors;
}

std::map<std::string, double> bendKnees(const Model& model, const Workspace& ws, const std::vector<FoundFoot>& feet) {
  constexpr double kPitch = 0.7;  // least cosine between an axis and left
  constexpr double kBends[] = {-0.4, 0.8, -0.4};
  std::map<std::string, double> angles;
  for (const FoundFoot& foot : feet) {
    std::vector<std::pair<int, double>> pitches;  // bodies/joints from the base on, y of their axes
    for (int i = foot.body; i > 1; i = model.joints()[static_cast<size_t>(i)].parent) {
      const Joint& joint = model.joints()[static_cast<size_t>(i)];
      const double left = (ws.X_WB[static_cast<size_t>(i)].R * joint.axis).y();
      if (joint.nv == 1 && joint.kind != JointKind::Prismatic && std::abs(left) > kPitch)
        pitches.insert(pitches.begin(), {i, left});
    }
    for (size_t k = 0; k < std::min(std::size(kBends), pitches.size()); ++k)
      angles[model.joints()[static_cast<size_t>(pitches[k].first)].name] =
          std::copysign(1.0, pitches[k].second) * kBends[k];
  }
  return angles;
}

bool canTurn(const Model& model, ConstVectorRef q, const FoundFoot& foot) {
  Workspace ws(model);
  updatePositions(model, ws, findBeside(model, q));
  MatrixXd J = calcFrameJacobian(model, ws, foot.body, foot.X_BF);
  const Joint& base = model.joints()[1];
  J.middleCols(base.idx_v, base.nv).setZero();
  const MatrixXd twists = J * calcMotions(model, ws);
  return countIndependent(twists) > countIndependent(twists.topRows(3));
}

}  // namespace bielle
