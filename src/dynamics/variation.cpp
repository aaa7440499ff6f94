#include "bielle/dynamics/variation.h"

#include <algorithm>

#include "bielle/dynamics/kinematics.h"
#include "dynamics/closure_rows.h"
#include "dynamics/joint_force.h"
#include "dynamics/point_spring.h"
#include "dynamics/saddle_point.h"

namespace bielle {
namespace {

// How the frames of a closure move in their bodies.
struct FrameTwists {
  Vector6d frame1 = Vector6d::Zero(), frame2 = Vector6d::Zero();
};

FrameTwists getFrameTwists(const ConstraintSet& set, size_t c, const ModelVariation& change) {
  if (static_cast<int>(c) < set.num_loops) return {change.frames1[c], change.frames2[c]};
  return {change.contacts[set.getContact(static_cast<int>(c))], Vector6d::Zero()};
}

// D_1 and D_1 - D_2, in the world.
struct Displacements {
  Vector6d first, relative;
};

Displacements calcDisplacements(const Workspace& ws, const ConstraintSet& set, size_t c, const ModelVariation& change,
                                const VariationWorkspace& variation) {
  const Closure& closure = set.closures[c];
  const FrameTwists twists = getFrameTwists(set, c, change);
  const Vector6d D_1 =
      variation.D[closure.body1] + getPlacement(ws, closure.body1, closure.X_B1).actMotion(twists.frame1);
  return {D_1,
          D_1 - variation.D[closure.body2] - getPlacement(ws, closure.body2, closure.X_B2).actMotion(twists.frame2)};
}

// The relative change of the length of a distance; 0 of others.
double getStretch(const ConstraintSet& set, size_t c, const ModelVariation& change) {
  return set.closures[c].kind == ClosureKind::Distance ? change.lengths[c] / set.closures[c].length : 0;
}

// The polynomial of the changes of a term's coefficients.
CouplerTerm makeTermChange(const MatrixXd& coefficients, size_t term) {
  const auto row = coefficients.row(static_cast<Eigen::Index>(term));
  CouplerTerm out;
  out.coefficient = row[0];
  out.higher.assign(row.begin() + 1, row.end());
  return out;
}

// Change of the value, rate or acceleration (order 0, 1, 2) of a coupler's sum of polynomials, Eq. (9) without dc_0.
RowVectorUpTo6 calcTermVariation(const Workspace& ws, const Closure& coupler, const MatrixXd& coefficients, int order,
                                 const MotionVariation& motion) {
  double sum = 0;
  for (size_t i = 0; i < coupler.terms.size(); ++i) {
    const CouplerTerm &term = coupler.terms[i], change = makeTermChange(coefficients, i);
    const int k = term.dof;
    const double q = ws.q[term.idx_q], v = ws.v[k], a = ws.a[k];
    const auto p = [&](int n) { return term.calcDerivative(n, q); };
    const auto dp = [&](int n) { return change.calcDerivative(n, q); };
    if (order == 0) sum += dp(0) + p(1) * motion.q[k];
    if (order == 1) sum += dp(1) * v + p(1) * motion.v[k] + p(2) * v * motion.q[k];
    if (order == 2)
      sum += dp(1) * a + p(1) * motion.a[k] + dp(2) * v * v + (p(2) * a + p(3) * v * v) * motion.q[k] +
             2 * p(2) * v * motion.v[k];
  }
  return RowVectorUpTo6::Constant(1, sum);
}

RowVectorUpTo6 calcResidualRows(const Workspace& ws, const ConstraintSet& set, size_t c, const ModelVariation& change,
                                const VariationWorkspace& variation) {
  const Closure& closure = set.closures[c];
  if (closure.kind == ClosureKind::Coupler)
    return RowVectorUpTo6::Constant(1, change.offsets[c]) -
           calcTermVariation(ws, closure, change.coefficients[c], 0, variation.motion);
  const SE3 X_W1 = getPlacement(ws, closure.body1, closure.X_B1);
  const Vector6d D = calcDisplacements(ws, set, c, change, variation).relative;
  RowVectorUpTo6 rows = calcClosureResidualRate(ws, closure) * X_W1.actInvMotion(D);  // Eq. (7)
  if (const double stretch = getStretch(set, c, change); stretch != 0)
    rows -= stretch * (calcClosureResidual(ws, closure) + RowVectorUpTo6::Constant(1, closure.length));
  return rows;
}

// Eq. (7), in the world.
Vector6d calcFullVelocityChange(const Workspace& ws, const Closure& closure, const Vector6d& D_1,
                                const VariationWorkspace& variation) {
  const int b1 = closure.body1, b2 = closure.body2;
  return variation.dV[b1] - variation.dV[b2] - crossMotion(D_1, ws.V[b1] - ws.V[b2]);
}

RowVectorUpTo6 calcVelocityRows(const Workspace& ws, const ConstraintSet& set, size_t c, const ModelVariation& change,
                                const VariationWorkspace& variation) {
  const Closure& closure = set.closures[c];
  if (closure.kind == ClosureKind::Coupler)
    return calcTermVariation(ws, closure, change.coefficients[c], 1, variation.motion);
  const auto [D_1, D] = calcDisplacements(ws, set, c, change, variation);
  RowVectorUpTo6 rows(getRows(closure.kind));
  ClosureRows<double>(ws, closure)
      .writeVelocityChange(1, D, calcFullVelocityChange(ws, closure, D_1, variation), rows.data());
  if (const double stretch = getStretch(set, c, change); stretch != 0)
    rows -= stretch * calcClosureVelocity(ws, closure);
  return rows;
}

RowVectorUpTo6 calcAccelerationRows(const Workspace& ws, const ConstraintSet& set, size_t c,
                                    const ModelVariation& change, const VariationWorkspace& variation) {
  const Closure& closure = set.closures[c];
  if (closure.kind == ClosureKind::Coupler)
    return calcTermVariation(ws, closure, change.coefficients[c], 2, variation.motion);
  const int b1 = closure.body1, b2 = closure.body2;
  const Vector6d a = ws.A[b1] - ws.A[b2] + crossMotion(ws.V[b1], ws.V[b2]);
  const auto [D_1, D] = calcDisplacements(ws, set, c, change, variation);
  const Vector6d da = variation.dA[b1] - variation.dA[b2] + crossMotion(variation.dV[b1], ws.V[b2]) +
                      crossMotion(ws.V[b1], variation.dV[b2]) - crossMotion(D_1, a);  // Eq. (8)
  RowVectorUpTo6 rows(getRows(closure.kind));
  ClosureRows<double>(ws, closure)
      .writeAccelerationChange(1, D, calcFullVelocityChange(ws, closure, D_1, variation), da, rows.data());
  if (const double stretch = getStretch(set, c, change); stretch != 0)
    rows -= stretch * calcClosureAcceleration(ws, closure);
  return rows;
}

// Calls write(c, rows) with the rows of closure c, for all closures.
template <typename Rows>
VectorXd stackRows(const ConstraintSet& set, Rows&& calcRows) {
  VectorXd out(set.rows);
  for (size_t c = 0; c < set.closures.size(); ++c)
    out.segment(set.offsets[c], getRows(set.closures[c].kind)) = calcRows(c);
  return out;
}

// Joint i of Eqs. (1) to (4).
void updateJointVariation(const Model& model, const Workspace& ws, int i, const ModelVariation& change,
                          const MotionVariation& motion, VariationWorkspace& out) {
  const Joint& joint = model.joints()[i];
  const int p = joint.parent, begin = joint.idx_v, end = begin + joint.nv;
  const bool sequential = joint.kind == JointKind::Universal;
  Vector6d D = out.D[p] + (ws.X_WB[p] * joint.X_PJ).actMotion(change.joints[i]);
  Vector6d w = ws.V[p], dw = out.dV[p];  // on the side that carries the axis
  const auto advance = [&](int k) {
    w += ws.J.col(k) * ws.v[k];
    dw += ws.J.col(k) * motion.v[k] + out.dJ.col(k) * ws.v[k];
  };
  if (!sequential) {
    for (int k = begin; k < end; ++k) D += ws.J.col(k) * motion.q[k];
    for (int k = begin; k < end; ++k) out.dJ.col(k) = crossMotion(D, ws.J.col(k));
    for (int k = begin; k < end; ++k) advance(k);
  }
  Vector6d dA = out.dA[p];
  for (int k = begin; k < end; ++k) {
    const Vector6d J = ws.J.col(k);
    if (sequential) out.dJ.col(k) = crossMotion(D, J);
    const Vector6d dJ = out.dJ.col(k);
    dA += J * motion.a[k] + dJ * ws.a[k] + ws.dJ.col(k) * motion.v[k] +
          (crossMotion(dw, J) + crossMotion(w, dJ)) * ws.v[k];
    if (!sequential) continue;
    D += J * motion.q[k];
    advance(k);
  }
  out.D[i] = D, out.dV[i] = dw, out.dA[i] = dA;
}

// Force of body i alone, and its change by Eq. (5).
void updateBodyForces(const Workspace& ws, int i, const Matrix6d& inertia, VariationWorkspace& out) {
  const Matrix6d& Y = ws.Y[i];
  const Vector6d &V = ws.V[i], &A = ws.A[i], &D = out.D[i];
  const auto vary = [&](const Vector6d& x, const Vector6d& dx) {  // of Y x
    return Vector6d(crossForce(D, Y * x) + Y * (dx - crossMotion(D, x)) +
                    ws.X_WB[i].actForce(inertia * ws.X_WB[i].actInvMotion(x)));
  };
  const Vector6d h = Y * V;
  out.F[i] = Y * A + crossForce(V, h);
  out.dF[i] = vary(A, out.dA[i]) + crossForce(out.dV[i], h) + crossForce(V, vary(V, out.dV[i]));
}

// The force of point spring s and its change, as those of body forces: less what acts on the bodies.
void addPointSpringVariation(const Model& model, const Workspace& ws, size_t s, const ModelVariation& change,
                             VariationWorkspace& out) {
  const PointSpring& spring = model.pointSprings()[s];
  const PointSpringLine<double> line(ws, spring);
  struct End {
    Vector3d dp, dp_rate;
  };
  const auto move = [&](int body, const Vector3d& p, const Vector3d& change_in_body) {
    const auto at = &PointSpringLine<double>::calcVelocityAt;
    const Vector3d dp = at(out.D[body], p) + ws.X_WB[body].R * change_in_body;
    return End{dp, at(out.dV[body], p) + angular(ws.V[body]).cross(dp)};
  };
  const End end1 = move(spring.body1, line.p1, change.points1[s]),
            end2 = move(spring.body2, line.p2, change.points2[s]);
  const Vector3d force = line.tension * line.u;
  const double dtension =
      change.springs[s].dot(Eigen::Vector4d(line.length - spring.rest, -spring.stiffness, 1, line.rate));
  const Vector3d dforce = line.calcForceChange(end2.dp - end1.dp, end2.dp_rate - end1.dp_rate) + dtension * line.u;
  const auto subtract = [&](int body, double sign, const Vector3d& p, const Vector3d& dp) {
    out.F[body] -= sign * line.makeWrench(p, force);
    out.dF[body] -= sign * line.makeWrench(p, dforce);
    out.dF[body].tail<3>() -= sign * dp.cross(force);
  };
  subtract(spring.body1, 1, line.p1, end1.dp);
  subtract(spring.body2, -1, line.p2, end2.dp);
}

}  // namespace

ModelVariation::ModelVariation(const Model& model)
    : joints(model.numBodies(), Vector6d::Zero()),
      frames1(model.closures().size(), Vector6d::Zero()),
      frames2(frames1),
      offsets(model.closures().size(), 0),
      lengths(offsets),
      points1(model.pointSprings().size(), Vector3d::Zero()),
      points2(points1),
      springs(model.pointSprings().size(), Eigen::Vector4d::Zero()),
      joint_forces(model.jointForces().size(), Vector5d::Zero()),
      contacts(model.contacts().size(), Vector6d::Zero()),
      shapes(model.shapes().size()),
      inertias(model.numBodies(), Matrix6d::Zero()),
      armature(VectorXd::Zero(model.nv())) {
  for (const Closure& closure : model.closures()) {
    size_t degree = 1;
    for (const CouplerTerm& term : closure.terms) degree = std::max(degree, 1 + term.higher.size());
    coefficients.push_back(
        MatrixXd::Zero(static_cast<Eigen::Index>(closure.terms.size()), static_cast<Eigen::Index>(degree)));
  }
}

MotionVariation::MotionVariation(const Model& model) : q(VectorXd::Zero(model.nv())), v(q), a(q) {}

VariationWorkspace::VariationWorkspace(const Model& model)
    : D(model.numBodies(), Vector6d::Zero()),
      dV(D),
      dA(D),
      dJ(Matrix6Xd::Zero(6, model.nv())),
      F(D),
      dF(D),
      motion(model) {}

void updateVariation(const Model& model, const Workspace& ws, const ModelVariation& change,
                     const MotionVariation& motion, VariationWorkspace& variation) {
  requireStage(ws, WorkspaceStage::Acceleration, "updateVariation", "updateAccelerations");
  variation.motion = motion;
  for (int i = 1; i < model.numBodies(); ++i) updateJointVariation(model, ws, i, change, motion, variation);
}

VectorXd calcInverseDynamicsVariation(const Model& model, const Workspace& ws, const ConstraintSet& constraints,
                                      ConstVectorRef lambda, const ModelVariation& change,
                                      const MotionVariation& motion, VariationWorkspace& variation) {
  for (int i = 1; i < model.numBodies(); ++i) updateBodyForces(ws, i, change.inertias[i], variation);
  for (size_t c = 0; c < constraints.closures.size(); ++c) {
    const Closure& closure = constraints.closures[c];
    if (closure.kind == ClosureKind::Coupler) continue;
    const Vector6d W =
        calcClosureWrench<double>(ws, closure, lambda.segment(constraints.offsets[c], getRows(closure.kind)));
    const auto [D_1, D] = calcDisplacements(ws, constraints, c, change, variation);
    const Vector6d dW =
        crossForce(D_1, W) + ClosureRows<double>(ws, closure).calcTurned(W, D) - getStretch(constraints, c, change) * W;
    variation.F[closure.body1] -= W, variation.dF[closure.body1] -= dW;
    variation.F[closure.body2] += W, variation.dF[closure.body2] += dW;
  }
  for (size_t s = 0; s < model.pointSprings().size(); ++s) addPointSpringVariation(model, ws, s, change, variation);
  VectorXd out = model.armature().cwiseProduct(motion.a) + change.armature.cwiseProduct(ws.a);
  for (size_t f = 0; f < model.jointForces().size(); ++f) {
    const JointForce& force = model.jointForces()[f];
    out[force.dof] += force.stiffness * motion.q[force.dof] +
                      calcResistance(force, ws.v[force.dof]) * motion.v[force.dof] -
                      change.joint_forces[f].dot(calcJointForceSlopes(force, ws));
  }
  for (size_t c = 0; c < constraints.closures.size(); ++c)
    for (size_t i = 0; i < constraints.closures[c].terms.size(); ++i) {
      const CouplerTerm& term = constraints.closures[c].terms[i];
      const double q = ws.q[term.idx_q];
      out[term.dof] -= (makeTermChange(change.coefficients[c], i).calcDerivative(1, q) +
                        term.calcDerivative(2, q) * motion.q[term.dof]) *
                       lambda[constraints.offsets[c]];
    }
  for (int i = model.numBodies() - 1; i > 0; --i) {
    const Joint& joint = model.joints()[i];
    for (int k = joint.idx_v; k < joint.idx_v + joint.nv; ++k)
      out[k] += variation.dJ.col(k).dot(variation.F[i]) + ws.J.col(k).dot(variation.dF[i]);  // Eq. (6)
    variation.F[joint.parent] += variation.F[i];
    variation.dF[joint.parent] += variation.dF[i];
  }
  return out;
}

VectorXd calcResidualVariation(const Workspace& ws, const ConstraintSet& constraints, const ModelVariation& change,
                               const VariationWorkspace& variation) {
  return stackRows(constraints, [&](size_t c) { return calcResidualRows(ws, constraints, c, change, variation); });
}

VectorXd calcVelocityVariation(const Workspace& ws, const ConstraintSet& constraints, const ModelVariation& change,
                               const VariationWorkspace& variation) {
  return stackRows(constraints, [&](size_t c) { return calcVelocityRows(ws, constraints, c, change, variation); });
}

VectorXd calcAccelerationVariation(const Workspace& ws, const ConstraintSet& constraints, const ModelVariation& change,
                                   const VariationWorkspace& variation) {
  return stackRows(constraints, [&](size_t c) {
    const Closure& closure = constraints.closures[c];
    RowVectorUpTo6 rows = calcAccelerationRows(ws, constraints, c, change, variation);
    if (closure.kd != 0) rows += closure.kd * calcVelocityRows(ws, constraints, c, change, variation);
    if (closure.kp != 0) rows -= closure.kp * calcResidualRows(ws, constraints, c, change, variation);
    return rows;
  });
}

DynamicsVariation calcConstrainedVariation(const Model& model, Workspace& ws, ConstrainedWorkspace& cws,
                                           const ConstraintSet& constraints, const std::vector<ModelVariation>& changes,
                                           const std::vector<MotionVariation>& motions) {
  const Eigen::Index n = static_cast<Eigen::Index>(changes.size());
  DynamicsVariation out{MatrixXd(model.nv(), n), MatrixXd(constraints.rows, n)};
  VariationWorkspace variation(model);
  for (Eigen::Index i = 0; i < n; ++i) {
    MotionVariation motion(model);
    if (!motions.empty()) motion.q = motions[i].q, motion.v = motions[i].v;
    updateVariation(model, ws, changes[i], motion, variation);
    out.a.col(i) = calcInverseDynamicsVariation(model, ws, constraints, cws.lambda, changes[i], motion, variation);
    out.lambda.col(i) = calcAccelerationVariation(ws, constraints, changes[i], variation);
  }
  cws.saddle_point->updateInverse();
  cws.saddle_point->solveDerivatives(out.a, out.lambda);
  return out;
}

double calcDistanceVariation(const Model& model, const Workspace& ws, int a, int b, const ShapeDistance& distance,
                             const ModelVariation& change, const VariationWorkspace& variation) {
  // How far the surface at a point advances along a direction, outwards or not.
  const auto advance = [&](int index, const Vector3d& point, const Vector3d& direction, double outward) {
    const Shape& shape = model.shapes()[index];
    const ShapeVariation& own = change.shapes[index];
    const SE3 X_WS = getPlacement(ws, shape.body, shape.X_BS);
    const Vector6d D = variation.D[shape.body] + X_WS.actMotion(own.frame);
    const Vector3d in_core = X_WS.R.transpose() * (point - outward * shape.radius * direction - X_WS.p);
    Vector3d grown = Vector3d::Zero();  // of the point of the core, which keeps its shares of the edges
    for (int i = 0; i < 3; ++i)
      if (shape.half[i] > 0) grown[i] = in_core[i] / shape.half[i] * own.half[i];
    return direction.dot(D.head<3>() + D.tail<3>().cross(point) + X_WS.R * grown) + outward * own.radius;
  };
  return advance(a, distance.point_a, distance.normal, -1) - advance(b, distance.point_b, distance.normal, 1);
}

}  // namespace bielle
