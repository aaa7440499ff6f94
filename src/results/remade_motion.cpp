#include "results/remade_motion.h"

#include "bielle/model/error.h"

namespace bielle {
namespace {

// Whole numbers may be written without a point.
double getNumber(const MotionSummary& summary, const std::string& name, const OptionValue& value) {
  if (const int* whole = std::get_if<int>(&value)) return *whole;
  if (const double* number = std::get_if<double>(&value)) return *number;
  throw InputError(summary.file, "option '" + name + "'", "it is not a number", "solve the motion again");
}

}  // namespace

LimitOptions readLimits(const MotionSummary& summary) {
  LimitOptions limits;
  const auto read = [&summary](const std::string& prefix, std::map<std::string, double>& to) {
    for (const auto& [name, value] : summary.options)
      if (name.rfind(prefix, 0) == 0) to[name.substr(prefix.size())] = getNumber(summary, name, value);
  };
  read(kEffortLimit, limits.efforts);
  read(kVelocityLimit, limits.velocities);
  read(kPowerLimit, limits.powers);
  read(kDeadPointMarginOf, limits.dead_point_margins);
  for (const auto& [name, value] : summary.options) {
    if (name == kDeadPointMargin) limits.dead_point_margin = getNumber(summary, name, value);
    if (name == kNoLimits) limits.enforced = false;
  }
  return limits;
}

Motion remakeMotion(const Model& model, const MotionSummary& summary) {
  const auto refuse = [&summary](const std::string& element, const std::string& problem, const std::string& remedy) {
    throw InputError(summary.file, element, problem, remedy);
  };
  if (summary.run.model != Belief::Closed)
    refuse("model", "it is that of the serial chain", "solve it without --model serial");
  if (!summary.timings.empty())
    refuse("free_timings", "durations are variables of this problem", "solve it without --free-timings");
  if (summary.objective.objective == Objective::PeakTorque)
    refuse("objective", "the largest torque is a variable of this problem", "solve it for effort or energy");
  ProblemOptions problem(summary.formulation, summary.step);
  problem.limits = readLimits(summary);
  problem.objective = summary.objective;
  return makeMotion(model, remakeRequest(summary), problem);
}

}  // namespace bielle
