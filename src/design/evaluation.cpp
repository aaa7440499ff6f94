#include "design/evaluation.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <set>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "design/motor_change.h"
#include "design/optimum_gradient.h"
#include "model/number_text.h"

namespace bielle {
namespace {

constexpr double kLimitShare = 1.01;  // of the margin: searches that end at a limit end inside it

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

// The designs of one architecture, and their start.
struct Base {
  std::once_flag made;
  std::optional<Model> model;
  std::vector<std::vector<int>> term_motors, constraint_motors;
  std::vector<std::optional<WorkspaceGrid>> term_grids;
  std::vector<std::optional<SolvedMotion>> solved;  // none where the start has no such motion
};

std::vector<int> findNamed(const Model& model, const std::vector<std::string>& names, const char* where) {
  std::vector<std::string> unknown;
  std::vector<int> motors = findMotors(model, names, &unknown);
  if (!unknown.empty())
    throw ModelError(model.name(), std::string(where) + ": motor '" + unknown.front() + "'", "there is no such motor",
                     "`bielle info` lists them; * stands for any text");
  for (int m = 0; m < model.nu() && names.empty(); ++m) motors.push_back(m);
  return motors;
}

}  // namespace

struct DesignEvaluator::Data {
  const Parametrization& robot;
  std::vector<DesignMotion> motions;
  std::vector<ObjectiveTerm> objective;
  EvaluationOptions options;
  double weight = 0;  // W
  std::set<Measure> asked;
  Evaluation start;
  std::mutex mutex;
  std::map<std::vector<int>, std::unique_ptr<Base>> bases;

  // Whether motions of the start design are transferred to other designs.
  bool mustKeep() const { return options.mode == MotionMode::Kept || options.margin > EvaluationOptions().margin; }
  void checkSpec();
  void readNames(Base& base) const;
  void solveStart();
  void solveBase(const VectorXd& x, bool must_solve, Base& base) const;
  // The base of the architecture of x, made if need be. Called by several threads.
  const Base& getBase(const VectorXd& x);
  void makeMotions(const Base& base, const Model& model, Evaluation& out,
                   std::vector<MotionOutcome>* outcomes = nullptr) const;
  // \param made  the model of the outcomes, if they are asked for
  Evaluation evaluate(const VectorXd& x, std::vector<MotionOutcome>* outcomes = nullptr,
                      std::optional<Model>* made = nullptr);
  std::vector<MotorSlopes> calcKeptSlopes(const Base& base, const Model& model, const VectorXd& x,
                                          const std::vector<MotionOutcome>& outcomes) const;
  MeasurePieces calcStartMargins(const Base& base, const Model& model, const VectorXd& x) const;
  MeasurePieces calcPieces(size_t i, const Base& base, const std::vector<MotorSlopes>& slopes,
                           const RobotSlopes& robot_slopes) const;
  MeasurePieces calcLimits(const Base& base, const std::vector<MotorSlopes>& slopes,
                           const RobotSlopes& robot_slopes) const;
  bool checkPostures(const Base& base, const Model& model, Evaluation& out) const;
  double calcTerm(size_t i, const Base& base, const Model& model, const std::vector<MotionMeasures>& measures) const;
  void checkConstraints(const Base& base, const Model& model, Evaluation& out) const;
  void sumUp(const Base& base, const Model& model, Evaluation& out) const;
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
    case DesignStatus::Violated:
      return "constraint violated";
    case DesignStatus::MotionFailed:
      break;
  }
  return "motion failed";
}

std::optional<GradientObstacle> findGradientObstacle(MotionMode mode, const std::vector<ObjectiveTerm>& objective,
                                                     const std::vector<DesignConstraint>& constraints) {
  for (const DesignConstraint& constraint : constraints)
    if (!hasGradient(constraint.measure))
      return GradientObstacle{
          std::string("it needs gradients, which the constraint on ") + getName(constraint.measure) + " does not have",
          "give bobyqa or sbplx, or leave that constraint out"};
  for (const ObjectiveTerm& term : objective) {
    const std::string name = getName(term.measure);
    if (!hasGradient(term.measure))
      return GradientObstacle{"it needs gradients, which " + name + " does not have",
                              "choose a torque, an energy, the cost or the mass, or give bobyqa or sbplx"};
    if (term.measure == Measure::Cost && mode == MotionMode::Kept)
      return GradientObstacle{"motions that are kept have no cost", "give `mode: reoptimized`"};
  }
  return {};
}

