#include "validate.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iomanip>
#include <limits>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/dynamics/rnea.h"
#include "math/decompositions.h"
#include "model_copy.h"
#include "motion.h"
#include "samples.h"
#include "simbody_bridge.h"

namespace bielle::validation {
namespace {

// Share of the response without constraints that is the least scale, see Comparison::add. With redundant rows the
// derivatives have rounding amplified by the proximal term, 1e-16 / 1e-7 of that response, visible where they vanish.
constexpr double kFloor = 1e-2;

// Wrenches of a range of closures, 6 x n.
MatrixXd stack(const std::vector<Vector6d>& wrenches, size_t begin, size_t end) {
  MatrixXd out(6, end - begin);
  for (size_t i = begin; i < end; ++i) out.col(i - begin) = wrenches[i];
  return out;
}

std::vector<Vector6d> expandForces(const ConstraintSet& set, ConstVectorRef lambda) {
  std::vector<Vector6d> out;
  for (size_t c = 0; c < set.closures.size(); ++c)
    out.push_back(expandRows(set.closures[c], lambda.segment(set.offsets[c], getRows(set.closures[c].kind))));
  return out;
}

// Orthonormal basis of the x with A x = 0.
MatrixXd calcNullSpace(const MatrixXd& A) {
  if (A.rows() == 0) return MatrixXd::Identity(A.cols(), A.cols());
  const Eigen::JacobiSVD<MatrixXd> svd(A, Eigen::ComputeFullV);
  const auto& sigma = svd.singularValues();
  return svd.matrixV().rightCols(A.cols() - (sigma.array() > 1e-7 * sigma[0]).count());
}

// Accelerations are compared as M_ii^(1/2) a_i, because rounding of forces has a large effect on the lightest link.
VectorXd getInertiaWeights(const Workspace& ws) { return ws.M.diagonal().cwiseSqrt(); }

bool isRedundant(const MatrixXd& J) { return calcNullSpace(J.transpose()).cols() > 0; }

// df/dt at t = 0, by central differences of the sixth order.
VectorXd differentiate(double h, const std::function<VectorXd(double)>& f) {
  return (45 * (f(h) - f(-h)) - 9 * (f(2 * h) - f(-2 * h)) + (f(3 * h) - f(-3 * h))) / (60 * h);
}

class Comparison {
 public:
  Comparison(const Model& model, const Model& oracle, const ValidationOptions& options, ValidationReport& report)
      : model_(model),
        oracle_(oracle),
        plain_(makeModelWithoutArmature(model)),
        plain_oracle_(makeModelWithoutArmature(oracle)),
        options_(options),
        report_(report) {}

  void compare(const Sample& sample, bool with_derivatives) {
    const ConstraintSet set = makeConstraintSet(model_, sample.contacts);
    SimbodyBridge simbody(oracle_, makeConstraintSet(oracle_, sample.contacts).closures);
    simbody.setState(sample.q, sample.v, sample.tau);
    compareKinematics(sample, simbody);
    compareUnconstrained(sample, simbody);
    const bool redundant = compareForward(model_, sample, set, simbody.solveWithArmature(), "with rotors");
    ++report_.states;
    report_.redundant_states += redundant;
    if (with_derivatives) compareDerivatives(sample, set, redundant, simbody);

    SimbodyBridge plain(plain_oracle_, makeConstraintSet(plain_oracle_, sample.contacts).closures);
    plain.setState(sample.q, sample.v, sample.tau);
    compareForward(plain_, sample, set, plain.solveBySimbody(), "Simbody solver");
  }

  // Contacts do not hold in a free motion, closures do.
  void compareFreeMotion(const Sample& sample) {
    MotionOptions options;
    options.duration = options_.motion_duration;
    options.step = options_.motion_step;
    const MotionReport motion = compareMotion(plain_, sample.q, sample.v, options);
    const double failed = std::numeric_limits<double>::infinity();
    report_.rows.push_back({"free motion, distance at the end", motion.ok ? motion.distance / motion.travelled : failed,
                            options_.motion_tolerance, 1});
    report_.rows.push_back({"free motion, energy error",
                            motion.ok ? motion.energy_error / motion.kinetic_energy : failed, options_.motion_tolerance,
                            1});
  }

 private:
  void add(const std::string& quantity, const MatrixXd& ours, const MatrixXd& theirs, double floor, double tolerance) {
    addDifference(report_, quantity, ours, theirs, floor, tolerance);
  }
  void add(const std::string& quantity, const MatrixXd& ours, const MatrixXd& theirs, double floor = 1e-6) {
    add(quantity, ours, theirs, floor, options_.tolerance);
  }

