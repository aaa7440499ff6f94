#include "design/evaluation.h"

#include <algorithm>
#include <cmath>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/io/result.h"
#include "bielle/model/error.h"
#include "bielle/transmission/serial_model.h"

namespace bielle {
namespace {

constexpr double kLimitShare = 1.01;  // of the margin: searches that end at a limit end inside it

// A motion of the start design.
struct SolvedMotion {
  MotionRecord record;
  std::vector<VectorXd> postures;
  std::optional<SerialTrajectory> serial;  // of its equivalent serial chain, where there is one
  std::vector<int> kept_dofs;              // of the closed model: those of the chain, in its order
};

// The outcome of one motion of a design.
struct Outcome {
  double missing = 1;  // share of the motion
  std::string message;
  MotionMeasures measures;
  LiftResult lifted;  // of a kept motion
};

std::vector<double> listSteps(const RobotProblem& problem) {
  std::vector<double> dt;
  for (int k = 0; k < problem.numStages(); ++k) dt.push_back(problem.spec(k).dt);
  return dt;
}

Motion makeReducedMotion(const Model& model, const DesignMotion& motion) {
  // Motions that are kept are lifted, which Euler steps alone can be; the others are comparable with them.
  return makeMotion(model, motion.plan(model, makeStandingPosture(model)), {Formulation::Reduced, StepRule::Euler});
}

Outcome solveMotion(const Model& model, Motion& motion, const FddpOptions& options,
                    const std::vector<MotorDrive>& drives) {
  Outcome out;
  const FddpSummary summary = Fddp(options).solve(*motion.problem, motion.guess);
  out.message = motion.name + ": " + getName(summary.termination) + " " + summary.message;
  if (summary.termination != FddpTermination::Converged) return out;
  out.measures = calcMotionMeasures(model, listSteps(*motion.problem), motion.guess, drives);
  out.missing = 0;
  return out;
}

// Starts from the solution of the start design: its postures with the loops closed again, its torques.
void setClosedGuess(const MotionRecord& record, Motion& motion) {
  setGuess(record, motion);
  const Model& model = motion.problem->model();
  for (VectorXd& x : motion.guess.xs) {
    const AssemblyResult closed = closeConfiguration(model, x.head(model.nq()));
    if (closed.status == AssemblyStatus::Closed) x.head(model.nq()) = closed.q;
  }
}

// Extracts the coordinates of the serial model from a motion of the closed one.
MotionRecord restrictRecord(const Model& closed, const Model& serial, const Motion& motion, MotionRecord record) {
  const MotionRecord names = makeRecord(motion, motion.guess);
  RowMatrixXd q(record.q.rows(), serial.nq()), v(record.v.rows(), serial.nv()), a(record.a.rows(), serial.nv());
  for (Eigen::Index k = 0; k < q.rows(); ++k) {
    q.row(k) = restrictConfiguration(closed, serial, record.q.row(k));
    v.row(k) = restrictVelocity(closed, serial, record.v.row(k));
    if (k < a.rows()) a.row(k) = restrictVelocity(closed, serial, record.a.row(k));
  }
  record.q = q, record.v = v, record.a = a;
  record.q_names = names.q_names, record.v_names = names.v_names;
  return record;
}

void addKeptMotion(const Model& closed, const DesignMotion& motion, SolvedMotion& solved) {
  const SerialModel serial = makeSerialModel(closed, makeStandingPosture(closed));
  const Motion serial_motion = makeReducedMotion(serial.model, motion);
  solved.serial =
      makeSerialTrajectory(serial_motion, restrictRecord(closed, serial.model, serial_motion, solved.record));
  solved.kept_dofs = findRestrictedDofs(closed, serial.model);
}

LiftResult liftMotion(const Model& model, const SerialTrajectory& kept) {
  return lift(model, makeSerialModel(model, makeStandingPosture(model)), kept);
}

// Starts from the motion of the start design with the motors recomputed, which is nearly a motion of this design.
// If that fails, starts from its postures and torques.
void setStart(const Model& model, const SolvedMotion& solved, Motion& motion) {
  if (solved.serial) {
    const LiftResult lifted = liftMotion(model, *solved.serial);
    const ShootingTrajectory& trajectory = lifted.trajectory;
    if (lifted.lifted() && trajectory.us.size() == motion.guess.us.size() &&
        trajectory.xs.size() == motion.guess.xs.size()) {
      motion.guess = trajectory;
      return;
    }
  }
  setClosedGuess(solved.record, motion);
}

Outcome keepMotion(const Model& model, const SerialTrajectory& kept, const std::vector<MotorDrive>& drives,
                   double margin) {
  Outcome out;
  out.lifted = liftMotion(model, kept);
  const LiftResult& lifted = out.lifted;
  out.missing = 1 - static_cast<double>(lifted.dt.size()) / static_cast<double>(kept.dt.size() + 1);
  if (!lifted.lifted()) {
    out.message = lifted.nodes.empty() ? "nothing could be lifted" : lifted.nodes.back().message;
    return out;
  }
  out.measures = calcMotionMeasures(model, lifted.dt, lifted.trajectory, drives);
  out.missing = 0;
  const auto near = std::find_if(lifted.nodes.begin(), lifted.nodes.end(),
                                 [margin](const LiftNode& node) { return node.margin < margin; });
  if (near == lifted.nodes.end()) return out;
  out.missing = static_cast<double>(lifted.nodes.end() - near) / static_cast<double>(lifted.nodes.size());
  out.message = "a linkage comes nearer to a dead point than the margin: " + std::to_string(near->margin) + " < " +
                std::to_string(margin);
  return out;
}

// Closes the loops with base and feet placed as in a posture of another design of the robot.
double calcPostureGap(const Model& start, const Model& model, const VectorXd& posture) {
  Workspace ws(start);
  updatePlacements(start, ws, posture);
  AssemblyProblem problem;
  problem.q_ref = posture;
  if (start.hasFreeFlyer()) problem.frames.push_back({start.bodies()[1].name, 1, SE3(), ws.X_WB[1]});
  for (size_t c = 0; c < start.contacts().size(); ++c) {
    const ContactFrame &from = start.contacts()[c], &foot = model.contacts()[c];
    FrameTarget target{foot.name, foot.body, foot.X_BF, getPlacement(ws, from.body, from.X_BF)};
    if (foot.kind == ContactKind::Point3D) target.mask.tail<3>().setConstant(false);
    problem.frames.push_back(target);
  }
  AssemblyOptions options;
  options.step = AssemblyStep::Shortest;
  options.tolerance = 1e-9;
  options.max_iterations = 30;
  options.continuation_steps = 4;
  const AssemblyResult result = assemble(model, problem, options);
  return result.status == AssemblyStatus::Closed ? 0 : std::max(result.gap, options.tolerance);
}

}  // namespace

struct DesignEvaluator::Data {
  const Parametrization& robot;
  std::vector<DesignMotion> motions;
  std::vector<ObjectiveTerm> objective;
  EvaluationOptions options;
  std::vector<MotorDrive> drives;
  std::vector<std::vector<int>> term_motors;
  std::vector<std::optional<WorkspaceGrid>> term_grids;
  double weight = 0;  // W
  std::vector<SolvedMotion> solved;
  Evaluation start;