void DesignEvaluator::Data::checkSpec() {
  const Model& model = robot.startModel();
  makeDrives(model, options.drives);  // \throws what is wrong with them
  const bool needs_motions = std::any_of(objective.begin(), objective.end(), [](const ObjectiveTerm& term) {
    return term.measure != Measure::Workspace && term.measure != Measure::Mass;
  });
  if (motions.empty() && needs_motions)
    throw ModelError(model.name(), "motions", "there are none", "name at least one");
  if (objective.empty()) throw ModelError(model.name(), "objective", "it is empty", "name a measure");
  for (const ObjectiveTerm& term : objective) {
    if (!(term.weight > 0 && std::isfinite(term.weight)))
      throw ModelError(model.name(), std::string("objective: ") + getName(term.measure), "its weight is not positive",
                       "give a positive number");
    weight += term.weight;
    asked.insert(term.measure);
  }
  for (const DesignConstraint& constraint : options.constraints) {
    asked.insert(constraint.measure);
    if (constraint.measure == Measure::Margin && model.serialJoints().empty())
      throw ModelError(model.name(), "constraints: margin", "the robot has no serial joints, whose motion it is",
                       "name them in its YAML file, `serial_joints`");
  }
}

void DesignEvaluator::Data::readNames(Base& base) const {
  const Model& model = *base.model;
  for (const ObjectiveTerm& term : objective) {
    base.term_motors.push_back(findNamed(model, term.motors, "objective"));
    base.term_grids.emplace_back();
    if (term.measure == Measure::Workspace) base.term_grids.back() = makeWorkspaceGrid(model, term.region);
  }
  for (const DesignConstraint& constraint : options.constraints) {
    std::vector<int> named = findNamed(model, constraint.motors, "constraints");
    const auto is_limited = [&](int m) {
      const Motor& motor = model.motors()[static_cast<size_t>(m)];
      const bool heat = std::isfinite(motor.continuous_effort);
      const bool envelope =
          std::isfinite(motor.effort_limit) || std::isfinite(motor.velocity_limit) || motor.hasEnvelope();
      return constraint.measure == Measure::Heat ? heat : constraint.measure != Measure::Envelope || envelope;
    };
    named.erase(std::remove_if(named.begin(), named.end(), [&](int m) { return !is_limited(m); }), named.end());
    if (named.empty())
      throw ModelError(model.name(), std::string("constraints: ") + getName(constraint.measure),
                       "none of the motors has such a limit",
                       "choose `motor` out of a catalogue, or give their windings in the robot's YAML file");
    base.constraint_motors.push_back(std::move(named));
  }
}

void DesignEvaluator::Data::solveBase(const VectorXd& x, bool must_solve, Base& base) const {
  base.model = robot.make(x);
  readNames(base);
  for (const DesignMotion& motion : motions) {
    base.solved.emplace_back();
    try {
      base.solved.back() = solveStartMotion(*base.model, motion, options.solver, options.postures, mustKeep());
    } catch (const ModelError&) {  // designs are solved from the plan's guess
      if (must_solve) throw;
    }
  }
}

const Base& DesignEvaluator::Data::getBase(const VectorXd& x) {
  Base* base = nullptr;
  {
    const std::lock_guard<std::mutex> lock(mutex);
    std::unique_ptr<Base>& entry = bases[robot.getArchitecture(x)];
    if (!entry) entry = std::make_unique<Base>();
    base = entry.get();
  }
  std::call_once(base->made, [&] {
    VectorXd start_of_parts = robot.start();
    for (size_t i = 0; i < robot.variables().size(); ++i) {
      const Eigen::Index k = static_cast<Eigen::Index>(i);
      if (robot.variables()[i].isArchitecture()) start_of_parts[k] = x[k];
    }
    solveBase(start_of_parts, start_of_parts == robot.start(), *base);
  });
  return *base;
}

