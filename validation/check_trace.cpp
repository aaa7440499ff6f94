#include "check_trace.h"

#include <array>
#include <memory>

#include "bielle/motion/motion.h"
#include "check_accelerations.h"
#include "math/decompositions.h"
#include "math/largest.h"
#include "math/so3.h"
#include "simbody_bridge.h"

namespace bielle::validation {
namespace {

// Rows whose pivot, after scaling, is below this are redundant; loops are closed to 1e-8 (CheckBounds::closed).
constexpr double kRankThreshold = 1e-8;

// Displacement of frame 2 in frame 1, without what is free: about the axis of a hinge, about any axis of a ball, along that of a
// slider. Of a distance, by how much it is too long, along x.
Vector6d calcGap(const Closure& closure, const SE3& X_12) {
  Vector6d gap = Vector6d::Zero();
  gap.head<3>() = X_12.p;
  if (closure.kind == ClosureKind::Distance) return (X_12.p.norm() - closure.length) * Vector6d::Unit(0);
  if (closure.kind == ClosureKind::Slider) gap << X_12.p - closure.axis.dot(X_12.p) * closure.axis, log3(X_12.R);
  if (closure.kind == ClosureKind::Weld6D) gap.tail<3>() = log3(X_12.R);
  if (closure.kind == ClosureKind::Hinge5D) {
    const Vector3d axis2 = X_12.R * closure.axis, normal = closure.axis.cross(axis2);
    gap.tail<3>() = std::atan2(normal.norm(), closure.axis.dot(axis2)) * normal.normalized();
  }
  return gap;
}

Vector6d dropFreeAxes(const Closure& closure, const SE3& X_12, Vector6d rate) {
  if (closure.kind == ClosureKind::Distance) return X_12.p.normalized().dot(rate.head<3>()) * Vector6d::Unit(0);
  if (closure.kind == ClosureKind::Slider) rate.head<3>() -= closure.axis.dot(rate.head<3>()) * closure.axis;
  if (closure.kind == ClosureKind::Ball3D) rate.tail<3>().setZero();
  if (closure.kind == ClosureKind::Hinge5D) rate.tail<3>() -= closure.axis.dot(rate.tail<3>()) * closure.axis;
  return rate;
}

// Diagonal of W, Eq. (3) of check.h, by Simbody's mass matrix, where the robot stands before a motion, about which a cycle moves; one for
// joints outside the loops. Empty for the full formulation.
VectorXd calcMetric(const CheckedMotion& motion) {
  constexpr double kFloor = 1e-3;
  const Model& model = motion.model;
  if (motion.summary.formulation == Formulation::Full || model.closures().empty()) return {};
  SimbodyBridge simbody(model, model.closures());
  const bool starts_standing = motion.record.cycle.size() == 0;
  simbody.setState(starts_standing ? motion.record.q.row(0).transpose().eval() : makeStandingPosture(model),
                   VectorXd::Zero(model.nv()), VectorXd::Zero(model.nv()));
  const VectorXd inertia = simbody.calcMassMatrix().diagonal();
  VectorXd metric = VectorXd::Ones(model.nv());
  for (const LoopCluster& cluster : model.clusters()) {
    double largest = 0;
    for (int k : cluster.dofs) largest = getLarger(largest, inertia[k]);
    for (int k : cluster.dofs) metric[k] = largest > 0 ? getLarger(inertia[k] / largest, kFloor) : 1;
  }
  return metric;
}

class Tracer {
 public:
  explicit Tracer(const CheckedMotion& motion) : motion_(motion), metric_(calcMetric(motion)) {
    for (const Closure& closure : motion.model.closures()) loop_rows_ += getRows(closure.kind);
  }

  MotionTrace trace() {
    MotionTrace out;
    const int stages = motion_.numStages();
    out.stages.resize(stages);
    for (int k = 0; k <= stages; ++k) {
      const VectorXd q = motion_.record.q.row(k), v = motion_.record.v.row(k);
      const VectorXd u = k < stages ? VectorXd(motion_.record.u.row(k)) : VectorXd::Zero(motion_.model.nu());
      SimbodyBridge& simbody = getBridge(motion_.findPhase(k));
      simbody.setState(q, v, calcMotorForces(motion_.model, u));
      out.nodes.push_back(traceNode(simbody, v));
      if (motion_.has_happened) continue;
      updateTangent(simbody);
      out.nodes.back().drift_power = v.dot(calcDriftForces(simbody));
      if (k > 0) traceArrival(k - 1, out.nodes[k - 1], out.nodes[k], out.stages[k - 1]);
      if (k < stages && hasMidpoint(k))
        traceMidpoint(simbody, k, out.stages[k]);
      else if (k < stages)
        traceStage(simbody, k, out.stages[k]);
    }
    return out;
  }