  void compareKinematics(const Sample& sample, const SimbodyBridge& simbody) {
    Workspace ws(model_);
    updatePositions(model_, ws, sample.q);
    updateVelocities(model_, ws, sample.v);
    const int n = model_.numBodies() - 1;
    MatrixXd X(3, 4 * n), X_s(3, 4 * n), V(6, n), V_s(6, n);
    for (int i = 0; i < n; ++i) {
      const SE3 placement = simbody.getPlacement(i + 1);
      X.middleCols(4 * i, 4) << ws.X_WB[i + 1].R, ws.X_WB[i + 1].p;
      X_s.middleCols(4 * i, 4) << placement.R, placement.p;
      V.col(i) = calcFrameVelocity(ws, i + 1, SE3::Identity());
      V_s.col(i) = simbody.calcTwist(i + 1);
    }
    add("body placements", X, X_s);
    add("body velocities", V, V_s);
    const auto scalar = [](double value) { return MatrixXd::Constant(1, 1, value); };
    add("kinetic energy", scalar(calcKineticEnergy(model_, ws)), scalar(simbody.calcKineticEnergy()));
    add("potential energy", scalar(calcPotentialEnergy(model_, ws)), scalar(simbody.calcPotentialEnergy()));
  }

  void compareUnconstrained(const Sample& sample, const SimbodyBridge& simbody) {
    Workspace ws(model_);
    updatePositions(model_, ws, sample.q);
    updateVelocities(model_, ws, sample.v);
    updateMassMatrix(model_, ws);
    updateBias(model_, ws);
    add("mass matrix", ws.M, simbody.calcMassMatrix());
    add("bias", ws.b, simbody.calcBias());
    add("inverse dynamics", calcInverseDynamics(model_, ws, sample.q, sample.v, sample.a),
        simbody.calcInverseDynamics(sample.a));
  }

  // Returns whether the rows were redundant.
  bool compareForward(const Model& model, const Sample& sample, const ConstraintSet& set, const OracleSolution& theirs,
                      const std::string& label) {
    Workspace ws(model);
    ConstrainedWorkspace cws;
    const NumericalStatus status = updateConstrainedDynamics(model, ws, cws, set, sample.q, sample.v, sample.tau);
    if (status != NumericalStatus::Ok) cws.a.setConstant(std::numeric_limits<double>::quiet_NaN());
    const std::string suffix = ", " + label;
    const VectorXd free_force = sample.tau - ws.b, free = ws.M.llt().solve(free_force);
    const double force = kFloor * free_force.cwiseAbs().maxCoeff();
    const double tolerance = std::max(options_.tolerance, theirs.rounding);
    const VectorXd weight = getInertiaWeights(ws);
    add("accelerations" + suffix, weight.cwiseProduct(cws.a), weight.cwiseProduct(theirs.a),
        kFloor * weight.cwiseProduct(free).cwiseAbs().maxCoeff(), tolerance);
    if (set.rows == 0) return false;
    add("constraint forces J'lambda" + suffix, cws.J.transpose() * cws.lambda, theirs.constraint_force, force,
        tolerance);
    if (isRedundant(cws.J)) return true;
    const std::vector<Vector6d> ours = expandForces(set, cws.lambda);
    add("closure forces" + suffix, stack(ours, 0, set.num_loops), stack(theirs.wrenches, 0, set.num_loops), force,
        tolerance);
    add("foot forces" + suffix, stack(ours, set.num_loops, ours.size()),
        stack(theirs.wrenches, set.num_loops, ours.size()), force, tolerance);
    return false;
  }

