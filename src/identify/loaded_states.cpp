#include "identify/loaded_states.h"

#include <algorithm>

#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "math/decompositions.h"

namespace bielle {
namespace {

// Eq. (1).
class ClusterMotion {
 public:
  explicit ClusterMotion(const MeasuredLinkage& linkage)
      : linkage_(linkage), cluster_(*linkage.cluster), scratch_(cluster_), state_(cluster_) {}

  // False if the linkage cannot be there.
  bool update(const VectorXd& q, Eigen::Index instant) {
    if (!updateClusterState<double>(cluster_, scratch_, q, state_)) return false;
    const auto count = static_cast<Eigen::Index>(linkage_.sensors.size());
    const ClusterBasis& basis = state_.basis;
    MatrixXd A(count, cluster_.size);
    VectorXd rates(count), accelerations(count);
    for (Eigen::Index s = 0; s < count; ++s) {
      const LinkageSensor& sensor = linkage_.sensors[static_cast<size_t>(s)];
      A.row(s) = basis.N.row(sensor.dof) / sensor.noise;
      rates[s] = linkage_.motion.rate(instant, s) / sensor.noise;
      accelerations[s] = linkage_.motion.acceleration(instant, s) / sensor.noise;
    }
    const Eigen::CompleteOrthogonalDecomposition<MatrixXd> factors(A);
    v = basis.N * VectorXd(factors.solve(rates));
    a = calcDrift();
    for (Eigen::Index s = 0; s < count; ++s) {
      const LinkageSensor& sensor = linkage_.sensors[static_cast<size_t>(s)];
      accelerations[s] -= a[sensor.dof] / sensor.noise;
    }
    a += basis.N * VectorXd(factors.solve(accelerations));
    return true;
  }
  const ClusterBasis& basis() const { return state_.basis; }

  VectorXd v, a;  // n

 private:
  // a_d
  VectorXd calcDrift() {
    loadClusterState(cluster_, state_, scratch_);
    Workspace& ws = scratch_.ws;
    updateVelocities<double>(cluster_.model, ws, v);
    updateDrift<double>(cluster_.model, ws);
    const ConstraintSet& closures = cluster_.closures;
    VectorXd all = VectorXd::Zero(cluster_.numRows());  // rows of idle spins, which follow those of closures, have none
    for (size_t c = 0; c < closures.closures.size(); ++c)
      all.segment(closures.offsets[c], getRows(closures.closures[c].kind)) =
          calcClosureAcceleration<double>(ws, closures.closures[c]);
    MatrixXd gamma(cluster_.rank, 1), drift(cluster_.model.nv(), 1);
    for (int p = 0; p < cluster_.rank; ++p) gamma(p, 0) = all[state_.basis.rows[static_cast<size_t>(p)]];
    applyPseudoInverse(cluster_, state_.basis, -1, gamma, drift);
    return drift;
  }

  const MeasuredLinkage& linkage_;
  const ReducedCluster& cluster_;
  ClusterScratch scratch_;
  ClusterState state_;
};

}  // namespace

int leaveOutFast(const Model& model, double window, LoadedMotion& motion) {
  size_t kept = 0;
  for (size_t i = 0; i < motion.states.size(); ++i) {
    double fastest = 0;  // rad/s
    for (const Joint& joint : model.joints())
      if (joint.kind != JointKind::Prismatic && joint.nv > 0)
        fastest = std::max(fastest, motion.states[i].v.segment(joint.idx_v, joint.nv).lpNorm<Eigen::Infinity>());
    if (fastest * window > kMostTurnInWindow) continue;
    if (kept != i) motion.states[kept] = std::move(motion.states[i]), motion.instants[kept] = motion.instants[i];
    ++kept;
  }
  const auto left_out = static_cast<int>(motion.states.size() - kept);
  motion.states.resize(kept), motion.instants.resize(kept);
  return left_out;
}

LoadedMotion findLoadedStates(const Model& model, ConstVectorRef q, const std::vector<MeasuredLinkage>& linkages,
                              const std::vector<MeasuredCoordinate>& coordinates, const MatrixXd& torques,
                              const MatrixXd& signs, const std::atomic<bool>& interrupt) {
  LoadedMotion out;
  const Eigen::Index K = torques.rows();
  std::vector<std::vector<Eigen::Index>> rows;  // per linkage and instant, of its configurations; -1 if there is none
  std::vector<MatrixXd> configurations;
  std::vector<ClusterMotion> motions;
  Eigen::Index size = static_cast<Eigen::Index>(coordinates.size());
  for (const MeasuredLinkage& linkage : linkages) {
    LogFit fit(linkage.cluster, {}, linkage.sensors, linkage.motion.value, linkage.q_start);
    if (!fit.follow(interrupt)) return out;
    rows.emplace_back(static_cast<size_t>(K), -1);
    for (size_t i = 0; i < fit.usedRows().size(); ++i)
      rows.back()[static_cast<size_t>(fit.usedRows()[i])] = static_cast<Eigen::Index>(i);
    configurations.push_back(fit.configurations());
    motions.emplace_back(linkage);
    out.groups.push_back(linkage.cluster->size);
    size += linkage.cluster->size;
  }
  out.groups.resize(linkages.size() + coordinates.size(), 1);
  for (Eigen::Index k = 0; k < K; ++k) {
    LoadedState state{q,
                      VectorXd::Zero(model.nv()),
                      VectorXd::Zero(model.nv()),
                      torques.row(k).transpose(),
                      VectorXd(model.nu()),
                      MatrixXd::Zero(model.nv(), size)};
    bool is_closed = true;
    Eigen::Index column = 0;
    for (size_t l = 0; l < linkages.size() && is_closed; ++l) {
      const ReducedCluster& cluster = *linkages[l].cluster;
      const Eigen::Index row = rows[l][static_cast<size_t>(k)];
      is_closed = row >= 0 && motions[l].update(configurations[l].col(row), k);
      if (!is_closed) break;
      scatterConfiguration(model, cluster, motions[l].basis().q, state.q);
      scatterVelocity(cluster, motions[l].v, state.v);
      scatterVelocity(cluster, motions[l].a, state.a);
      for (size_t i = 0; i < cluster.dofs.size(); ++i)
        state.N.block(cluster.dofs[i], column, 1, cluster.size) =
            motions[l].basis().N.row(static_cast<Eigen::Index>(i));
      column += cluster.size;
    }
    if (!is_closed) continue;
    for (const MeasuredCoordinate& coordinate : coordinates) {
      state.q[coordinate.position] = coordinate.motion.value(k, 0);
      state.v[coordinate.dof] = coordinate.motion.rate(k, 0);
      state.a[coordinate.dof] = coordinate.motion.acceleration(k, 0);
      state.N(coordinate.dof, column++) = 1;
    }
    for (int m = 0; m < model.nu(); ++m) {
      const Motor& motor = model.motors()[static_cast<size_t>(m)];
      state.signs[m] = signs.size() > 0 ? signs(k, m) : calcFrictionSign(model, motor, state.v[motor.dof]);
    }
    out.states.push_back(std::move(state));
    out.instants.push_back(k);
  }
  return out;
}

}  // namespace bielle