 private:
  // The bridge of a phase: feet that stand again stand elsewhere.
  SimbodyBridge& getBridge(int phase) {
    if (phase != bridge_phase_)
      bridge_ = std::make_unique<SimbodyBridge>(motion_.model,
                                                makeConstraintSet(motion_.model, motion_.getContacts(phase)).closures);
    bridge_phase_ = phase;
    return *bridge_;
  }

  NodeTrace traceNode(const SimbodyBridge& simbody, const VectorXd& v) const {
    NodeTrace node;
    for (const ContactFrame& contact : motion_.model.contacts()) {
      node.feet.push_back(simbody.getPlacement(contact.body) * contact.X_BF);
      node.foot_twists.push_back(contact.X_BF.actInvMotion(simbody.calcTwist(contact.body)));
    }
    node.closures = traceClosures(simbody);
    for (int i = 0; i < motion_.model.numBodies(); ++i) node.bodies.push_back(simbody.getPlacement(i));
    node.com = simbody.calcCom();
    node.kinetic = simbody.calcKineticEnergy();
    node.potential = simbody.calcPotentialEnergy();
    node.passive = simbody.calcPassiveForces();
    node.passive_power = v.dot(node.passive);
    node.dissipative_power = v.dot(simbody.calcDissipativeForces());
    node.inertial_power = v.dot(simbody.calcBias() + node.passive);
    return node;
  }

  ClosureTrace traceClosures(const SimbodyBridge& simbody) const {
    ClosureTrace out;
    for (const Closure& closure : motion_.model.closures()) {
      if (closure.kind == ClosureKind::Coupler) {
        out.gaps.push_back(simbody.calcCouplerGap(closure) * Vector6d::Unit(3));
        out.gap_rates.push_back(simbody.calcCouplerRate(closure) * Vector6d::Unit(3));
        continue;
      }
      const SE3 X_12 = (simbody.getPlacement(closure.body1) * closure.X_B1)
                           .inverseTimes(simbody.getPlacement(closure.body2) * closure.X_B2);
      const Vector6d V1 = closure.X_B1.actInvMotion(simbody.calcTwist(closure.body1));
      const Vector6d V2 = closure.X_B2.actInvMotion(simbody.calcTwist(closure.body2));
      out.gaps.push_back(calcGap(closure, X_12));
      out.gap_rates.push_back(dropFreeAxes(closure, X_12, V1 - X_12.actMotion(V2)));
    }
    return out;
  }

  // Projection along the closures at a node: the part of x that no correction W^{-1} J^T y can produce.
  void updateTangent(const SimbodyBridge& simbody) {
    if (!metric_.size()) return;
    const VectorXd inverse_root = metric_.cwiseSqrt().cwiseInverse();
    const MatrixXd J = simbody.calcConstraintJacobian().topRows(loop_rows_) * inverse_root.asDiagonal();
    factors_.setThreshold(kRankThreshold);
    factors_.compute(J.transpose());
    const int n = motion_.model.nv();
    const MatrixXd Q = factors_.householderQ();
    N_ = inverse_root.asDiagonal() * Q.rightCols(n - factors_.rank());
    normal_ = inverse_root.asDiagonal() * Q.leftCols(factors_.rank());
  }

  // f of Eq. (11), at the state that the bridge has; dampers and friction act in the kick. a_n is the smallest acceleration, in the metric W, that keeps the
  // loops closed.
  VectorXd calcDriftForces(const SimbodyBridge& simbody) const {
    const VectorXd bias = simbody.calcBias() + simbody.calcDissipativeForces();
    if (!metric_.size()) return bias;
    const VectorXd left = simbody.calcConstraintAcceleration(VectorXd::Zero(bias.size())).head(loop_rows_);
    const auto rank = factors_.rank();
    const auto R = factors_.matrixR().topLeftCorner(rank, rank).triangularView<Eigen::Upper>();
    const VectorXd ordered = factors_.colsPermutation().transpose() * left;
    const VectorXd turn = -normal_ * R.transpose().solve(ordered.head(rank));
    return bias + simbody.calcMassMatrix() * turn;
  }
  VectorXd projectOnTangent(const VectorXd& x) const {
    if (!metric_.size()) return x;
    return N_ * (N_.transpose() * metric_.cwiseProduct(x));
  }

