#include "bielle/motion/lift.h"

#include <cmath>
#include <memory>

#include "bielle/dynamics/constrained.h"
#include "bielle/dynamics/rnea.h"
#include "bielle/model/error.h"
#include "math/decompositions.h"
#include "math/largest.h"
#include "model/number_text.h"
#include "motion/posture_lift.h"
#include "motion/slsqp.h"

namespace bielle {
namespace {

constexpr double kRankTolerance = 1e-9;  // of motors and feet in Eq. (2), relative singular values
constexpr double kTorqueStep = 1e-3;     // N m, of the differences of Eq. (1)
constexpr double kWeakDirection = 1e-9;  // of the torques in Eq. (1), relative singular values: left alone

std::string describe(const char* what, double value, double tolerance) {
  TextStream text;
  text << what << " has an error of " << value << ", more than " << tolerance;
  return text.str();
}

class Lifter {
 public:
  Lifter(const Model& closed, const SerialModel& serial, const SerialTrajectory& trajectory, const LiftOptions& options)
      : closed_(closed),
        serial_(serial.model),
        trajectory_(trajectory),
        options_(options),
        posture_(closed, serial),
        ws_(closed) {
    result_.dt = trajectory.dt;
    for (const ConstraintSet& contacts : trajectory.constraints)
      result_.constraints.push_back(makeConstraints(contacts));
  }

  LiftResult run() {
    const int stages = static_cast<int>(trajectory_.a.size());
    VectorXd x;
    for (int k = 0; k <= stages; ++k) {
      result_.nodes.emplace_back();
      if (!setState(k, x)) break;
      result_.trajectory.xs.push_back(x);
      if (k == stages) return std::move(result_);
      VectorXd u;
      if (!findTorques(k, x, u)) break;
      result_.trajectory.us.push_back(u);
    }
    // The last valid node is the terminal one of the lifted part.
    std::vector<VectorXd>&xs = result_.trajectory.xs, &us = result_.trajectory.us;
    us.resize(xs.empty() ? 0 : std::min(us.size(), xs.size() - 1));
    result_.constraints.resize(us.size());
    result_.dt.resize(us.size());
    return std::move(result_);
  }

 private:
  ConstraintSet makeConstraints(const ConstraintSet& contacts) const {
    std::vector<ContactTarget> targets;
    for (const Closure& contact : contacts.closures)
      targets.push_back({closed_.findContact(contact.name), contact.X_B2, contact.kp, contact.kd});
    return makeConstraintSet(closed_, targets);
  }

  bool fail(NumericalStatus status, const std::string& why) {
    result_.nodes.back().status = status;
    result_.nodes.back().message = why;
    return false;
  }
  bool failAtLinkage(NumericalStatus status, const PostureLift& posture) {
    result_.nodes.back().joint = posture.joint();
    return fail(status, posture.why());
  }

  // The closed state of node k: lifted separately, or reached by the previous step.
  bool setState(int k, VectorXd& x) {
    LiftNode& node = result_.nodes.back();
    const bool stepped = options_.method == LiftMethod::Nlopt && k > 0;
    if (stepped) x = next_;
    const NumericalStatus status = stepped ? posture_.setClosedConfiguration(x.head(closed_.nq()), options_.singular)
                                           : posture_.setConfiguration(trajectory_.q[k], options_.singular);
    node.margin = posture_.margin();
    if (status != NumericalStatus::Ok) return failAtLinkage(status, posture_);
    if (!stepped) {
      x.resize(closed_.nq() + closed_.nv());
      x << posture_.q(), posture_.liftVelocity(trajectory_.v[k]);
    }
    const VectorXd error = calcTrackingError(k, x);
    node.position_error = calcLargest(error.head(serial_.nv()));
    node.velocity_error = calcLargest(error.tail(serial_.nv()));
    if (!(node.position_error <= options_.position_tolerance))
      return failToFollow(k, "the posture", node.position_error);
    if (!(node.velocity_error <= options_.velocity_tolerance))
      return failToFollow(k, "the velocity", node.velocity_error);
    return true;
  }

