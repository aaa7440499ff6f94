// The nearest dead point of a linkage: a volume (1) of linkage.h vanishes there.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>

#include "bielle/model/error.h"
#include "dynamics/linkage_workspace.h"
#include "math/decompositions.h"
#include "model/number_text.h"

namespace bielle {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();

// A volume at the configuration of the point, N (n x m), and the gradient by its coordinates. With X the rows of motors
// or O, and dN = -J^+ J' N, ds = s tr((X N)^+ (X' - X J^+ J') N).
double calcVolume(const Linkage& linkage, LinkageWorkspace& s, DeadPointKind kind, MatrixXd& N, VectorXd& gradient) {
  const ClusterBasis& basis = s.point.basis();
  const int m = linkage.size();
  updateOutput(linkage, s.point.workspace(), s.O);
  N = selectMoving(linkage, s, basis.N);
  const bool twists = kind == DeadPointKind::Output && linkage.joints.empty();
  const std::vector<int>& rows = kind == DeadPointKind::Output ? linkage.joint_dofs : linkage.motor_dofs;
  MatrixXd X;
  if (twists) {
    X = s.O;
  } else {
    X.setZero(m, N.rows());
    for (int i = 0; i < m; ++i) X(i, rows[i]) = 1;
  }
  const Eigen::JacobiSVD<MatrixXd> svd(X * N, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const VectorXd& sigma = svd.singularValues();
  VectorXd others = VectorXd::Ones(m);  // products of all singular values but one: finite where the volume vanishes
  for (int i = 0; i < m; ++i)
    for (int k = 0; k < m; ++k)
      if (k != i) others[i] *= sigma[k];
  const MatrixXd C = svd.matrixV() * others.asDiagonal() * svd.matrixU().transpose();  // s (X N)^+
  MatrixXd y = basis.J * (X.transpose() * C.transpose());                              // metric of ones
  s.point.solveGram(y);
  gradient.setZero(m);
  for (int j = 0; j < m; ++j) {
    updateDrift(linkage, s, N.col(j));
    Eigen::RowVectorXd along = Eigen::RowVectorXd::Zero(N.rows());
    for (int i = 0; i < linkage.cluster->rank; ++i) along -= y(i, j) * s.drift.row(basis.rows[i]);
    if (twists) along += C.row(j) * s.turn;
    gradient += (along * N).transpose();
  }
  return sigma.prod();
}

// The largest way of the coordinates whose ways are distances.
double calcWay(const Linkage& linkage, const VectorXd& from, const VectorXd& to) {
  double largest = 0;
  const auto add = [&](int i) {
    if (i >= 0) largest = std::max(largest, std::abs(to[i] - from[i]));
  };
  for (int i : linkage.motor_positions) add(i);
  for (int i : linkage.joint_positions) add(i);
  if (linkage.joints.empty())
    for (const Joint& joint : linkage.cluster->model.joints())
      if (joint.nv == 1) add(joint.idx_q);
  return largest;
}

// The way from a configuration to where a volume vanishes; infinite if that is not within kFarthestDeadPoint.
double follow(const Linkage& linkage, const VectorXd& start, DeadPointKind kind, int side) {
  constexpr double kLongestStep = 0.1, kDead = 1e-9;  // in all coordinates of the cluster; of a volume
  constexpr double kShort = 1e-3, kShare = 0.9;       // of a step that does not close: to be left out, or taken
  constexpr int kMostSteps = 100;
  const ReducedCluster& cluster = *linkage.cluster;
  LinkageWorkspace here(linkage), there(linkage);
  if (!here.point.update(cluster, start)) return kNone;
  MatrixXd N;
  VectorXd gradient, way, before;
  bool near = false;  // within the reach of Newton's method, whichever the side
  for (int step = 0; step < kMostSteps; ++step) {
    const double volume = calcVolume(linkage, here, kind, N, gradient);
    if (volume < kDead) {
      const double distance = calcWay(linkage, start, here.point.basis().q);
      return distance <= kFarthestDeadPoint ? distance : kNone;
    }
    const double slope = gradient.norm();
    if (linkage.size() > 1 || near) {
      if (!(slope > 1e-6 * volume)) return kNone;
      way = N * (-gradient / slope);
    } else {
      way = side * N.col(0);
      if (step > 0 && way.dot(before) < 0) way = -way;
    }
    const double rate = (N.transpose() * way).dot(gradient);
    const double root = rate < 0 ? volume / -rate : kNone;
    if (root < 2 * kLongestStep) near = true;  // a longest step may pass it by
    const VectorXd move = std::min(root, kLongestStep) * way;
    if (!there.point.close(cluster, here.point.basis(), move, VectorXd())) {
      // Where the volume vanishes loops may lose rank, so that there is no basis: short of it, then.
      if (root < kShort) return calcWay(linkage, start, cluster.model.integrate(here.point.basis().q, move));
      if (!there.point.close(cluster, here.point.basis(), kShare * move, VectorXd())) return kNone;
    }
    before = way;
    std::swap(here.point, there.point);
    if (!(calcWay(linkage, start, here.point.basis().q) < kFarthestDeadPoint + kLongestStep)) return kNone;
  }
  return kNone;
}

// Nodes where the transmission is a least or a largest one among its neighbours: the least of the least and the largest of
// the largest, whose values differ.
void addExtremes(VectorXd rho, std::set<int>& nodes) {
  constexpr int kMost = 4;
  constexpr double kApart = 0.01;  // relative
  const int last = static_cast<int>(rho.size()) - 1;
  std::vector<int> order(rho.size());
  std::iota(order.begin(), order.end(), 0);
  for (const double sign : {1.0, -1.0}) {  // least, largest
    const auto get = [&](int k) { return sign * rho[std::clamp(k, 0, last)]; };
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return get(a) < get(b); });
    int count = 0, before = -1;
    for (int k : order) {
      if (count == kMost) break;
      if (get(k) > get(k - 1) || get(k) > get(k + 1)) continue;
      if (before >= 0 && get(k) - get(before) < kApart * std::abs(get(before))) continue;
      nodes.insert(k);
      before = k;
      ++count;
    }
  }
}

}  // namespace

