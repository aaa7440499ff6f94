#include "design/architecture_start.h"

#include <algorithm>
#include <cmath>

#include "bielle/dynamics/assembly.h"
#include "bielle/dynamics/kinematics.h"
#include "bielle/model/error.h"
#include "design/motor_change.h"

namespace bielle {
namespace {

// Closes the loops with base and feet placed as in a posture of another design of the robot.
double calcPostureGap(const Model& start, const Model& model, const VectorXd& posture) {
  Workspace ws(start);
  updatePlacements(start, ws, posture);
  AssemblyProblem problem;
  problem.q_ref = posture;
  if (start.hasFreeFlyer()) problem.frames.push_back({start.bodies()[1].name, 1, SE3(), ws.X_WB[1]});
  for (size_t c = 0; c < start.contacts().size(); ++c) {
    const ContactFrame& from = start.contacts()[c];
    problem.frames.push_back(makeFrameTarget(model.contacts()[c], getPlacement(ws, from.body, from.X_BF)));
  }
  AssemblyOptions options;
  options.step = AssemblyStep::Shortest;
  options.tolerance = 1e-9;
  options.max_iterations = 30;
  options.continuation_steps = 4;
  const AssemblyResult result = assemble(model, problem, options);
  return result.status == NumericalStatus::Ok ? 0 : std::max(result.gap, options.tolerance);
}

std::vector<int> findNamed(const Model& model, const std::vector<std::string>& names, const char* where) {
  std::vector<std::string> unknown;
  std::vector<int> motors = findMotors(model, names, &unknown);
  if (!unknown.empty())
    throw InputError(model.name(), std::string(where) + ": motor '" + unknown.front() + "'", "there is no such motor",
                     "`bielle info` lists them; * stands for any text");
  for (int m = 0; m < model.nu() && names.empty(); ++m) motors.push_back(m);
  return motors;
}

std::vector<JointRange> findRangesOf(const Model& model, Measure measure, const JointAngles& requested,
                                     const char* where) {
  if (!isOfJoints(measure)) return {};
  return findRanges(model, requested, measure != Measure::Range, where);
}

void readNames(const std::vector<ObjectiveTerm>& objective, const std::vector<DesignConstraint>& constraints,
               ArchitectureStart& start) {
  const Model& model = start.model;
  for (const ObjectiveTerm& term : objective) {
    start.term_motors.push_back(findNamed(model, term.motors, "objective"));
    start.term_grids.emplace_back();
    if (term.measure == Measure::Workspace) start.term_grids.back() = makeWorkspaceGrid(model, term.region);
    start.term_ranges.push_back(findRangesOf(model, term.measure, term.range, "objective"));
  }
  for (const DesignConstraint& constraint : constraints) {
    start.constraint_ranges.push_back(findRangesOf(model, constraint.measure, constraint.range, "constraints"));
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
      throw InputError(model.name(), std::string("constraints: ") + getName(constraint.measure),
                       "none of the motors has such a limit",
                       "choose `motor` from a catalogue, or give the windings in the robot's YAML file");
    start.constraint_motors.push_back(std::move(named));
  }
}

}  // namespace

ArchitectureStart makeArchitectureStart(Model model, const std::vector<DesignMotion>& motions,
                                        const std::vector<ObjectiveTerm>& objective, const EvaluationOptions& options,
                                        bool must_solve, bool must_keep) {
  ArchitectureStart start{std::move(model), {}, {}, {}, {}, {}, {}, {}};
  readNames(objective, options.constraints, start);
  for (const DesignConstraint& constraint : options.constraints) {
    if (constraint.measure != Measure::Distance) continue;
    start.left_out.merge(findOverlaps(start.model));
    start.left_out.merge(findBodyPairs(start.model, constraint.except));
  }
  for (const DesignMotion& motion : motions) {
    start.solved.emplace_back();
    try {
      start.solved.back() = solveStartMotion(start.model, motion, options.solver, options.postures, must_keep);
    } catch (const InputError&) {  // designs are solved from the plan's guess
      if (must_solve) throw;
    }
  }
  return start;
}

double calcMeanGap(const ArchitectureStart& start, const Model& model) {
  double sum = 0;
  int count = 0;
  for (const auto& motion : start.solved)
    for (size_t p = 0; motion && p < motion->postures.size(); ++p) {
      sum += std::min(1.0, 10 * calcPostureGap(start.model, model, motion->postures[p]));  // Eq. (2)
      ++count;
    }
  return count > 0 ? sum / count : 0;
}

}  // namespace bielle