  // The state is too far from the serial one: out of reach, or merely inaccurate.
  bool failToFollow(int k, const char* what, double error) {
    PostureLift other = posture_;
    const NumericalStatus status = other.setConfiguration(trajectory_.q[k], options_.singular);
    if (status != NumericalStatus::Ok) return failAtLinkage(status, other);
    const bool posture = error == result_.nodes.back().position_error;
    return fail(NumericalStatus::Inaccurate,
                describe(what, error, posture ? options_.position_tolerance : options_.velocity_tolerance));
  }

  VectorXd calcTrackingError(int k, const VectorXd& x) const {
    VectorXd error(2 * serial_.nv());
    error << serial_.difference(trajectory_.q[k], restrictConfiguration(closed_, serial_, x.head(closed_.nq()))),
        restrictVelocity(closed_, serial_, x.tail(closed_.nv())) - trajectory_.v[k];
    return error;
  }

  bool findTorques(int k, const VectorXd& x, VectorXd& u) {
    u = calcInverseTorques(k, x);
    if (options_.method == LiftMethod::Nlopt && !followBySlsqp(k, x, u)) return false;
    LiftNode& node = result_.nodes.back();
    const NumericalStatus status =
        updateConstrainedDynamics(closed_, ws_, cws_, result_.constraints[k], x.head(closed_.nq()),
                                  x.tail(closed_.nv()), calcMotorForces(closed_, u));
    if (status != NumericalStatus::Ok) return fail(status, getMessage(status));
    node.acceleration_error = calcLargest(restrictVelocity(closed_, serial_, cws_.a) - trajectory_.a[k]);
    const double tolerance = options_.acceleration_tolerance * (1 + calcLargest(trajectory_.a[k]));
    if (options_.method == LiftMethod::Newton && !(node.acceleration_error <= tolerance))
      return fail(NumericalStatus::Inaccurate, describe("an acceleration", node.acceleration_error, tolerance));
    return true;
  }

  // Eq. (2) at the current posture: the foot forces nearest to the serial ones for which motors can provide the rest.
  VectorXd calcInverseTorques(int k, const VectorXd& x) {
    const ConstraintSet& set = result_.constraints[k];
    VectorXd v, a;
    posture_.liftMotion(restrictVelocity(closed_, serial_, x.tail(closed_.nv())), trajectory_.a[k], v, a);
    const VectorXd force = calcInverseDynamics(closed_, ws_, x.head(closed_.nq()), v, a);
    const MatrixXd T = posture_.calcTangent();
    MatrixXd motors(serial_.nv(), closed_.nu()), J = MatrixXd::Zero(set.rows, closed_.nv());
    for (int m = 0; m < closed_.nu(); ++m) motors.col(m) = T.row(closed_.motors()[m].dof).transpose();
    for (size_t c = set.num_loops; c < set.closures.size(); ++c)
      calcClosureJacobian(ws_, set.closures[c], J.middleRows(set.offsets[c], getRows(set.closures[c].kind)));
    const Eigen::Index rows = trajectory_.forces[k].size();
    const MatrixXd feet = (J.bottomRows(rows) * T).transpose();
    VectorXd rest = T.transpose() * force - feet * trajectory_.forces[k];
    Eigen::JacobiSVD<MatrixXd> svd(motors, Eigen::ComputeFullU | Eigen::ComputeThinV);
    svd.setThreshold(kRankTolerance);
    const MatrixXd unreached = svd.matrixU().rightCols(serial_.nv() - svd.rank()).transpose();
    if (rows > 0 && unreached.rows() > 0) {
      Eigen::JacobiSVD<MatrixXd> share(unreached * feet, Eigen::ComputeThinU | Eigen::ComputeThinV);
      share.setThreshold(kRankTolerance);
      rest -= feet * share.solve(unreached * rest);
    }
    return svd.solve(rest);
  }