const char* getName(DeadPointKind kind) {
  return kind == DeadPointKind::Output ? "output" : kind == DeadPointKind::Motors ? "motors" : "";
}

std::string formatDistance(const DeadPoint& point) {
  const bool far = point.kind == DeadPointKind::None;
  return far ? "over " + formatNumber(kFarthestDeadPoint, "%.2g") : formatNumber(point.distance, "%.2g");
}

DeadPoint findDeadPoint(const Linkage& linkage, const Model& model, ConstVectorRef q) {
  DeadPoint nearest{DeadPointKind::None, kNone};
  if (linkage.isDirect() || linkage.size() > kMostLinkageMobility) return nearest;
  VectorXd start(linkage.cluster->model.nq());
  gatherConfiguration(model, *linkage.cluster, q, start);
  for (DeadPointKind kind : {DeadPointKind::Output, DeadPointKind::Motors})
    for (int side : {-1, 1}) {
      if (side > 0 && linkage.size() > 1) continue;
      const double distance = follow(linkage, start, kind, side);
      if (distance < nearest.distance) nearest = {kind, distance};
    }
  return nearest;
}

std::vector<DeadPointTrace> traceDeadPoints(const Model& model, const RowMatrixXd& qs, int samples) {
  std::vector<Linkage> linkages;
  if (!qs.allFinite()) return {};
  try {
    linkages = listLinkagesAnywhere(model, qs.row(0).transpose());
  } catch (const InputError&) {  // its loops are open
    return {};
  }
  std::vector<DeadPointTrace> traces;
  LinkageWorkspaces memory;
  for (const Linkage& linkage : linkages) {
    VectorXd rho(qs.rows());
    for (Eigen::Index k = 0; k < qs.rows(); ++k) {
      const double value = calcTransmission(linkage, memory, model, qs.row(k).transpose());
      rho[k] = std::isfinite(value) ? value : 0;
    }
    std::set<int> nodes = {0, static_cast<int>(qs.rows()) - 1};
    addExtremes(rho, nodes);
    for (int i = 0; i < samples; ++i) nodes.insert(static_cast<int>(i * (qs.rows() - 1) / std::max(samples - 1, 1)));
    DeadPointTrace trace{linkage.output, {nodes.begin(), nodes.end()}, {}, 0};
    for (int k : trace.nodes) trace.points.push_back(findDeadPoint(linkage, model, qs.row(k).transpose()));
    const auto is_nearer = [](const DeadPoint& a, const DeadPoint& b) { return a.distance < b.distance; };
    trace.nearest =
        static_cast<int>(std::min_element(trace.points.begin(), trace.points.end(), is_nearer) - trace.points.begin());
    traces.push_back(std::move(trace));
  }
  return traces;
}

}  // namespace bielle
