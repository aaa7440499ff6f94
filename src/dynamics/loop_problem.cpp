#include "dynamics/loop_problem.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/builder.h"
#include "math/decompositions.h"
#include "math/so3.h"

namespace bielle {
namespace {

constexpr int kNewtonSteps = 60, kMultiplierSteps = 12;
constexpr double kClosed = 1e-11;     // m, of r
constexpr double kPenalty = 1e3;      // rho at first; p and r are of the same unit
constexpr double kStepLimit = 0.3;    // per Newton step and coordinate, rad or m
constexpr double kDifference = 1e-6;  // rad or m
constexpr double kResolved = 1e-12;   // smallest gain by which line searches can judge, of the objective

// A twist along direction k of a change.
Vector6d makeTwist(Change change, int k) { return Vector6d::Unit(change == Change::Rotation ? k + 3 : k); }

ModelVariation makeVariation(const Model& model, Change change, const ModelPlace& place, int k) {
  ModelVariation out(model);
  switch (place.kind) {
    case ModelPlace::Kind::Joint:
      out.joints[place.index] = makeTwist(change, k);
      break;
    case ModelPlace::Kind::Frame1:
      out.frames1[place.index] = makeTwist(change, k);
      break;
    case ModelPlace::Kind::Frame2:
      out.frames2[place.index] = makeTwist(change, k);
      break;
    case ModelPlace::Kind::Offset:
      (model.closures()[place.index].kind == ClosureKind::Distance ? out.lengths : out.offsets)[place.index] = 1;
      break;
  }
  return out;
}

// L for angles and the offsets of couplers, 1 for lengths.
double getChangeUnit(const Model& model, double length, Change change, const ModelPlace& place) {
  const bool is_length = change == Change::Translation ||
                         (change == Change::Offset && model.closures()[place.index].kind == ClosureKind::Distance);
  return is_length ? 1 : length;
}

}  // namespace

Model selectClosures(const Model& model, const std::vector<int>& closures) {
  ModelParts parts = takeParts(model);
  parts.closures.clear();
  for (int c : closures) parts.closures.push_back(model.closures()[c]);
  parts.frames.clear(), parts.motors.clear(), parts.contacts.clear(), parts.references.clear(), parts.visuals.clear();
  parts.serial_joints.clear(), parts.joint_forces.clear(), parts.point_springs.clear();
  return ModelBuilder::restore(std::move(parts));
}

double calcTypicalLength(const Model& model, const std::vector<int>& closures) {
  double sum = 0;
  int count = 0;
  const auto add = [&](const SE3& X) {
    if (X.p.norm() > 1e-9) sum += X.p.norm(), ++count;
  };
  std::set<int> joints;
  for (int c : closures) {
    const Closure& closure = model.closures()[c];
    for (int k : closure.dofs) joints.insert(model.dofs()[k].joint);
    add(closure.X_B1), add(closure.X_B2);
    if (closure.kind == ClosureKind::Distance) sum += closure.length, ++count;
  }
  for (int j : joints) add(model.joints()[j].X_PJ);
  return count ? sum / count : 1;
}

LoopProblem::LoopProblem(const Model& model, double length, Change change, const ModelPlace& place)
    : model_(model),
      changed_(model),
      set_(makeConstraintSet(model)),
      ws_(model),
      variation_(model),
      still_(model),
      length_(length),
      change_(change),
      place_(place),
      unit_(getChangeUnit(model, length, change, place)),
      scale_(VectorXd::Ones(set_.rows)) {
  std::set<int> dofs;
  for (size_t c = 0; c < set_.closures.size(); ++c) {
    const Closure& closure = set_.closures[c];
    dofs.insert(closure.dofs.begin(), closure.dofs.end());
    const int lengths = getLengthRows(closure.kind);
    scale_.segment(set_.offsets[c] + lengths, getRows(closure.kind) - lengths).setConstant(length_);
  }
  dofs_.assign(dofs.begin(), dofs.end());
  const int directions = change == Change::None ? 0 : change == Change::Offset ? 1 : 3;
  for (int k = 0; k < directions; ++k) variations_.push_back(makeVariation(model, change, place, k));
  y_ = VectorXd::Zero(set_.rows);
}

// Makes the changed model, if the change is a new one, and its kinematics.
void LoopProblem::update(const LoopPoint& z) {
  if (z.change.p != made_change_.p || z.change.R != made_change_.R || z.offset != made_offset_) {
    changed_ = applyRemedy(model_, {place_, z.change, z.offset, 0});
    set_ = makeConstraintSet(changed_);
    made_change_ = z.change, made_offset_ = z.offset;
  }
  updatePositions(changed_, ws_, z.q);
}

VectorXd LoopProblem::calcResidual(const LoopPoint& z) {
  update(z);
  VectorXd r(set_.rows);
  for (size_t c = 0; c < set_.closures.size(); ++c)
    r.segment(set_.offsets[c], getRows(set_.closures[c].kind)) = calcClosureResidual(ws_, set_.closures[c]);
  return scale_.cwiseProduct(r);
}

MatrixXd LoopProblem::calcJacobian(const LoopPoint& z) {
  update(z);
  MatrixXd H = MatrixXd::Zero(set_.rows, model_.nv()), out(set_.rows, size());
  for (size_t c = 0; c < set_.closures.size(); ++c)
    calcClosureResidualJacobian(ws_, set_.closures[c], H.middleRows(set_.offsets[c], getRows(set_.closures[c].kind)));
  const int n = static_cast<int>(dofs_.size());
  for (int k = 0; k < n; ++k) out.col(k) = H.col(dofs_[k]);
  if (directions() > 0) {
    updateVelocities(changed_, ws_, still_.v);
    updateAccelerations(changed_, ws_, still_.a);
  }
  for (int k = 0; k < directions(); ++k) {
    updateVariation(changed_, ws_, variations_[k], still_, variation_);
    out.col(n + k) = calcResidualVariation(ws_, set_, variations_[k], variation_);
  }
  out.rightCols(directions()) /= unit_;
  return scale_.asDiagonal() * out;
}

VectorXd LoopProblem::calcChange(const LoopPoint& z) const {
  switch (change_) {
    case Change::None:
      return {};
    case Change::Translation:
      return z.change.p;
    case Change::Rotation:
      return unit_ * log3(z.change.R);
    case Change::Offset:
      return VectorXd::Constant(1, unit_ * z.offset);
  }
  return {};
}

LoopProblem::Squares LoopProblem::calcSquares(const LoopPoint& z) {
  Squares out{calcResidual(z), calcJacobian(z)};
  if (rho_ == 0) return out;
  const int m = set_.rows, n = static_cast<int>(dofs_.size()), np = directions();
  Squares all{VectorXd(np + m), MatrixXd::Zero(np + m, n + np)};
  all.R << calcChange(z), std::sqrt(rho_) * (out.R + y_ / rho_);
  all.R_z.topRightCorner(np, np).setIdentity();
  if (change_ == Change::Rotation) all.R_z.topRightCorner<3, 3>() = calcRightJacobianInverse3(log3(z.change.R));
  all.R_z.bottomRows(m) = std::sqrt(rho_) * out.R_z;
  return all;
}

double LoopProblem::calcObjective(const LoopPoint& z) {
  const VectorXd r = calcResidual(z);
  if (rho_ == 0) return 0.5 * r.squaredNorm();
  return 0.5 * (calcChange(z).squaredNorm() + rho_ * (r + y_ / rho_).squaredNorm());
}

LoopPoint LoopProblem::move(const LoopPoint& z, const VectorXd& step) const {
  const Eigen::Index n = static_cast<Eigen::Index>(dofs_.size());
  VectorXd dq = VectorXd::Zero(model_.nv());
  for (Eigen::Index k = 0; k < n; ++k) dq[dofs_[k]] = step[k];
  LoopPoint out = z;
  out.q = model_.integrate(z.q, dq);
  if (change_ == Change::Translation) out.change.p += step.tail<3>();
  if (change_ == Change::Rotation) out.change.R = z.change.R * exp3(Vector3d(step.tail<3>() / unit_));
  if (change_ == Change::Offset) out.offset += step[n] / unit_;
  return out;
}

// The second term of Eq. (1).
MatrixXd LoopProblem::calcCurvature(const LoopPoint& z, const Squares& squares) {
  MatrixXd out(size(), size());
  const VectorXd gradient = squares.R_z.transpose() * squares.R;
  for (int k = 0; k < size(); ++k) {
    const Squares there = calcSquares(move(z, kDifference * VectorXd::Unit(size(), k)));
    out.col(k) = (there.R_z.transpose() * squares.R - gradient) / kDifference;
  }
  return 0.5 * (out + out.transpose());
}

// Goes along the step as far as the objective falls; false when it does not.
bool LoopProblem::search(LoopPoint& z, const VectorXd& step, double slope) {
  const double start = calcObjective(z);
  for (double length = 1; length > 1e-6; length *= 0.5) {
    LoopPoint next = move(z, length * step);
    if (calcObjective(next) > start + 1e-4 * length * slope) continue;
    z = std::move(next);
    return true;
  }
  return false;
}

void LoopProblem::minimise(LoopPoint& z) {
  for (int i = 0; i < kNewtonSteps; ++i) {
    const Squares squares = calcSquares(z);
    const double objective = 0.5 * squares.R.squaredNorm();
    if (!std::isfinite(objective) || (rho_ == 0 && squares.R.cwiseAbs().maxCoeff() < kClosed)) return;
    const VectorXd gradient = squares.R_z.transpose() * squares.R;
    const MatrixXd hessian = squares.R_z.transpose() * squares.R_z + calcCurvature(z, squares);
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(hessian);
    const VectorXd sizes = eigen.eigenvalues().cwiseAbs();
    const double floor = 1e-9 * std::max(sizes.maxCoeff(), 1e-12);
    VectorXd step =
        -eigen.eigenvectors() * (eigen.eigenvectors().transpose() * gradient).cwiseQuotient(sizes.cwiseMax(floor));
    const double largest = step.cwiseAbs().maxCoeff();
    if (largest > kStepLimit) step *= kStepLimit / largest;
    const double slope = gradient.dot(step);
    if (-slope > kResolved * objective) {
      if (search(z, step, slope)) continue;
    } else {
      z = move(z, step);  // the objective no longer resolves it
    }
    // Stationary: a minimum, or a saddle that is left either way.
    if (eigen.eigenvalues()[0] > -1e-6 * sizes.maxCoeff()) return;
    const VectorXd way = 0.1 * eigen.eigenvectors().col(0);
    if (!search(z, way, eigen.eigenvalues()[0] * 1e-3) && !search(z, -way, eigen.eigenvalues()[0] * 1e-3)) return;
  }
}

bool LoopProblem::findLeastChange(LoopPoint& z) {
  rho_ = kPenalty;
  y_.setZero();
  double last = calcResidual(z).cwiseAbs().maxCoeff();
  const double start = last;
  for (int i = 0; i < kMultiplierSteps && last > kClosed; ++i) {
    minimise(z);
    const VectorXd r = calcResidual(z);
    const double now = r.cwiseAbs().maxCoeff();
    if (!std::isfinite(now) || (i == 2 && now > 0.1 * start)) return false;
    y_ += rho_ * r;
    if (now > 0.1 * last) rho_ *= 10;
    last = now;
  }
  return last < 10 * kClosed;
}

}  // namespace bielle
