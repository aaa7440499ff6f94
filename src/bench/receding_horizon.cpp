#include "bench/receding_horizon.h"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>
#include <stdexcept>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "math/largest.h"
#include "solve/receding.h"
#include "solve/window.h"

namespace bielle {
namespace {

// Every plan brakes at the end of its horizon, which moves by one stage at every shift. Without damping, half of the
// full steps overshoot there; with this damping almost none do, and the plans cost 1 % more.
constexpr double kRegularization = 5e-3;
constexpr double kPositionNoise = 1e-4, kVelocityNoise = 1e-3;  // rad or m, rad/s or m/s

class Disturbance {
 public:
  explicit Disturbance(const Model& model) : model_(model), ws_(model) {}
  // A state near x with closed loops, and a velocity that keeps the constraints.
  VectorXd apply(const ConstraintSet& constraints, const VectorXd& x) {
    const int nq = model_.nq(), nv = model_.nv();
    VectorXd out(x.size());
    out.head(nq) = closeConfiguration(model_, model_.integrate(x.head(nq), makeNoise(kPositionNoise))).q;
    out.tail(nv) = projectVelocity(model_, ws_, constraints, out.head(nq), x.tail(nv) + makeNoise(kVelocityNoise));
    return out;
  }

 private:
  VectorXd makeNoise(double scale) {
    std::normal_distribution<double> normal(0, scale);
    return VectorXd::NullaryExpr(model_.nv(), [&](Eigen::Index) { return normal(rng_); });
  }
  const Model& model_;
  Workspace ws_;
  std::mt19937 rng_{1};
};

// The new last stage of a shifted horizon: torques that hold the robot still, and the resulting state.
void extend(const RobotProblem& whole, RobotEvaluator& evaluator, int new_stage, ShootingTrajectory& trajectory) {
  const VectorXd& last = *(trajectory.xs.end() - 2);
  VectorXd& u = trajectory.us.back();
  u = calcStaticTorques(whole.model(), whole.spec(new_stage).constraints, last.head(whole.model().nq())).u;
  const RobotEvaluation& step = evaluator.evaluate(new_stage, last, u);
  trajectory.xs.back() = step.status == NumericalStatus::Ok ? step.x_next : last;
}

// Height of the first body and its direction that was initially up.
struct Torso {
  double height;
  Vector3d up;
};
Torso findTorso(const Model& model, Workspace& ws, const VectorXd& x) {
  updatePositions(model, ws, x.head(model.nq()));
  return {ws.X_WB[1].p.z(), ws.X_WB[1].R.row(2).transpose()};
}

// Number of involuntary context switches of this program.
long countPreemptions() {
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_nivcsw;
}

ShiftTimes summarize(std::vector<double> times) {
  if (times.empty()) return {};
  std::sort(times.begin(), times.end());
  const size_t count = times.size();
  return {static_cast<int>(count), times[count / 2], times[(99 * count + 99) / 100 - 1], times.back()};
}

class ShiftedWalk {
 public:
  ShiftedWalk(const Model& model, Formulation formulation, const ShiftOptions& options)
      : model_(model),
        options_(options),
        motion_(makeBenchmarkWalk(model, options.walk, formulation)),
        whole_(*motion_.problem),
        window_(whole_, options.nodes),
        evaluator_(whole_),
        ws_(model),
        disturbance_(model) {
    if (options.shifts < 1 || options.nodes >= whole_.numStages())
      throw std::invalid_argument("receding horizon: " + std::to_string(options.shifts) + " shifts of " +
                                  std::to_string(options.nodes) + " nodes in a walk of " +
                                  std::to_string(whole_.numStages()) + " stages");
    out_.formulation = formulation;
    out_.threads = options.threads;
    out_.cones = options.walk.friction > 0;
    out_.least_height = 1;
    out_.up = true;
  }

