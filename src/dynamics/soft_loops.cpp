#include "dynamics/soft_loops.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>

#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/modes.h"
#include "bielle/dynamics/rnea.h"
#include "math/decompositions.h"

namespace bielle {
namespace {

// MuJoCo's bounds of impedances (mjMINIMP, mjMAXIMP).
constexpr double kLeastImpedance = 1e-4, kMostImpedance = 0.9999;
// Squares of frequencies of the springs, relative to the largest: below it, a motion does not open the loops. Its root is
// kRankTolerance of reduction.h.
constexpr double kClosedMotion = 1e-12;
constexpr double kRestTolerance = 1e-10;  // of the last step, relative to the whole displacement
constexpr int kMostSteps = 60, kMostHalvings = 30;
constexpr double kFarthest = 1;           // rad or m: loops that open so far do not hold
constexpr double kDifference = 1e-6;      // of coordinates, rad or m, and of speeds
constexpr double kLeastFrequency = 1e-3;  // 1/s: slower motions have none
constexpr double kLeastStep = 1e-5, kStepFactor = 1.25, kStepTolerance = 1e-3;
constexpr double kGrowth = 1;  // 1/s, beyond what is compared with: what grows faster falls or diverges

// y(x) of the documentation, for x from 0 to 1, and its slope.
struct Sigmoid {
  double value, slope;
};
Sigmoid calcSigmoid(double x, double midpoint, double power) {
  if (power == 1) return {x, 1};
  const bool below = x <= midpoint;
  const double side = below ? midpoint : 1 - midpoint, u = below ? x : 1 - x, a = 1 / std::pow(side, power - 1);
  const double y = a * std::pow(u, power), slope = power * a * std::pow(u, power - 1);
  return {below ? y : 1 - y, slope};
}

MatrixXd multiplyRows(const VectorXd& factors, const MatrixXd& rows) { return factors.asDiagonal() * rows; }

}  // namespace

SoftRow calcSoftRow(const SoftSettings& settings, double gap, const SoftStep& step) {
  std::array<double, 2> ref = settings.solref;
  if ((ref[0] > 0) != (ref[1] > 0)) ref = SoftSettings().solref;  // as MuJoCo does
  const auto clamp = [](double x) { return std::clamp(x, kLeastImpedance, kMostImpedance); };
  const double least = clamp(settings.solimp[0]), most = clamp(settings.solimp[1]);
  const double width = std::max(0.0, settings.solimp[2]), midpoint = clamp(settings.solimp[3]);
  const double power = std::max(1.0, settings.solimp[4]);
  double d = least, slope = 0;
  if (least == most || width < 1e-15) {
    d = (least + most) / 2;
  } else if (const double x = std::abs(gap) / width; x >= 1) {
    d = most;
  } else if (x > 0) {
    const Sigmoid y = calcSigmoid(x, midpoint, power);
    d = least + (most - least) * y.value;
    slope = (most - least) / width * y.slope;
  }
  double K = -ref[0] / (most * most), B = -ref[1] / most;
  if (ref[0] > 0) {
    const double time = step.is_safe ? std::max(ref[0], 2 * step.duration) : ref[0];
    K = 1 / std::pow(most * time * ref[1], 2);
    B = 2 / (most * time);
  }
  SoftRow row;
  row.mass = d / (1 - d);
  row.damping = B * row.mass;
  row.stiffness = K * d * row.mass;
  row.hardening = K * slope * (2 * d - d * d) / ((1 - d) * (1 - d));
  return row;
}

struct SoftLoops::State {
  MatrixXd M, H;           // nv x nv, rows x nv
  VectorXd load;           // nv, of inverse dynamics without the rows
  VectorXd force;          // rows, of the springs, and of Eq. (5)
  VectorXd mass, damping;  // rows
  MatrixXd stiffness;      // rows x rows, of the springs, by equality
  std::vector<ClosureGap> gap;
  std::vector<double> bias;
};

SoftLoops::SoftLoops(const Model& model, std::vector<SoftEquality> equalities, const SoftStep& step)
    : model_(model), equalities_(std::move(equalities)), step_(step) {
  for (const SoftEquality& equality : equalities_) rows_ += getRows(equality.closure.kind);
  for (const Closure& closure : model.closures())
    if (std::none_of(equalities_.begin(), equalities_.end(),
                     [&](const SoftEquality& equality) { return equality.closure.name == closure.name; }))
      rigid_.push_back(closure);
}

SoftLoops::State SoftLoops::evaluate(ConstVectorRef q) const {
  const VectorXd rest = VectorXd::Zero(model_.nv());
  return evaluate(q, rest, rest);
}

// dJ/dt v, by central differences; zero where MuJoCo knows it.
VectorXd SoftLoops::calcBias(const SoftEquality& equality, ConstVectorRef q, ConstVectorRef v) const {
  const int rows = getRows(equality.closure.kind);
  const double speed = v.cwiseAbs().maxCoeff();
  if (equality.has_bias || speed == 0) return VectorXd::Zero(rows);
  const double time = kDifference / speed;
  Workspace ws(model_);
  const auto calcVelocity = [&](double at) -> VectorXd {
    updatePositions(model_, ws, model_.integrate(q, at * v));
    MatrixXd H = MatrixXd::Zero(rows, model_.nv());
    calcClosureResidualJacobian(ws, equality.closure, H);
    return H * v;
  };
  return (calcVelocity(time) - calcVelocity(-time)) / (2 * time);
}

SoftLoops::State SoftLoops::evaluate(ConstVectorRef q, ConstVectorRef v, ConstVectorRef a) const {
  Workspace ws(model_);
  State state;
  state.load = calcInverseDynamics(model_, ws, q, v, a);
  updatePositions(model_, ws, q);
  updateMassMatrix(model_, ws);
  state.M = ws.M;
  state.H.setZero(rows_, model_.nv());
  for (VectorXd* x : {&state.force, &state.mass, &state.damping}) x->setZero(rows_);
  state.stiffness.setZero(rows_, rows_);
  int at = 0;
  for (const SoftEquality& equality : equalities_) {
    const int rows = getRows(equality.closure.kind);
    calcClosureResidualJacobian(ws, equality.closure, state.H.middleRows(at, rows));
    state.gap.push_back(calcClosureGap(ws, equality.closure));
    const VectorXd residual = calcClosureResidual(ws, equality.closure);
    const VectorXd share = equality.scale.cwiseAbs2().cwiseQuotient(equality.weight);
    const double gap = equality.scale.cwiseProduct(residual).norm();
    const SoftRow row = calcSoftRow(equality.settings, gap, step_);
    const VectorXd pull = share.cwiseProduct(residual);
    const VectorXd bias = calcBias(equality, q, v);
    state.bias.push_back(bias.norm());
    state.force.segment(at, rows) = row.mass * share.cwiseProduct(bias) - row.stiffness * pull;
    state.mass.segment(at, rows) = row.mass * share;
    state.damping.segment(at, rows) = row.damping * share;
    MatrixXd block = (row.stiffness * share).asDiagonal();
    if (row.hardening != 0 && gap > 0)
      block += row.hardening / gap * pull * equality.scale.cwiseAbs2().cwiseProduct(residual).transpose();
    state.stiffness.block(at, at, rows, rows) = block;
    at += rows;
  }
  return state;
}

// b - H^T f
VectorXd SoftLoops::calcLoad(ConstVectorRef q, const VectorXd& force) const {
  Workspace ws(model_);
  updatePositions(model_, ws, q);
  updateVelocities(model_, ws, VectorXd::Zero(model_.nv()));
  updateBias(model_, ws);
  MatrixXd H = MatrixXd::Zero(rows_, model_.nv());
  int at = 0;
  for (const SoftEquality& equality : equalities_) {
    const int rows = getRows(equality.closure.kind);
    calcClosureResidualJacobian(ws, equality.closure, H.middleRows(at, rows));
    at += rows;
  }
  return ws.b - H.transpose() * force;
}

// K_0 of Eq. (4), by central differences at a fixed force of the rows.
MatrixXd SoftLoops::calcStiffness(ConstVectorRef q, const VectorXd& force, const MatrixXd& directions) const {
  MatrixXd out(directions.cols(), directions.cols());
  for (Eigen::Index k = 0; k < directions.cols(); ++k) {
    const double step = kDifference / directions.col(k).cwiseAbs().maxCoeff();
    const VectorXd change = calcLoad(model_.integrate(q, step * directions.col(k)), force) -
                            calcLoad(model_.integrate(q, -step * directions.col(k)), force);
    out.col(k) = directions.transpose() * change / (2 * step);
  }
  return out;
}

// Without dry friction, which MuJoCo does not damp.
MatrixXd SoftLoops::calcDamping(ConstVectorRef q, const MatrixXd& directions) const {
  Workspace ws(model_);
  const VectorXd rest = VectorXd::Zero(model_.nv());
  MatrixXd out(directions.cols(), directions.cols());
  for (Eigen::Index k = 0; k < directions.cols(); ++k) {
    const double speed = kDifference / directions.col(k).cwiseAbs().maxCoeff();
    const VectorXd v = speed * directions.col(k);
    VectorXd change = calcInverseDynamics(model_, ws, q, v, rest) - calcInverseDynamics(model_, ws, q, -v, rest);
    for (const JointForce& force : model_.jointForces())
      change[force.dof] -= 2 * force.friction * v[force.dof] / std::hypot(v[force.dof], force.friction_speed);
    out.col(k) = directions.transpose() * change / (2 * speed);
  }
  return out;
}

MatrixXd SoftLoops::makeDirections(ConstVectorRef q, const std::vector<int>& dofs) const {
  MatrixXd selected = MatrixXd::Zero(model_.nv(), static_cast<Eigen::Index>(dofs.size()));
  for (size_t k = 0; k < dofs.size(); ++k) selected(dofs[k], static_cast<Eigen::Index>(k)) = 1;
  if (rigid_.empty() || dofs.empty()) return selected;
  Workspace ws(model_);
  updatePositions(model_, ws, q);
  int rows = 0;
  for (const Closure& closure : rigid_) rows += getRows(closure.kind);
  MatrixXd H = MatrixXd::Zero(rows, model_.nv());
  rows = 0;
  for (const Closure& closure : rigid_) {
    calcClosureResidualJacobian(ws, closure, H.middleRows(rows, getRows(closure.kind)));
    rows += getRows(closure.kind);
  }
  const MatrixXd kept = H * selected;
  Eigen::JacobiSVD<MatrixXd> svd(kept, Eigen::ComputeFullV);
  const double least = 1e-6 * std::max(1e-300, svd.singularValues().size() > 0 ? svd.singularValues()[0] : 0);
  const Eigen::Index rank = (svd.singularValues().array() > least).count();
  return selected * svd.matrixV().rightCols(selected.cols() - rank);
}

namespace {

// Directions orthonormal in the mass matrix, those that open the loops and those that do not, by the springs H^T S H.
struct SplitDirections {
  MatrixXd opening, closed;
};
SplitDirections splitDirections(const MatrixXd& M, const MatrixXd& H, const MatrixXd& S, const MatrixXd& directions) {
  const Eigen::Index n = directions.cols();
  if (n == 0) return {directions, directions};
  const MatrixXd reduced = directions.transpose() * M * directions;
  const Eigen::LLT<MatrixXd> factors(reduced);
  const MatrixXd basis = directions * MatrixXd(factors.matrixU().solve(MatrixXd::Identity(n, n)));
  const MatrixXd rows = H * basis;
  const MatrixXd K = rows.transpose() * S * rows;
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(0.5 * (K + K.transpose()));
  const double least = kClosedMotion * std::max(1e-300, solver.eigenvalues()[n - 1]);
  const Eigen::Index closed = (solver.eigenvalues().array() <= least).count();
  return {basis * solver.eigenvectors().rightCols(n - closed), basis * solver.eigenvectors().leftCols(closed)};
}

}  // namespace

MatrixXd SoftLoops::makeClosedMotions(ConstVectorRef q, const MatrixXd& directions) const {
  const State state = evaluate(q);
  return splitDirections(state.M, state.H, state.stiffness, directions).closed;
}

SoftRest SoftLoops::findRest(ConstVectorRef q, const MatrixXd& directions, ConstVectorRef tau) const {
  const VectorXd none = VectorXd::Zero(model_.nv());
  return findRest(q, none, none, directions, tau);
}

SoftRest SoftLoops::findRest(ConstVectorRef q, ConstVectorRef v, ConstVectorRef a, const MatrixXd& directions,
                             ConstVectorRef tau) const {
  SoftRest rest;
  State state = evaluate(q, v, a);
  rest.bias = state.bias;
  const MatrixXd T = splitDirections(state.M, state.H, state.stiffness, directions).opening;
  const auto solve = [&T](const State& at, const VectorXd& load) -> VectorXd {
    const MatrixXd rows = at.H * T;
    const MatrixXd K = rows.transpose() * at.stiffness * rows;
    return K.ldlt().solve(T.transpose() * load);
  };
  // Rigid loops have the forces of the first, linear step.
  VectorXd rigid = VectorXd::Zero(rows_);
  if (T.cols() > 0) rigid = -(state.stiffness * (state.H * (T * solve(state, tau - state.load))));
  rest.rigid_load = state.load - state.H.transpose() * rigid;
  int at = 0;
  for (const SoftEquality& equality : equalities_) {
    const int rows = getRows(equality.closure.kind);
    const VectorXd share = equality.weight.cwiseQuotient(equality.scale.cwiseAbs2());
    rest.pull.push_back(share.cwiseProduct(rigid.segment(at, rows)).norm());
    at += rows;
  }
  rest.q = q;
  rest.status = T.cols() == 0 ? NumericalStatus::Ok : NumericalStatus::NotClosed;
  // Newton's method without the stiffness of other forces, which is small beside that of the springs.
  const auto measure = [&](const State& s) {
    return VectorXd(T.transpose() * (tau - s.load + s.H.transpose() * s.force));
  };
  for (int i = 0; i < kMostSteps && rest.status != NumericalStatus::Ok; ++i) {
    const double size = measure(state).norm();
    VectorXd step = T * solve(state, tau - state.load + state.H.transpose() * state.force);
    if (!step.allFinite() || step.cwiseAbs().maxCoeff() > 10 * kFarthest) break;
    int halvings = 0;
    for (;; ++halvings, step /= 2) {
      const VectorXd next = model_.integrate(rest.q, step);
      State there = evaluate(next, v, a);
      if (measure(there).norm() < size || halvings == kMostHalvings) {
        rest.q = next;
        state = std::move(there);
        break;
      }
    }
    const double moved = model_.difference(q, rest.q).cwiseAbs().maxCoeff();
    if (moved > kFarthest) break;
    if (step.cwiseAbs().maxCoeff() <= std::max(kRestTolerance * moved, 1e-15) || halvings == kMostHalvings)
      rest.status = NumericalStatus::Ok;
  }
  rest.displacement = model_.difference(q, rest.q);
  rest.load = state.load - state.H.transpose() * state.force;
  rest.gap = state.gap;
  at = 0;
  for (const SoftEquality& equality : equalities_) {
    rest.force.push_back(state.force.segment(at, getRows(equality.closure.kind)));
    at += getRows(equality.closure.kind);
  }
  return rest;
}

namespace {

// The solver gives up now and then. In another order of the coordinates, or transposed, it iterates otherwise to the same
// eigenvalues, and unlike one of complex matrices it is compiled already.
Eigen::VectorXcd calcEigenvalues(const MatrixXd& A) {
  Eigen::EigenSolver<MatrixXd> solver(A, false);
  if (solver.info() != Eigen::Success) solver.compute(MatrixXd(A.reverse()), false);
  if (solver.info() != Eigen::Success) solver.compute(MatrixXd(A.transpose()), false);
  if (solver.info() == Eigen::Success) return solver.eigenvalues();
  return Eigen::VectorXcd::Constant(A.rows(), std::numeric_limits<double>::infinity());  // as if unstable
}

// Eq. (4) in directions that are orthonormal in the mass matrix.
struct SmallMotions {
  MatrixXd stiffness, damping;  // without the rows
  MatrixXd implicit;            // damping that the integrator takes at the end of its step
  MatrixXd row_mass, row_damping, row_stiffness;
  SoftIntegrator integrator;

