#include "design/evaluation.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bielle/model/error.h"
#include "design/evaluation_data.h"
#include "model/number_text.h"

namespace bielle {

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
    case DesignStatus::GoalMissed:
      return "goal missed";
    case DesignStatus::MotionFailed:
      break;
  }
  return "motion failed";
}

void DesignEvaluator::Data::checkSpec() {
  const Model& model = robot.startModel();
  makeDrives(model, options.drives);  // \throws what is wrong with them
  const auto is_of_motions = [](const auto& asked_for) { return !isOfRobot(asked_for.measure); };
  const bool needs_motions = std::any_of(objective.begin(), objective.end(), is_of_motions) ||
                             std::any_of(options.constraints.begin(), options.constraints.end(), is_of_motions);
  if (motions.empty() && needs_motions)
    throw InputError(model.name(), "motions", "there are none", "name at least one");
  for (const DesignMotion& motion : motions) {
    if (!(motion.weight >= 0 && std::isfinite(motion.weight)))
      throw InputError(model.name(), "motion '" + motion.name + "'", "its weight is negative or not finite",
                       "give 0 or more");
    addPayload(model, motion.payload);  // \throws what is wrong with it
  }
  if (objective.empty()) throw InputError(model.name(), "objective", "it is empty", "name a measure");
  for (const ObjectiveTerm& term : objective) {
    if (!(term.weight > 0 && std::isfinite(term.weight)))
      throw InputError(model.name(), std::string("objective: ") + getName(term.measure), "its weight is not positive",
                       "give a positive number");
    weight += term.weight;
    requested.insert(term.measure);
  }
  for (const DesignConstraint& constraint : options.constraints) {
    requested.insert(constraint.measure);
    for (const auto& names : constraint.except) {  // bodies of one architecture may be missing in others
      const auto has = [&](const VectorXd& x) { return !findBodyPairs(robot.make(x), {names}).empty(); };
      const std::vector<VectorXd> all = robot.listCombinations();
      if (std::none_of(all.begin(), all.end(), has))
        throw InputError(model.name(), "constraints: distance: except [" + names[0] + ", " + names[1] + "]",
                         "there are no two such bodies", "`bielle info` lists them; * stands for any text");
    }
    if (constraint.measure == Measure::Margin && model.serialJoints().empty())
      throw InputError(model.name(), "constraints: margin", "the robot has no serial joints, which the margin is about",
                       "name them in its YAML file, `serial_joints`");
  }
}

const ArchitectureStart& DesignEvaluator::Data::getBase(const VectorXd& x) {
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
    base->start = makeArchitectureStart(robot.make(start_of_parts), motions, objective, options,
                                        start_of_parts == robot.start(), mustKeep());
  });
  return *base->start;
}

std::vector<double> DesignEvaluator::Data::listWeights() const {
  std::vector<double> weights;
  for (const DesignMotion& motion : motions) weights.push_back(motion.weight);
  return weights;
}

std::vector<double> DesignEvaluator::Data::listWeights(const DesignConstraint& constraint) const {
  return isSum(constraint.measure) ? listWeights() : std::vector<double>();
}

void DesignEvaluator::Data::solveStart() {
  const ArchitectureStart& base = getBase(robot.start());
  const Model& model = base.model;
  makeMotions(base, model, start);
  if (start.status != DesignStatus::Feasible)
    throw InputError(model.name(), "start design", start.message, "request a motion that the robot can make");
  JointWays ways(model);
  for (size_t i = 0; i < objective.size(); ++i) {
    start.terms.push_back(calcTerm(i, base, model, ways, start.motions));
    if (!(start.terms[i] > 0 && std::isfinite(start.terms[i])))
      throw InputError(model.name(), std::string("objective: ") + getName(objective[i].measure),
                       "its value at the start design is zero or infinite",
                       "choose another measure, other motors or other weights of motions");
  }
  start.value = weight;
  checkConstraints(base, model, ways, start);
}

void DesignEvaluator::Data::makeMotions(const ArchitectureStart& base, const Model& model, Evaluation& out,
                                        std::vector<MotionOutcome>* outcomes) const {
  const std::vector<MotorConversion> drives = makeDrives(model, options.drives);
  double missing = 0;
  for (size_t i = 0; i < motions.size(); ++i) {
    const SolvedMotion* from = base.solved[i] ? &*base.solved[i] : nullptr;
    if (!from && options.mode == MotionMode::Kept)
      throw InputError(model.name(), motions[i].name, "the start design with these parts cannot make it",
                       "leave them out");
    MotionOutcome outcome = options.mode == MotionMode::Kept
                                ? keepMotion(model, motions[i], *from, drives, options.margin)
                                : remakeMotion(model, motions[i], from, options.solver, drives);
    missing += outcome.missing / static_cast<double>(motions.size());
    const bool made =
        addMotion(motions[i].name, base, missing,
                  outcome.solution ? outcome.solution->trajectory : outcome.lifted.trajectory, outcome, out);
    if (!made && !outcomes) return;
    if (outcomes) outcomes->push_back(std::move(outcome));
  }
}

