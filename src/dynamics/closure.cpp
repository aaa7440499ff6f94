#include "bielle/dynamics/closure.h"

#include <cmath>

#include "bielle/dynamics/kinematics.h"
#include "dynamics/closure_change.h"
#include "dynamics/closure_rows.h"
#include "math/constants.h"
#include "math/lanes.h"
#include "math/so3.h"

namespace bielle {
namespace {

// Nearer to opposite axes, where the direction of their angle vector turns ever faster, its rate is that of here: one that still
// leaves the other rows their rank.
constexpr double kLeastSine = 1e-6;

template <typename T>
SE3Of<T> getFrame1(const WorkspaceOf<T>& ws, const Closure& c) {
  return ws.X_WB[c.body1] * c.X_B1;
}

template <typename T>
SE3Of<T> calcRelativePlacement(const WorkspaceOf<T>& ws, const Closure& c, const ClosureChangeOf<T>* change = nullptr) {
  SE3Of<T> X_W1 = getFrame1(ws, c), X_W2 = ws.X_WB[c.body2] * c.X_B2;
  if (change) {
    X_W1.p += X_W1.R * change->shift1;
    X_W2.p += X_W2.R * change->shift2;
  }
  return X_W1.inverseTimes(X_W2);
}

// theta / sin(theta) of the angle between the hinge axes, whose sine is positive.
double calcHingeFactor(double sine, double cosine) {
  const double theta = std::atan2(sine, cosine);
  return theta < 1e-3 ? 1 + theta * theta / 6 : theta / sine;
}

// The angle vector between the hinge axes, by the two normals: `sine`, which is sin(theta) along it, made theta long. Opposite
// axes do not determine its direction: that is then the first normal.
Eigen::Vector2d calcHingeTurn(const Eigen::Vector2d& sine, double cosine) {
  const double s = sine.norm();
  if (s == 0 && cosine < 0) return {kPi, 0};
  return calcHingeFactor(s, cosine) * sine;
}

Eigen::Vector2<Lanes> calcHingeTurn(const Eigen::Vector2<Lanes>& sine, const Lanes& cosine) {
  Eigen::Vector2<Lanes> out;
  for (Eigen::Index l = 0; l < kLane; ++l) {
    const Eigen::Vector2d one = calcHingeTurn(Eigen::Vector2d(sine[0][l], sine[1][l]), cosine[l]);
    for (int k = 0; k < 2; ++k) out[k].set(l, one[k]);
  }
  return out;
}

// The row of a coupler: the sum of what `calc` makes of its terms.
template <typename T, typename Calc>
VectorUpTo6<T> sumTerms(const Closure& c, const Calc& calc) {
  VectorUpTo6<T> row(1);
  row[0] = 0;
  for (const CouplerTerm& term : c.terms) row[0] += calc(term);
  return row;
}

// The row of derivatives of a coupler: what `calc` makes of its terms in their columns, 0 in the others.
template <typename Matrix, typename Calc>
void writeTerms(const Closure& c, Matrix&& row, const Calc& calc) {
  for (int k : c.dofs) row(0, k) = 0;
  for (const CouplerTerm& term : c.terms) row(0, term.dof) = calc(term);
}

}  // namespace

ConstraintSet makeConstraintSet(const Model& model, const std::vector<ContactTarget>& contacts) {
  ConstraintSet set;
  set.closures = model.closures();
  set.num_loops = static_cast<int>(set.closures.size());
  for (const ContactTarget& target : contacts) {
    const ContactFrame& frame = model.contacts()[target.contact];
    Closure closure;
    closure.name = frame.name;
    closure.kind = frame.kind == ContactKind::Surface6D ? ClosureKind::Weld6D
                   : frame.kind == ContactKind::Edge5D  ? ClosureKind::Hinge5D
                                                        : ClosureKind::Ball3D;
    closure.axis = Vector3d::UnitX();  // of an edge
    closure.body1 = frame.body;
    closure.X_B1 = frame.X_BF;
    closure.X_B2 = target.X_WT;
    closure.kp = target.kp;
    closure.kd = target.kd;
    closure.dofs = model.supportDofs(frame.body);
    closure.signs.assign(closure.dofs.size(), 1);
    set.closures.push_back(closure);
    set.contacts.push_back(target.contact);
  }
  for (const Closure& closure : set.closures) {
    set.offsets.push_back(set.rows);
    set.rows += getRows(closure.kind);
  }
  return set;
}

template <typename T>
VectorUpTo6<T> selectRows(const Closure& c, const Vector6<T>& full) {
  switch (c.kind) {
    case ClosureKind::Weld6D:
      return full;
    case ClosureKind::Ball3D:
      return linear(full);
    case ClosureKind::Coupler:
    case ClosureKind::Distance:
      return full.template head<1>();
    case ClosureKind::Hinge5D:
    case ClosureKind::Slider:
      break;
  }
  const auto normals = getAxisNormals(c);
  VectorUpTo6<T> rows(5);
  if (c.kind == ClosureKind::Slider)
    rows << normals.transpose() * linear(full), angular(full);
  else
    rows << linear(full), normals.transpose() * angular(full);
  return rows;
}

template <typename T>
Vector6<T> expandRows(const Closure& c, const VectorUpTo6<T>& lambda) {
  Vector6<T> full = Vector6<T>::Zero();
  if (c.kind == ClosureKind::Coupler || c.kind == ClosureKind::Distance) {
    full[0] = lambda[0];
    return full;
  }
  if (c.kind == ClosureKind::Slider) {
    linear(full) = getAxisNormals(c) * lambda.template head<2>();
    angular(full) = lambda.template tail<3>();
    return full;
  }
  linear(full) = linear(lambda);
  if (c.kind == ClosureKind::Weld6D) angular(full) = angular(lambda);
  if (c.kind == ClosureKind::Hinge5D) angular(full) = getAxisNormals(c) * lambda.template tail<2>();
  return full;
}

Vector6d expandRows(const Closure& c, ConstVectorRef lambda) {
  return expandRows<double>(c, VectorUpTo6<double>(lambda));
}

template <typename T>
VectorUpTo6<T> calcClosureResidual(const WorkspaceOf<T>& ws, const Closure& c) {
  return calcClosureResidual<T>(ws, c, nullptr);
}

template <typename T>
VectorUpTo6<T> calcClosureResidual(const WorkspaceOf<T>& ws, const Closure& c, const ClosureChangeOf<T>* change) {
  requireStage(ws, WorkspaceStage::Placement, "calcClosureResidual", "updatePlacements or updatePositions");
  if (c.kind == ClosureKind::Coupler) {
    VectorUpTo6<T> row =
        sumTerms<T>(c, [&](const CouplerTerm& term) { return term.calcDerivative(0, ws.q[term.idx_q]); });
    row[0] = c.offset - row[0];
    return row;
  }
  const SE3Of<T> X = calcRelativePlacement(ws, c, change);
  if (!change || c.kind != ClosureKind::Distance) return calcClosureResidual(c, X);
  VectorUpTo6<T> row(1);
  row[0] = (X.p.dot(X.p) - change->square) * (0.5 / change->length);
  return row;
}

template <typename T>
VectorUpTo6<T> calcClosureResidual(const Closure& c, const SE3Of<T>& X) {
  if (c.kind == ClosureKind::Weld6D) return log6(X);
  if (c.kind == ClosureKind::Ball3D) return X.p;
  if (c.kind == ClosureKind::Distance) {
    VectorUpTo6<T> row(1);
    row[0] = (X.p.dot(X.p) - c.length * c.length) * (0.5 / c.length);
    return row;
  }
  if (c.kind == ClosureKind::Slider) {
    VectorUpTo6<T> rows(5);
    rows << getAxisNormals(c).transpose() * (X.R.transpose() * X.p), log3(X.R);
    return rows;
  }
  const Vector3<T> axis = c.axis.cast<T>(), n2 = X.R * axis;
  const Eigen::Vector2<T> sine = getAxisNormals(c).transpose() * axis.cross(n2);
  VectorUpTo6<T> rows(5);
  rows << X.p, calcHingeTurn(sine, axis.dot(n2));
  return rows;
}

// Frame 2 turns in frame 1 with omega = -nu_ang. With the direction u of the turn in the plane of the normals and v = axis x u,
//     d(theta u)/dt = u (u . omega) + v (theta cot(theta) (v . omega) + theta (axis . omega)).
Eigen::Matrix<double, 2, 3> calcHingeTurnRate(const Closure& c, const Matrix3d& R) {
  const Eigen::Matrix<double, 2, 3> normals = getAxisNormals(c).transpose();
  const Vector3d n2 = R * c.axis;
  const Eigen::Vector2d sine = normals * c.axis.cross(n2);
  const double s = sine.norm(), cosine = c.axis.dot(n2), theta = std::atan2(s, cosine);
  const Eigen::Vector2d u = s > 0 ? Eigen::Vector2d(sine / s) : Eigen::Vector2d::UnitX(), v(-u.y(), u.x());
  const double across = cosine > 0 ? calcHingeFactor(s, cosine) * cosine : theta * cosine / std::max(s, kLeastSine);
  const Eigen::RowVector3d axis = c.axis.transpose();
  return -(u * (u.transpose() * normals) + v * (across * (v.transpose() * normals) + theta * axis));
}

RowsBy6 calcClosureResidualRate(const Workspace& ws, const Closure& c) {
  requireStage(ws, WorkspaceStage::Position, "calcClosureResidualRate", "updatePositions");
  return calcClosureResidualRate(c, calcRelativePlacement(ws, c));
}

RowsBy6 calcClosureResidualRate(const Closure& c, const SE3& X) {
  // Frame 2 moves in frame 1 with the twist -nu_c.
  if (c.kind == ClosureKind::Weld6D) return -calcLogJacobian6(X) * X.inverse().toActionMatrix();
  RowsBy6 rate = RowsBy6::Zero(getRows(c.kind), 6);
  if (c.kind == ClosureKind::Coupler) return rate;
  if (c.kind == ClosureKind::Distance) {
    rate.leftCols<3>() = -X.p.transpose() / c.length;
    return rate;
  }
  if (c.kind == ClosureKind::Slider) {  // origin 1 moves in frame 2 with R^T nu_lin
    rate.topLeftCorner<2, 3>() = -getAxisNormals(c).transpose() * X.R.transpose();
    rate.bottomRightCorner<3, 3>() = -calcRightJacobianInverse3(Vector3d(-log3(X.R)));
    return rate;
  }
  rate.topLeftCorner<3, 3>() = -Matrix3d::Identity();
  rate.topRightCorner<3, 3>() = skew(X.p);
  if (c.kind == ClosureKind::Hinge5D) rate.bottomRightCorner<2, 3>() = calcHingeTurnRate(c, X.R);
  return rate;
}

ClosureGap calcClosureGap(const Workspace& ws, const Closure& closure) {
  const RowVectorUpTo6 r = calcClosureResidual(ws, closure);
  if (closure.kind == ClosureKind::Distance)
    return {std::abs(calcRelativePlacement(ws, closure).p.norm() - closure.length), 0};
  const int lengths = getLengthRows(closure.kind);
  return {r.head(lengths).norm(), r.tail(r.size() - lengths).norm()};
}

void calcClosureResidualJacobian(const Workspace& ws, const Closure& closure, MatrixRef H) {
  if (closure.kind == ClosureKind::Coupler)
    return writeTerms(closure, H, [&](const CouplerTerm& term) { return -term.calcDerivative(1, ws.q[term.idx_q]); });
  const RowsBy6 rate = calcClosureResidualRate(ws, closure);
  const SE3 X_W1 = getPlacement(ws, closure.body1, closure.X_B1);
  for (size_t i = 0; i < closure.dofs.size(); ++i)
    H.col(closure.dofs[i]) = closure.signs[i] * (rate * X_W1.actInvMotion(ws.J.col(closure.dofs[i])));
}

RowVectorUpTo6 calcClosureVelocity(const Workspace& ws, const Closure& c) {
  requireStage(ws, WorkspaceStage::Velocity, "calcClosureVelocity", "updateVelocities");
  if (c.kind == ClosureKind::Coupler)
    return sumTerms<double>(
        c, [&](const CouplerTerm& term) { return term.calcDerivative(1, ws.q[term.idx_q]) * ws.v[term.dof]; });
  RowVectorUpTo6 rows(getRows(c.kind));
  ClosureRows<double>(ws, c).write(1, ws.V[c.body1] - ws.V[c.body2], rows.data());
  return rows;
}

template <typename T>
VectorUpTo6<T> calcClosureAcceleration(const WorkspaceOf<T>& ws, const Closure& c) {
  return calcClosureAcceleration<T>(ws, c, nullptr);
}

template <typename T>
VectorUpTo6<T> calcClosureAcceleration(const WorkspaceOf<T>& ws, const Closure& c, const ClosureChangeOf<T>* change) {
  if (c.kind == ClosureKind::Coupler)
    return sumTerms<T>(c, [&](const CouplerTerm& term) {
      const T &q = ws.q[term.idx_q], &v = ws.v[term.dof], &a = ws.a[term.dof];
      return T(term.isLinear() ? term.coefficient * a
                               : term.calcDerivative(1, q) * a + term.calcDerivative(2, q) * v * v);
    });
  VectorUpTo6<T> rows(getRows(c.kind));
  ClosureRows<T>(ws, c, change).writeAcceleration(rows.data());
  return rows;
}

RowVectorUpTo6 calcClosureStabilization(const Workspace& ws, const Closure& c) {
  RowVectorUpTo6 rows = RowVectorUpTo6::Zero(getRows(c.kind));
  if (c.kd != 0) rows += c.kd * calcClosureVelocity(ws, c);
  if (c.kp != 0) rows -= c.kp * calcClosureResidual(ws, c);
  return rows;
}

template <typename T>
void calcClosureJacobian(const WorkspaceOf<T>& ws, const Closure& c, typename ArgumentsOf<T>::Matrix J) {
  calcClosureJacobian<T>(ws, c, nullptr, J);
}

template <typename T>
void calcClosureJacobian(const WorkspaceOf<T>& ws, const Closure& c, const ClosureChangeOf<T>* change,
                         typename ArgumentsOf<T>::Matrix J) {
  if (c.kind == ClosureKind::Coupler)
    return writeTerms(c, J, [&](const CouplerTerm& term) { return term.calcDerivative(1, ws.q[term.idx_q]); });
  const ClosureRows<T> rows(ws, c, change);
  for (size_t i = 0; i < c.dofs.size(); ++i) rows.write(c.signs[i], ws.J.col(c.dofs[i]), &J(0, c.dofs[i]));
}

void calcClosureDerivatives(const Workspace& ws, const Closure& c, MatrixRef da_dq, MatrixRef da_dv) {
  requireStage(ws, WorkspaceStage::Acceleration, "calcClosureDerivatives", "updateAccelerations");
  if (c.kind == ClosureKind::Coupler) {  // Eq. (6)
    writeTerms(c, da_dq, [&](const CouplerTerm& term) {
      const double q = ws.q[term.idx_q], v = ws.v[term.dof];
      return term.calcDerivative(2, q) * ws.a[term.dof] + term.calcDerivative(3, q) * v * v;
    });
    return writeTerms(c, da_dv, [&](const CouplerTerm& term) {
      return 2 * term.calcDerivative(2, ws.q[term.idx_q]) * ws.v[term.dof];
    });
  }
  const ClosureRows<double> rows(ws, c);
  const Vector6d &V1 = ws.V[c.body1], &V2 = ws.V[c.body2], &A2 = ws.A[c.body2];
  const Vector6d V12 = V1 + V2;
  for (size_t i = 0; i < c.dofs.size(); ++i) {
    const int k = c.dofs[i];
    const double s = c.signs[i];
    const Vector6d J = ws.J.col(k), dV = ws.dV.col(k);
    const Vector6d J_V2 = crossMotion(J, V2), dnu = dV + J_V2;
    const Vector6d dq = ws.dA.col(k) - crossMotion(V12, dV) + crossMotion(J, A2) - crossMotion(V1, J_V2);  // Eq. (1)
    const Vector6d dv = ws.dJ.col(k) + dV - crossMotion(V12, J);                                           // Eq. (2)
    rows.writeAccelerationChange(s, J, dnu, dq, &da_dq(0, k));
    rows.writeAccelerationChange(s, Vector6d::Zero(), J, dv, &da_dv(0, k));
  }
}

void addStabilizationDerivatives(const Workspace& ws, const Closure& c, MatrixRef ds_dq, MatrixRef ds_dv) {
  requireStage(ws, WorkspaceStage::Velocity, "addStabilizationDerivatives", "updateVelocities");
  if (c.kd == 0 && c.kp == 0) return;
  if (c.kind == ClosureKind::Coupler) {
    for (const CouplerTerm& term : c.terms) {
      const double q = ws.q[term.idx_q], slope = term.calcDerivative(1, q);
      ds_dq(0, term.dof) += c.kp * slope + c.kd * term.calcDerivative(2, q) * ws.v[term.dof];
      ds_dv(0, term.dof) += c.kd * slope;
    }
    return;
  }
  const ClosureRows<double> rows(ws, c);
  const SE3 X_W1 = getFrame1(ws, c);
  RowsBy6 rate = RowsBy6::Zero(getRows(c.kind), 6);
  if (c.kp != 0) rate = calcClosureResidualRate(ws, c);
  RowVectorUpTo6 row(getRows(c.kind));
  for (size_t i = 0; i < c.dofs.size(); ++i) {
    const int k = c.dofs[i];
    const double s = c.signs[i];
    const Vector6d J = ws.J.col(k);
    rows.writeVelocityChange(s * c.kd, J, ws.dV.col(k) + crossMotion(J, ws.V[c.body2]), row.data());  // Eq. (3)
    ds_dq.col(k) += row - (c.kp * s) * (rate * X_W1.actInvMotion(J));
    rows.write(s * c.kd, J, row.data());  // Eq. (4)
    ds_dv.col(k) += row;
  }
}

void calcClosureVelocityDerivative(const Workspace& ws, const Closure& c, MatrixRef dnu_dq) {
  requireStage(ws, WorkspaceStage::Velocity, "calcClosureVelocityDerivative", "updateVelocities");
  if (c.kind == ClosureKind::Coupler)
    return writeTerms(c, dnu_dq, [&](const CouplerTerm& term) {  // Eq. (6)
      return term.calcDerivative(2, ws.q[term.idx_q]) * ws.v[term.dof];
    });
  const ClosureRows<double> rows(ws, c);
  for (size_t i = 0; i < c.dofs.size(); ++i) {
    const int k = c.dofs[i];
    const Vector6d dnu = ws.dV.col(k) + crossMotion(ws.J.col(k), ws.V[c.body2]);  // Eq. (3)
    rows.writeVelocityChange(c.signs[i], ws.J.col(k), dnu, &dnu_dq(0, k));
  }
}

template <typename T>
Vector6<T> calcClosureWrench(const WorkspaceOf<T>& ws, const Closure& c, typename ArgumentsOf<T>::ConstVector lambda) {
  if (c.kind == ClosureKind::Coupler) return Vector6<T>::Zero();
  Vector6<T> W = expandRows<T>(c, lambda);
  if (c.kind == ClosureKind::Distance) linear(W) = (W[0] / c.length * calcRelativePlacement(ws, c).p).eval();
  return getFrame1(ws, c).actForce(W);
}

void addClosureForceDerivative(const Model& model, const Workspace& ws, const Closure& c, ConstVectorRef lambda,
                               MatrixRef dID_dq) {
  for (const CouplerTerm& term : c.terms)
    dID_dq(term.dof, term.dof) -= term.calcDerivative(2, ws.q[term.idx_q]) * lambda[0];  // Eq. (7)
  const bool turns = c.kind == ClosureKind::Distance;
  if (c.kind == ClosureKind::Coupler || (c.body2 == 0 && !turns)) return;  // no effect on the world
  const Vector6d wrench = calcClosureWrench<double>(ws, c, lambda);
  const ClosureRows<double> rows(ws, c);
  for (size_t i = 0; i < c.dofs.size(); ++i) {
    const int k = c.dofs[i];
    const Vector6d moved = c.signs[i] * crossForce(ws.J.col(k), wrench);
    for (int j : model.supportDofs(c.body2)) dID_dq(j, k) += ws.J.col(j).dot(moved);  // Eq. (5); none of the world
    if (!turns) continue;
    const Vector6d turned = c.signs[i] * rows.calcTurned(wrench, ws.J.col(k));
    for (size_t l = 0; l < c.dofs.size(); ++l) dID_dq(c.dofs[l], k) -= c.signs[l] * ws.J.col(c.dofs[l]).dot(turned);
  }
}

template VectorUpTo6<double> selectRows(const Closure&, const Vector6d&);
template VectorUpTo6<Lanes> selectRows(const Closure&, const Vector6<Lanes>&);
template Vector6d expandRows(const Closure&, const VectorUpTo6<double>&);
template Vector6<Lanes> expandRows(const Closure&, const VectorUpTo6<Lanes>&);
template Vector6d calcClosureWrench(const Workspace&, const Closure&, ConstVectorRef);
template Vector6<Lanes> calcClosureWrench(const WorkspaceOf<Lanes>&, const Closure&, ArgumentsOf<Lanes>::ConstVector);

template VectorUpTo6<double> calcClosureResidual(const Closure&, const SE3&);
template VectorUpTo6<double> calcClosureResidual(const Workspace&, const Closure&);
template VectorUpTo6<Lanes> calcClosureResidual(const WorkspaceOf<Lanes>&, const Closure&);
template VectorUpTo6<double> calcClosureAcceleration(const Workspace&, const Closure&);
template VectorUpTo6<Lanes> calcClosureAcceleration(const WorkspaceOf<Lanes>&, const Closure&);
template void calcClosureJacobian(const Workspace&, const Closure&, MatrixRef);
template void calcClosureJacobian(const WorkspaceOf<Lanes>&, const Closure&, ArgumentsOf<Lanes>::Matrix);

template VectorUpTo6<double> calcClosureResidual(const Workspace&, const Closure&, const ClosureChangeOf<double>*);
template VectorUpTo6<Lanes> calcClosureResidual(const WorkspaceOf<Lanes>&, const Closure&,
                                                const ClosureChangeOf<Lanes>*);
template VectorUpTo6<double> calcClosureAcceleration(const Workspace&, const Closure&, const ClosureChangeOf<double>*);
template VectorUpTo6<Lanes> calcClosureAcceleration(const WorkspaceOf<Lanes>&, const Closure&,
                                                    const ClosureChangeOf<Lanes>*);
template void calcClosureJacobian(const Workspace&, const Closure&, const ClosureChangeOf<double>*, MatrixRef);
template void calcClosureJacobian(const WorkspaceOf<Lanes>&, const Closure&, const ClosureChangeOf<Lanes>*,
                                  ArgumentsOf<Lanes>::Matrix);

}  // namespace bielle
