#include "bielle/design/parametrization.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "bielle/model/error.h"
#include "bielle/robots/robot_loader.h"
#include "design/draft.h"
#include "design/motor_change.h"
#include "design/open_choices.h"
#include "model/listing.h"
#include "model/number_text.h"

namespace bielle {
namespace {

struct Line {
  Vector3d from, aside, along;  // to = from + aside + along
};

Line getLine(const RobotDraft& draft, const LengthChange& change) {
  const RobotDraft::Place to = draft.getPlace(change.to);
  Line line;
  line.from = draft.getPlaceIn(to.body, change.from);
  line.aside = change.across.dot(to.p - line.from) * change.across;
  line.along = to.p - line.from - line.aside;
  return line;
}

double getLength(const RobotDraft& draft, const LengthChange& change) {
  return change.rod.empty() ? getLine(draft, change).along.norm() : draft.getRod(change.rod);
}

// `length` over the one in the robot as it was.
void setLength(RobotDraft& draft, const LengthChange& change, double length, double original) {
  if (!change.rod.empty()) return draft.setRod(change.rod, length);
  const Line line = getLine(draft, change);
  const double now = line.along.norm();
  draft.setPlace(change.to, line.from + line.aside + length / now * line.along);
  if (!change.stretched.empty()) draft.stretch(change.stretched, line.from, line.along / now, length / original);
}

std::string describeRange(double lower, double upper) {
  return formatNumber(lower, "%.5g") + " .. " + formatNumber(upper, "%.5g");
}

// Without its sign.
std::string describeDirection(const std::string& word, const Vector3d& direction) {
  if (direction.isZero()) return "";
  Eigen::Index largest = 0;
  direction.cwiseAbs().maxCoeff(&largest);
  const Vector3d d = direction[largest] < 0 ? Vector3d(-direction) : direction;
  std::string text;
  for (const double component : d) text += (text.empty() ? "" : ", ") + formatNumber(component + 0.0, "%.4g");
  return word + " [" + text + "]";
}

// What the variable sets, and no other one may.
std::vector<std::string> listTargets(const DesignVariable& variable, const Model& robot) {
  std::vector<std::string> out;
  if (!variable.parameter.empty()) out.push_back("parameter '" + variable.parameter + "'");
  for (const std::string& mass : variable.masses) out.push_back("parameter '" + mass + "'");
  for (const int m : findMotors(robot, variable.motors))
    out.push_back((variable.isChoice() ? "the type of motor '" : "the ratio of motor '") +
                  robot.motors()[static_cast<size_t>(m)].name + "'");
  for (const LengthChange& change : variable.lengths) {
    if (!change.rod.empty()) {
      out.push_back("the length of '" + change.rod + "'");
      continue;
    }
    const auto [first, second] = std::minmax(change.from, change.to);
    out.push_back("the distance of '" + first + "' and '" + second + "'" + describeDirection(" across", change.across));
  }
  for (const ShiftChange& shift : variable.shifts)
    out.push_back("the place of '" + shift.of + "'" + describeDirection(" along", shift.along));
  return out;
}

int getChoice(const DesignVariable& variable, double value) {
  return std::clamp(static_cast<int>(std::lround(value)), 0, static_cast<int>(variable.choices.size()) - 1);
}

}  // namespace

std::string describeValue(const DesignVariable& variable, double value) {
  if (variable.isChoice()) return variable.choices[static_cast<size_t>(getChoice(variable, value))];
  return formatNumber(value, "%.5g") + (variable.unit == "1" ? "" : " " + variable.unit);
}

Parametrization::Parametrization(Model model, std::vector<DesignVariable> variables, std::string source)
    : source_(std::move(source)), variables_(std::move(variables)), model_(std::move(model)) {
  start_ = VectorXd::Zero(static_cast<Eigen::Index>(variables_.size()));
  for (size_t i = 0; i < variables_.size(); ++i) {
    const DesignVariable& variable = variables_[i];
    const std::string element = "variable '" + variable.name + "'";
    if (variable.isChoice() && variable.types.empty())
      throw InputError(source_, element, "a given robot has no parts to choose",
                       "give the `motor` or the `ratio` of its motors, or a generator");
    const int kinds = !variable.lengths.empty() + !variable.shifts.empty() + !variable.motors.empty();
    if (!variable.parameter.empty() || kinds != 1)
      throw InputError(source_, element, "it is not a length, a shift, a ratio or a motor",
                       "give `length`, `shift`, `ratio` or `motor`; `parameter` is for generated robots");
    RobotDraft draft(model_);
    for (const ShiftChange& shift : variable.shifts) draft.getPlace(shift.of);
    for (size_t k = 0; k < variable.lengths.size(); ++k) {
      const LengthChange& change = variable.lengths[k];
      const double length = getLength(draft, change);
      if (k == 0) start_[static_cast<Eigen::Index>(i)] = length;
      if (!(length > 1e-9 && length + variable.lower - start_[static_cast<Eigen::Index>(i)] > 1e-9))
        throw InputError(
            source_, element,
            (change.rod.empty() ? "the distance of '" + change.from + "' and '" + change.to + "'"
                                : "the length of '" + change.rod + "'") +
                " is zero, or would become zero",
            change.rod.empty() ? "name two separate places, or raise the lower bound" : "raise the lower bound");
      setLength(draft, change, length, length);
    }
  }
  finish();
}

Parametrization::Parametrization(const std::string& generator, OptionValues settings,
                                 std::vector<DesignVariable> variables, std::string source)
    : source_(std::move(source)),
      generator_(findGenerator(generator, settings)),
      settings_(std::move(settings)),
      variables_(std::move(variables)) {
  const OptionSet parameters = getParameters();
  std::vector<std::string> continuous;
  start_ = VectorXd::Zero(static_cast<Eigen::Index>(variables_.size()));
  for (size_t i = 0; i < variables_.size(); ++i) {
    const DesignVariable& variable = variables_[i];
    if (variable.parameter.empty() && variable.motors.empty())
      throw InputError(source_, "variable '" + variable.name + "'",
                       "it is neither a parameter of the generator nor one of its motors",
                       "give `parameter`, `ratio` or `motor`; `length` and `shift` are for given robots");
    if (variable.parameter.empty()) continue;
    double& start = start_[static_cast<Eigen::Index>(i)];
    const Option& parameter = parameters.get(variable.parameter);
    if (variable.isChoice()) {
      const auto begin = variable.choices.begin(),
                 chosen = std::find(begin, variable.choices.end(), formatOption(parameter.value));
      start = chosen == variable.choices.end() ? 0 : static_cast<double>(chosen - begin);
      continue;
    }
    const double* value = std::get_if<double>(&parameter.value);
    if (!value)
      throw InputError(source_, "variable '" + variable.name + "'",
                       "parameter '" + parameter.name + "' does not vary continuously",
                       "give it `choices`, or set it for all designs");
    continuous.push_back(parameter.name);
    start = *value;
    const OptionBounds& bounds = parameter.bounds;
    if (!(variable.lower >= bounds.lower && variable.upper <= bounds.upper))
      throw InputError(source_, "variable '" + variable.name + "'",
                       "its bounds " + describeRange(variable.lower, variable.upper) +
                           " go beyond those of parameter '" + parameter.name + "', " +
                           describeRange(bounds.lower, bounds.upper) +
                           (parameter.unit == "1" ? "" : " " + parameter.unit),
                       "narrow them");
  }
  if (const auto unused = findUnused(generator, continuous, settings_, listOpenChoices(settings_, variables_))) {
    std::vector<std::string> names;
    for (const DesignVariable& variable : variables_)
      if (contains(unused->names, variable.parameter)) names.push_back("'" + variable.name + "'");
    throw InputError(source_, (names.size() == 1 ? "variable " : "variables ") + listItems(names), unused->problem,
                     unused->remedy);
  }
  finish();
}

// Of the robot before the variables change them.
OptionSet Parametrization::getParameters() const {
  OptionSet parameters = generator_->parameters;
  for (const auto& [name, value] : settings_) parameters.set(name, value);
  return parameters;
}

Model Parametrization::generate(const VectorXd& x) const {
  OptionSet parameters = getParameters();
  for (size_t i = 0; i < variables_.size(); ++i) {
    const DesignVariable& variable = variables_[i];
    const double value = x[static_cast<Eigen::Index>(i)];
    const size_t choice = variable.isChoice() ? static_cast<size_t>(getChoice(variable, value)) : 0;
    for (const std::string& mass : variable.masses) parameters.set(mass, variable.types[choice].drive.mass);
    if (variable.parameter.empty()) continue;
    if (variable.isChoice())
      parameters.set(variable.parameter, variable.choices[choice]);
    else
      parameters.set(variable.parameter, value);
  }
  return generator_->make(parameters);
}

// Types come before ratios, whatever the order of the variables.
Model Parametrization::changeMotors(Model model, const VectorXd& x) const {
  const auto is_of_motors = [](const DesignVariable& variable) { return !variable.motors.empty(); };
  if (std::none_of(variables_.begin(), variables_.end(), is_of_motors)) return model;
  std::vector<Motor> motors = model.motors();
  VectorXd gears = VectorXd::Zero(model.nu());  // what they weigh more
  for (const bool types : {true, false})
    for (size_t i = 0; i < variables_.size(); ++i) {
      const DesignVariable& variable = variables_[i];
      const double value = x[static_cast<Eigen::Index>(i)];
      if (variable.motors.empty() || variable.isChoice() != types) continue;
      for (int m : findMotors(model, variable.motors)) {
        Motor& motor = motors[static_cast<size_t>(m)];
        if (types)
          setType(variable.types[static_cast<size_t>(getChoice(variable, value))], motor);
        else
          gears[m] += setRatio(value, variable.gear, motor);
      }
    }
  RobotDraft draft(model);
  for (size_t m = 0; m < motors.size(); ++m) {
    const double gear = gears[static_cast<Eigen::Index>(m)];
    // A given robot carries its motors on their joints; one of a generator, where and as heavy as its parameters say.
    const double more = gear + (generator_ ? 0 : motors[m].drive.mass - model.motors()[m].drive.mass);
    if (motors[m].drive.mass > 0) motors[m].drive.mass += gear;
    draft.setMotor(static_cast<int>(m), motors[m]);
    if (more == 0) continue;
    const Joint& joint = model.joints()[static_cast<size_t>(motors[m].joint)];
    draft.addMass(joint.parent, joint.X_PJ.p, more);
  }
  return draft.build();
}

void Parametrization::refuseSharedTargets(const Model& robot) const {
  std::map<std::string, std::string> owners;
  for (const DesignVariable& variable : variables_)
    for (const std::string& target : listTargets(variable, robot)) {
      const std::string& owner = owners.emplace(target, variable.name).first->second;
      if (owner != variable.name)
        throw InputError(source_, "variables '" + owner + "' and '" + variable.name + "'", "both set " + target,
                         "keep one of them");
    }
}

// Of variables of motors: what is given, or that of the first of them. A type brings its ratio.
void Parametrization::readStart() {
  const Model robot = !generator_ ? model_ : generate(start_);
  refuseSharedTargets(robot);
  std::vector<Motor> motors = robot.motors();
  for (const bool choices : {true, false})
    for (size_t i = 0; i < variables_.size(); ++i) {
      const DesignVariable& variable = variables_[i];
      if (variable.isChoice() != choices) continue;
      double& start = start_[static_cast<Eigen::Index>(i)];
      if (variable.motors.empty()) {
        start = variable.start.value_or(start);
        continue;
      }
      const std::vector<int> named = findMotors(robot, variable.motors);
      if (named.empty())
        throw InputError(source_, "variable '" + variable.name + "'", "the robot has no such motor",
                         "`bielle info` lists them; * stands for any text");
      for (const int m : named)
        if (const Motor& motor = robot.motors()[static_cast<size_t>(m)];
            choices && !generator_ && !(motor.drive.mass > 0))
          throw InputError(source_, "variable '" + variable.name + "'",
                           "the mass of motor '" + motor.name + "', which its link includes, is not known",
                           "give the motor its `type` or its `mass` in the robot's YAML file");
      const MotorDrive& drive = motors[static_cast<size_t>(named.front())].drive;
      if (!choices) start = drive.ratio;
      for (size_t k = 0; k < variable.choices.size(); ++k)
        if (variable.choices[k] == drive.type) start = static_cast<double>(k);
      start = variable.start.value_or(start);
      for (int m : named)
        if (choices)
          setType(variable.types[static_cast<size_t>(getChoice(variable, start))], motors[static_cast<size_t>(m)]);
    }
}

void Parametrization::finish() {
  if (variables_.empty()) throw InputError(source_, "variables", "there are none", "name at least one");
  for (DesignVariable& variable : variables_)
    if (variable.isChoice()) variable.lower = 0, variable.upper = static_cast<double>(variable.choices.size()) - 1;
  readStart();
  lower_ = upper_ = start_;
  std::set<std::string> names;
  for (size_t i = 0; i < variables_.size(); ++i) {
    const DesignVariable& variable = variables_[i];
    const Eigen::Index k = static_cast<Eigen::Index>(i);
    lower_[k] = variable.lower, upper_[k] = variable.upper;
    TextStream bounds;
    bounds << variable.lower << " .. " << variable.upper;
    const std::string element = "variable '" + variable.name + "'";
    if (!names.insert(variable.name).second) throw InputError(source_, element, "it is given twice", "rename one");
    if (!(std::isfinite(variable.lower) && std::isfinite(variable.upper) &&
          (variable.isChoice() || variable.lower < variable.upper)))
      throw InputError(source_, element, "its bounds " + bounds.str() + " are in the wrong order",
                       "give the lower one first");
    if (!(start_[k] >= variable.lower && start_[k] <= variable.upper)) {
      TextStream problem;
      problem << "the robot has " << describeValue(variable, start_[k]) << ", outside its bounds " << bounds.str();
      throw InputError(source_, element, problem.str(),
                       variable.motors.empty() ? "widen the bounds" : "widen the bounds, or give `start`");
    }
  }
  if (!generator_) {
    changePlaces(start_);  // \throws what cannot be changed
    model_ = changeMotors(std::move(model_), start_);
    return;
  }
  model_ = make(start_);
}

std::vector<int> Parametrization::getArchitecture(const VectorXd& x) const {
  std::vector<int> parts;
  for (size_t i = 0; i < variables_.size(); ++i)
    if (variables_[i].isArchitecture()) parts.push_back(getChoice(variables_[i], x[static_cast<Eigen::Index>(i)]));
  return parts;
}

std::vector<Eigen::Index> Parametrization::listContinuous() const {
  std::vector<Eigen::Index> out;
  for (size_t i = 0; i < variables_.size(); ++i)
    if (!variables_[i].isChoice()) out.push_back(static_cast<Eigen::Index>(i));
  return out;
}

std::vector<VectorXd> Parametrization::listCombinations() const {
  std::vector<VectorXd> out = {start_};
  for (size_t i = 0; i < variables_.size(); ++i) {
    const size_t known = out.size(), count = variables_[i].choices.size();
    for (size_t choice = 0; choice < count; ++choice)
      for (size_t k = 0; k < known && static_cast<double>(choice) != start_[static_cast<Eigen::Index>(i)]; ++k) {
        out.push_back(out[k]);
        out.back()[static_cast<Eigen::Index>(i)] = static_cast<double>(choice);
      }
  }
  return out;
}

Model Parametrization::make(const VectorXd& x) const {
  if (x.size() != start_.size() || !x.allFinite())
    throw InputError(source_, "design", "it does not have one finite number for each variable");
  return changeMotors(!generator_ ? changePlaces(x) : generate(x), x);
}

Model Parametrization::changePlaces(const VectorXd& x) const {
  const RobotDraft original(model_);
  RobotDraft draft(model_);
  for (size_t i = 0; i < variables_.size(); ++i) {
    const Eigen::Index k = static_cast<Eigen::Index>(i);
    for (const ShiftChange& shift : variables_[i].shifts)
      draft.setPlace(shift.of, draft.getPlace(shift.of).p + x[k] * shift.along);
    for (const LengthChange& change : variables_[i].lengths) {
      const double length = getLength(original, change);
      // An unchanged value is reproduced up to the rounding of a square root.
      if (x[k] != start_[k] || getLength(draft, change) != length)
        setLength(draft, change, length + x[k] - start_[k], length);
    }
  }
  return draft.build();
}

}  // namespace bielle
