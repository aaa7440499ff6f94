// The output of a design run: the robot, the table, the figures.
#include <algorithm>
#include <filesystem>
#include <numeric>
#include <sstream>

#include "bielle/dynamics/assembly.h"
#include "bielle/formats/robot_writer.h"
#include "bielle/model/builder.h"
#include "bielle/model/error.h"
#include "bielle/results/result.h"
#include "bielle/results/robot_info.h"
#include "design/figures.h"
#include "design/motor_change.h"
#include "design/run.h"
#include "formats/text_file.h"
#include "model/number_text.h"

namespace fs = std::filesystem;

namespace bielle {
namespace {

std::string format(double value, const char* pattern = "%.4g") { return formatNumber(value, pattern); }

std::string formatChange(double before, double after) {
  return before > 0 ? format(100 * (after / before - 1), "%+.1f %%") : "";
}

// Rounding of what is nothing.
double dropNoise(double value) { return std::abs(value) < 1e-9 ? 0 : value; }

void writeRow(std::ostream& out, const std::string& name, double before, double after) {
  before = dropNoise(before), after = dropNoise(after);
  out << "| " << name << " | " << format(before) << " | " << format(after) << " | " << formatChange(before, after)
      << " |\n";
}

std::string getFrontName(size_t i) { return (i < 9 ? "0" : "") + std::to_string(i + 1); }

std::string formatBounds(const DesignVariable& v) {
  if (!v.isChoice()) return format(v.lower) + " .. " + format(v.upper);
  std::string text;
  for (const std::string& choice : v.choices) text += (text.empty() ? "" : ", ") + choice;
  return text;
}

// Without the unit.
std::string formatValue(const DesignVariable& v, double value) {
  return v.isChoice() ? describeValue(v, value) : format(value, "%.5g");
}

// Whether a design changes with variable i: parameters of parts that it does not have change nothing.
bool matters(const Parametrization& robot, const VectorXd& x, size_t i) {
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

// The value of variable i without its unit, or that it means nothing.
std::string formatOwn(const Parametrization& robot, const VectorXd& x, size_t i) {
  return matters(robot, x, i) ? formatValue(robot.variables()[i], x[static_cast<Eigen::Index>(i)]) : "–";
}

void writeConstraints(std::ostream& out, const DesignEvaluator& evaluator, const DesignRun& run) {
  if (evaluator.constraints().empty()) return;
  out << "\n| constraint | bound | before | after |\n|---|---|---|---|\n";
  for (size_t i = 0; i < evaluator.constraints().size() && i < run.evaluation.constraints.size(); ++i) {
    const DesignConstraint& constraint = evaluator.constraints()[i];
    out << "| " << describeMeasure(constraint.measure, constraint.motors) << " | at "
        << (constraint.at_least ? "least " : "most ") << format(constraint.bound) << " | "
        << format(evaluator.start().constraints[i]) << " | " << format(run.evaluation.constraints[i]) << " |\n";
  }
  const std::vector<std::string> left_out = evaluator.listLeftOut(run.best);
  for (const std::string& pair : left_out)
    out << (&pair == &left_out.front() ? "\nThe distance ignores bodies that overlap as drawn, or by name: " : "; ")
        << pair;
  if (!left_out.empty()) out << ".\n";
}

// Of a goal that was missed, that it was.
std::string formatAchieved(const GoalOutcome& outcome) {
  return format(outcome.achieved) + (outcome.met() ? "" : ", **missed**");
}

std::string formatRequested(const Goal& goal) {
  const std::string unit = getUnit(goal.kind);
  return format(goal.requested) + " ± " + format(goal.tolerance) + (unit == "1" ? "" : " " + unit);
}

void writeGoals(std::ostream& out, const std::vector<DesignGoal>& before, const std::vector<DesignGoal>& after) {
  for (size_t i = 0; i < std::min(before.size(), after.size()); ++i)
    out << (i == 0 ? "\n| goal | requested | before | after |\n|---|---|---|---|\n" : "") << "| "
        << describeGoal(after[i]) << " | " << formatRequested(after[i].outcome.goal) << " | "
        << formatAchieved(before[i].outcome) << " | " << formatAchieved(after[i].outcome) << " |\n";
}

// The best design as `bielle solve` makes its motions, beside what the search made of it.
void writeUsual(std::ostream& out, const DesignEvaluator& evaluator, const DesignRun& run) {
  if (!run.usual) return;
  const Evaluation &search = run.evaluation, &usual = *run.usual;
  out << "\n## By the usual steps\n\n"
         "The motions of `best` as `bielle solve` makes them, by steps of the length and kind that it takes by itself";
  if (usual.status != DesignStatus::Feasible) out << ": **" << getName(usual.status) << "**, " << usual.message;
  out << ".\n";
  if (!isMeasured(usual.status) || !isMeasured(search.status)) return;
  out << "\n| | search | `bielle solve` | change |\n|---|---|---|---|\n";
  for (size_t i = 0; i < evaluator.objective().size(); ++i)
    writeRow(out, describeTerm(evaluator.objective()[i]), search.terms[i], usual.terms[i]);
  for (size_t i = 0; i < evaluator.constraints().size(); ++i) {
    const DesignConstraint& constraint = evaluator.constraints()[i];
    writeRow(out, describeMeasure(constraint.measure, constraint.motors), search.constraints[i], usual.constraints[i]);
  }
  for (size_t i = 0; i < std::min(search.goals.size(), usual.goals.size()); ++i)
    out << "| " << describeGoal(usual.goals[i]) << " | " << formatAchieved(search.goals[i].outcome) << " | "
        << formatAchieved(usual.goals[i].outcome) << " | |\n";
}

// What the best design has of a variable that is no choice: nearer to a bound than a thousandth of the way between them, the bound
// may be what decided.
std::string markBound(const DesignVariable& v, double value) {
  const double near = 1e-3 * (v.upper - v.lower);
  if (v.isChoice()) return "";
  if (value - v.lower < near) return " (lower bound)";
  return v.upper - value < near ? " (upper bound)" : "";
}

void writeVariables(std::ostream& out, const Parametrization& robot, const VectorXd& best) {
  out << "| variable | unit | bounds | before | after |\n|---|---|---|---|---|\n";
  for (size_t i = 0; i < robot.variables().size(); ++i) {
    const DesignVariable& v = robot.variables()[i];
    const Eigen::Index k = static_cast<Eigen::Index>(i);
    out << "| " << v.name << " | " << (v.isChoice() ? "" : v.unit) << " | " << formatBounds(v) << " | "
        << formatOwn(robot, robot.start(), i) << " | " << formatOwn(robot, best, i)
        << (matters(robot, best, i) ? markBound(v, best[k]) : "") << " |\n";
  }
}

// The goals of the designs of a front, which all of them meet.
void writeFrontGoals(std::ostream& out, const std::vector<FrontDesign>& front) {
  if (front.empty() || front.front().goals.empty()) return;
  out << "\n| achieved";
  for (const DesignGoal& goal : front.front().goals)
    out << " | " << describeGoal(goal) << ", " << formatRequested(goal.outcome.goal);
  out << " |\n|---";
  for (size_t i = 0; i < front.front().goals.size(); ++i) out << "|---";
  out << "|\n";
  for (size_t i = 0; i < front.size(); ++i) {
    out << "| " << getFrontName(i);
    for (const DesignGoal& goal : front[i].goals) out << " | " << formatAchieved(goal.outcome);
    out << " |\n";
  }
}

// The robots of the front, and the start.
void writeFront(std::ostream& out, const DesignEvaluator& evaluator, const DesignRun& run) {
  const Parametrization& robot = evaluator.robot();
  out << "\n"
         "## Front\n\n"
         "None of these designs is dominated by another one found. The robots are in `front`; `best` has the smallest "
         "value, the weighted sum of the objectives relative to the start.\n\n"
         "| robot";
  for (const ObjectiveTerm& term : evaluator.objective()) out << " | " << describeTerm(term);
  for (const DesignVariable& v : robot.variables())
    out << " | " << v.name << (v.isChoice() || v.unit == "1" ? "" : " [" + v.unit + "]");
  out << " |\n|---";
  for (size_t i = 0; i < evaluator.objective().size() + robot.variables().size(); ++i) out << "|---";
  out << "|\n";
  const auto write = [&](const std::string& name, const std::vector<double>& measures, const VectorXd& x) {
    out << "| " << name;
    for (double measure : measures) out << " | " << format(measure);
    for (size_t i = 0; i < robot.variables().size(); ++i) out << " | " << formatOwn(robot, x, i);
    out << " |\n";
  };
  write("start", evaluator.start().terms, robot.start());
  for (size_t i = 0; i < run.front.size(); ++i) write(getFrontName(i), run.front[i].measures, run.front[i].x);
  writeFrontGoals(out, run.front);
}

// Keeps the table short: only changes of at least a thousandth are listed.
bool isChanged(double before, double after) { return std::abs(dropNoise(after - before)) > 1e-3 * std::abs(before); }

void writeMotion(std::ostream& out, const Model& model, const Model& best, const std::string& name,
                 const MotionMeasures& before, const MotionMeasures& after) {
  out << "\n### " << name << "\n\n| measure | before | after | change |\n|---|---|---|---|\n";
  for (int m = 0; m < std::min(model.nu(), best.nu()); ++m) {
    const MotorMeasures &a = before.motors[m], &b = after.motors[m];
    if (!isChanged(a.peak_torque, b.peak_torque) && !isChanged(a.peak_speed, b.peak_speed)) continue;
    const std::string &name_before = model.motors()[m].name, &name_after = best.motors()[m].name;
    const std::string motor = name_before == name_after ? name_before : name_before + ", then " + name_after;
    writeRow(out, motor + ": peak torque [N m]", a.peak_torque, b.peak_torque);
    writeRow(out, motor + ": rms torque [N m]", a.rms_torque, b.rms_torque);
    writeRow(out, motor + ": peak speed [rad/s]", a.peak_speed, b.peak_speed);
    writeRow(out, motor + ": mechanical energy [J]", a.energy, b.energy);
    writeRow(out, motor + ": electrical energy [J]", a.electrical_energy, b.electrical_energy);
  }
  writeRow(out, "conditioning of the linkages", before.conditioning, after.conditioning);
}

std::string formatPage(const DesignEvaluator& evaluator, const DesignSpec& spec, const DesignRun& run) {
  const Parametrization& robot = evaluator.robot();
  std::ostringstream out;
  out << "# Design of " << robot.startModel().name() << "\n\nMade by `bielle design` from "
      << fs::path(spec.path).filename().string() << ", motions " << getName(spec.mode)
      << ". The robot is in `best`; rows of motors that change by less than a thousandth are left out.\n\n";
  writeVariables(out, robot, run.best);
  if (const double mass = calcMassInLinks(robot, run.best); mass > 0)
    out << "\nThe masses that the catalogue gives for motors, " << format(mass)
        << " kg together, count as included in the links that carry them; nothing was added.\n";
  out << "\n| objective | before | after | change |\n|---|---|---|---|\n";
  for (size_t i = 0; i < evaluator.objective().size() && i < run.evaluation.terms.size(); ++i)
    writeRow(out, describeTerm(evaluator.objective()[i]), evaluator.start().terms[i], run.evaluation.terms[i]);
  writeRow(out, "value", evaluator.start().value, run.value);
  writeConstraints(out, evaluator, run);
  writeGoals(out, evaluator.start().goals, run.evaluation.goals);
  if (run.evaluation.status != DesignStatus::Feasible)
    out << "\n**No design is feasible**; this is the start design, where " << run.evaluation.message << ".\n";
  if (spec.front) writeFront(out, evaluator, run);
  out << "\n"
      << std::accumulate(run.counts.begin(), run.counts.end(), 0)
      << (spec.front ? " evaluations of designs: "
                     : " designs in " + std::to_string(run.searches.size()) + " searches: ")
      << run.counts[0] << " feasible, " << run.counts[1] << " whose loops do not close, " << run.counts[2]
      << " whose motion fails"
      << (evaluator.start().goals.empty() ? "" : ", " + std::to_string(run.counts[4]) + " that miss a goal")
      << (evaluator.constraints().empty() ? "" : ", " + std::to_string(run.counts[3]) + " that violate constraints")
      << ".\n";
  for (size_t i = 0; i < run.evaluation.motions.size(); ++i)
    writeMotion(out, robot.startModel(), robot.make(run.best), describeMotion(evaluator.motions()[i]),
                evaluator.start().motions[i], run.evaluation.motions[i]);
  writeUsual(out, evaluator, run);
  return out.str();
}

// The robot of a design. Where its lengths do not allow the angles that a reference of the start gives, this gives those that it is
// assembled with, and the place of its base, which would pull at them.
Model makeWritten(const Parametrization& robot, const VectorXd& x) {
  const Model model = robot.make(x);
  ModelParts parts = takeParts(model);
  for (Reference& reference : parts.references) {
    const AssemblyResult result = assembleReference(model, reference.name);
    const std::vector<ReferenceJoint> joints = listReferenceJoints(model, reference, result.q);
    const bool moves = std::any_of(joints.begin(), joints.end(),
                                   [](const ReferenceJoint& joint) { return joint.moved > kReferenceTolerance; });
    if (!moves || result.status != AssemblyStatus::Closed) continue;
    for (const ReferenceJoint& joint : joints)
      reference.joints[model.joints()[joint.joint].name].assign(joint.assembled.begin(), joint.assembled.end());
    if (model.hasFreeFlyer()) reference.joints[model.joints()[1].name].assign(result.q.begin(), result.q.begin() + 7);
  }
  return ModelBuilder::restore(std::move(parts));
}

}  // namespace

double calcMassInLinks(const Parametrization& robot, const VectorXd& x) {
  const Model model = robot.make(x);
  double mass = 0;
  for (const Motor& motor : model.motors()) mass += motor.drive.mass;
  for (const DesignVariable& variable : robot.variables())
    if (!variable.mass.empty())
      for (const int m : findMotors(model, variable.motors)) mass -= model.motors()[static_cast<size_t>(m)].drive.mass;
  return dropNoise(mass);
}

std::vector<std::string> writeDesign(const std::string& directory, const DesignEvaluator& evaluator,
                                     const DesignSpec& spec, const DesignRun& run) {
  const std::string best = directory + "/best", page = directory + "/design.md";
  writeRobot(makeWritten(evaluator.robot(), run.best), best, "Written by `bielle design`.");
  writeTextFile(page, formatPage(evaluator, spec, run));
  std::vector<std::string> paths = {best, page};
  for (size_t i = 0; i < run.front.size(); ++i) {
    paths.push_back(directory + "/front/" + getFrontName(i));
    writeRobot(makeWritten(evaluator.robot(), run.front[i].x), paths.back(), "Written by `bielle design`.");
  }
  for (const DesignFigure& figure : makeDesignFigures(evaluator, run)) {
    const std::string path = directory + "/" + figure.name + ".svg";
    if (drawPlots(path, figure.plots)) paths.push_back(path);
  }
  return paths;
}

}  // namespace bielle
