#pragma once
// Small shooting problems with exact derivatives: textbook plants by complex steps, a turning body on SO(3) by hand.
#include <Eigen/LU>
#include <array>
#include <complex>
#include <vector>

#include "bielle/solve/shooting_problem.h"
#include "model/joint.h"

namespace bielle::test {

/// A problem whose evaluations hold nothing but states, controls and costs, from functions of one node.
class PlainProblem : public NodewiseProblem {
 public:
  using NodewiseProblem::difference;
  using NodewiseProblem::evaluate;
  using NodewiseProblem::integrate;
  using NodewiseProblem::linearize;

  void evaluate(EvaluateTask& task, ProblemScratch*) const override {
    NodeEvaluation& out = *task.out;
    out.x = *task.x;
    out.status = NumericalStatus::Ok;
    if (task.node == numStages()) {
      out.cost = calcTerminalCost(out.x);
    } else {
      out.u = *task.u;
      out.x_next.resize(stateSize());
      out.cost = calcStep(task.node, out.x, out.u, out.x_next);
    }
  }
  void linearize(LinearizeTask& task, ProblemScratch*) const override {
    task.status = NumericalStatus::Ok;
    task.out->cost = task.at->cost;
    task.out->hessian().setZero();
    if (task.node == numStages()) return linearizeTerminal(task.at->x, *task.out);
    calcDifference(task.next->x, task.at->x_next, task.out->gap);
    linearizeStage(*task.at, *task.out);
  }
  void integrate(const IntegrateTask& task, ProblemScratch*) const override {
    calcSum(task.at->x, *task.dx, *task.x_out);
  }
  void difference(const DifferenceTask& task, ProblemScratch*) const override {
    calcDifference(task.at->x, *task.x1, *task.dx);
  }

  virtual void calcSum(const VectorXd& x, const VectorXd& dx, VectorXd& out) const { out = x + dx; }
  virtual void calcDifference(const VectorXd& x0, const VectorXd& x1, VectorXd& dx) const { dx = x1 - x0; }
  /// x_next, and the cost.
  virtual double calcStep(int stage, const VectorXd& x, const VectorXd& u, VectorXd& x_next) const = 0;
  virtual double calcTerminalCost(const VectorXd& x) const = 0;
  /// All but cost and gap; second derivatives are zero before.
  virtual void linearizeStage(const NodeEvaluation& at, StageModel& out) const = 0;
  virtual void linearizeTerminal(const VectorXd& x, StageModel& out) const = 0;
};

/// theta from hanging; torque at the hinge.
struct Pendulum {
  static constexpr int kStates = 2, kControls = 1;
  template <class S>
  static std::array<S, 2> calcRate(const std::array<S, 2>& x, const std::array<S, 1>& u) {
    using std::sin;
    return {x[1], -9.81 * sin(x[0]) - 0.05 * x[1] + u[0]};
  }
};

/// Position, angle of the pole from upright, their rates; force on the cart.
struct CartPole {
  static constexpr int kStates = 4, kControls = 1;
  template <class S>
  static std::array<S, 4> calcRate(const std::array<S, 4>& x, const std::array<S, 1>& u) {
    using std::cos, std::sin;
    const double cart = 1, pole = 0.2, length = 0.5, g = 9.81;
    const S s = sin(x[1]), c = cos(x[1]), push = u[0] + pole * length * x[3] * x[3] * s;
    const S turn = (g * s - c * push / (cart + pole)) / (length * (4.0 / 3 - pole * c * c / (cart + pole)));
    return {x[2], x[3], (push - pole * length * turn * c) / (cart + pole), turn};
  }
};

/// Unstable linear plant, coupled.
struct Linear {
  static constexpr int kStates = 3, kControls = 2;
  template <class S>
  static std::array<S, 3> calcRate(const std::array<S, 3>& x, const std::array<S, 2>& u) {
    return {x[1] + 0.2 * u[1], 0.5 * x[0] - 0.3 * x[2] + u[0], x[0] - x[2] + 0.7 * u[1]};
  }
};

/// Plant under Euler steps, with cost 1/2 dt (x - goal).Q.(x - goal) + 1/2 dt r u.u and 1/2 (x - goal).P.(x - goal), Q
/// and P diagonal. Allocates nothing once built.
template <class Plant>
class PlantProblem : public PlainProblem {
 public:
  static constexpr int kX = Plant::kStates, kU = Plant::kControls;
  using State = Eigen::Matrix<double, kX, 1>;

  int stages = 100;
  double dt = 0.02, control_weight = 1e-2, bound = std::numeric_limits<double>::infinity();
  State goal = State::Zero(), weight = State::Zero(), terminal_weight = State::Zero();
  VectorXd start = VectorXd::Zero(kX);