  // Quantities judged along the closures of the next node, and those that need both nodes.
  void traceArrival(int k, const NodeTrace& here, const NodeTrace& next, StageTrace& stage) const {
    const double h = motion_.getTimeStep(k);
    const VectorXd v_next = motion_.record.v.row(k + 1);
    if (hasMidpoint(k)) {
      const VectorXd q_mid = motion_.record.q_mid.row(k), q_next = motion_.record.q.row(k + 1);
      stage.position_rest = projectOnTangent(motion_.model.difference(q_mid, q_next) - h / 2 * v_next);
      stage.passive_work = here.potential - next.potential + stage.dissipative_work;
      stage.energy_scale += h / 4 * std::abs(here.drift_power - stage.midpoint_power + next.drift_power);
    } else {
      stage.position_rest = projectOnTangent(calcStep(k) - h * v_next);
      stage.passive_work = h / 2 * (here.passive_power + next.passive_power);
      stage.dissipative_work = h / 2 * (here.dissipative_power + next.dissipative_power);
      stage.energy_scale += h * std::abs(next.inertial_power - here.inertial_power) +
                            h / 2 * std::abs((next.passive - here.passive).dot(v_next));
    }
  }

  VectorXd calcStep(int k) const {
    return motion_.model.difference(motion_.record.q.row(k).transpose(), motion_.record.q.row(k + 1).transpose());
  }

  std::vector<Vector6d> gatherWrenches(int k) const {
    const MotionRecord& record = motion_.record;
    std::vector<Vector6d> wrenches;
    const int loops = static_cast<int>(motion_.model.closures().size());
    for (int c = 0; c < loops; ++c) wrenches.push_back(record.closure_wrenches.block<1, 6>(k, 6 * c).transpose());
    for (const ContactTarget& target : motion_.getContacts(motion_.findPhase(k)))
      wrenches.push_back(record.contact_wrenches.block<1, 6>(k, 6 * target.contact).transpose());
    return wrenches;
  }

  bool hasMidpoint(int k) const { return motion_.record.has_midpoints && !motion_.isImpact(k); }

  // Velocities and impulses of an impact by Simbody's mass matrix and constraints, those of loops and of the feet that
  // stand afterwards. Loops that are open, as the full formulation leaves them, have no velocity that all rows agree on:
  // they keep the recorded one, which the row of opening velocities bounds.
  void traceImpact(const SimbodyBridge& simbody, int k, StageTrace& stage) const {
    const VectorXd v = motion_.record.v.row(k), next = motion_.record.v.row(k + 1), change = next - v;
    const MatrixXd J = simbody.calcConstraintJacobian();
    VectorXd rates = VectorXd::Zero(J.rows());
    if (motion_.summary.formulation == Formulation::Full) rates.head(loop_rows_) = J.topRows(loop_rows_) * next;
    const OracleSolution solution = simbody.solveImpact(rates);
    stage.balance = VectorXd::Zero(motion_.model.nv());
    stage.velocity_rest = next - solution.a;
    stage.contact_work = change.dot(simbody.calcMassMatrix() * (v + change / 2));  // energy lost in the impact
    stage.impulses.assign(motion_.model.contacts().size(), Vector6d::Zero());
    size_t i = motion_.model.closures().size();
    for (const ContactTarget& target : motion_.getContacts(motion_.findPhase(k)))
      stage.impulses[target.contact] = solution.wrenches[i++];
  }

  void traceStage(const SimbodyBridge& simbody, int k, StageTrace& stage) const {
    if (motion_.isImpact(k)) return traceImpact(simbody, k, stage);
    const MotionRecord& record = motion_.record;
    const double h = motion_.getTimeStep(k);
    const VectorXd v = record.v.row(k), a = record.a.row(k), next = record.v.row(k + 1), d = calcStep(k);
    const VectorXd motors = calcMotorForces(motion_.model, record.u.row(k).transpose());
    std::vector<Vector6d> wrenches = gatherWrenches(k);
    stage.balance = simbody.calcInverseDynamics(a) - motors - simbody.calcWrenchForces(wrenches);
    stage.velocity_rest = projectOnTangent(d / h - v - h * a);

    const MatrixXd M = simbody.calcMassMatrix();
    const AccelerationTrace own = traceAccelerations(simbody, M, calcClosureErrors(simbody, v), a, h,
                                                     motion_.summary.formulation == Formulation::Full);
    stage.acceleration = own.size;
    stage.acceleration_error = own.error;
    stage.finite_difference = calcInertialNorm(M, (next - v) / h - own.a);

    traceWork(simbody, motors, wrenches, h / 2 * (v + next), stage);
    const VectorXd inertial = simbody.calcBias() + simbody.calcPassiveForces();
    stage.energy_scale = h * h / 2 * std::abs(a.dot(inertial)) + std::abs((M * (next - v - h * a)).dot(v + next)) / 2;
  }