bool DesignEvaluator::Data::addMotion(const std::string& name, const ArchitectureStart& base, double missing,
                                      const ShootingTrajectory& trajectory, MotionOutcome& outcome,
                                      Evaluation& out) const {
  const bool failed = outcome.missing > 0 || !std::isfinite(outcome.measures.conditioning);
  if (failed && out.status == DesignStatus::Feasible) {
    out.status = DesignStatus::MotionFailed;
    out.message = outcome.missing > 0 ? outcome.message : name + ": a dead point of the motors";
    out.value = weight * (1.5 + 0.5 * std::max(missing, 1e-3));
  }
  if (!failed) addLimitMeasures(*outcome.loaded, trajectory, requested, base.left_out, outcome.measures);
  out.motions.push_back(outcome.measures);
  if (!failed && !outcome.loaded->serialJoints().empty())
    out.margin = std::min(out.margin.value_or(outcome.measures.margin), outcome.measures.margin);
  for (const GoalOutcome& goal : outcome.goals) out.goals.push_back({name, goal});
  return !failed;
}

bool DesignEvaluator::Data::checkPostures(const ArchitectureStart& base, const Model& model, Evaluation& out) const {
  const double gap = calcMeanGap(base, model);
  if (gap == 0) return true;
  out.status = DesignStatus::LoopOpen;
  out.message = "a loop cannot be closed at a posture where the start design can";
  out.value = weight * (2 + gap);
  return false;
}

namespace {

// The worst of the joints.
double calcOfJoints(Measure measure, JointWays& ways, const std::vector<JointRange>& ranges) {
  double value = isLeast(measure) ? std::numeric_limits<double>::infinity() : 0;
  for (const JointRange& range : ranges) {
    const RangeCoverage coverage = ways.calcCoverage(range);
    value = measure == Measure::Range        ? std::min(value, coverage.share)
            : measure == Measure::LeastRatio ? std::min(value, coverage.least)
                                             : std::max(value, coverage.largest);
  }
  return value;
}

}  // namespace

double DesignEvaluator::Data::calcTerm(size_t i, const ArchitectureStart& base, const Model& model, JointWays& ways,
                                       const std::vector<MotionMeasures>& measures) const {
  const Measure measure = objective[i].measure;
  if (measure == Measure::Mass) return model.mass();
  if (isOfJoints(measure)) {
    constexpr double kLeastShare = 0.01;
    const double value = calcOfJoints(measure, ways, base.term_ranges[i]);
    const double term = measure == Measure::LargestRatio
                            ? value
                            : 1 / (measure == Measure::Range ? std::max(value, kLeastShare) : value);
    if (!std::isfinite(term))
      throw InputError(model.name(), std::string("objective: ") + getName(measure),
                       "the joint has a dead point in its angles", "narrow `angles`");
    return term;
  }
  const std::optional<WorkspaceGrid>& grid = base.term_grids[i];
  if (!grid) return getMeasure(objective[i].measure, base.term_motors[i], measures, listWeights());
  return 1 / std::max(calcCoverage(model, *grid).share, 0.5 / static_cast<double>(grid->placements.size()));
}

namespace {

// The bodies of the least distance of all motions.
std::string getNearest(const std::vector<MotionMeasures>& motions) {
  const auto is_nearer = [](const MotionMeasures& a, const MotionMeasures& b) { return a.distance < b.distance; };
  return std::min_element(motions.begin(), motions.end(), is_nearer)->nearest;
}

}  // namespace

