#include "bielle/dynamics/modes.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "bielle/dynamics/kinematics.h"
#include "bielle/model/builder.h"
#include "math/constants.h"
#include "math/decompositions.h"

namespace bielle {
namespace {

// An eigenvalue whose imaginary part is below this, over the size of the matrix, is real but for rounding. It is the
// root of rounding, by which pairs that coincide part.
constexpr double kReal = 1e-8;
// A square of a frequency below this, over the largest one, is zero: nothing holds the mode.
constexpr double kRounding = 1e-12;

Mode makeMode(const MatrixXd& N, std::complex<double> s, const Eigen::VectorXcd& y) {
  Mode mode;
  mode.eigenvalue = s;
  const double size = std::abs(s);
  mode.frequency = s.imag() / (2 * kPi);
  mode.damping = size > 0 ? 0 - s.real() / size : 0;  // no negative zero
  mode.shape = N * y;
  Eigen::Index largest = 0;
  if (mode.shape.cwiseAbs().maxCoeff(&largest) > 0) mode.shape /= mode.shape[largest];
  return mode;
}

// y'' + K y = 0 with a symmetric K: no rounding in real parts.
std::vector<Mode> listConservativeModes(const MatrixXd& N, const MatrixXd& stiffness) {
  const MatrixXd symmetric = 0.5 * (stiffness + stiffness.transpose());
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(symmetric);
  const VectorXd& squares = solver.eigenvalues();
  const double rounding = kRounding * squares.cwiseAbs().maxCoeff();
  std::vector<Mode> modes;
  for (Eigen::Index i = 0; i < squares.size(); ++i) {
    const Eigen::VectorXcd y = solver.eigenvectors().col(i);
    const double size = std::sqrt(std::abs(squares[i]));
    if (std::abs(squares[i]) <= rounding)
      modes.push_back(makeMode(N, 0, y));
    else if (squares[i] > 0)
      modes.push_back(makeMode(N, {0, size}, y));
    else
      for (const double sign : {1, -1}) modes.push_back(makeMode(N, sign * size, y));
  }
  return modes;
}

std::vector<Mode> listDampedModes(const MatrixXd& N, const MatrixXd& stiffness, const MatrixXd& damping) {
  const Eigen::Index r = N.cols();
  MatrixXd A = MatrixXd::Zero(2 * r, 2 * r);
  A.topRightCorner(r, r).setIdentity();
  A.bottomLeftCorner(r, r) = -stiffness;
  A.bottomRightCorner(r, r) = -damping;
  const Eigen::EigenSolver<MatrixXd> solver(A);
  const double rounding = kReal * std::sqrt(std::max(1e-300, A.bottomRows(r).cwiseAbs().maxCoeff()));
  std::vector<Mode> modes;
  for (Eigen::Index i = 0; i < 2 * r; ++i) {
    std::complex<double> s = solver.eigenvalues()[i];
    if (s.imag() < -rounding) continue;  // the other one of its pair
    if (s.imag() <= rounding) s = s.real();
    modes.push_back(makeMode(N, s, solver.eigenvectors().col(i).head(r)));
  }
  return modes;
}

// Columns with J N = 0 and N^T M N = 1.
MatrixXd makeBasis(const MatrixXd& J, const MatrixXd& M, double tolerance) {
  const Eigen::LLT<MatrixXd> factors(M);
  if (factors.info() != Eigen::Success) return {};
  const Eigen::Index n = M.rows();
  MatrixXd basis = MatrixXd::Identity(n, n);
  if (J.rows() > 0) {
    const MatrixXd scaled = factors.matrixL().solve(J.transpose()).transpose();
    Eigen::JacobiSVD<MatrixXd> svd(scaled, Eigen::ComputeFullV);
    const VectorXd& sizes = svd.singularValues();
    const Eigen::Index rank = (sizes.array() > tolerance * (sizes.size() > 0 ? sizes[0] : 0)).count();
    basis = svd.matrixV().rightCols(n - rank).eval();
  }
  if (basis.cols() == 0) return basis;  // nothing can move
  return factors.matrixU().solve(basis);
}

// Corners of a sole in its frame.
std::vector<Vector3d> listCorners(const ContactFrame& contact) {
  if (contact.kind == ContactKind::Point3D) return {Vector3d::Zero()};
  const double x = contact.half_length, y = contact.half_width;
  return {{x, y, 0}, {x, -y, 0}, {-x, y, 0}, {-x, -y, 0}};
}

// Forces at the corners, 3 x n, the least that make up a wrench.
Eigen::Matrix3Xd spread(const std::vector<Vector3d>& corners, const Vector6d& wrench) {
  MatrixXd sum(6, 3 * corners.size());
  for (size_t i = 0; i < corners.size(); ++i) sum.middleCols<3>(3 * i) << Matrix3d::Identity(), skew(corners[i]);
  const VectorXd forces = Eigen::CompleteOrthogonalDecomposition<MatrixXd>(sum).solve(VectorXd(wrench));
  return forces.reshaped(3, corners.size());
}

}  // namespace

std::vector<Mode> calcModes(const MatrixXd& N, const MatrixXd& stiffness, const MatrixXd& damping) {
  if (N.cols() == 0) return {};
  const double asymmetry = (stiffness - stiffness.transpose()).cwiseAbs().maxCoeff();
  const double size = stiffness.cwiseAbs().maxCoeff();
  const bool is_conservative =
      asymmetry <= kReal * size && damping.cwiseAbs().maxCoeff() <= kRounding * std::sqrt(size);
  std::vector<Mode> modes =
      is_conservative ? listConservativeModes(N, stiffness) : listDampedModes(N, stiffness, damping);
  std::stable_sort(modes.begin(), modes.end(),
                   [](const Mode& a, const Mode& b) { return std::abs(a.eigenvalue) < std::abs(b.eigenvalue); });
  return modes;
}

Modes calcModes(const Model& model, const ConstraintSet& constraints, ConstVectorRef q, ConstVectorRef tau,
                double rank_tolerance) {
  Modes out;
  Workspace ws(model);
  ConstrainedWorkspace cws;
  out.status = updateConstrainedDynamics(model, ws, cws, constraints, q, VectorXd::Zero(model.nv()), tau);
  if (out.status != NumericalStatus::Ok) return out;
  out.acceleration = cws.a.cwiseAbs().maxCoeff();
  out.lambda = cws.lambda;
  const MatrixXd M = ws.M;
  out.status = updateConstrainedDerivatives(model, ws, cws, constraints);
  if (out.status != NumericalStatus::Ok) return out;
  out.N = makeBasis(cws.J, M, rank_tolerance);
  const MatrixXd weights = out.N.transpose() * M;
  out.stiffness = -weights * cws.da_dq * out.N;
  out.damping = -weights * cws.da_dv * out.N;
  out.modes = calcModes(out.N, out.stiffness, out.damping);
  return out;
}

void addLock(const Model& model, ConstVectorRef q, int joint, ConstraintSet& constraints) {
  const Joint& held = model.joints().at(joint);
  if (held.nv != 1) throw std::logic_error("only a joint of one coordinate can be locked");
  Closure lock;
  lock.name = "lock of " + held.name;
  lock.kind = ClosureKind::Coupler;
  lock.body1 = lock.body2 = held.parent;
  lock.terms = {{joint, 1, held.idx_q, held.idx_v}};
  lock.offset = q[held.idx_q];
  lock.dofs = {held.idx_v};
  lock.signs = {1};
  constraints.offsets.push_back(constraints.rows);
  constraints.closures.push_back(lock);
  constraints.rows += 1;
}

Model makeCompliantContacts(const Model& model, const ConstraintSet& constraints, ConstVectorRef q,
                            ConstVectorRef lambda, double stiffness) {
  constexpr double kLong = 1e3;  // m: the directions of the springs hardly turn
  Workspace ws(model);
  updatePositions(model, ws, q);
  ModelParts parts = takeParts(model);
  for (int c = constraints.num_loops; c < constraints.num_loops + static_cast<int>(constraints.contacts.size()); ++c) {
    const ContactFrame& contact = model.contacts()[constraints.getContact(c)];
    const Closure& closure = constraints.closures[c];
    const std::vector<Vector3d> corners = listCorners(contact);
    const SE3 X_WC = getPlacement(ws, contact.body, contact.X_BF);
    const Eigen::Matrix3Xd forces =
        X_WC.R * spread(corners, expandRows(closure, lambda.segment(constraints.offsets[c], getRows(closure.kind))));
    for (size_t i = 0; i < corners.size(); ++i)
      for (int axis = 0; axis < 3; ++axis) {
        PointSpring spring;
        spring.name = contact.name + " " + std::to_string(i) + " " + "xyz"[axis];
        spring.body1 = contact.body;
        spring.point1 = contact.X_BF.act(corners[i]);
        spring.point2 = X_WC.act(corners[i]) + kLong * Vector3d::Unit(axis);
        spring.stiffness = stiffness / static_cast<double>(corners.size());
        spring.rest = kLong;
        spring.preload = forces(axis, i);
        parts.point_springs.push_back(spring);
      }
  }
  return ModelBuilder::restore(parts);
}

}  // namespace bielle
