// The nearest dead point of a linkage: a volume (1) of transmission.h vanishes there.
#include <algorithm>
#include <cmath>
#include <limits>

#include "dynamics/transmission_map.h"
#include "math/decompositions.h"

namespace bielle {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();

}  // namespace

// A volume at the configuration of the point, and its gradient by the coordinates of N (m). With X the rows of motors
// or O, and dN = -J^+ J' N, ds = s tr((X N)^+ (X' - X J^+ J') N).
double TransmissionMap::calcVolume(Scratch& s, DeadPoint::Kind kind, VectorXd& gradient) const {
  const ClusterBasis& basis = s.point.basis();
  const int m = countMotors();
  const bool twists = kind == DeadPoint::Kind::Output && joints_.empty();
  const std::vector<int>& rows = kind == DeadPoint::Kind::Output ? joints_ : motors_;
  MatrixXd X;
  if (twists) {
    updateOutputs(s.point.workspace(), s.O);
    X = s.O;
  } else {
    X.setZero(m, basis.N.rows());
    for (int i = 0; i < m; ++i) X(i, rows[i]) = 1;
  }
  const Eigen::JacobiSVD<MatrixXd> svd(X * basis.N, Eigen::ComputeThinU | Eigen::ComputeThinV);
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
    updateDrift(s, basis.N.col(j));
    Eigen::RowVectorXd along = Eigen::RowVectorXd::Zero(basis.N.rows());
    for (int i = 0; i < cluster_.rank; ++i) along -= y(i, j) * s.drift.row(basis.rows[i]);
    if (twists) along += C.row(j) * s.turn;
    gradient += (along * basis.N).transpose();
  }
  return sigma.prod();
}

// The way from a configuration to where a volume vanishes; infinite if that is not within kFarthestDeadPoint.
double TransmissionMap::follow(const VectorXd& start, DeadPoint::Kind kind, int side) const {
  constexpr double kLongestStep = 0.1, kDead = 1e-9;  // in all coordinates of the cluster; of a volume
  constexpr int kMostSteps = 100;
  Scratch here(*this), there(*this);
  if (!here.point.update(cluster_, start)) return kNone;
  VectorXd gradient, way, before;
  bool near = false;  // within the reach of Newton's method, whichever the side
  for (int step = 0; step < kMostSteps; ++step) {
    const double volume = calcVolume(here, kind, gradient);
    const MatrixXd& N = here.point.basis().N;
    if (volume < kDead) {
      const double distance = calcWay(start, here.point.basis().q);
      return distance <= kFarthestDeadPoint ? distance : kNone;
    }
    const double slope = gradient.norm();
    if (countMotors() > 1 || near) {
      if (!(slope > 1e-6 * volume)) return kNone;
      way = N * (-gradient / slope);
    } else {
      way = side * N.col(0);
      if (step > 0 && way.dot(before) < 0) way = -way;
    }
    const double rate = (N.transpose() * way).dot(gradient);
    const double root = rate < 0 ? volume / -rate : kNone;
    if (root < kLongestStep) near = true;
    if (!there.point.close(cluster_, here.point.basis(), std::min(root, kLongestStep) * way, VectorXd())) return kNone;
    before = way;
    std::swap(here.point, there.point);
    if (!(calcWay(start, here.point.basis().q) < kFarthestDeadPoint + kLongestStep)) return kNone;
  }
  return kNone;
}

double TransmissionMap::calcWay(const VectorXd& from, const VectorXd& to) const {
  double largest = 0;
  for (int i : ways_) largest = std::max(largest, std::abs(to[i] - from[i]));
  return largest;
}

DeadPoint TransmissionMap::findDeadPoint(const Model& model, ConstVectorRef q) const {
  VectorXd start(cluster_.model.nq());
  gatherConfiguration(model, cluster_, q, start);
  DeadPoint nearest{DeadPoint::Kind::None, kNone};
  for (DeadPoint::Kind kind : {DeadPoint::Kind::Output, DeadPoint::Kind::Motors})
    for (int side : {-1, 1}) {
      if (side > 0 && countMotors() > 1) continue;
      const double distance = follow(start, kind, side);
      if (distance < nearest.distance) nearest = {kind, distance};
    }
  return nearest;
}

DeadPoint findDeadPoint(const Transmission& transmission, const Model& model, ConstVectorRef q) {
  return transmission.data->findDeadPoint(model, q);
}

}  // namespace bielle