void DesignEvaluator::Data::checkConstraints(const ArchitectureStart& base, const Model& model, JointWays& ways,
                                             Evaluation& out) const {
  double sum = 0;
  for (size_t i = 0; i < options.constraints.size(); ++i) {
    const DesignConstraint& constraint = options.constraints[i];
    const double value =
        constraint.measure == Measure::Mass ? model.mass()
        : isOfJoints(constraint.measure)
            ? calcOfJoints(constraint.measure, ways, base.constraint_ranges[i])
            : getMeasure(constraint.measure, base.constraint_motors[i], out.motions, listWeights(constraint));
    const double violation = calcViolation(constraint, value);
    out.constraints.push_back(value);
    if (violation > 0)
      out.message += (sum > 0 ? ", " : "") + std::string(getName(constraint.measure)) + " is " +
                     formatNumber(value, "%.4g") + (constraint.at_least ? " < " : " > ") +
                     formatNumber(constraint.bound, "%.4g") +
                     (constraint.measure == Measure::Distance ? " (" + getNearest(out.motions) + ")" : "");
    sum += violation;
  }
  if (sum > 0) out.status = DesignStatus::Violated;
  for (const DesignGoal& goal : out.goals) {
    const double miss = calcMiss(goal.outcome);
    if (miss == 0) continue;
    out.message += (sum > 0 ? ", " : "") + describeGoal(goal) + ": " + formatOutcome(goal.outcome);
    out.status = DesignStatus::GoalMissed;
    sum += miss;
  }
  if (sum == 0) return;
  out.value = weight * (1.5 + 0.5 / static_cast<double>(motions.size() + 1) * sum / (1 + sum));  // Eq. (4)
}

std::string describeGoal(const DesignGoal& goal) { return goal.motion + ": " + goal.outcome.goal.name; }

void DesignEvaluator::Data::sumUp(const ArchitectureStart& base, const Model& model, Evaluation& out) const {
  JointWays ways(model);
  for (size_t i = 0; i < objective.size(); ++i) {
    out.terms.push_back(calcTerm(i, base, model, ways, out.motions));
    out.value += objective[i].weight * out.terms[i] / start.terms[i];  // Eq. (1)
  }
  checkConstraints(base, model, ways, out);
}

DesignEvaluator::DesignEvaluator(const Parametrization& robot, std::vector<DesignMotion> motions,
                                 std::vector<ObjectiveTerm> objective, const EvaluationOptions& options)
    : data_(new Data{robot, std::move(motions), std::move(objective), options, 0, {}, {}, {}, {}}) {
  data_->checkSpec();
  data_->solveStart();
}
DesignEvaluator::~DesignEvaluator() = default;

const Evaluation& DesignEvaluator::start() const { return data_->start; }
std::vector<std::string> DesignEvaluator::listLeftOut(const VectorXd& x) const {
  const ArchitectureStart& base = data_->getBase(x);
  std::vector<std::string> names;
  for (const auto& [a, b] : base.left_out) names.push_back(describePair(base.model, a, b));
  return names;
}
const Parametrization& DesignEvaluator::robot() const { return data_->robot; }
const std::vector<DesignMotion>& DesignEvaluator::motions() const { return data_->motions; }
const std::vector<ObjectiveTerm>& DesignEvaluator::objective() const { return data_->objective; }
const std::vector<DesignConstraint>& DesignEvaluator::constraints() const { return data_->options.constraints; }

Evaluation DesignEvaluator::Data::evaluate(const VectorXd& x, std::vector<MotionOutcome>* outcomes,
                                           std::optional<Model>* made) {
  Evaluation out;
  try {
    Model model = robot.make(x);
    const ArchitectureStart& base = getBase(x);
    if (!checkPostures(base, model, out)) return out;
    makeMotions(base, model, out, outcomes);
    if (out.status == DesignStatus::Feasible) sumUp(base, model, out);
    if (made) *made = std::move(model);
  } catch (const InputError& error) {  // numbers that define no robot, postures from which no motion can start
    out.status = DesignStatus::MotionFailed;
    out.message = error.what();
    out.value = weight * 2;
  }
  return out;
}

Evaluation DesignEvaluator::evaluate(const VectorXd& x, std::vector<MotionOutcome>* outcomes) const {
  return data_->evaluate(x, outcomes);
}

Evaluation DesignEvaluator::solveUsually(const VectorXd& x) const {
  Evaluation out;
  const Model model = data_->robot.make(x);
  const ArchitectureStart& base = data_->getBase(x);
  const std::vector<MotorConversion> drives = makeDrives(model, data_->options.drives);
  for (const DesignMotion& motion : data_->motions) {
    MotionOutcome outcome;
    ShootingTrajectory trajectory;
    try {
      outcome = bielle::solveUsually(model, motion, drives, trajectory);
    } catch (const InputError& error) {  // there is no guess to start from
      outcome.message = motion.name + ": " + error.what();
    }
    if (!data_->addMotion(motion.name, base, 1, trajectory, outcome, out)) return out;
  }
  data_->sumUp(base, model, out);
  return out;
}

}  // namespace bielle