  // The matrix of (x / h, v) is that of Eq. (4) times h, so that all entries have the same size; or that of a step of the duration h.
  enum class Time { Continuous, Step };
  MatrixXd makeMatrix(double h, Time time) const {
    const Eigen::Index n = stiffness.rows();
    const MatrixXd one = MatrixXd::Identity(n, n);
    const Eigen::LLT<MatrixXd> factors(one + row_mass);
    MatrixXd position = -h * h * MatrixXd(factors.solve(stiffness + row_stiffness));
    MatrixXd velocity = -h * MatrixXd(factors.solve(damping + row_damping));
    MatrixXd out(2 * n, 2 * n);
    if (time == Time::Continuous) {
      out << MatrixXd::Zero(n, n), one, position, velocity;
      return out;
    }
    const Eigen::PartialPivLU<MatrixXd> end(one + h * implicit);
    position = end.solve(position).eval();
    velocity = one + end.solve(velocity);
    out << one + position, velocity, position, velocity;
    return out;
  }
  // Rates s of the motions e^{s t}.
  Eigen::VectorXcd calcRates(double h) const { return calcEigenvalues(makeMatrix(h, Time::Continuous)) / h; }
  // Of steps of the duration h, from their eigenvalues e^{s h}.
  Eigen::VectorXcd calcSteppedRates(double h) const {
    const bool explicitly = integrator == SoftIntegrator::RungeKutta;
    Eigen::VectorXcd s = calcEigenvalues(makeMatrix(h, explicitly ? Time::Continuous : Time::Step));
    for (std::complex<double>& z : s) {
      if (explicitly) z = 1.0 + z * (1.0 + z / 2.0 * (1.0 + z / 3.0 * (1.0 + z / 4.0)));
      z = std::log(z) / h;
    }
    return s;
  }
};

double getFastest(const Eigen::VectorXcd& rates) { return rates.real().maxCoeff(); }

}  // namespace

SoftMotion SoftLoops::calcMotion(ConstVectorRef q, const SoftRest& rest, const MatrixXd& directions) const {
  SoftMotion motion;
  const State closed = evaluate(q), open = evaluate(rest.q);
  const SplitDirections split = splitDirections(closed.M, closed.H, closed.stiffness, directions);
  VectorXd force(rows_);
  int at = 0;
  for (const VectorXd& each : rest.force) {
    force.segment(at, each.size()) = each;
    at += static_cast<int>(each.size());
  }
  const MatrixXd& N = split.closed;
  std::vector<Mode> rigid;
  if (N.cols() > 0) rigid = calcModes(N, calcStiffness(q, force, N), calcDamping(q, N));
  double fastest = 0;
  for (const Mode& mode : rigid) fastest = std::max(fastest, mode.eigenvalue.real());

  const MatrixXd reduced = directions.transpose() * open.M * directions;
  const Eigen::LLT<MatrixXd> factors(reduced);
  const Eigen::Index n = directions.cols();
  const MatrixXd Z = directions * MatrixXd(factors.matrixU().solve(MatrixXd::Identity(n, n)));
  const MatrixXd rows = open.H * Z;
  SmallMotions small;
  small.integrator = step_.integrator;
  small.stiffness = calcStiffness(rest.q, force, Z);
  small.damping = calcDamping(rest.q, Z);
  VectorXd dampers = VectorXd::Zero(model_.nv());
  for (const JointForce& joint : model_.jointForces()) dampers[joint.dof] += joint.damping;
  small.implicit =
      step_.integrator == SoftIntegrator::Implicit ? small.damping : MatrixXd(Z.transpose() * multiplyRows(dampers, Z));
  small.row_mass = rows.transpose() * multiplyRows(open.mass, rows);
  // Another duration of the step changes the time constant, and with it B and K of each equality.
  const auto makeSteps = [&](double h) {
    VectorXd damping = open.damping;
    MatrixXd stiffness = open.stiffness;
    int row = 0;
    for (const SoftEquality& equality : equalities_) {
      const int count = getRows(equality.closure.kind);
      SoftStep other = step_;
      other.duration = h;
      const SoftRow now = calcSoftRow(equality.settings, 0, step_), then = calcSoftRow(equality.settings, 0, other);
      damping.segment(row, count) *= then.damping / now.damping;
      stiffness.block(row, row, count, count) *= then.stiffness / now.stiffness;
      row += count;
    }
    small.row_damping = rows.transpose() * multiplyRows(damping, rows);
    small.row_stiffness = rows.transpose() * stiffness * rows;
    return small;
  };

  const double softest = getFastest(makeSteps(kLeastStep).calcRates(kLeastStep));
  motion.falls = softest > fastest + kGrowth;
  const double most = std::max(fastest, softest) + kGrowth;
  const auto diverges = [&](double h) { return getFastest(makeSteps(h).calcSteppedRates(h)) > most; };
  const Eigen::VectorXcd rates = makeSteps(step_.duration).calcSteppedRates(step_.duration);
  motion.diverges = getFastest(rates) > most;
  for (const Mode& mode : rigid) {
    if (std::abs(mode.eigenvalue) < kLeastFrequency) continue;
    const std::complex<double> nearest = *std::min_element(rates.begin(), rates.end(), [&](auto a, auto b) {
      return std::abs(a - mode.eigenvalue) < std::abs(b - mode.eigenvalue);
    });
    const bool swings = mode.frequency > 0;
    const double error = swings ? nearest.imag() / mode.eigenvalue.imag() - 1
                                : (nearest.real() - mode.eigenvalue.real()) / std::abs(mode.eigenvalue.real());
    const double loss = 2 * (mode.eigenvalue.real() - nearest.real());
    if (std::abs(error) >= std::abs(motion.frequency_error))
      motion.frequency_error = error, motion.frequency = mode.frequency;
    if (swings && std::abs(loss) > std::abs(motion.energy_loss)) motion.energy_loss = loss;
  }
  double step = kLeastStep;
  while (step < kLongestStep && !diverges(step)) step *= kStepFactor;
  double stable = step / kStepFactor;
  if (step >= kLongestStep) {
    stable = step = kLongestStep;
  } else if (step == kLeastStep) {
    stable = step = 0;
  }
  while (step - stable > kStepTolerance * step) {
    const double middle = (step + stable) / 2;
    (diverges(middle) ? step : stable) = middle;
  }
  motion.stable_step = stable;
  return motion;
}

}  // namespace bielle