  RecedingHorizon run() {
    Multipliers multipliers;
    const ShootingTrajectory plan = makePlan(multipliers);
    RecedingOptions single;
    single.threads = options_.threads;
    single.initial_regularization = single.min_regularization = kRegularization;
    Receding solver(window_, single);
    ShootingTrajectory trajectory = plan;
    solver.step(trajectory);  // sizes the memory
    while (out_.up && static_cast<int>(times_.size()) < options_.shifts) {
      if (out_.cones) solver.setMultipliers(multipliers);
      walk(plan, solver);
    }
    out_.all = summarize(times_);
    out_.undisturbed = summarize(undisturbed_);
    return out_;
  }

 private:
  // The plan before the first shift, without a time limit.
  ShootingTrajectory makePlan(Multipliers& multipliers) {
    const int nodes = options_.nodes;
    ShootingTrajectory plan{{motion_.guess.xs.begin(), motion_.guess.xs.begin() + nodes + 1},
                            {motion_.guess.us.begin(), motion_.guess.us.begin() + nodes}};
    FddpOptions options;
    options.threads = options_.threads;
    options.max_iterations = options_.first_iterations;
    FddpResult solved = bielle::solve(window_, std::move(plan), options);
    multipliers = std::move(solved.multipliers);
    return std::move(solved.trajectory);
  }

  // One pass from the start of the walk until the horizon reaches its end, or enough shifts are made.
  void walk(ShootingTrajectory trajectory, Receding& solver) {
    VectorXd x = whole_.initialState(), next = x;
    const Torso start = findTorso(model_, ws_, x);
    const int last = whole_.numStages() - options_.nodes;
    for (int k = 0; k < last && out_.up && static_cast<int>(times_.size()) < options_.shifts; ++k) {
      window_.move(k, x);
      const bool solved = solve(k, solver, trajectory);
      const RobotEvaluation& step = evaluator_.evaluate(k, x, trajectory.us[0]);
      out_.up = solved && step.status == NumericalStatus::Ok;
      if (!out_.up) break;
      next = step.x_next;
      out_.violation = getLarger(out_.violation, calcViolation(k, step));
      x = disturbance_.apply(whole_.spec(k + 1).constraints, next);
      const Torso torso = findTorso(model_, ws_, x);
      out_.least_height = getSmaller(out_.least_height, torso.height / start.height);
      out_.largest_tilt =
          getLarger(out_.largest_tilt, std::atan2(torso.up.cross(start.up).norm(), torso.up.dot(start.up)));
      out_.up = out_.least_height > 0.8 && out_.largest_tilt < 0.5;
    }
  }

  double calcViolation(int k, const NodeEvaluation& step) const {
    VectorXd lower(step.constraints.size()), upper = lower;
    whole_.getConstraintBounds(k, lower, upper);
    double worst = 0;
    for (Eigen::Index i = 0; i < lower.size(); ++i)
      worst = getLarger(worst, getLarger(lower[i] - step.constraints[i], step.constraints[i] - upper[i]));
    return worst;
  }

  bool solve(int k, Receding& solver, ShootingTrajectory& trajectory) {
    const long preemptions = countPreemptions();
    const auto begin = std::chrono::steady_clock::now();
    if (k > 0) {
      solver.advance(trajectory);
      extend(whole_, evaluator_, k + options_.nodes - 1, trajectory);
    }
    const FddpSummary& summary = solver.step(trajectory);
    times_.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    if (countPreemptions() == preemptions) undisturbed_.push_back(times_.back());
    return summary.termination != FddpTermination::Failed;
  }

  const Model& model_;
  const ShiftOptions& options_;
  Motion motion_;
  RobotProblem& whole_;
  Window window_;
  RobotEvaluator evaluator_;
  Workspace ws_;
  Disturbance disturbance_;
  std::vector<double> times_, undisturbed_;  // s
  RecedingHorizon out_;
};

}  // namespace

RecedingHorizon runRecedingHorizon(const Model& model, Formulation formulation, const ShiftOptions& options) {
  return ShiftedWalk(model, formulation, options).run();
}

}  // namespace bielle
