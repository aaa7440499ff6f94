#include "dynamics/reduction.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "bielle/model/builder.h"
#include "dynamics/idle_spins.h"
#include "dynamics/point_spring.h"

namespace bielle {
namespace {

// The cluster's joints over their common root, which becomes the world of the cluster.
Model makeClusterModel(const Model& model, const LoopCluster& loops, const std::vector<int>& joints) {
  ModelBuilder builder("loops of " + model.name());
  builder.setGravity(Vector3d::Zero());
  std::vector<std::string> links(model.numBodies(), "world");
  for (int i : joints) {
    Joint joint = model.joints()[i];
    links[i] = model.bodies()[i].name;
    builder.addLink(links[i], links[joint.parent], joint, {});
  }
  for (int c : loops.closures) {
    Closure closure = model.closures()[c];
    closure.kp = closure.kd = 0;
    if (closure.kind == ClosureKind::Coupler) {
      builder.copyClosure(model, closure);
      continue;
    }
    builder.addFrame(closure.name + "|1", links[closure.body1], closure.X_B1);
    builder.addFrame(closure.name + "|2", links[closure.body2], closure.X_B2);
    builder.addClosure(closure.name + "|1", closure.name + "|2", closure);
  }
  return builder.build();
}

// W: the inertia of each dof, with a floor that keeps (1) well conditioned. Without inertia all dofs weigh the same.
VectorXd makeMetric(const Workspace& ws, const std::vector<int>& dofs) {
  constexpr double kFloor = 1e-3;
  VectorXd metric(dofs.size());
  for (size_t k = 0; k < dofs.size(); ++k) metric[k] = ws.M(dofs[k], dofs[k]);
  const double largest = metric.maxCoeff();
  return largest > 0 ? VectorXd((metric / largest).cwiseMax(kFloor)) : VectorXd::Ones(metric.size());
}

// Parent, path and outer coordinates of a reduced joint carried by body `root`.
void connect(const Model& model, const Reduction& reduction, int root, ReducedJoint& reduced) {
  if (root == 0) return;
  reduced.parent = reduction.joint_of_body[root];
  const ReducedJoint& up = reduction.joints[reduced.parent];
  reduced.outer = up.outer;
  for (int k = 0; k < up.size; ++k) reduced.outer.push_back(up.offset + k);
  std::vector<int> dofs;
  if (up.cluster >= 0) {
    dofs = reduction.clusters[up.cluster].dofs;
  } else {
    const Joint& joint = model.joints()[up.joint];
    for (int k = 0; k < joint.nv; ++k) dofs.push_back(joint.idx_v + k);
  }
  const std::vector<int>& support = model.supportDofs(root);
  for (size_t k = 0; k < dofs.size(); ++k)
    if (std::binary_search(support.begin(), support.end(), dofs[k])) reduced.path.push_back(static_cast<int>(k));
}

// Groups of dofs that make up the paths through a cluster.
void addGroups(ReducedCluster& cluster) {
  std::vector<int> last_group(cluster.model.numBodies(), -1);
  cluster.body_dof.assign(cluster.model.numBodies(), -1);
  for (int i = 1; i < cluster.model.numBodies(); ++i) {
    const Joint& joint = cluster.model.joints()[i];
    last_group[i] = last_group[joint.parent];
    cluster.body_dof[i] = cluster.body_dof[joint.parent];
    const int step = joint.kind == JointKind::Universal ? 1 : joint.nv;
    for (int k = joint.idx_v; k < joint.idx_v + joint.nv; k += step) {
      cluster.groups.push_back({k, k + step, cluster.body_dof[i], last_group[i]});
      cluster.body_dof[i] = k + step - 1;
      last_group[i] = static_cast<int>(cluster.groups.size()) - 1;
    }
  }
}

// The closures of a cluster, as the whole model has them.
void placeClosures(const Model& model, ReducedCluster& cluster) {
  for (int c : cluster.closure_indices) {
    cluster.placed.push_back(model.closures()[c]);
    cluster.placed.back().kp = cluster.placed.back().kd = 0;
  }
}

}  // namespace

Reduction makeReduction(const Model& model, ConstVectorRef q) {
  Reduction out;
  Workspace whole(model);
  updatePositions(model, whole, q);
  updateMassMatrix(model, whole);
  std::vector<int> owner(model.numBodies(), -1);
  for (const LoopCluster& loops : model.clusters()) {
    ReducedCluster cluster;
    cluster.dofs = loops.dofs;
    for (int k : loops.dofs)
      if (cluster.joints.empty() || cluster.joints.back() != model.dofs()[k].joint)
        cluster.joints.push_back(model.dofs()[k].joint);
    for (int i : cluster.joints) owner[i] = static_cast<int>(out.clusters.size());
    cluster.model = makeClusterModel(model, loops, cluster.joints);
    cluster.closures = makeConstraintSet(cluster.model);
    cluster.closure_indices = loops.closures;
    VectorXd q_cluster(cluster.model.nq());
    gatherConfiguration(model, cluster, q, q_cluster);
    const Mobility mobility = calcMobility(cluster.model, q_cluster, kRankTolerance);
    cluster.rank = mobility.rank;
    cluster.size = mobility.mobility;
    cluster.metric = makeMetric(whole, cluster.dofs);
    cluster.inverse_metric = cluster.metric.cwiseInverse();
    cluster.inverse_root = cluster.metric.cwiseSqrt().cwiseInverse();
    for (size_t k = 0; k < cluster.dofs.size(); ++k) cluster.own_dofs.push_back(static_cast<int>(k));
    cluster.root = model.joints()[cluster.joints.front()].parent;
    addGroups(cluster);
    placeClosures(model, cluster);
    Workspace ws(cluster.model);
    updatePositions(cluster.model, ws, q_cluster);
    for (const Closure& closure : cluster.closures.closures)
      if (!(calcClosureResidual(ws, closure).cwiseAbs().maxCoeff() < 1e-8))
        throw InputError(model.name(), "closure '" + closure.name + "'", "it is open at the given configuration",
                         "close the configuration first (assemble, closeConfiguration)");
    cluster.spins = findIdleSpins(model, cluster, q_cluster);
    out.clusters.push_back(std::move(cluster));
  }
  for (const PointSpring& spring : model.pointSprings())
    if (calcPointSpringLength(spring, whole) < kShortestSpring)
      throw InputError(model.name(), "point spring '" + spring.name + "'",
                       "its points coincide at the given configuration, where its force has no direction",
                       "move one of its points, or start from another posture");
  // Reduced joints and their reduced coordinates, in the order of the first joint of each.
  std::vector<int> cluster_joint(out.clusters.size(), -1);
  std::vector<int>& joint_of = out.joint_of_body;
  joint_of.assign(model.numBodies(), -1);
  for (int i = 1; i < model.numBodies(); ++i) {
    if (owner[i] >= 0 && cluster_joint[owner[i]] >= 0) {
      joint_of[i] = cluster_joint[owner[i]];
      continue;
    }
    ReducedJoint reduced;
    reduced.offset = out.size;
    joint_of[i] = static_cast<int>(out.joints.size());
    if (owner[i] < 0) {
      reduced.joint = i;
      reduced.size = model.joints()[i].nv;
      out.free_joints.push_back(i);
      out.free_offsets.push_back(out.size);
    } else {
      reduced.cluster = owner[i];
      cluster_joint[owner[i]] = joint_of[i];
      out.clusters[owner[i]].offset = out.size;
      reduced.size = out.clusters[owner[i]].size;
    }
    // The parent of a cluster's first joint carries the whole cluster.
    connect(model, out, model.joints()[i].parent, reduced);
    out.size += reduced.size;
    out.joints.push_back(reduced);
  }
  if (out.size == 0)
    throw InputError(model.name(), "closures", "they leave the robot without mobility", "see `bielle info` for ranks");
  return out;
}

ReducedJoint makeTip(const Model& model, const Reduction& reduction, int body) {
  ReducedJoint tip;
  connect(model, reduction, body, tip);
  return tip;
}

template <typename T>
void gatherConfiguration(const Model& model, const ReducedCluster& cluster, typename ArgumentsOf<T>::ConstVector q,
                         typename ArgumentsOf<T>::Vector q_cluster) {
  int at = 0;
  for (int i : cluster.joints) {
    const Joint& joint = model.joints()[i];
    q_cluster.segment(at, joint.nq) = q.segment(joint.idx_q, joint.nq);
    at += joint.nq;
  }
}

template <typename T>
void scatterConfiguration(const Model& model, const ReducedCluster& cluster,
                          typename ArgumentsOf<T>::ConstVector q_cluster, typename ArgumentsOf<T>::Vector q) {
  int at = 0;
  for (int i : cluster.joints) {
    const Joint& joint = model.joints()[i];
    q.segment(joint.idx_q, joint.nq) = q_cluster.segment(at, joint.nq);
    at += joint.nq;
  }
}

template void gatherConfiguration<double>(const Model&, const ReducedCluster&, ConstVectorRef, VectorRef);
template void gatherConfiguration<Lanes>(const Model&, const ReducedCluster&, ArgumentsOf<Lanes>::ConstVector,
                                         ArgumentsOf<Lanes>::Vector);
template void scatterConfiguration<double>(const Model&, const ReducedCluster&, ConstVectorRef, VectorRef);
template void scatterConfiguration<Lanes>(const Model&, const ReducedCluster&, ArgumentsOf<Lanes>::ConstVector,
                                          ArgumentsOf<Lanes>::Vector);

void gatherVelocity(const ReducedCluster& cluster, ConstVectorRef v, VectorRef v_cluster) {
  for (size_t k = 0; k < cluster.dofs.size(); ++k) v_cluster[k] = v[cluster.dofs[k]];
}

void scatterVelocity(const ReducedCluster& cluster, ConstVectorRef v_cluster, VectorRef v) {
  for (size_t k = 0; k < cluster.dofs.size(); ++k) v[cluster.dofs[k]] = v_cluster[k];
}

}  // namespace bielle