  void compareDerivatives(const Sample& sample, const ConstraintSet& set, bool redundant, SimbodyBridge& simbody) {
    const int nv = model_.nv(), nu = model_.nu(), nw = redundant ? 0 : 6 * static_cast<int>(set.closures.size());
    Workspace ws(model_), other(model_);
    ConstrainedWorkspace cws;
    if (updateConstrainedDynamics(model_, ws, cws, set, sample.q, sample.v, sample.tau) != NumericalStatus::Ok ||
        updateConstrainedDerivatives(model_, ws, cws, set) != NumericalStatus::Ok)
      return;  // reported by the row of the accelerations
    // Accelerations, then wrenches.
    const auto solve = [&](const VectorXd& q, const VectorXd& v, const VectorXd& tau) {
      simbody.setState(q, v, tau);
      const OracleSolution solution = simbody.solveWithArmature();
      VectorXd out(nv + nw);
      out << solution.a, stack(solution.wrenches, 0, nw / 6).reshaped();
      return out;
    };
    const auto expand = [&](const VectorXd& da, const VectorXd& dlambda) {
      VectorXd out(nv + nw);
      out.head(nv) = da;
      if (nw > 0) out.tail(nw) = stack(expandForces(set, dlambda), 0, nw / 6).reshaped();
      return out;
    };
    const MatrixXd N = calcNullSpace(cws.J);
    const int n = static_cast<int>(N.cols());
    MatrixXd dq(nv + nw, n), dq_s(dq), dv(dq), dv_s(dq), du(nv + nw, nu), du_s(du);
    for (int k = 0; k < n; ++k) {
      const VectorXd direction = N.col(k);
      const VectorXd rate = differentiate(options_.derivative_step, [&](double t) {
        VectorXd q = model_.integrate(sample.q, t * direction);
        retract(model_, other, set, q);
        const VectorXd v = projectVelocity(model_, other, set, q, sample.v);
        VectorXd out(3 * nv + nw);
        out << model_.difference(sample.q, q), v, solve(q, v, sample.tau);
        return out;
      });
      const VectorXd q_rate = rate.head(nv), v_rate = rate.segment(nv, nv);
      dq_s.col(k) = rate.tail(nv + nw);
      dq.col(k) = expand(cws.da_dq * q_rate + cws.da_dv * v_rate, cws.dlambda_dq * q_rate + cws.dlambda_dv * v_rate);
      dv.col(k) = expand(cws.da_dv * direction, cws.dlambda_dv * direction);
      dv_s.col(k) = differentiate(options_.derivative_step,
                                  [&](double t) { return solve(sample.q, sample.v + t * direction, sample.tau); });
    }
    for (int m = 0; m < nu; ++m) {  // linear in the torques: any step is exact
      du.col(m) = expand(cws.da_du.col(m), cws.dlambda_du.col(m));
      const VectorXd torque = VectorXd::Unit(nv, model_.motors()[m].dof);
      du_s.col(m) = differentiate(1, [&](double t) { return solve(sample.q, sample.v, sample.tau + t * torque); });
    }
    const double tolerance = options_.derivative_tolerance;
    MatrixXd B = MatrixXd::Zero(nv, nu);
    for (int m = 0; m < nu; ++m) B(model_.motors()[m].dof, m) = 1;
    const VectorXd weight = getInertiaWeights(ws);
    const auto weigh = [&](const MatrixXd& da) -> MatrixXd { return weight.asDiagonal() * da.topRows(nv); };
    const double response = nu > 0 ? kFloor * weigh(ws.M.llt().solve(B)).cwiseAbs().maxCoeff() : 0;
    const double a = kFloor * weigh(cws.a).cwiseAbs().maxCoeff(),
                 force = kFloor * (sample.tau - ws.b).cwiseAbs().maxCoeff();
    add("da/dq along the closures", weigh(dq), weigh(dq_s), a, tolerance);
    add("da/dv along the closures", weigh(dv), weigh(dv_s), a, tolerance);
    add("da/du", weigh(du), weigh(du_s), response, tolerance);
    add("dlambda/dq along the closures", dq.bottomRows(nw), dq_s.bottomRows(nw), force, tolerance);
    add("dlambda/dv along the closures", dv.bottomRows(nw), dv_s.bottomRows(nw), force, tolerance);
    add("dlambda/du", du.bottomRows(nw), du_s.bottomRows(nw), kFloor, tolerance);
  }

  const Model &model_, &oracle_;
  const Model plain_, plain_oracle_;
  const ValidationOptions& options_;
  ValidationReport& report_;
};

}  // namespace

bool ValidationReport::passed() const {
  return failure.empty() && !rows.empty() &&
         std::all_of(rows.begin(), rows.end(), [](const ValidationRow& row) { return row.passed(); });
}

const ValidationRow* ValidationReport::findRow(const std::string& quantity) const {
  const auto row =
      std::find_if(rows.begin(), rows.end(), [&](const ValidationRow& r) { return r.quantity == quantity; });
  return row == rows.end() ? nullptr : &*row;
}

ValidationReport validateAgainst(const Model& model, const Model& oracle, const ValidationOptions& options) {
  ValidationReport report;
  report.robot = model.name();
  try {
    SampleSource source(model, options);
    report.failure = source.failure;
    if (!report.failure.empty()) return report;
    Comparison comparison(model, oracle, options, report);
    for (int i = 0; i < options.samples; ++i) {
      const Sample sample = source.draw();
      comparison.compare(sample, i < options.derivative_samples);
      if (i == 0 && options.motion_duration > 0) comparison.compareFreeMotion(sample);
    }
  } catch (const std::exception& error) {  // Simbody throws if it cannot solve
    report.failure = error.what();
  }
  return report;
}

ValidationReport validateRobot(const Model& model, const ValidationOptions& options) {
  return validateAgainst(model, model, options);
}

void printReport(std::ostream& out, const ValidationReport& report) {
  out << report.robot << ": " << report.states << " states";
  if (report.redundant_states > 0) out << ", " << report.redundant_states << " with redundant constraint rows";
  out << (report.passed() ? ", agrees with " : ", DISAGREES with ") << report.engine << "\n";
  if (!report.failure.empty()) out << "  " << report.failure << "\n";
  for (const ValidationRow& row : report.rows) {
    out << "  " << std::left << std::setw(44) << row.quantity << std::right << std::scientific << std::setprecision(1)
        << std::setw(9) << row.difference;
    if (std::isfinite(row.tolerance)) out << "  (" << row.tolerance << ")";
    out << std::setw(std::isfinite(row.tolerance) ? 6 : 17) << row.samples;
    if (std::isfinite(row.tolerance)) out << "  " << (row.passed() ? "pass" : "FAIL");
    out << "\n";
  }
  out << std::defaultfloat;
}

}  // namespace bielle::validation
