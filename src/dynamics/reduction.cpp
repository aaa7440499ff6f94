#include "bielle/dynamics/reduction.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "bielle/model/builder.h"

namespace bielle {
namespace {

// The cluster's joints over their common root, which becomes the world of the block.
Model makeBlockModel(const Model& model, const LoopCluster& cluster, const std::vector<int>& joints) {
  ModelBuilder builder("loops of " + model.name());
  builder.setGravity(Vector3d::Zero());
  std::vector<std::string> links(model.numBodies(), "world");
  for (int i : joints) {
    Joint joint = model.joints()[i];
    links[i] = model.bodies()[i].name;
    builder.addLink(links[i], links[joint.parent], joint, {});
  }
  for (int c : cluster.closures) {
    const Closure& closure = model.closures()[c];
    builder.addFrame(closure.name + "|1", links[closure.body1], closure.X_B1);
    builder.addFrame(closure.name + "|2", links[closure.body2], closure.X_B2);
    builder.addClosure(closure.name, closure.kind, closure.name + "|1", closure.name + "|2", closure.axis);
  }
  return builder.build();
}

// W: the inertia of each dof, with a floor that keeps (1) well conditioned. A mechanism without inertia has no preference.
VectorXd makeMetric(const Workspace& ws, const std::vector<int>& dofs) {
  constexpr double kFloor = 1e-3;
  VectorXd metric(dofs.size());
  for (size_t k = 0; k < dofs.size(); ++k) metric[k] = ws.M(dofs[k], dofs[k]);
  const double largest = metric.maxCoeff();
  return largest > 0 ? VectorXd((metric / largest).cwiseMax(kFloor)) : VectorXd::Ones(metric.size());
}

// Parent, path and outer coordinates of a unit carried by body `root`.
void connectUnit(const Model& model, const Reduction& reduction, int root, ReducedUnit& unit) {
  if (root == 0) return;
  unit.parent = reduction.unit_of_body[root];
  const ReducedUnit& up = reduction.units[unit.parent];
  unit.outer = up.outer;
  for (int k = 0; k < up.size; ++k) unit.outer.push_back(up.offset + k);
  std::vector<int> dofs;
  if (up.block >= 0) {
    dofs = reduction.blocks[up.block].dofs;
  } else {
    const Joint& joint = model.joints()[up.joint];
    for (int k = 0; k < joint.nv; ++k) dofs.push_back(joint.idx_v + k);
  }
  const std::vector<int>& support = model.supportDofs(root);
  for (size_t k = 0; k < dofs.size(); ++k)
    if (std::binary_search(support.begin(), support.end(), dofs[k])) unit.path.push_back(static_cast<int>(k));
}

// What the paths through a block are made of.
void addGroups(LoopBlock& block) {
  std::vector<int> last_group(block.model.numBodies(), -1);
  block.body_dof.assign(block.model.numBodies(), -1);
  for (int i = 1; i < block.model.numBodies(); ++i) {
    const Joint& joint = block.model.joints()[i];
    last_group[i] = last_group[joint.parent];
    block.body_dof[i] = block.body_dof[joint.parent];
    const int step = joint.kind == JointKind::Universal ? 1 : joint.nv;
    for (int k = joint.idx_v; k < joint.idx_v + joint.nv; k += step) {
      block.groups.push_back({k, k + step, block.body_dof[i], last_group[i]});
      block.body_dof[i] = k + step - 1;
      last_group[i] = static_cast<int>(block.groups.size()) - 1;
    }
  }
}

// The closures of a block for someone who looks at the whole model.
void placeClosures(const Model& model, LoopBlock& block) {
  block.placed = block.closures.closures;
  for (size_t c = 0; c < block.placed.size(); ++c) {
    const Closure& whole = model.closures()[block.cluster_closures[c]];
    block.placed[c].body1 = whole.body1;
    block.placed[c].body2 = whole.body2;
  }
}

}  // namespace

Reduction makeReduction(const Model& model, ConstVectorRef q) {
  Reduction out;
  Workspace whole(model);
  updatePositions(model, whole, q);
  updateMassMatrix(model, whole);
  std::vector<int> owner(model.numBodies(), -1);
  for (const LoopCluster& cluster : model.clusters()) {
    LoopBlock block;
    block.dofs = cluster.dofs;
    for (int k : cluster.dofs)
      if (block.joints.empty() || block.joints.back() != model.dofs()[k].joint)
        block.joints.push_back(model.dofs()[k].joint);
    for (int i : block.joints) owner[i] = static_cast<int>(out.blocks.size());
    block.model = makeBlockModel(model, cluster, block.joints);
    block.closures = makeConstraintSet(block.model);
    block.cluster_closures = cluster.closures;
    VectorXd q_block(block.model.nq());
    gatherConfiguration(model, block, q, q_block);
    const Mobility mobility = calcMobility(block.model, q_block, kRankTolerance);
    block.rank = mobility.rank;
    block.size = mobility.mobility;
    block.metric = makeMetric(whole, block.dofs);
    block.inverse_metric = block.metric.cwiseInverse();
    block.inverse_root = block.metric.cwiseSqrt().cwiseInverse();
    for (size_t k = 0; k < block.dofs.size(); ++k) block.own_dofs.push_back(static_cast<int>(k));
    block.root = model.joints()[block.joints.front()].parent;
    addGroups(block);
    placeClosures(model, block);
    Workspace ws(block.model);
    updatePositions(block.model, ws, q_block);
    for (const Closure& closure : block.closures.closures)
      if (!(calcClosureResidual(ws, closure).cwiseAbs().maxCoeff() < 1e-8))
        throw ModelError(model.name(), "closure '" + closure.name + "'", "it is open at the given configuration",
                         "close the configuration first (assemble, closeConfiguration)");
    out.blocks.push_back(std::move(block));
  }
  // Units and their reduced coordinates, in the order of the first joint of each.
  std::vector<int> block_unit(out.blocks.size(), -1);
  std::vector<int>& unit_of = out.unit_of_body;
  unit_of.assign(model.numBodies(), -1);
  for (int i = 1; i < model.numBodies(); ++i) {
    if (owner[i] >= 0 && block_unit[owner[i]] >= 0) {
      unit_of[i] = block_unit[owner[i]];
      continue;
    }
    ReducedUnit unit;
    unit.offset = out.size;
    unit_of[i] = static_cast<int>(out.units.size());
    if (owner[i] < 0) {
      unit.joint = i;
      unit.size = model.joints()[i].nv;
      out.free_joints.push_back(i);
      out.free_offsets.push_back(out.size);
    } else {
      unit.block = owner[i];
      block_unit[owner[i]] = unit_of[i];
      out.blocks[owner[i]].offset = out.size;
      unit.size = out.blocks[owner[i]].size;
    }
    // The first joint of a block hangs on the body that carries the whole block.
    connectUnit(model, out, model.joints()[i].parent, unit);
    out.size += unit.size;
    out.units.push_back(unit);
  }
  if (out.size == 0)
    throw ModelError(model.name(), "closures", "they leave the robot no mobility", "see `bielle info` for ranks");
  return out;
}

ReducedUnit makeTip(const Model& model, const Reduction& reduction, int body) {
  ReducedUnit tip;
  connectUnit(model, reduction, body, tip);
  return tip;
}

void gatherConfiguration(const Model& model, const LoopBlock& block, ConstVectorRef q, VectorRef q_block) {
  int at = 0;
  for (int i : block.joints) {
    const Joint& joint = model.joints()[i];
    q_block.segment(at, joint.nq) = q.segment(joint.idx_q, joint.nq);
    at += joint.nq;
  }
}

void scatterConfiguration(const Model& model, const LoopBlock& block, ConstVectorRef q_block, VectorRef q) {
  int at = 0;
  for (int i : block.joints) {
    const Joint& joint = model.joints()[i];
    q.segment(joint.idx_q, joint.nq) = q_block.segment(at, joint.nq);
    at += joint.nq;
  }
}

void gatherVelocity(const LoopBlock& block, ConstVectorRef v, VectorRef v_block) {
  for (size_t k = 0; k < block.dofs.size(); ++k) v_block[k] = v[block.dofs[k]];
}

void scatterVelocity(const LoopBlock& block, ConstVectorRef v_block, VectorRef v) {
  for (size_t k = 0; k < block.dofs.size(); ++k) v[block.dofs[k]] = v_block[k];
}

}  // namespace bielle
