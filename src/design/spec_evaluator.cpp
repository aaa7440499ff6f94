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

}  // namespace

DesignEvaluator makeEvaluator(const DesignSpec& spec) {
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

}  // namespace bielle
