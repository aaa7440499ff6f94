#include "identify/torque_fit.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "dynamics/joint_force.h"
#include "math/decompositions.h"
#include "model/listing.h"

namespace bielle {
namespace {

using Vector10d = Eigen::Matrix<double, 10, 1>;

constexpr Eigen::Index kBlock = 1024;  // rows beside the factor before it takes them in

// pi of a spatial inertia: mass, first moments, xx yy zz xy xz yz about the origin.
Vector10d takeNumbers(double mass, const Vector3d& moments, const Matrix3d& I) {
  Vector10d pi;
  pi << mass, moments, I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2);
  return pi;
}

Matrix6d makeSpatialInertia(const Vector10d& pi) {
  Matrix6d Y;
  const Matrix3d mc = skew(Vector3d(pi.segment<3>(1)));
  Matrix3d I;
  I << pi[4], pi[7], pi[8], pi[7], pi[5], pi[9], pi[8], pi[9], pi[6];
  Y << pi[0] * Matrix3d::Identity(), -mc, mc, I;
  return Y;
}

const std::array<Matrix6d, 10>& getBasis() {
  static const std::array<Matrix6d, 10> basis = [] {
    std::array<Matrix6d, 10> E;
    for (int p = 0; p < 10; ++p) E[static_cast<size_t>(p)] = makeSpatialInertia(Vector10d::Unit(p));
    return E;
  }();
  return basis;
}

// Eq. (3), and its derivatives by the mass and by a coordinate of the centre.
Matrix3d calcSteiner(const Vector3d& c, const Vector3d& d) {
  return c.dot(d) * Matrix3d::Identity() - 0.5 * (c * d.transpose() + d * c.transpose());
}
Vector10d calcNumbers(const Inertia& at) {
  return takeNumbers(at.mass, at.mass * at.com, at.I_com + at.mass * calcSteiner(at.com, at.com));
}
Vector10d calcComSlope(const Inertia& at, int axis) {
  const Vector3d e = Vector3d::Unit(axis);
  return takeNumbers(0, at.mass * e, 2 * at.mass * calcSteiner(at.com, e));
}

// Eq. (2): rows x 10; needs updateInverseDynamics.
MatrixXd calcBodyRows(const Model& model, const Workspace& ws, int body, const MatrixXd& N) {
  const SE3& X = ws.X_WB[static_cast<size_t>(body)];
  const Vector6d V = X.actInvMotion(ws.V[static_cast<size_t>(body)]);
  const Vector6d A = X.actInvMotion(ws.A[static_cast<size_t>(body)]);
  Matrix6Xd JN = Matrix6Xd::Zero(6, N.cols());
  for (const int k : model.supportDofs(body)) JN += X.actInvMotion(Vector6d(ws.J.col(k))) * N.row(k);
  Eigen::Matrix<double, 6, 10> forces;
  for (int p = 0; p < 10; ++p) {
    const Matrix6d& E = getBasis()[static_cast<size_t>(p)];
    forces.col(p) = E * A + crossForce(V, Vector6d(E * V));
  }
  return JN.transpose() * forces;
}

// The torque that a motor takes for one unit of its armature, damping or friction.
double calcMotorPart(const Model& model, const LoadNumber& number, const LoadedState& state) {
  const Motor& motor = model.motors()[static_cast<size_t>(number.motor)];
  if (number.kind == LoadKind::Armature) return state.a[motor.dof];
  return number.kind == LoadKind::Damping ? state.v[motor.dof] : state.signs[number.motor];
}

// M a + b in ws.b.
void updateBalance(const Model& model, const LoadedState& state, Workspace& ws) {
  updatePositions(model, ws, state.q);
  updateVelocities<double>(model, ws, state.v);
  updateInverseDynamics<double>(model, ws, state.a);
  for (int m = 0; m < model.nu(); ++m) {
    const Motor& motor = model.motors()[static_cast<size_t>(m)];
    ws.b[motor.dof] += getJointForce(model, motor.joint).friction *
                       (state.signs[m] - calcFrictionSign(model, motor, state.v[motor.dof]));
  }
}

}  // namespace

double calcFrictionSign(const Model& model, const Motor& motor, double speed) {
  return calcSmoothSign(speed, getJointForce(model, motor.joint).friction_speed).value;
}

VectorXd calcRowWeights(const Model& model, const std::vector<LoadedState>& states, const std::vector<int>& groups,
                        double torques) {
  Workspace ws(model);
  VectorXd squares = VectorXd::Zero(states.empty() ? 0 : states.front().N.cols());
  for (const LoadedState& state : states) {
    updateBalance(model, state, ws);
    squares += (state.N.transpose() * (ws.b - torques * calcMotorForces(model, state.u))).cwiseAbs2();
  }
  VectorXd weights = VectorXd::Zero(squares.size());
  Eigen::Index first = 0;
  for (const int count : groups) {
    if (first == squares.size()) break;
    const double mean = squares.segment(first, count).sum() / (count * static_cast<double>(states.size()));
    if (mean > 0) weights.segment(first, count).setConstant(1 / std::sqrt(mean));
    first += count;
  }
  return weights;
}