  int numStages() const override { return stages; }
  int stateSize() const override { return kX; }
  int tangentSize(int) const override { return kX; }
  int controlSize(int) const override { return kU; }
  const VectorXd& initialState() const override { return start; }
  void getControlBounds(int, VectorRef lower, VectorRef upper) const override {
    lower.setConstant(-bound);
    upper.setConstant(bound);
  }

  double calcStep(int, const VectorXd& x, const VectorXd& u, VectorXd& x_next) const override {
    const auto next = calcNext<double>(x, u, -1);
    for (int i = 0; i < kX; ++i) x_next[i] = next[i];
    const State e = x - goal;
    return 0.5 * dt * (e.dot(weight.cwiseProduct(e)) + control_weight * u.squaredNorm());
  }
  double calcTerminalCost(const VectorXd& x) const override {
    const State e = x - goal;
    return 0.5 * e.dot(terminal_weight.cwiseProduct(e));
  }
  void linearizeStage(const NodeEvaluation& at, StageModel& out) const override {
    for (int j = 0; j < kX + kU; ++j) {
      const auto next = calcNext<std::complex<double>>(at.x, at.u, j);
      for (int i = 0; i < kX; ++i) (j < kX ? out.Fx()(i, j) : out.Fu()(i, j - kX)) = next[i].imag() / kComplexStep;
    }
    const State e = at.x - goal;
    out.lx = dt * weight.cwiseProduct(e);
    out.lxx().diagonal() = dt * weight;
    out.lu = dt * control_weight * at.u;
    out.luu().diagonal().setConstant(dt * control_weight);
  }
  void linearizeTerminal(const VectorXd& x, StageModel& out) const override {
    const State e = x - goal;
    out.lx = terminal_weight.cwiseProduct(e);
    out.lxx().diagonal() = terminal_weight;
  }

 private:
  static constexpr double kComplexStep = 1e-30;

  // Euler step; entry `seed` of (x, u) carries the complex step.
  template <class S>
  std::array<S, kX> calcNext(ConstVectorRef x, ConstVectorRef u, int seed) const {
    std::array<S, kX> xs;
    std::array<S, kU> us;
    for (int i = 0; i < kX; ++i) xs[i] = x[i];
    for (int i = 0; i < kU; ++i) us[i] = u[i];
    if constexpr (!std::is_same_v<S, double>) (seed < kX ? xs[seed] : us[seed - kX]) += S(0, kComplexStep);
    const std::array<S, kX> rate = Plant::calcRate(xs, us);
    for (int i = 0; i < kX; ++i) xs[i] += dt * rate[i];
    return xs;
  }
};

inline PlantProblem<Pendulum> makePendulum() {
  PlantProblem<Pendulum> p;
  p.goal << M_PI, 0;
  p.weight << 0.1, 0.1;
  p.terminal_weight << 500, 50;
  return p;
}

inline PlantProblem<CartPole> makeCartPole() {
  PlantProblem<CartPole> p;
  p.start << 0, M_PI, 0, 0;
  p.weight << 0.1, 0.1, 0.01, 0.01;
  p.terminal_weight << 500, 500, 50, 50;
  return p;
}

inline PlantProblem<Linear> makeLinear() {
  PlantProblem<Linear> p;
  p.stages = 40;
  p.start << 1, -2, 0.5;
  p.goal << 0.3, 0, 0.1;
  p.weight << 1, 0.1, 2;
  p.terminal_weight << 10, 20, 30;
  return p;
}

/// A point x pushed out of the crest of a double well, x+ = x + dt u, with the cost 1/2 dt r u^2 and (x^2 - 1)^2 at the
/// end, whose exact Hessian is negative about the crest.
class DoubleWell : public PlainProblem {
 public:
  double dt = 0.1, control_weight = 1e-3;
  VectorXd start = VectorXd::Constant(1, 0.1);

  int numStages() const override { return 10; }
  int stateSize() const override { return 1; }
  int tangentSize(int) const override { return 1; }
  int controlSize(int) const override { return 1; }
  const VectorXd& initialState() const override { return start; }
  double calcStep(int, const VectorXd& x, const VectorXd& u, VectorXd& x_next) const override {
    x_next = x + dt * u;
    return 0.5 * dt * control_weight * u.squaredNorm();
  }
  double calcTerminalCost(const VectorXd& x) const override { return std::pow(x[0] * x[0] - 1, 2); }
  void linearizeStage(const NodeEvaluation& at, StageModel& out) const override {
    out.Fx()(0, 0) = 1;
    out.Fu()(0, 0) = dt;
    out.lx.setZero();
    out.lu = dt * control_weight * at.u;
    out.luu()(0, 0) = dt * control_weight;
  }
  void linearizeTerminal(const VectorXd& x, StageModel& out) const override {
    out.lx[0] = 4 * x[0] * (x[0] * x[0] - 1);
    out.lxx()(0, 0) = 12 * x[0] * x[0] - 4;
  }
};

/// A body turned by torques from one attitude to another. x = (quaternion x y z w, angular velocity w in the body):
///     w+ = w + dt I^{-1} (u - w x I w),    q+ = q (+) dt w+,
/// with the cost 1/2 dt (w_r |q (-) q_goal|^2 + |w|^2 + r |u|^2), and 1/2 P (|q (-) q_goal|^2 + |w|^2) at the end.
class TurningBody : public PlainProblem {
 public:
  int stages = 60;
  double dt = 0.05, attitude_weight = 1, control_weight = 0.1, terminal_weight = 100;
  Vector3d inertia{0.5, 1, 2};
  VectorXd start = VectorXd::Unit(7, 3), goal = VectorXd::Unit(4, 3);