  // Eq. (1) from u, in the preconditioned coordinates z of u + P z; stores the resulting state in next_.
  bool followBySlsqp(int k, const VectorXd& x, VectorXd& u) {
    if (!problem_) {  // bound to the first state
      problem_ = std::make_unique<RobotProblem>(closed_, x.head(closed_.nq()), x.tail(closed_.nv()),
                                                makeStages(result_.dt, result_.constraints), Formulation::Reduced);
      evaluator_ = std::make_unique<RobotEvaluator>(*problem_);
      next_ = x;
    }
    bool failed = false;
    const auto follow = [&](const VectorXd& torques) {
      const RobotEvaluation& step = evaluator_->evaluate(k, x, torques);
      failed |= step.status != NumericalStatus::Ok;
      if (!failed) next_ = step.x_next;
      return failed ? VectorXd(VectorXd::Zero(2 * serial_.nv())) : calcTrackingError(k + 1, next_);
    };
    const auto differentiate = [&](const VectorXd& torques) {
      MatrixXd G(2 * serial_.nv(), u.size());
      for (Eigen::Index m = 0; m < u.size(); ++m) {
        const VectorXd step = kTorqueStep * VectorXd::Unit(u.size(), m);
        G.col(m) = (follow(torques + step) - follow(torques - step)) / (2 * kTorqueStep);
      }
      return G;
    };
    const VectorXd u0 = u;
    const Eigen::JacobiSVD<MatrixXd> svd(differentiate(u0), Eigen::ComputeThinU | Eigen::ComputeThinV);
    const VectorXd& sigma = svd.singularValues();
    VectorXd scale = VectorXd::Zero(sigma.size());
    for (Eigen::Index i = 0; i < sigma.size(); ++i)
      if (sigma[i] > kWeakDirection * sigma[0]) scale[i] = 1 / sigma[i];
    const MatrixXd P = svd.matrixV() * scale.asDiagonal();
    const SlsqpObjective objective = [&](const VectorXd& z, VectorXd* gradient) {
      const VectorXd torques = u0 + P * z;
      if (gradient) *gradient = P.transpose() * (differentiate(torques).transpose() * follow(torques));
      return 0.5 * follow(torques).squaredNorm();
    };
    const SlsqpResult best = minimizeBySlsqp(VectorXd::Zero(u.size()), objective);
    u = u0 + P * best.x;
    result_.nodes.back().evaluations = best.evaluations;
    follow(u);
    if (failed)
      return fail(NumericalStatus::NearDeadPoint,
                  "the step of the closed dynamics fails: " + evaluator_->evaluation().failure);
    return true;
  }

  const Model &closed_, &serial_;
  const SerialTrajectory& trajectory_;
  const LiftOptions& options_;
  PostureLift posture_;
  Workspace ws_;
  ConstrainedWorkspace cws_;
  std::unique_ptr<RobotProblem> problem_;
  std::unique_ptr<RobotEvaluator> evaluator_;  // of the problem
  VectorXd next_;
  LiftResult result_;
};

}  // namespace

const char* getName(LiftMethod method) { return method == LiftMethod::Newton ? "newton" : "nlopt"; }

std::vector<StageSpec> makeStages(const std::vector<double>& dt, const std::vector<ConstraintSet>& constraints) {
  std::vector<StageSpec> stages(constraints.size() + 1);
  for (size_t k = 0; k < constraints.size(); ++k) {
    stages[k].step = StepRule::Euler;  // lift.h: accelerations belong to the nodes
    stages[k].dt = dt[k];
    stages[k].constraints = constraints[k];
  }
  return stages;
}

LiftResult lift(const Model& closed, const SerialModel& serial, const SerialTrajectory& trajectory,
                const LiftOptions& options) {
  const size_t stages = trajectory.a.size();
  bool fits = stages > 0 && trajectory.q.size() == stages + 1 && trajectory.v.size() == stages + 1 &&
              trajectory.constraints.size() == stages && trajectory.dt.size() == stages &&
              trajectory.forces.size() == stages;
  for (size_t k = 0; fits && k <= stages; ++k)
    fits = trajectory.q[k].size() == serial.model.nq() && trajectory.v[k].size() == serial.model.nv() &&
           trajectory.q[k].allFinite() && trajectory.v[k].allFinite() &&
           (k == stages || (trajectory.a[k].size() == serial.model.nv() && trajectory.a[k].allFinite() &&
                            trajectory.forces[k].size() == trajectory.constraints[k].rows));
  if (!fits)
    throw InputError(closed.name(), "trajectory",
                     "its sizes differ from those of the serial model, or it is not finite",
                     "give a motion of the serial model of this robot");
  return Lifter(closed, serial, trajectory, options).run();
}

}  // namespace bielle