TorqueFit::TorqueFit(const Model& model, std::vector<LoadNumber> numbers, const std::vector<LoadedState>& states,
                     const std::vector<int>& groups, VectorXd weights)
    : numbers_(std::move(numbers)), weights_(std::move(weights)) {
  for (const LoadNumber& number : numbers_)
    for (const int body : number.bodies)
      if (!contains(bodies_, body)) bodies_.push_back(body);
  for (const int body : bodies_) inertias_.push_back(model.bodies()[static_cast<size_t>(body)].inertia);
  int columns = 10 * static_cast<int>(bodies_.size());
  for (const LoadNumber& number : numbers_) columns_.push_back(number.bodies.empty() ? columns++ : -1);
  makeScales(model, states);

  if (weights_.size() == 0) weights_ = calcRowWeights(model, states, groups, 0) / kTorqueNoise;
  Workspace ws(model);
  const Eigen::Index size = weights_.size();
  factor_.resize(columns + 1 + kBlock + size, columns + 1);
  MatrixXd rows(size, columns + 1);
  for (const LoadedState& state : states) {
    updateBalance(model, state, ws);
    for (size_t i = 0; i < bodies_.size(); ++i)
      rows.middleCols<10>(10 * static_cast<Eigen::Index>(i)) = calcBodyRows(model, ws, bodies_[i], state.N);
    for (size_t i = 0; i < numbers_.size(); ++i) {
      if (columns_[i] < 0) continue;
      const Motor& motor = model.motors()[static_cast<size_t>(numbers_[i].motor)];
      rows.col(columns_[i]) = calcMotorPart(model, numbers_[i], state) * state.N.row(motor.dof).transpose();
    }
    rows.col(columns) = state.N.transpose() * (ws.b - calcMotorForces(model, state.u));
    addRows(weights_.asDiagonal() * rows);
    rows_ += (weights_.array() > 0).count();
  }
  compress();
}

void TorqueFit::makeScales(const Model& model, const std::vector<LoadedState>& states) {
  scales_.resize(static_cast<Eigen::Index>(numbers_.size()));
  for (size_t i = 0; i < numbers_.size(); ++i) {
    const LoadNumber& number = numbers_[i];
    double& scale = scales_[static_cast<Eigen::Index>(i)];
    if (number.kind == LoadKind::Mass) {
      scale = kShareOfMass * number.value;
      continue;
    }
    if (number.kind == LoadKind::Com) {
      const Inertia& inertia = model.bodies()[static_cast<size_t>(number.bodies.front())].inertia;
      scale = std::max(std::sqrt(inertia.I_com.trace() / (2 * inertia.mass)), kLeastLever);
      continue;
    }
    double torque = 0, share = 0;
    for (const LoadedState& state : states) {
      torque += std::pow(state.u[number.motor], 2);
      share += std::pow(calcMotorPart(model, number, state), 2);
    }
    scale = share > 0 ? std::sqrt(torque / share) : 1;
    if (!(scale > 0)) scale = 1;  // of a motor that gives nothing
  }
}

void TorqueFit::addRows(const MatrixXd& rows) {
  if (used_ + rows.rows() > factor_.rows()) compress();
  factor_.middleRows(used_, rows.rows()) = rows;
  used_ += rows.rows();
}

void TorqueFit::compress() {
  const Eigen::Index n = factor_.cols();
  const Eigen::HouseholderQR<MatrixXd> qr(factor_.topRows(used_));
  used_ = std::min(used_, n);
  factor_.topRows(used_) = qr.matrixQR().topRows(used_).triangularView<Eigen::Upper>();
}

void TorqueFit::evaluate(const VectorXd& x, VectorXd& r, MatrixXd* J) const {
  const Eigen::Index columns = factor_.cols() - 1;
  VectorXd change = VectorXd::Zero(columns);
  MatrixXd slopes = MatrixXd::Zero(columns, x.size());
  for (size_t b = 0; b < bodies_.size(); ++b) {
    const Inertia& given = inertias_[b];
    Inertia at = given;
    const auto ten = static_cast<Eigen::Index>(10 * b);
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      const LoadNumber& number = numbers_[static_cast<size_t>(i)];
      if (!contains(number.bodies, bodies_[b])) continue;
      if (number.kind == LoadKind::Mass) {
        const double factor = 1 + x[i] / number.value;
        at.mass *= factor, at.I_com *= factor;
      } else {
        at.com[number.axis] += x[i];
      }
    }
    const Vector10d pi = calcNumbers(at);
    change.segment<10>(ten) = pi - calcNumbers(given);
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      const LoadNumber& number = numbers_[static_cast<size_t>(i)];
      if (!contains(number.bodies, bodies_[b])) continue;
      const Inertia of_unit{given.mass / number.value, at.com, given.I_com / number.value};
      slopes.block<10, 1>(ten, i) =
          number.kind == LoadKind::Mass ? calcNumbers(of_unit) : calcComSlope(at, number.axis);
    }
  }
  for (Eigen::Index i = 0; i < x.size(); ++i)
    if (const int column = columns_[static_cast<size_t>(i)]; column >= 0) change[column] = x[i], slopes(column, i) = 1;
  const MatrixXd F = factor_.topRows(used_);
  r = F.leftCols(columns) * change + F.col(columns);
  if (J) *J = F.leftCols(columns) * slopes;
}

double TorqueFit::calcShare(const VectorXd& r) const {
  return rows_ > 0 ? kTorqueNoise * r.norm() / std::sqrt(static_cast<double>(rows_)) : 0;
}

}  // namespace bielle