  TurningBody() {
    joint_.kind = JointKind::Spherical;
    joint_.nq = 4;
    joint_.nv = 3;
  }
  int numStages() const override { return stages; }
  int stateSize() const override { return 7; }
  int tangentSize(int) const override { return 6; }
  int controlSize(int) const override { return 3; }
  const VectorXd& initialState() const override { return start; }
  void calcSum(const VectorXd& x, const VectorXd& dx, VectorXd& out) const override {
    integrateJoint(joint_, x.head(4), dx.head(3), out.head(4));
    out.tail(3) = x.tail(3) + dx.tail(3);
  }
  void calcDifference(const VectorXd& x0, const VectorXd& x1, VectorXd& dx) const override {
    calcJointDifference(joint_, x0.head(4), x1.head(4), dx.head(3));
    dx.tail(3) = x1.tail(3) - x0.tail(3);
  }
  double calcStep(int, const VectorXd& x, const VectorXd& u, VectorXd& x_next) const override {
    const Vector3d w = x.tail(3), torque = u;
    const Vector3d w_next = w + dt * (torque - w.cross(inertia.cwiseProduct(w))).cwiseQuotient(inertia);
    integrateJoint(joint_, x.head(4), dt * w_next, x_next.head(4));
    x_next.tail(3) = w_next;
    return 0.5 * dt * (calcAttitudeCost(x, nullptr) + w.squaredNorm() + control_weight * u.squaredNorm());
  }
  double calcTerminalCost(const VectorXd& x) const override {
    return 0.5 * terminal_weight * (calcAttitudeCost(x, nullptr) / attitude_weight + x.tail(3).squaredNorm());
  }
  void linearizeStage(const NodeEvaluation& at, StageModel& out) const override {
    const Vector3d w = at.x.tail(3);
    const Matrix3d W = (skew(inertia.cwiseProduct(w)) - skew(w) * Matrix3d(inertia.asDiagonal()));
    const Matrix3d w_w = Matrix3d::Identity() + dt * inertia.cwiseInverse().asDiagonal() * W;
    const Matrix3d w_u = dt * Matrix3d(inertia.cwiseInverse().asDiagonal());
    MatrixXd J_q(3, 3), J_dq(3, 3), J_gap(3, 3);
    calcJointIntegrateJacobians(joint_, dt * at.x_next.tail(3), J_q, J_dq);
    calcJointDifferenceJacobian(joint_, out.gap.head(3), J_gap);
    out.Fx() << J_gap * J_q, J_gap * J_dq * dt * w_w, Matrix3d::Zero(), w_w;
    out.Fu() << J_gap * J_dq * dt * w_u, w_u;
    out.lu = dt * control_weight * at.u;
    updateStateCost(at.x, dt * attitude_weight, dt, out);
    out.luu() = dt * control_weight * Matrix3d::Identity();
  }
  void linearizeTerminal(const VectorXd& x, StageModel& out) const override {
    updateStateCost(x, terminal_weight, terminal_weight, out);
  }

 private:
  double calcAttitudeCost(ConstVectorRef x, VectorXd* error) const {
    VectorXd e(3);
    calcJointDifference(joint_, goal, x.head(4), e);
    if (error) *error = e;
    return attitude_weight * e.squaredNorm();
  }
  void updateStateCost(ConstVectorRef x, double w_attitude, double w_rate, StageModel& out) const {
    VectorXd e;
    calcAttitudeCost(x, &e);
    MatrixXd J(3, 3);
    calcJointDifferenceJacobian(joint_, e, J);
    out.lx << w_attitude * J.transpose() * e, w_rate * x.tail(3);
    out.lxx().topLeftCorner(3, 3) = w_attitude * J.transpose() * J;
    out.lxx().bottomRightCorner(3, 3) = w_rate * Matrix3d::Identity();
  }

  Joint joint_;
};

}  // namespace bielle::test
