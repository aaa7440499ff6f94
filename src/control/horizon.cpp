#include "control/horizon.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "bielle/model/error.h"
#include "control/window_grid.h"
#include "motion/robot_size.h"
#include "solve/fddp_checks.h"

namespace bielle {

void describe(OptionFields& f, PredictiveOptions& o) {
  f.integer("nodes", o.nodes, {10, 1000}, "number of nodes in the window of predictive control");
  f.integer("fine_nodes", o.fine_nodes, {10, 1000},
            "number of nodes at its beginning that are one stage long; later ones are up to two, then four");
  f.integer("iterations", o.iterations, {1, 100}, "solver iterations of predictive control at every stage");
  f.number("regularization", o.regularization, "1", kPositive, "regularization of its sweeps");
  f.number("penalty", o.penalty, "1", kPositive, "penalty of violated constraints");
  f.number("look_ahead", o.look_ahead, "s", kNotNegative,
           "near the end of a contact phase, the last gains computed at least this long before it are reused");
  f.number(
      "dead_point_stop", o.dead_point_stop, "1", {0, 1},
      "motors brake before the transmission of a linkage reaches this share of that at the start, or the reciprocal");
  f.integer("threads", o.threads, {0, kMostThreads},
            "number of threads of predictive control; 0: all, in real time (own_thread) all but one; results do not "
            "depend on it");
  f.flag("own_thread", o.own_thread, "solves run in parallel with control; results then depend on their speed");
  f.number(
      "solve_time", o.solve_time, "s", kNotNegative,
      "time that a solve is given: another one begins in a stage that leaves so much; without own_thread, policies "
      "come into force only when it has passed; 0: one solve for each stage");
  f.number("lead", o.lead, "s", kNotNegative,
           "time from the measurement to the stage that is solved for; 0: the whole stage before; no effect with "
           "solve_time");
  f.number("end_place", o.end_place, "1/m^2 or 1", kNotNegative, "weight of heading and place at the end of a window");
  f.number("end_posture", o.end_posture, "1/m^2 or 1", kNotNegative, "weight of the other coordinates");
  f.number("end_velocity", o.end_velocity, "s^2/m^2 or s^2", kNotNegative, "weight of the velocities");
}

namespace {

// Of the weights of joints at the end of a walk's window, whose postures are not foreseen: without any, the last stages would
// throw the swing leg about.
constexpr double kJointShare = 0.01;

// Where a window should end. \param joints  nv: shares of the weights of each joint
StateCost makeEndCost(const Model& model, const VectorXd& q, const VectorXd& joints, const PredictiveOptions& o) {
  const int nv = model.nv();
  VectorXd weights(2 * nv);
  weights << o.end_posture * joints, o.end_velocity * joints;
  if (model.hasFreeFlyer()) {
    weights.head<6>() << o.end_place, o.end_place, o.end_posture, o.end_posture, o.end_posture, o.end_place;
    weights.segment<6>(nv).setConstant(o.end_velocity);
  }
  const RobotSize size = calcRobotSize(model, makeStandingRobot(model, q));
  scaleStateWeights(model, size, weights);
  return {1, q, VectorXd::Zero(nv), weights, calcWeightAxes(size)};
}

std::vector<StageSpec> listStages(const RobotProblem& problem) {
  std::vector<StageSpec> stages;
  for (int k = 0; k <= problem.numStages(); ++k) stages.push_back(problem.spec(k));
  return stages;
}

double calcTime(const Model& model, ConstVectorRef q) { return calcRobotSize(model, makeStandingRobot(model, q)).time; }

// A problem of its own, whose stages are replaced as windows move on: copies of a motion share theirs.
std::unique_ptr<RobotProblem> copyProblem(const RobotProblem& problem) {
  if (problem.formulation() != Formulation::Reduced || problem.hasFreeTimings())
    throw std::invalid_argument("PredictiveController: the problem is not reduced, or its durations are free");
  const Model& model = problem.model();
  const VectorXd& x0 = problem.initialState();
  return std::make_unique<RobotProblem>(model, x0.head(model.nq()), x0.tail(model.nv()), listStages(problem),
                                        Formulation::Reduced);
}

// Of a motion whose last node is the terminal one, s.
double findShortestStep(const std::vector<StageSpec>& stages) {
  double shortest = std::numeric_limits<double>::infinity();
  for (size_t k = 0; k + 1 < stages.size(); ++k)
    if (stages[k].kind == StageKind::Dynamics) shortest = std::min(shortest, stages[k].dt);
  return shortest;
}

class MotionHorizon : public Horizon {
 public:
  MotionHorizon(const Motion& motion, const ShootingTrajectory& plan, const PredictiveOptions& options)
      : own_(copyProblem(*motion.problem)),
        problem_(*own_),
        last_(static_cast<int>(plan.us.size())),
        last_dt_(problem_.spec(std::min(last_, problem_.numStages())).dt),
        plan_(plan) {
    if (plan.xs.size() != plan.us.size() + 1 || last_ >= problem_.numStages() ||
        last_ + countMostStages(options, findShortestStep(listStages(problem_)) / calcTimeScale(problem_)) !=
            problem_.numStages())
      throw std::invalid_argument("PredictiveController: the plan does not belong to the motion");
    double time = 0;
    for (int k = 0; k < problem_.numStages(); ++k) {
      starts_.push_back(time);
      time += problem_.spec(k).dt;
    }
    int phase = 0;
    for (const ContactPhase& p : motion.schedule.phases) phases_.insert(phases_.end(), p.nodes, phase++);
    const Model& model = problem_.model();
    VectorXd rest = plan.xs.back();
    rest.head(model.nq()) = settlePosture(model, motion.schedule.phases.back().contacts, rest.head(model.nq()));
    rest.tail(model.nv()).setZero();
    const VectorXd u = calcStaticTorques(model, problem_.spec(last_).constraints, rest.head(model.nq())).u;
    plan_.xs.resize(problem_.numStages() + 1, rest);
    plan_.us.resize(problem_.numStages(), u);
  }

