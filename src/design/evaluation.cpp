#include "design/evaluation.h"

#include <algorithm>
#include <cmath>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "design/optimum_gradient.h"

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

}  // namespace

struct DesignEvaluator::Data {
  const Parametrization& robot;
  std::vector<DesignMotion> motions;
  std::vector<ObjectiveTerm> objective;
  EvaluationOptions options;
  std::vector<MotorConversion> drives;
  std::vector<std::vector<int>> term_motors;
  std::vector<std::optional<WorkspaceGrid>> term_grids;
  double weight = 0;  // W
  std::vector<SolvedMotion> solved;
  Evaluation start;

  // Whether motions of the start design are transferred to other designs.
  bool mustKeep() const { return options.mode == MotionMode::Kept || options.margin > EvaluationOptions().margin; }
  void readObjective();
  void solveStart();
  void makeMotions(const Model& model, Evaluation& out, std::vector<MotionOutcome>* outcomes = nullptr) const;
  // \param made  the model of the outcomes, if they are asked for
  Evaluation evaluate(const VectorXd& x, std::vector<MotionOutcome>* outcomes = nullptr,
                      std::optional<Model>* made = nullptr) const;
  std::vector<MotorSlopes> calcKeptSlopes(const Model& model, const VectorXd& x,
                                          const std::vector<MotionOutcome>& outcomes) const;
  MeasurePieces calcStartMargins(const Model& model, const VectorXd& x) const;
  MeasurePieces calcPieces(size_t i, const std::vector<MotorSlopes>& slopes) const;
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
  for (const ObjectiveTerm& term : objective) {
    const std::string name = getName(term.measure);
    if (!hasGradient(term.measure))
      return GradientObstacle{"it needs gradients, which " + name + " does not have",
                              "choose a torque, an energy or the cost, or give bobyqa or sbplx"};
    if (term.measure == Measure::Cost && mode == MotionMode::Kept)
      return GradientObstacle{"motions that are kept have no cost", "give `mode: reoptimized`"};
  }
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
  for (const DesignMotion& motion : motions)
    solved.push_back(solveStartMotion(model, motion, options.solver, options.postures, mustKeep()));
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

void DesignEvaluator::Data::makeMotions(const Model& model, Evaluation& out,
                                        std::vector<MotionOutcome>* outcomes) const {
  double missing = 0;
  for (size_t i = 0; i < motions.size(); ++i) {
    MotionOutcome outcome = options.mode == MotionMode::Kept
                                ? keepMotion(model, *solved[i].serial, drives, options.margin)
                                : remakeMotion(model, motions[i], solved[i], options.solver, drives);
    missing += outcome.missing / static_cast<double>(motions.size());
    const bool failed = outcome.missing > 0 || !std::isfinite(outcome.measures.conditioning);
    if (failed && out.status == DesignStatus::Feasible) {
      out.status = DesignStatus::MotionFailed;
      out.message = outcome.missing > 0 ? outcome.message : "a dead point of the motors";
      out.value = weight * (1.5 + 0.5 * std::max(missing, 1e-3));
    }
    if (failed && !outcomes) return;
    out.motions.push_back(outcome.measures);
    if (outcomes) outcomes->push_back(std::move(outcome));
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

Evaluation DesignEvaluator::Data::evaluate(const VectorXd& x, std::vector<MotionOutcome>* outcomes,
                                           std::optional<Model>* made) const {
  Evaluation out;
  try {
    Model model = robot.make(x);
    if (!checkPostures(model, out)) return out;
    std::optional<Model> own;
    std::optional<Model>& kept = made ? *made : own;  // optima refer to it
    kept = std::move(model);
    makeMotions(*kept, out, outcomes);
    if (out.status == DesignStatus::Feasible) sumUp(*kept, out);
  } catch (const ModelError& error) {  // numbers that define no robot, postures from which no motion can start
    out.status = DesignStatus::MotionFailed;
    out.message = error.what();
    out.value = weight * 2;
  }
  return out;
}

Evaluation DesignEvaluator::evaluate(const VectorXd& x) const { return data_->evaluate(x); }

// Slopes of the motors; a failure is that of the first motion which has none.
std::vector<MotorSlopes> DesignEvaluator::Data::calcKeptSlopes(const Model& model, const VectorXd& x,
                                                               const std::vector<MotionOutcome>& outcomes) const {
  const std::vector<ModelVariation> variations = calcDesignVariations(robot, x);
  std::vector<MotorSlopes> slopes;
  for (size_t i = 0; i < outcomes.size(); ++i) {
    slopes.push_back(calcMotorSlopes(model, solved[i].kept_dofs, *solved[i].serial, outcomes[i].lifted, variations));
    if (!slopes.back().failure.empty()) break;
  }
  return slopes;
}

// Margins of the motions of the start design in the linkages of x; none where these cannot follow them.
MeasurePieces DesignEvaluator::Data::calcStartMargins(const Model& model, const VectorXd& x) const {
  std::vector<MotionOutcome> outcomes;
  for (const SolvedMotion& start : solved) {
    outcomes.push_back(keepMotion(model, *start.serial, drives, 0));
    if (!outcomes.back().lifted.lifted()) return {};
  }
  const std::vector<MotorSlopes> slopes = calcKeptSlopes(model, x, outcomes);
  return slopes.back().failure.empty() ? calcMarginPieces(kLimitShare * options.margin, slopes) : MeasurePieces();
}

MeasurePieces DesignEvaluator::Data::calcPieces(size_t i, const std::vector<MotorSlopes>& slopes) const {
  const ObjectiveTerm& term = objective[i];
  MeasurePieces out = term.measure == Measure::Cost ? calcCostPiece(slopes)
                                                    : calcMeasurePieces(term.measure, term_motors[i], slopes, drives);
  const double scale = term.weight / start.terms[i];
  out.values *= scale;
  out.gradients *= scale;
  return out;
}

SlopedEvaluation DesignEvaluator::differentiate(const VectorXd& x) const {
  const Data& data = *data_;
  if (const auto obstacle = findGradientObstacle(data.options.mode, data.objective))
    throw ModelError(data.robot.startModel().name(), "search", obstacle->problem, obstacle->remedy);
  std::vector<MotionOutcome> outcomes;
  std::optional<Model> model;
  SlopedEvaluation out{data.evaluate(x, &outcomes, &model), {}, {}};
  const bool kept = data.options.mode == MotionMode::Kept;
  const auto is_made = [&](const MotionOutcome& outcome) { return kept ? outcome.lifted.lifted() : !!outcome.motion; };
  if (outcomes.size() < data.motions.size() || !std::all_of(outcomes.begin(), outcomes.end(), is_made)) return out;
  const std::vector<MotorSlopes> slopes =
      kept ? data.calcKeptSlopes(*model, x, outcomes) : calcOptimumSlopes(data.robot, x, data.motions, outcomes);
  if (!slopes.back().failure.empty()) {
    out.evaluation = {DesignStatus::MotionFailed, 2 * data.weight, {}, {}, slopes.back().failure};
    return out;
  }
  for (size_t i = 0; i < data.objective.size(); ++i) out.terms.push_back(data.calcPieces(i, slopes));
  if (kept) out.limits = calcMarginPieces(kLimitShare * data.options.margin, slopes);
  if (kept || !data.mustKeep()) return out;
  out.limits = data.calcStartMargins(*model, x);
  if (out.limits.values.size() == 0) out.terms.clear();
  return out;
}

}  // namespace bielle
