#include "identify/play_sides.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "dynamics/joint_force.h"
#include "dynamics/linkage_workspace.h"
#include "math/decompositions.h"
#include "model/rod_end.h"

namespace bielle {
namespace {

// What pushes a motor's rotor beside its gear: of springs, dampers and friction on its joint, and of its inertia.
double calcRotorForce(const Model& model, const Motor& motor, const Workspace& ws, const LoadedState& state) {
  double force = -model.armature()[motor.dof] * state.a[motor.dof];
  for (const JointForce& one : model.jointForces())
    if (one.joint == motor.joint) force += calcJointForce<double>(one, ws);
  return force;
}

// Eq. (2). \param joints  dofs of the cluster
VectorXd holdJoints(const VectorXd& move, const MatrixXd& N, const std::vector<int>& joints) {
  if (joints.empty()) return move;
  const MatrixXd A = N(joints, Eigen::all);
  const VectorXd moved = move(joints);
  const Eigen::CompleteOrthogonalDecomposition<MatrixXd> factors(A);
  return move - N * VectorXd(factors.solve(moved));
}

}  // namespace

std::vector<LinkagePlay> listLinkagePlays(const Model& model, const ReducedCluster& cluster,
                                          const std::vector<LinkageSensor>& sensors, const std::vector<Play>& present) {
  const std::vector<Play> sizes = listPlays(model, present);
  const auto getSize = [&sizes](const std::string& name) {
    const auto at = std::find_if(sizes.begin(), sizes.end(), [&](const Play& play) { return play.name == name; });
    return at == sizes.end() ? 0.0 : at->size;
  };
  std::vector<LinkagePlay> plays;
  for (size_t s = 0; s < sensors.size(); ++s)
    if (const std::string& name = sensors[s].name; model.findMotor(name) >= 0)
      plays.push_back({name, getSize(name), static_cast<int>(s), {}});
  for (size_t c = 0; c < cluster.closure_indices.size(); ++c) {
    const Closure& closure = model.closures()[static_cast<size_t>(cluster.closure_indices[c])];
    const std::optional<RodEnd> end = findRodEnd(model, closure);
    if (!end || !(end->far.norm() > 1e-9)) continue;  // addPlay() says why
    const auto kind = end->is_first ? GeometryMove::Kind::Frame1 : GeometryMove::Kind::Frame2;
    plays.push_back({closure.name,
                     getSize(closure.name),
                     -1,
                     {closure.name, 0, true, {{kind, static_cast<int>(c), end->far.normalized()}}}});
  }
  return plays;
}

PlayLoads calcPlayLoads(const Model& model, const MeasuredLinkage& linkage, const std::vector<LinkagePlay>& plays,
                        const LoadedMotion& motion, const VectorXd& noise) {
  const ReducedCluster& cluster = *linkage.cluster;
  LogFit fit(linkage.cluster, {}, linkage.sensors, {}, linkage.q_start);
  fit.addPlays(plays, {});
  std::vector<int> joints;
  for (const LinkageSensor& sensor : linkage.sensors)
    if (model.findMotor(sensor.name) < 0) joints.push_back(sensor.dof);
  const auto K = static_cast<Eigen::Index>(motion.states.size()), count = static_cast<Eigen::Index>(plays.size());
  PlayLoads loads{MatrixXd::Zero(K, count), MatrixXd::Zero(K, count)};
  Workspace ws(model);
  VectorXd q(cluster.model.nq());
  for (Eigen::Index k = 0; k < K; ++k) {
    const LoadedState& state = motion.states[static_cast<size_t>(k)];
    const VectorXd motors = calcMotorForces(model, state.u), noises = calcMotorForces(model, noise).cwiseAbs();
    const VectorXd inertial = calcInverseDynamics(model, ws, state.q, state.v, state.a);
    gatherConfiguration(model, cluster, state.q, q);
    const auto [moves, N] = fit.calcPlayMotions(q);
    for (Eigen::Index p = 0; p < count; ++p) {
      const LinkagePlay& play = plays[static_cast<size_t>(p)];
      double driven = 0, rest = 0;
      if (play.sensor >= 0) {
        const Motor& motor = model.motors()[static_cast<size_t>(model.findMotor(play.name))];
        driven = motors[motor.dof], loads.least(k, p) = noises[motor.dof];
        rest = calcRotorForce(model, motor, ws, state);
      } else if (N.size() > 0) {
        const VectorXd move = holdJoints(moves.col(p), N, joints);
        driven = move.dot(motors(cluster.dofs)), loads.least(k, p) = move.cwiseAbs().dot(noises(cluster.dofs));
        rest = -move.dot(inertial(cluster.dofs));
      }
      loads.values(k, p) = driven + rest;
      loads.least(k, p) = std::max(loads.least(k, p), kClearLoad * (std::abs(driven) + std::abs(rest)));
    }
  }
  return loads;
}

MatrixXd findSides(const VectorXd& time, const std::vector<double>& instants, const PlayLoads& loads, double farthest) {
  MatrixXd sides = MatrixXd::Zero(time.size(), loads.values.cols());
  const auto find = [&loads](Eigen::Index i, Eigen::Index p) {
    const double load = loads.values(i, p);
    return std::abs(load) > loads.least(i, p) ? (load > 0 ? 1 : -1) : 0;
  };
  Eigen::Index next = 0;
  const auto count = static_cast<Eigen::Index>(instants.size());
  for (Eigen::Index k = 0; k < time.size(); ++k) {
    while (next < count && instants[static_cast<size_t>(next)] < time[k]) ++next;
    if (next == 0 || next == count) continue;
    if (instants[static_cast<size_t>(next)] - instants[static_cast<size_t>(next) - 1] > farthest) continue;
    for (Eigen::Index p = 0; p < sides.cols(); ++p)
      if (const int side = find(next, p); side == find(next - 1, p)) sides(k, p) = side;
  }
  for (auto column : sides.colwise())
    if (static_cast<double>((column.array() != 0).count()) < kLeastClear * static_cast<double>(time.size()))
      column.setOnes();
  return sides;
}

}  // namespace bielle