  // Eqs. (9) and (10); what is judged at the next node is left to traceArrival(). The bridge is at the node.
  void traceMidpoint(SimbodyBridge& simbody, int k, StageTrace& stage) {
    const MotionRecord& record = motion_.record;
    const double h = motion_.getTimeStep(k);
    const VectorXd q = record.q.row(k), v = record.v.row(k), a = record.a.row(k), next = record.v.row(k + 1);
    const VectorXd q_mid = record.q_mid.row(k), v_mid = record.v_mid.row(k), q_next = record.q.row(k + 1);
    const VectorXd motors = calcMotorForces(motion_.model, record.u.row(k).transpose());
    const VectorXd first = motion_.model.difference(q, q_mid), second = motion_.model.difference(q_mid, q_next);
    stage.midpoint_rest = projectOnTangent(first - h / 2 * v);
    const ClosureErrors errors = calcClosureErrors(simbody, v);

    simbody.setState(q_mid, v_mid, motors);
    stage.midpoint = traceClosures(simbody);
    updateTangent(simbody);
    std::vector<Vector6d> wrenches = gatherWrenches(k);
    stage.balance = simbody.calcInverseDynamics(a) - motors - simbody.calcWrenchForces(wrenches);
    const bool full = motion_.summary.formulation == Formulation::Full;
    const VectorXd before = full ? v : projectOnTangent(2 / h * first), after = before + h * projectOnTangent(a);
    stage.velocity_rest = projectOnTangent(2 / h * second - after);
    const MatrixXd M = simbody.calcMassMatrix();
    const AccelerationTrace own = traceAccelerations(simbody, M, errors, a, h, full);
    stage.acceleration = own.size;
    stage.finite_difference = calcInertialNorm(M, (next - v) / h - own.a);
    traceWork(simbody, motors, wrenches, h / 2 * (before + after), stage);
    stage.dissipative_work = h / 2 * (before + after).dot(simbody.calcDissipativeForces());

    simbody.setState(q_mid, before, motors);
    const VectorXd foreseen = projectOnTangent(simbody.solveWithArmature(Precision::Double).a);
    stage.acceleration_error = getLarger(own.error, calcInertialNorm(M, 2 / h * (v_mid - before) - foreseen));
    traceMidpointEnergy(simbody, h, q_mid, {before, after, v_mid}, motors, stage);
  }

  // Eq. (12), but for the powers at the nodes. `v` are v-, w and v_m.
  void traceMidpointEnergy(SimbodyBridge& simbody, double h, const VectorXd& q_mid, const std::array<VectorXd, 3>& v,
                           const VectorXd& motors, StageTrace& stage) const {
    const auto calcForces = [&](const VectorXd& velocity) {
      simbody.setState(q_mid, velocity, motors);
      return calcDriftForces(simbody);
    };
    const VectorXd mean = (v[0] + v[1]) / 2, f = calcForces(mean);
    stage.midpoint_power = v[0].dot(calcForces(v[0])) + v[1].dot(calcForces(v[1]));
    stage.energy_scale =
        h / 2 * std::abs(stage.midpoint_power - 2 * mean.dot(f)) + h * std::abs(mean.dot(calcForces(v[2]) - f));
  }

  // Works along a displacement.
  void traceWork(const SimbodyBridge& simbody, const VectorXd& motors, std::vector<Vector6d>& wrenches,
                 const VectorXd& moved, StageTrace& stage) const {
    stage.motor_work = motors.dot(moved);
    stage.exchanged = motors.cwiseProduct(moved).cwiseAbs().sum();
    const double all_work = simbody.calcWrenchForces(wrenches).dot(moved);
    std::fill_n(wrenches.begin(), motion_.model.closures().size(), Vector6d::Zero());
    stage.contact_work = simbody.calcWrenchForces(wrenches).dot(moved);
    stage.closure_work = all_work - stage.contact_work;
  }

  const CheckedMotion& motion_;
  VectorXd metric_;  // nv, diagonal of W, or empty
  // At the state that updateTangent() saw last, n = nv: with J of the loops, J^T in the metric W is factorized as
  // W^{-1/2} J^T = Q R, and N (n x mobility, N^T W N = 1) and `normal` are W^{-1/2} Q.
  Eigen::ColPivHouseholderQR<MatrixXd> factors_;
  MatrixXd N_, normal_;
  int loop_rows_ = 0;
  std::unique_ptr<SimbodyBridge> bridge_;
  int bridge_phase_ = -1;
};

}  // namespace

MotionTrace traceMotion(const CheckedMotion& motion) { return Tracer(motion).trace(); }

}  // namespace bielle::validation