void DesignEvaluator::Data::solveStart() {
  const Base& base = getBase(robot.start());
  const Model& model = *base.model;
  makeMotions(base, model, start);
  if (start.status != DesignStatus::Feasible)
    throw ModelError(model.name(), "start design", start.message, "ask for a motion that the robot can make");
  for (size_t i = 0; i < objective.size(); ++i) {
    start.terms.push_back(calcTerm(i, base, model, start.motions));
    if (!(start.terms[i] > 0 && std::isfinite(start.terms[i])))
      throw ModelError(model.name(), std::string("objective: ") + getName(objective[i].measure),
                       "the start design has zero or infinity", "choose another measure or other motors");
  }
  start.value = weight;
  checkConstraints(base, model, start);
}

void DesignEvaluator::Data::makeMotions(const Base& base, const Model& model, Evaluation& out,
                                        std::vector<MotionOutcome>* outcomes) const {
  const std::vector<MotorConversion> drives = makeDrives(model, options.drives);
  double missing = 0;
  for (size_t i = 0; i < motions.size(); ++i) {
    const SolvedMotion* from = base.solved[i] ? &*base.solved[i] : nullptr;
    if (!from && options.mode == MotionMode::Kept)
      throw ModelError(model.name(), motions[i].name, "the start with these parts cannot make it", "leave them out");
    MotionOutcome outcome = options.mode == MotionMode::Kept
                                ? keepMotion(model, *from->serial, drives, options.margin)
                                : remakeMotion(model, motions[i], from, options.solver, drives);
    missing += outcome.missing / static_cast<double>(motions.size());
    const bool failed = outcome.missing > 0 || !std::isfinite(outcome.measures.conditioning);
    if (failed && out.status == DesignStatus::Feasible) {
      out.status = DesignStatus::MotionFailed;
      out.message = outcome.missing > 0 ? outcome.message : "a dead point of the motors";
      out.value = weight * (1.5 + 0.5 * std::max(missing, 1e-3));
    }
    if (failed && !outcomes) return;
    if (!failed)
      addLimitMeasures(model, outcome.motion ? outcome.motion->guess : outcome.lifted.trajectory, asked,
                       outcome.measures);
    out.motions.push_back(outcome.measures);
    if (outcomes) outcomes->push_back(std::move(outcome));
  }
}

bool DesignEvaluator::Data::checkPostures(const Base& base, const Model& model, Evaluation& out) const {
  double sum = 0;
  int count = 0;
  for (const auto& motion : base.solved)
    for (size_t p = 0; motion && p < motion->postures.size(); ++p) {
      sum += std::min(1.0, 10 * calcPostureGap(*base.model, model, motion->postures[p]));  // Eq. (2)
      ++count;
    }
  if (sum == 0) return true;
  out.status = DesignStatus::LoopOpen;
  out.message = "a loop cannot be closed where the start design can be";
  out.value = weight * (2 + sum / count);
  return false;
}

double DesignEvaluator::Data::calcTerm(size_t i, const Base& base, const Model& model,
                                       const std::vector<MotionMeasures>& measures) const {
  if (objective[i].measure == Measure::Mass) return model.mass();
  const std::optional<WorkspaceGrid>& grid = base.term_grids[i];
  if (!grid) return getMeasure(objective[i].measure, base.term_motors[i], measures);
  return 1 / std::max(calcCoverage(model, *grid).share, 0.5 / static_cast<double>(grid->placements.size()));
}

