#include "design/marks.h"

#include "bielle/formats/robot_writer.h"
#include "bielle/model/error.h"
#include "model/number_text.h"

namespace bielle {

std::string findBound(double lower, double upper, double value) {
  const double near = 1e-3 * (upper - lower);
  if (value - lower < near) return "lower";
  return upper - value < near ? "upper" : "";
}

std::string findBound(const DesignVariable& v, double value) {
  return v.isChoice() ? "" : findBound(v.lower, v.upper, value);
}

bool changesDesign(const Parametrization& robot, const VectorXd& x, size_t i) {
  const auto format_with = [&](double value) {
    VectorXd other = x;
    other[static_cast<Eigen::Index>(i)] = value;
    const RobotText text = formatRobot(robot.make(other));
    return text.urdf + text.yaml;
  };
  const DesignVariable& variable = robot.variables()[i];
  try {
    return variable.isArchitecture() || format_with(variable.lower) != format_with(variable.upper);
  } catch (const InputError&) {  // one of them defines no robot
    return true;
  }
}

std::string describeViolation(const DesignConstraint& constraint, double value) {
  if (calcViolation(constraint, value) == 0) return "";
  return std::string(getName(constraint.measure)) + " " + formatNumber(value, "%.4g") +
         (constraint.at_least ? " < " : " > ") + formatNumber(constraint.bound, "%.4g");
}

std::vector<std::string> listMarks(const DesignEvaluator& evaluator, const VectorXd& x,
                                   const std::vector<double>& constraints) {
  const Parametrization& robot = evaluator.robot();
  std::vector<std::string> marks;
  for (size_t i = 0; i < robot.variables().size(); ++i) {
    const std::string bound = findBound(robot.variables()[i], x[static_cast<Eigen::Index>(i)]);
    if (!bound.empty() && changesDesign(robot, x, i))
      marks.push_back(robot.variables()[i].name + " at its " + bound + " bound");
  }
  for (size_t i = 0; i < constraints.size(); ++i)
    if (const std::string text = describeViolation(evaluator.constraints()[i], constraints[i]); !text.empty())
      marks.push_back(text);
  return marks;
}

std::string formatMarks(const std::optional<double>& margin, const std::vector<std::string>& marks) {
  std::string text = margin ? "; margin " + formatNumber(*margin, "%.3f") : "";
  for (const std::string& mark : marks) text += "; " + mark;
  return text;
}

}  // namespace bielle