  void readObjective();
  void solveStart();
  void makeMotions(const Model& model, Evaluation& out, std::vector<LiftResult>* lifted = nullptr) const;
  Evaluation evaluate(const VectorXd& x, std::vector<LiftResult>* lifted = nullptr) const;
  bool checkPostures(const Model& model, Evaluation& out) const;
  double calcTerm(size_t i, const Model& model, const std::vector<MotionMeasures>& measures) const;
  void sumUp(const Model& model, Evaluation& out) const;
};

FddpOptions EvaluationOptions::makeSolverOptions() {
  FddpOptions options;
  options.max_iterations = 100;
  options.gradient_tolerance = 1e-6;
  options.cost_tolerance = 1e-8;
  options.threads = 1;
  return options;
}

const char* getName(MotionMode mode) { return mode == MotionMode::Kept ? "kept" : "reoptimized"; }

const char* getName(DesignStatus status) {
  switch (status) {
    case DesignStatus::Feasible:
      return "feasible";
    case DesignStatus::LoopOpen:
      return "loop open";
    case DesignStatus::MotionFailed:
      break;
  }
  return "motion failed";
}

std::optional<GradientObstacle> findGradientObstacle(MotionMode mode, const std::vector<ObjectiveTerm>& objective) {
  if (mode != MotionMode::Kept)
    return GradientObstacle{"it needs gradients, which motions that are made anew for every design do not have",
                            "give `mode: kept`, or bobyqa or sbplx"};
  for (const ObjectiveTerm& term : objective)
    if (!hasGradient(term.measure))
      return GradientObstacle{std::string("it needs gradients, which ") + getName(term.measure) + " does not have",
                              "choose a torque or an energy, or give bobyqa or sbplx"};
  return {};
}

void DesignEvaluator::Data::readObjective() {
  const Model& model = robot.startModel();
  drives = makeDrives(model, options.drives);
  const bool needs_motions = std::any_of(objective.begin(), objective.end(),
                                         [](const ObjectiveTerm& term) { return term.measure != Measure::Workspace; });
  if (motions.empty() && needs_motions)
    throw ModelError(model.name(), "motions", "there are none", "name at least one");
  if (objective.empty()) throw ModelError(model.name(), "objective", "it is empty", "name a measure");
  for (const ObjectiveTerm& term : objective) {
    std::vector<int> motors;
    for (const std::string& name : term.motors) {
      motors.push_back(model.findMotor(name));
      if (motors.back() < 0)
        throw ModelError(model.name(), "objective: motor '" + name + "'", "there is no such motor",
                         "`bielle info` lists them");
    }
    if (motors.empty())
      for (int m = 0; m < model.nu(); ++m) motors.push_back(m);
    if (!(term.weight > 0 && std::isfinite(term.weight)))
      throw ModelError(model.name(), std::string("objective: ") + getName(term.measure), "its weight is not positive",
                       "give a positive number");
    term_motors.push_back(motors);
    term_grids.emplace_back();
    if (term.measure == Measure::Workspace) term_grids.back() = makeWorkspaceGrid(model, term.region);
    weight += term.weight;
  }
}

void DesignEvaluator::Data::solveStart() {
  const Model& model = robot.startModel();
  for (const DesignMotion& motion : motions) {
    Motion problem = makeReducedMotion(model, motion);
    const Outcome outcome = solveMotion(model, problem, options.solver, drives);
    if (outcome.missing > 0)
      throw ModelError(model.name(), "start design", outcome.message, "ask for a motion that the robot can make");
    SolvedMotion solved_motion{makeRecord(problem, problem.guess), {}, {}, {}};
    const int last = problem.problem->numStages();
    for (int p = 0; p < options.postures; ++p)
      solved_motion.postures.push_back(problem.guess.xs[p * last / std::max(1, options.postures - 1)].head(model.nq()));
    try {
      addKeptMotion(model, motion, solved_motion);
    } catch (const ModelError&) {  // no serial chain, or impacts: motions can be solved but not kept
      if (options.mode == MotionMode::Kept) throw;
    }
    solved.push_back(std::move(solved_motion));
  }
  makeMotions(model, start);
  if (start.status != DesignStatus::Feasible)
    throw ModelError(model.name(), "start design", start.message, "ask for a motion that the robot can make");
  for (size_t i = 0; i < objective.size(); ++i) {
    start.terms.push_back(calcTerm(i, model, start.motions));
    if (!(start.terms[i] > 0 && std::isfinite(start.terms[i])))
      throw ModelError(model.name(), std::string("objective: ") + getName(objective[i].measure),
                       "the start design has zero or infinity", "choose another measure or other motors");
  }
  start.value = weight;
}

void DesignEvaluator::Data::makeMotions(const Model& model, Evaluation& out, std::vector<LiftResult>* lifted) const {
  double missing = 0;
  for (size_t i = 0; i < motions.size(); ++i) {
    Outcome outcome;
    if (options.mode == MotionMode::Kept) {
      outcome = keepMotion(model, *solved[i].serial, drives, options.margin);
    } else {
      Motion motion = makeReducedMotion(model, motions[i]);
      setStart(model, solved[i], motion);
      outcome = solveMotion(model, motion, options.solver, drives);
    }
    missing += outcome.missing / static_cast<double>(motions.size());
    const bool failed = outcome.missing > 0 || !std::isfinite(outcome.measures.conditioning);
    if (lifted) lifted->push_back(std::move(outcome.lifted));
    if (failed && out.status == DesignStatus::Feasible) {
      out.status = DesignStatus::MotionFailed;
      out.message = outcome.missing > 0 ? outcome.message : "a dead point of the motors";
      out.value = weight * (1.5 + 0.5 * std::max(missing, 1e-3));
    }
    if (failed && !lifted) return;
    out.motions.push_back(outcome.measures);
  }
}

bool DesignEvaluator::Data::checkPostures(const Model& model, Evaluation& out) const {
  double sum = 0;
  int count = 0;
  for (const SolvedMotion& motion : solved)
    for (const VectorXd& posture : motion.postures) {
      sum += std::min(1.0, 10 * calcPostureGap(robot.startModel(), model, posture));  // Eq. (2)
      ++count;
    }
  if (sum == 0) return true;
  out.status = DesignStatus::LoopOpen;
  out.message = "a loop cannot be closed where the start design can be";
  out.value = weight * (2 + sum / count);
  return false;
}

double DesignEvaluator::Data::calcTerm(size_t i, const Model& model,
                                       const std::vector<MotionMeasures>& measures) const {
  if (!term_grids[i]) return getMeasure(objective[i].measure, term_motors[i], measures);
  const double points = static_cast<double>(term_grids[i]->placements.size());
  return 1 / std::max(calcCoverage(model, *term_grids[i]).share, 0.5 / points);
}

void DesignEvaluator::Data::sumUp(const Model& model, Evaluation& out) const {
  for (size_t i = 0; i < objective.size(); ++i) {
    out.terms.push_back(calcTerm(i, model, out.motions));
    out.value += objective[i].weight * out.terms[i] / start.terms[i];  // Eq. (1)
  }
}

DesignEvaluator::DesignEvaluator(const Parametrization& robot, std::vector<DesignMotion> motions,
                                 std::vector<ObjectiveTerm> objective, const EvaluationOptions& options)
    : data_(new Data{robot, std::move(motions), std::move(objective), options, {}, {}, {}, 0, {}, {}}) {
  data_->readObjective();
  data_->solveStart();
}
DesignEvaluator::~DesignEvaluator() = default;

const Evaluation& DesignEvaluator::start() const { return data_->start; }
const Parametrization& DesignEvaluator::robot() const { return data_->robot; }
const std::vector<DesignMotion>& DesignEvaluator::motions() const { return data_->motions; }
const std::vector<ObjectiveTerm>& DesignEvaluator::objective() const { return data_->objective; }

Evaluation DesignEvaluator::Data::evaluate(const VectorXd& x, std::vector<LiftResult>* lifted) const {
  Evaluation out;
  try {
    const Model model = robot.make(x);
    if (!checkPostures(model, out)) return out;
    makeMotions(model, out, lifted);
    if (out.status == DesignStatus::Feasible) sumUp(model, out);
  } catch (const ModelError& error) {  // numbers that define no robot, postures from which no motion can start
    out.status = DesignStatus::MotionFailed;
    out.message = error.what();
    out.value = weight * 2;
  }
  return out;
}

Evaluation DesignEvaluator::evaluate(const VectorXd& x) const { return data_->evaluate(x); }

SlopedEvaluation DesignEvaluator::differentiate(const VectorXd& x) const {
  if (const auto obstacle = findGradientObstacle(data_->options.mode, data_->objective))
    throw ModelError(data_->robot.startModel().name(), "search", obstacle->problem, obstacle->remedy);
  std::vector<LiftResult> lifted;
  SlopedEvaluation out{data_->evaluate(x, &lifted), {}, {}};
  if (lifted.size() < data_->motions.size()) return out;
  const Model model = data_->robot.make(x);
  const std::vector<ModelVariation> variations = calcDesignVariations(data_->robot, x);
  std::vector<MotorSlopes> slopes;
  for (size_t i = 0; i < lifted.size(); ++i) {
    if (!lifted[i].lifted()) return out;
    const SolvedMotion& kept = data_->solved[i];
    slopes.push_back(calcMotorSlopes(model, kept.kept_dofs, *kept.serial, lifted[i], variations));
    if (slopes.back().failure.empty()) continue;
    out.evaluation = {DesignStatus::MotionFailed, 2 * data_->weight, {}, {}, slopes.back().failure};
    return out;
  }
  for (size_t i = 0; i < data_->objective.size(); ++i) {
    const ObjectiveTerm& term = data_->objective[i];
    out.terms.push_back(calcMeasurePieces(term.measure, data_->term_motors[i], slopes, data_->drives));
    const double scale = term.weight / data_->start.terms[i];
    out.terms[i].values *= scale;
    out.terms[i].gradients *= scale;
  }
  out.limits = calcMarginPieces(kLimitShare * data_->options.margin, slopes);
  return out;
}

}  // namespace bielle