void DesignEvaluator::Data::checkConstraints(const Base& base, const Model& model, Evaluation& out) const {
  double sum = 0;
  for (size_t i = 0; i < options.constraints.size(); ++i) {
    const DesignConstraint& constraint = options.constraints[i];
    const double value = constraint.measure == Measure::Mass
                             ? model.mass()
                             : getMeasure(constraint.measure, base.constraint_motors[i], out.motions);
    const double violation = calcViolation(constraint, value);
    out.constraints.push_back(value);
    if (violation > 0)
      out.message += (sum > 0 ? ", " : "") + std::string(getName(constraint.measure)) + " is " +
                     formatNumber(value, "%.4g") + (constraint.at_least ? " < " : " > ") +
                     formatNumber(constraint.bound, "%.4g");
    sum += violation;
  }
  if (sum == 0) return;
  out.status = DesignStatus::Violated;
  out.value = weight * (1.5 + 0.5 / static_cast<double>(motions.size() + 1) * sum / (1 + sum));  // Eq. (4)
}

void DesignEvaluator::Data::sumUp(const Base& base, const Model& model, Evaluation& out) const {
  for (size_t i = 0; i < objective.size(); ++i) {
    out.terms.push_back(calcTerm(i, base, model, out.motions));
    out.value += objective[i].weight * out.terms[i] / start.terms[i];  // Eq. (1)
  }
  checkConstraints(base, model, out);
}

DesignEvaluator::DesignEvaluator(const Parametrization& robot, std::vector<DesignMotion> motions,
                                 std::vector<ObjectiveTerm> objective, const EvaluationOptions& options)
    : data_(new Data{robot, std::move(motions), std::move(objective), options, 0, {}, {}, {}, {}}) {
  data_->checkSpec();
  data_->solveStart();
}
DesignEvaluator::~DesignEvaluator() = default;

const Evaluation& DesignEvaluator::start() const { return data_->start; }
const Parametrization& DesignEvaluator::robot() const { return data_->robot; }
const std::vector<DesignMotion>& DesignEvaluator::motions() const { return data_->motions; }
const std::vector<ObjectiveTerm>& DesignEvaluator::objective() const { return data_->objective; }
const std::vector<DesignConstraint>& DesignEvaluator::constraints() const { return data_->options.constraints; }

Evaluation DesignEvaluator::Data::evaluate(const VectorXd& x, std::vector<MotionOutcome>* outcomes,
                                           std::optional<Model>* made) {
  Evaluation out;
  try {
    Model model = robot.make(x);
    const Base& base = getBase(x);
    if (!checkPostures(base, model, out)) return out;
    std::optional<Model> own;
    std::optional<Model>& kept = made ? *made : own;  // optima refer to it
    kept = std::move(model);
    makeMotions(base, *kept, out, outcomes);
    if (out.status == DesignStatus::Feasible) sumUp(base, *kept, out);
  } catch (const ModelError& error) {  // numbers that define no robot, postures from which no motion can start
    out.status = DesignStatus::MotionFailed;
    out.message = error.what();
    out.value = weight * 2;
  }
  return out;
}

Evaluation DesignEvaluator::evaluate(const VectorXd& x) const { return data_->evaluate(x); }

// Slopes of the motors; a failure is that of the first motion which has none.
std::vector<MotorSlopes> DesignEvaluator::Data::calcKeptSlopes(const Base& base, const Model& model, const VectorXd& x,
                                                               const std::vector<MotionOutcome>& outcomes) const {
  const std::vector<ModelVariation> variations = calcDesignVariations(robot, x);
  std::vector<MotorSlopes> slopes;
  for (size_t i = 0; i < outcomes.size(); ++i) {
    const SolvedMotion& from = *base.solved[i];
    slopes.push_back(calcMotorSlopes(model, from.kept_dofs, *from.serial, outcomes[i].lifted, variations,
                                     asked.count(Measure::Distance) > 0));
    if (!slopes.back().failure.empty()) break;
  }
  return slopes;
}

