#include "dynamics/idle_spins.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "bielle/dynamics/kinematics.h"
#include "math/decompositions.h"
#include "model/listing.h"

namespace bielle {
namespace {

constexpr double kNothing = 1e-6;  // relative, of singular values
constexpr double kAside = 0.1;     // of the postures that are tried, rad or m

struct Candidate {
  int top = 0;                 // the body whose joint carries all that moves
  std::vector<int> dofs;       // with a part in the spin
  std::vector<int> with_dofs;  // all of their joints
  std::vector<int> bodies;
};

// What is at rest in an idle spin.
struct AtRest {
  std::set<int> dofs;    // of motors and serial joints
  std::set<int> bodies;  // that carry something
};

AtRest listAtRest(const Model& model, const ReducedCluster& cluster) {
  AtRest out;
  std::set<int> joints(model.serialJoints().begin(), model.serialJoints().end());
  for (const Motor& motor : model.motors()) joints.insert(motor.joint);
  const std::vector<int> carriers = listCarriers(model, cluster.joints);
  for (size_t i = 0; i < cluster.joints.size(); ++i) {
    const Joint& own = cluster.model.joints()[i + 1];  // the first one is the root
    if (joints.count(cluster.joints[i]))
      for (int k = 0; k < own.nv; ++k) out.dofs.insert(own.idx_v + k);
    if (contains(carriers, cluster.joints[i])) out.bodies.insert(static_cast<int>(i) + 1);
  }
  return out;
}

MatrixXd calcJacobian(const ReducedCluster& cluster, const Workspace& ws) {
  MatrixXd J = MatrixXd::Zero(cluster.closures.rows, cluster.model.nv());
  for (size_t c = 0; c < cluster.closures.closures.size(); ++c) {
    const Closure& closure = cluster.closures.closures[c];
    calcClosureJacobian<double>(ws, closure, J.middleRows(cluster.closures.offsets[c], getRows(closure.kind)));
  }
  return J;
}

// The one vector of the null space, or none.
VectorXd findOnlyNull(const MatrixXd& A) {
  const Eigen::JacobiSVD<MatrixXd> svd(A, Eigen::ComputeFullV);
  const VectorXd& sigma = svd.singularValues();
  const Eigen::Index n = A.cols(), rank = (sigma.array() > kNothing * sigma[0]).count();
  return rank == n - 1 ? VectorXd(svd.matrixV().col(n - 1)) : VectorXd();
}

// A point of the line: the centre of the joint that carries all, or where a closure holds what moves.
std::optional<Vector3d> findCentre(const ReducedCluster& cluster, const Workspace& ws, int top) {
  const JointKind kind = cluster.model.joints()[top].kind;
  if (kind == JointKind::Spherical || kind == JointKind::Universal || kind == JointKind::Revolute ||
      kind == JointKind::Continuous)
    return ws.X_WB[top].p;
  for (const Closure& closure : cluster.closures.closures) {
    if (closure.kind == ClosureKind::Coupler) continue;
    if (cluster.model.isAncestorOrSelf(top, closure.body1)) return ws.X_WB[closure.body1].act(closure.X_B1.p);
    if (cluster.model.isAncestorOrSelf(top, closure.body2)) return ws.X_WB[closure.body2].act(closure.X_B2.p);
  }
  return {};
}

// Eq. (3) for the bodies behind the joint of `top`, without the dofs that are taken.
std::optional<Candidate> findBehind(const ReducedCluster& cluster, const AtRest& at_rest, const Workspace& ws,
                                    const MatrixXd& J, int top, const std::set<int>& taken) {
  const Model& own = cluster.model;
  Candidate out;
  out.top = top;
  std::vector<int> dofs, bodies;
  for (int b = top; b < own.numBodies(); ++b) {
    if (!own.isAncestorOrSelf(top, b)) continue;
    const Joint& joint = own.joints()[b];
    bodies.push_back(b);
    for (int k = joint.idx_v; k < joint.idx_v + joint.nv; ++k)
      if (!taken.count(k) && !at_rest.dofs.count(k)) dofs.push_back(k);
    if (dofs.size() > kMostSpinDofs) return {};
  }
  const std::optional<Vector3d> centre = findCentre(cluster, ws, top);
  if (dofs.empty() || !centre) return {};
  const auto n = static_cast<Eigen::Index>(dofs.size());
  std::vector<Eigen::RowVectorXd> rows;
  for (Eigen::Index r = 0; r < J.rows(); ++r)
    if (const Eigen::RowVectorXd row = J(r, dofs); !row.isZero(0)) rows.push_back(row);
  for (const int b : bodies) {
    Matrix6Xd twist = Matrix6Xd::Zero(6, n);
    for (Eigen::Index k = 0; k < n; ++k)
      if (own.isAncestorOrSelf(own.dofs()[dofs[k]].joint, b)) twist.col(k) = ws.J.col(dofs[k]);
    for (int a = 0; a < 3; ++a) {
      Eigen::RowVectorXd velocity = twist.row(a);
      for (Eigen::Index k = 0; k < n; ++k) velocity[k] += twist.col(k).tail<3>().cross(*centre)[a];
      rows.push_back(velocity);
      if (at_rest.bodies.count(b)) rows.emplace_back(twist.row(3 + a));
    }
  }
  MatrixXd A(rows.size(), n);
  for (size_t r = 0; r < rows.size(); ++r) A.row(static_cast<Eigen::Index>(r)) = rows[r];
  const VectorXd spin = findOnlyNull(A);
  if (spin.size() == 0) return {};
  for (Eigen::Index k = 0; k < n; ++k)
    if (std::abs(spin[k]) > kNothing) out.dofs.push_back(dofs[k]);
  for (const int k : dofs)
    if (std::any_of(out.dofs.begin(), out.dofs.end(),
                    [&](int moved) { return own.dofs()[moved].joint == own.dofs()[k].joint; }))
      out.with_dofs.push_back(k);
  // These joints alone must have no other motion, as the row that holds the spin is found from them.
  if (findOnlyNull(J(Eigen::all, out.with_dofs)).size() == 0) return {};
  for (const int b : bodies)
    if (std::any_of(out.dofs.begin(), out.dofs.end(),
                    [&](int moved) { return own.isAncestorOrSelf(own.dofs()[moved].joint, b); }))
      out.bodies.push_back(b);
  return out;
}

std::vector<Candidate> findAt(const ReducedCluster& cluster, const AtRest& at_rest, ConstVectorRef q) {
  Workspace ws(cluster.model);
  updatePositions(cluster.model, ws, q);
  const MatrixXd J = calcJacobian(cluster, ws);
  std::vector<Candidate> out;
  std::set<int> taken;
  for (int top = cluster.model.numBodies() - 1; top > 0; --top)
    if (std::optional<Candidate> found = findBehind(cluster, at_rest, ws, J, top, taken)) {
      taken.insert(found->with_dofs.begin(), found->with_dofs.end());
      out.push_back(std::move(*found));
    }
  return out;
}

// Closed configurations beside q.
std::vector<VectorXd> findAside(const ReducedCluster& cluster, ConstVectorRef q) {
  std::vector<VectorXd> out;
  ClusterPoint here(cluster), there(cluster);
  if (!here.update(cluster, q)) return out;
  const MatrixXd& N = here.basis().N;
  for (const double size : {kAside, -kAside}) {
    VectorXd d = N * VectorXd::LinSpaced(N.cols(), 0.7, 1.1);
    d *= size / d.cwiseAbs().maxCoeff();
    for (int halving = 0; halving < 4; ++halving, d /= 2)
      if (there.close(cluster, here.basis(), d, VectorXd())) {
        out.push_back(there.basis().q);
        break;
      }
  }
  return out;
}

}  // namespace

std::vector<int> listCarriers(const Model& model, const std::vector<int>& joints) {
  std::vector<int> carriers;
  const auto add = [&](int body) {
    if (contains(joints, body) && !contains(carriers, body)) carriers.push_back(body);
  };
  for (int i = 1; i < model.numBodies(); ++i)
    if (!contains(joints, i)) add(model.joints()[i].parent);
  for (const ContactFrame& contact : model.contacts()) add(contact.body);
  return carriers;
}

std::vector<IdleSpin> findIdleSpins(const Model& model, const ReducedCluster& cluster, ConstVectorRef q_cluster) {
  const AtRest at_rest = listAtRest(model, cluster);
  std::vector<Candidate> found = findAt(cluster, at_rest, q_cluster);
  if (found.empty()) return {};
  const std::vector<VectorXd> aside = findAside(cluster, q_cluster);
  if (aside.empty()) return {};
  for (const VectorXd& q : aside) {
    const std::vector<Candidate> others = findAt(cluster, at_rest, q);
    std::vector<Candidate> both;
    for (Candidate& one : found)
      for (const Candidate& other : others)
        if (one.top == other.top) {
          std::set<int> dofs(one.with_dofs.begin(), one.with_dofs.end()), bodies(one.bodies.begin(), one.bodies.end());
          dofs.insert(other.with_dofs.begin(), other.with_dofs.end());
          bodies.insert(other.bodies.begin(), other.bodies.end());
          both.push_back({one.top, {}, {dofs.begin(), dofs.end()}, {bodies.begin(), bodies.end()}});
        }
    found = std::move(both);
  }
  std::vector<IdleSpin> out;
  for (Candidate& one : found) out.push_back({std::move(one.with_dofs), std::move(one.bodies)});
  return out;
}

int countIdleSpins(const Model& model, ConstVectorRef q) {
  int count = 0;
  if (model.closures().empty()) return count;
  for (const ReducedCluster& cluster : makeReduction(model, q).clusters)
    count += static_cast<int>(cluster.spins.size());
  return count;
}

void holdSpins(const Model& model, const std::vector<int>& joints, ReducedCluster& cluster) {
  const auto moves = [&](const IdleSpin& spin) {
    return std::any_of(spin.dofs.begin(), spin.dofs.end(),
                       [&](int k) { return contains(joints, model.dofs()[cluster.dofs[k]].joint); });
  };
  cluster.spins.erase(std::remove_if(cluster.spins.begin(), cluster.spins.end(), moves), cluster.spins.end());
  cluster.holds_spins = true;
  cluster.rank += static_cast<int>(cluster.spins.size());
  cluster.size -= static_cast<int>(cluster.spins.size());
}

}  // namespace bielle
