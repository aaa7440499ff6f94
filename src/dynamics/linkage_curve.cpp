#include "dynamics/linkage_curve.h"

#include <cmath>

#include "bielle/dynamics/kinematics.h"
#include "math/decompositions.h"

namespace bielle {
namespace {

constexpr double kHeldTolerance = 1e-13;  // rad
constexpr double kLongest = 1.2;          // largest displacement of a step over its length
constexpr double kRankPlace = 1e-9;       // of a loss of rank, along the curve
constexpr double kHeldRank = 1e-6;        // singular values of the rates of held joints, relative

}  // namespace

LinkageCurve::LinkageCurve(const Linkage& linkage, int joint, ConstVectorRef q_cluster)
    : linkage_(linkage), joint_(joint), q_start_(q_cluster), from_(*linkage.cluster), point_(*linkage.cluster) {
  for (int j = 0; j < linkage.size(); ++j)
    if (j != joint) held_.push_back(j);
  held_angles_.resize(held_.size());
  for (size_t i = 0; i < held_.size(); ++i) held_angles_[i] = q_start_[linkage.joint_positions[held_[i]]];
}

MatrixXd LinkageCurve::heldRows() const {
  const MatrixXd& N = point_.basis().N;
  MatrixXd rows(held_.size(), N.cols());
  for (size_t i = 0; i < held_.size(); ++i) rows.row(i) = N.row(linkage_.joint_dofs[held_[i]]);
  return rows;
}

// Tangent and rates at point_, on the side of `direction` (n).
bool LinkageCurve::finishPoint(const VectorXd& direction, CurvePoint& point) {
  const ClusterBasis& basis = point_.basis();
  const int m = linkage_.size();
  VectorXd C = VectorXd::Ones(m);
  if (m > 1) {
    const Eigen::JacobiSVD<MatrixXd> svd(heldRows(), Eigen::ComputeFullV);
    if (!(svd.singularValues()[m - 2] > kHeldRank * svd.singularValues()[0])) {
      why_ = "the other joints of the linkage cannot be held: they are at a dead point";
      return false;
    }
    C = svd.matrixV().col(m - 1);
  }
  if (C.dot(basis.WN.transpose() * direction) < 0) C = -C;
  point.q = basis.q;
  point.tangent = basis.N * C;
  point.joint_rate = point.tangent[linkage_.joint_dofs[joint_]];
  point.motor_volume = point.side * basis.N(linkage_.motor_dofs, Eigen::all).determinant();
  return true;
}

bool LinkageCurve::start(CurvePoint& point) {
  if (!point_.update(*linkage_.cluster, q_start_)) {
    why_ = point_.describeFailure(*linkage_.cluster);
    return false;
  }
  point.s = 0;
  const VectorXd towards = VectorXd::Unit(linkage_.cluster->model.nv(), linkage_.joint_dofs[joint_]);
  return finishPoint(point_.basis().N * (point_.basis().N.transpose() * towards), point);
}

bool LinkageCurve::advance(const CurvePoint& from, double h, CurvePoint& to) {
  const ReducedCluster& cluster = *linkage_.cluster;
  if (!from_.update(cluster, from.q)) {
    why_ = from_.describeFailure(cluster);
    return false;
  }
  // d = h t + N H z, with z such that the held angles stay; the slope of the angles with respect to z is near the
  // identity.
  const ClusterBasis& basis = from_.basis();
  VectorXd d = h * from.tangent;
  MatrixXd NH;
  if (!held_.empty()) {
    MatrixXd rows(held_.size(), basis.N.cols());
    for (size_t i = 0; i < held_.size(); ++i) rows.row(i) = basis.N.row(linkage_.joint_dofs[held_[i]]);
    const MatrixXd inverse = rows.completeOrthogonalDecomposition().pseudoInverse();
    NH = basis.N * inverse;
  }
  constexpr int kMaxIterations = 30;
  double error = 0;
  for (int i = 0; i < kMaxIterations; ++i) {
    if (!point_.close(cluster, basis, d, VectorXd())) {
      why_ = point_.describeFailure(cluster);
      return false;
    }
    VectorXd miss(held_.size());
    for (size_t k = 0; k < held_.size(); ++k)
      miss[k] = point_.basis().q[linkage_.joint_positions[held_[k]]] - held_angles_[k];
    error = held_.empty() ? 0 : miss.cwiseAbs().maxCoeff();
    if (error <= kHeldTolerance) break;
    d -= NH * miss;
  }
  if (error > 1e-10) {
    why_ = "the other joints of the linkage cannot be held";
    return false;
  }
  if (cluster.model.difference(from.q, point_.basis().q).norm() > kLongest * std::abs(h)) {
    why_ = "the linkage jumps to another configuration";
    return false;
  }
  to.s = from.s + h;
  to.side = (basis.N.transpose() * point_.basis().N).determinant() < 0 ? -from.side : from.side;
  return finishPoint(from.tangent, to);
}

double LinkageCurve::findRoot(const CurvePoint& from, double h, double tolerance,
                              const std::function<double(const CurvePoint&)>& f) {
  CurvePoint point;
  double low = 0, high = h, f_low = f(from);
  if (!advance(from, h, point)) return h;
  double f_high = f(point);
  // Regula falsi; the value at an end that stays is halved (Illinois).
  for (int i = 0, side = 0; i < 200 && std::abs(high - low) > tolerance; ++i) {
    const double middle = (low * f_high - high * f_low) / (f_high - f_low);
    if (!advance(from, middle, point)) return middle;
    const double value = f(point);
    if (value == 0) return middle;
    if ((value > 0) == (f_high > 0)) {
      if (std::abs(high - middle) <= tolerance) return middle;
      high = middle, f_high = value;
      if (side == 1) f_low /= 2;
      side = 1;
    } else {
      if (std::abs(low - middle) <= tolerance) return middle;
      low = middle, f_low = value;
      if (side == -1) f_high /= 2;
      side = -1;
    }
  }
  return (low + high) / 2;
}

MatrixXd LinkageCurve::calcJacobian(const VectorXd& q) {
  const ConstraintSet& set = linkage_.cluster->closures;
  MatrixXd J = MatrixXd::Zero(linkage_.cluster->numRows(), linkage_.cluster->model.nv());
  Workspace ws(linkage_.cluster->model);
  updatePositions(linkage_.cluster->model, ws, q);
  for (size_t c = 0; c < set.closures.size(); ++c)
    calcClosureJacobian(ws, set.closures[c], J.middleRows(set.offsets[c], getRows(set.closures[c].kind)));
  if (linkage_.cluster->holds_spins) updateSpinRows(*linkage_.cluster, J);
  return J;
}

double LinkageCurve::calcRankMargin(const VectorXd& q) {
  const VectorXd sigma = Eigen::JacobiSVD<MatrixXd>(calcJacobian(q)).singularValues();
  return sigma[linkage_.cluster->rank - 1] / sigma[0];
}

// Where rank is lost, the margin of rank falls to zero and rises again, about as fast as the linkage moves.
bool LinkageCurve::findRankMinimum(const CurvePoint& from, const CurvePoint& to, double& h) {
  constexpr double kRate = 10;  // of the margin, per length of the curve
  const double before = calcRankMargin(from.q), after = calcRankMargin(to.q), most = kRate * std::abs(h);
  if (before < kLostRank || before > most || after > most) return false;
  const auto calc = [&](double step) {
    CurvePoint at;
    return advance(from, step, at) ? calcRankMargin(at.q) : 0.0;
  };
  constexpr double kGolden = 0.6180339887498949, kEnd = 0.01;
  if (calc(kEnd * h) >= before || calc((1 - kEnd) * h) >= after) return false;  // it is least at an end
  double low = 0, high = h, a = h - kGolden * h, b = kGolden * h, f_a = calc(a), f_b = calc(b);
  while (std::abs(high - low) > kRankPlace && std::min(f_a, f_b) > 0) {
    if (f_a < f_b) {
      high = b, b = a, f_b = f_a;
      f_a = calc(a = high - kGolden * (high - low));
    } else {
      low = a, a = b, f_a = f_b;
      f_b = calc(b = low + kGolden * (high - low));
    }
  }
  if (std::min(f_a, f_b) > kLostRank) return false;
  h = f_a < f_b ? a : b;
  return true;
}

// The determinant of J on the independent rows of the start, completed by the tangent space there, changes its sign, where
// one rank is lost; the margin finds where two are lost at once.
bool LinkageCurve::findRankLoss(const CurvePoint& from, const CurvePoint& to, double& h) {
  if (!from_.update(*linkage_.cluster, from.q)) return false;
  const std::vector<int> rows = from_.basis().rows;
  MatrixXd completed(rows.size() + linkage_.size(), from_.basis().N.rows());
  completed.bottomRows(linkage_.size()) = from_.basis().N.transpose();
  const auto calcDeterminant = [&](const CurvePoint& point) {
    const MatrixXd J = calcJacobian(point.q);
    for (size_t i = 0; i < rows.size(); ++i) completed.row(i) = J.row(rows[i]);
    return completed.determinant();
  };
  double root = h;
  if (calcDeterminant(from) * calcDeterminant(to) > 0) {
    if (!findRankMinimum(from, to, root)) return false;
  } else {
    root = findRoot(from, h, kRankPlace, calcDeterminant);
    CurvePoint at;
    if (advance(from, root, at) && hasRank(at.q)) return false;  // other rows keep the rank
  }
  why_ = "closure '" + linkage_.cluster->closures.closures.front().name +
         "': its loops lose rank and can continue in several ways";
  h = root;
  return true;
}

RatioSample LinkageCurve::makeSample(const CurvePoint& point, DeadPointKind dead) {
  RatioSample sample;
  sample.s = point.s;
  sample.dead = dead;
  sample.q = point.q;
  const int m = linkage_.size();
  sample.joints.resize(m);
  sample.motors.resize(m);
  for (int i = 0; i < m; ++i) {
    sample.joints[i] = point.q[linkage_.joint_positions[i]];
    sample.motors[i] = point.q[linkage_.motor_positions[i]];
  }
  sample.loses_rank = !hasRank(point.q);
  const bool there = from_.update(*linkage_.cluster, point.q) && calcLinkageRatio(linkage_, from_, sample.ratio);
  if (dead == DeadPointKind::Output || !there) {
    const double infinite = std::numeric_limits<double>::infinity();
    sample.ratio.R.setConstant(m, m, infinite);
    sample.ratio.dR.assign(m, MatrixXd::Zero(m, m));
    sample.ratio.condition = infinite;
  }
  return sample;
}

}  // namespace bielle