  RobotProblem& getProblem() override { return problem_; }
  int getFirst(int stage) const override { return getNode(stage); }  // the window moves no farther than its end
  void prepare(int) override {}
  int begin() const override { return 0; }
  int end() const override { return last_; }
  int getNode(int stage) const override { return std::min(stage, last_); }
  double getStart(int stage) const override {
    return stage <= last_ ? starts_[stage] : starts_[last_] + (stage - last_) * last_dt_;
  }
  int getPhase(int stage) const override { return phases_[getNode(stage)]; }
  const VectorXd& getState(int stage) const override { return plan_.xs[stage]; }
  VectorXd makeGuess(int stage) const override { return plan_.xs[stage]; }
  const VectorXd& getControl(int stage) const override { return plan_.us[stage]; }
  void extend(int stage, int end, VectorXd& x, VectorXd& u) const override {
    x = plan_.xs[end];
    u = plan_.us[stage];
  }
  bool isSolved() const override { return true; }

 private:
  const std::unique_ptr<RobotProblem> own_;
  RobotProblem& problem_;
  const int last_;              // the first copy of the last stage
  const double last_dt_;        // of one copy, s: a node of the problem may stand for several
  ShootingTrajectory plan_;     // of all stages of the problem
  std::vector<double> starts_;  // of each stage, s
  std::vector<int> phases_;     // likewise
};

// The problem is a ring: stage s is its node s modulo their number. Behind a window there is room for one step, in which a
// foot that lands early began to swing.
class WalkHorizon : public Horizon {
 public:
  WalkHorizon(CommandedWalk walk, const PredictiveOptions& options) : walk_(std::move(walk)) {
    listOptions(options, "option", "PredictiveOptions").check();
    const Model& model = walk_.model();
    std::vector<StageSpec> specs = {keep(walk_.makeNext())};
    stages_ = countMostStages(options, walk_.timeStep() / calcTime(model, states_[0].head(model.nq())));
    for (int s = 1; s <= stages_; ++s) specs.push_back(keep(walk_.makeNext()));
    for (StageSpec& spec : walk_.makeExamples()) specs.push_back(std::move(spec));
    size_ = static_cast<int>(specs.size());
    states_.resize(size_);
    controls_.resize(size_);
    phases_.resize(size_);
    const VectorXd joints = kJointShare * selectMainJoints(model);
    const VectorXd q0 = states_[0].head(model.nq());
    specs.emplace_back();
    specs.back().state = makeEndCost(model, q0, joints, options);
    problem_ =
        std::make_unique<RobotProblem>(model, q0, VectorXd::Zero(model.nv()), std::move(specs), Formulation::Reduced);
  }

