// Evaluations with gradients.
#include <algorithm>

#include "bielle/model/error.h"
#include "design/evaluation_data.h"
#include "design/motion_slopes.h"

namespace bielle {
namespace {

constexpr double kLimitShare = 1.01;  // of the margin: searches that end at a limit end inside it

// Why there are no slopes, or empty: that of the last motion, after which none were calculated.
const std::string& getFailure(const std::vector<MotorSlopes>& slopes) {
  static const std::string none;
  return slopes.empty() ? none : slopes.back().failure;
}

}  // namespace

std::optional<GradientObstacle> findGradientObstacle(MotionMode mode, const std::vector<ObjectiveTerm>& objective,
                                                     const std::vector<DesignConstraint>& constraints) {
  for (const DesignConstraint& constraint : constraints)
    if (!hasGradient(constraint.measure))
      return GradientObstacle{
          std::string("it needs gradients, which the constraint on ") + getName(constraint.measure) + " does not have",
          "use bobyqa or sbplx, or leave out that constraint"};
  for (const ObjectiveTerm& term : objective) {
    const std::string name = getName(term.measure);
    if (!hasGradient(term.measure))
      return GradientObstacle{"it needs gradients, which " + name + " does not have",
                              "choose a torque, an energy, the cost or the mass, or use bobyqa or sbplx"};
    if (term.measure == Measure::Cost && mode == MotionMode::Kept)
      return GradientObstacle{"kept motions have no cost", "give `mode: reoptimized`"};
  }
  return {};
}

// Margins of the motions of the start design in the linkages of x; none where these cannot follow them.
MeasurePieces DesignEvaluator::Data::calcStartMargins(const ArchitectureStart& base, const Model& model,
                                                      const VectorXd& x) const {
  const std::vector<MotorConversion> drives = makeDrives(model, options.drives);
  std::vector<MotionOutcome> outcomes;
  for (size_t i = 0; i < motions.size(); ++i) {
    if (!base.solved[i]) return {};
    outcomes.push_back(keepMotion(model, motions[i], *base.solved[i], drives, 0));
    if (!outcomes.back().lifted.lifted()) return {};
  }
  const std::vector<MotorSlopes> slopes =
      calcKeptSlopes(robot, x, motions, base.solved, outcomes, {Measure::Margin}, base.left_out);
  return getFailure(slopes).empty() ? calcMarginPieces(kLimitShare * options.margin, slopes) : MeasurePieces();
}

MeasurePieces DesignEvaluator::Data::calcPieces(size_t i, const ArchitectureStart& base,
                                                const std::vector<MotorSlopes>& slopes,
                                                const RobotSlopes& robot_slopes) const {
  const ObjectiveTerm& term = objective[i];
  MeasurePieces out = calcMeasurePieces(term.measure, base.term_motors[i], slopes, listWeights(), robot_slopes);
  const double scale = term.weight / start.terms[i];
  out.values *= scale;
  out.gradients *= scale;
  return out;
}

// Of the constraints. Motions made anew keep to the envelopes of motors as exactly as the solver keeps to anything: where they go along
// one, the design cannot move its share, which would be the violated constraint of a search if it were not given that much.
MeasurePieces DesignEvaluator::Data::calcLimits(const ArchitectureStart& base, const std::vector<MotorSlopes>& slopes,
                                                const RobotSlopes& robot_slopes) const {
  MeasurePieces out;
  for (size_t i = 0; i < options.constraints.size(); ++i) {
    const DesignConstraint& constraint = options.constraints[i];
    MeasurePieces pieces =
        calcConstraintPieces(constraint, base.constraint_motors[i], slopes, listWeights(constraint), robot_slopes);
    if (constraint.measure == Measure::Envelope && options.mode == MotionMode::Reoptimized)
      pieces.values.array() -= 0.5 * kConstraintSlack;
    append(pieces, out);
  }
  return out;
}

SlopedEvaluation DesignEvaluator::differentiate(const VectorXd& x) const {
  Data& data = *data_;
  if (const auto obstacle = findGradientObstacle(data.options.mode, data.objective, data.options.constraints))
    throw InputError(data.robot.startModel().name(), "search", obstacle->problem, obstacle->remedy);
  std::vector<MotionOutcome> outcomes;
  std::optional<Model> model;
  SlopedEvaluation out{data.evaluate(x, &outcomes, &model), {}, {}};
  const bool kept = data.options.mode == MotionMode::Kept;
  const ArchitectureStart& base = data.getBase(x);
  const auto is_made = [&](const MotionOutcome& outcome) {
    return kept ? outcome.lifted.lifted() : outcome.solution.has_value();
  };
  if (outcomes.size() < data.motions.size() || !std::all_of(outcomes.begin(), outcomes.end(), is_made)) return out;
  std::set<Measure> requested = data.requested;
  if (kept) requested.insert(Measure::Margin);
  const std::vector<MotorSlopes> slopes =
      kept ? calcKeptSlopes(data.robot, x, data.motions, base.solved, outcomes, requested, base.left_out)
           : calcOptimumSlopes(data.robot, x, data.motions, outcomes, requested, base.left_out);
  if (const std::string& failure = getFailure(slopes); !failure.empty()) {
    out.evaluation = {DesignStatus::MotionFailed, 2 * data.weight, {}, {}, {}, failure, {}};
    return out;
  }
  const RobotSlopes robot_slopes = calcRobotSlopes(data.robot, x, data.options.drives);
  for (size_t i = 0; i < data.objective.size(); ++i)
    out.terms.push_back(data.calcPieces(i, base, slopes, robot_slopes));
  if (kept) out.limits = calcMarginPieces(kLimitShare * data.options.margin, slopes);
  if (!kept && data.mustKeep()) {
    out.limits = data.calcStartMargins(base, *model, x);
    if (out.limits.values.size() == 0 && !slopes.empty()) {
      out.terms.clear();
      return out;
    }
  }
  append(data.calcLimits(base, slopes, robot_slopes), out.limits);
  append(calcGoalPieces(slopes), out.limits);
  return out;
}

}  // namespace bielle