// Margins of the motions of the start design in the linkages of x; none where these cannot follow them.
MeasurePieces DesignEvaluator::Data::calcStartMargins(const Base& base, const Model& model, const VectorXd& x) const {
  const std::vector<MotorConversion> drives = makeDrives(model, options.drives);
  std::vector<MotionOutcome> outcomes;
  for (const auto& from : base.solved) {
    if (!from) return {};
    outcomes.push_back(keepMotion(model, *from->serial, drives, 0));
    if (!outcomes.back().lifted.lifted()) return {};
  }
  const std::vector<MotorSlopes> slopes = calcKeptSlopes(base, model, x, outcomes);
  return slopes.back().failure.empty() ? calcMarginPieces(kLimitShare * options.margin, slopes) : MeasurePieces();
}

MeasurePieces DesignEvaluator::Data::calcPieces(size_t i, const Base& base, const std::vector<MotorSlopes>& slopes,
                                                const RobotSlopes& robot_slopes) const {
  const ObjectiveTerm& term = objective[i];
  MeasurePieces out = term.measure == Measure::Cost
                          ? calcCostPiece(slopes)
                          : calcMeasurePieces(term.measure, base.term_motors[i], slopes, robot_slopes);
  const double scale = term.weight / start.terms[i];
  out.values *= scale;
  out.gradients *= scale;
  return out;
}

// Of the constraints. Motions made anew keep to the envelopes of motors as exactly as the solver keeps to anything: where they go along
// one, the design cannot move its share, which would be the violated constraint of a search if it were not given that much.
MeasurePieces DesignEvaluator::Data::calcLimits(const Base& base, const std::vector<MotorSlopes>& slopes,
                                                const RobotSlopes& robot_slopes) const {
  MeasurePieces out;
  for (size_t i = 0; i < options.constraints.size(); ++i) {
    const DesignConstraint& constraint = options.constraints[i];
    MeasurePieces pieces = calcConstraintPieces(constraint, base.constraint_motors[i], slopes, robot_slopes);
    if (constraint.measure == Measure::Envelope && options.mode == MotionMode::Reoptimized)
      pieces.values.array() -= 0.5 * kConstraintSlack;
    append(pieces, out);
  }
  return out;
}

SlopedEvaluation DesignEvaluator::differentiate(const VectorXd& x) const {
  Data& data = *data_;
  if (const auto obstacle = findGradientObstacle(data.options.mode, data.objective, data.options.constraints))
    throw ModelError(data.robot.startModel().name(), "search", obstacle->problem, obstacle->remedy);
  std::vector<MotionOutcome> outcomes;
  std::optional<Model> model;
  SlopedEvaluation out{data.evaluate(x, &outcomes, &model), {}, {}};
  const bool kept = data.options.mode == MotionMode::Kept;
  const Base& base = data.getBase(x);
  const auto is_made = [&](const MotionOutcome& outcome) { return kept ? outcome.lifted.lifted() : !!outcome.motion; };
  if (outcomes.size() < data.motions.size() || !std::all_of(outcomes.begin(), outcomes.end(), is_made)) return out;
  const std::vector<MotorSlopes> slopes = kept ? data.calcKeptSlopes(base, *model, x, outcomes)
                                               : calcOptimumSlopes(data.robot, x, data.motions, outcomes, data.asked);
  if (!slopes.back().failure.empty()) {
    out.evaluation = {DesignStatus::MotionFailed, 2 * data.weight, {}, {}, {}, slopes.back().failure};
    return out;
  }
  const RobotSlopes robot_slopes = calcRobotSlopes(data.robot, x, data.options.drives);
  for (size_t i = 0; i < data.objective.size(); ++i)
    out.terms.push_back(data.calcPieces(i, base, slopes, robot_slopes));
  if (kept) out.limits = calcMarginPieces(kLimitShare * data.options.margin, slopes);
  if (!kept && data.mustKeep()) {
    out.limits = data.calcStartMargins(base, *model, x);
    if (out.limits.values.size() == 0) {
      out.terms.clear();
      return out;
    }
  }
  append(data.calcLimits(base, slopes, robot_slopes), out.limits);
  return out;
}

}  // namespace bielle