  RobotProblem& getProblem() override { return *problem_; }
  int getFirst(int stage) const override { return stage; }
  void prepare(int first) override {
    while (made_ <= first + stages_) {
      const int node = made_ % size_;
      problem_->replaceStage(node, keep(walk_.makeNext()));
    }
  }
  int begin() const override { return std::max(0, made_ - size_); }
  int end() const override { return made_ - 1; }
  int getNode(int stage) const override { return stage % size_; }
  double getStart(int stage) const override { return stage * walk_.timeStep(); }
  int getPhase(int stage) const override { return phases_[getNode(stage)]; }
  const VectorXd& getState(int stage) const override { return states_[getNode(stage)]; }
  // At rest: the feet stand, and with them the velocity would be none that the contacts allow.
  VectorXd makeGuess(int stage) const override {
    VectorXd x = getState(stage);
    x.tail(walk_.model().nv()).setZero();
    return x;
  }
  const VectorXd& getControl(int stage) const override { return controls_[getNode(stage)]; }
  // State and control before, which are nearer than the posture that stands. Only a foot that takes off must not push.
  void extend(int stage, int, VectorXd&, VectorXd& u) const override {
    if (countFeet(stage) < countFeet(stage - 1)) u = getControl(stage);
  }
  bool isSolved() const override { return false; }

 private:
  size_t countFeet(int stage) const { return problem_->spec(getNode(stage)).constraints.contacts.size(); }
  // Keeps all but the spec of the next stage.
  StageSpec keep(CommandedWalk::Stage stage) {
    if (size_ == 0) {  // the first ones
      states_.emplace_back();
      controls_.emplace_back();
      phases_.emplace_back();
    }
    const int node = size_ == 0 ? made_ : made_ % size_;
    states_[node] = std::move(stage.x);
    controls_[node] = std::move(stage.u);
    phases_[node] = stage.phase;
    ++made_;
    return std::move(stage.spec);
  }

  CommandedWalk walk_;
  int stages_ = 0;                           // of the longest window
  int size_ = 0;                             // of the ring
  int made_ = 0;                             // stages
  std::vector<VectorXd> states_, controls_;  // by node
  std::vector<int> phases_;                  // likewise
  std::unique_ptr<RobotProblem> problem_;
};

}  // namespace

double calcTimeScale(const RobotProblem& problem) {
  const Model& model = problem.model();
  return calcTime(model, problem.initialState().head(model.nq()));
}

Motion makePredictiveMotion(const Model& model, MotionPlan plan, const ProblemOptions& problem,
                            const PredictiveOptions& options) {
  listOptions(options, "option", "PredictiveOptions").check();
  if (plan.stages.size() < 2 || plan.schedule.phases.empty() || plan.guess.us.empty() || plan.guess.xs.empty())
    throw InputError(model.name(), "motion '" + plan.name + "'", "its plan has no stage, phase or guess",
                     "fill them in, e.g. by planSquat()");
  const int copies = countMostStages(options, findShortestStep(plan.stages) / calcTime(model, plan.q_start));
  const StageSpec last = *(plan.stages.end() - 2);
  if (last.kind != StageKind::Dynamics)
    throw InputError(model.name(), "motion '" + plan.name + "'", "it ends with an impact",
                     "let it end with the robot standing");
  plan.stages.insert(plan.stages.end() - 1, static_cast<size_t>(copies), last);
  plan.schedule.phases.back().nodes += copies;
  plan.guess.xs.insert(plan.guess.xs.end(), static_cast<size_t>(copies), VectorXd(plan.guess.xs.back()));
  plan.guess.us.insert(plan.guess.us.end(), static_cast<size_t>(copies), VectorXd(plan.guess.us.back()));
  plan.stages.back() = StageSpec();
  plan.stages.back().state = makeEndCost(model, plan.q_end, selectMainJoints(model), options);
  plan.goals.clear();
  return makeMotion(model, std::move(plan), problem);
}

std::unique_ptr<Horizon> makeMotionHorizon(const Motion& motion, const ShootingTrajectory& plan,
                                           const PredictiveOptions& options) {
  return std::make_unique<MotionHorizon>(motion, plan, options);
}

std::unique_ptr<Horizon> makeWalkHorizon(CommandedWalk walk, const PredictiveOptions& options) {
  return std::make_unique<WalkHorizon>(std::move(walk), options);
}

}  // namespace bielle
