#include <algorithm>

#include "bielle/model/error.h"
#include "bielle/model/names.h"
#include "bielle/motion/registry.h"
#include "design/motor_change.h"
#include "design/spec.h"

namespace bielle {
namespace {

DesignMotion makeRequestedMotion(const std::string& file, const MotionSpec& motion) {
  MotionRequest request = findMotion(file, motion.motion).request;
  MotionRequest usual = request;
  for (const auto& [name, value] : motion.settings) {
    request.options.set(name, value);
    if (name != "time_step") usual.options.set(name, value);
  }
  return {motion.motion,
          [request](const Model& model, const StandingRobot& standing) { return request.plan(model, standing); },
          motion.weight, motion.payload, usual};
}

DesignEvaluator makeEvaluatorOf(const DesignSpec& spec) {
  std::vector<DesignMotion> motions;
  for (const MotionSpec& motion : spec.motions) motions.push_back(makeRequestedMotion(spec.path, motion));
  EvaluationOptions options;
  options.mode = spec.mode;
  options.drives = spec.drives;
  options.margin = spec.margin;
  options.constraints = spec.constraints;
  const Parametrization robot = makeParametrization(spec);
  if (!spec.motor_names.empty()) {
    const Model start = robot.make(robot.start());
    for (const auto& [name, entry] : spec.motor_names)
      if (findMotors(start, {name}).empty()) entry.failUnknown("motor", name, getNames(start.motors()));
  }
  return DesignEvaluator(robot, motions, spec.objective, options);
}

}  // namespace

DesignEvaluator makeEvaluator(const DesignSpec& spec) {
  try {
    return makeEvaluatorOf(spec);
  } catch (const InputError& error) {  // of a robot, where the file that names it is wrong
    if (error.source() == spec.path) throw;
    throw InputError(spec.path, (error.source().empty() ? "" : error.source() + ": ") + error.element(),
                     error.problem(), error.remedy());
  }
}

std::vector<std::string> listShortMotions(const DesignSpec& spec, const std::vector<DesignGoal>& goals) {
  std::vector<std::string> warnings;
  for (const MotionSpec& motion : spec.motions) {
    const auto reaches = [&motion](const DesignGoal& goal) {
      return goal.motion == motion.motion && goal.outcome.goal.kind == GoalKind::Speed;
    };
    const bool has_steps = std::any_of(motion.settings.begin(), motion.settings.end(),
                                       [](const auto& setting) { return setting.first == "steps"; });
    const bool moves = findMotion(spec.path, motion.motion).request.options.find("speed");
    if (!goals.empty() && has_steps && moves && std::none_of(goals.begin(), goals.end(), reaches))
      warnings.push_back(spec.path + ": the " + motion.motion +
                         " has too few steps to reach its speed: it starts and stops, and what it needs may change "
                         "otherwise than what a whole one needs; leave `steps` out");
  }
  return warnings;
}

}  // namespace bielle
