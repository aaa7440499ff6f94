// The output of a design run: the robot, the table, the figures.
#include <algorithm>
#include <filesystem>
#include <numeric>

#include "bielle/formats/robot_writer.h"
#include "bielle/model/error.h"
#include "bielle/results/result.h"
#include "bielle/results/robot_info.h"
#include "design/figures.h"
#include "design/joint_reach.h"
#include "design/marks.h"
#include "design/motor_change.h"
#include "design/run.h"
#include "design/shown_designs.h"
#include "formats/text_file.h"
#include "model/number_text.h"
#include "results/mechanism_figure.h"

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

// The value of variable i without its unit and whether it is at a bound, or that it means nothing.
std::string formatOwn(const Parametrization& robot, const VectorXd& x, size_t i) {
  if (!changesDesign(robot, x, i)) return "–";
  const DesignVariable& variable = robot.variables()[i];
  const double value = x[static_cast<Eigen::Index>(i)];
  const std::string bound = findBound(variable, value);
  return formatValue(variable, value) + (bound.empty() ? "" : " (" + bound + " bound)");
}

// Of a constraint that is violated, that it is.
std::string formatConstraint(const DesignConstraint& constraint, double value) {
  return format(value) + (calcViolation(constraint, value) > 0 ? ", **violated**" : "");
}

// The least of the motions; nothing where there is none.
std::string formatMargin(const std::optional<double>& margin) { return margin ? format(*margin) : "–"; }

void writeConstraints(std::ostream& out, const DesignEvaluator& evaluator, const DesignRun& run) {
  if (evaluator.constraints().empty()) return;
  out << "\n| constraint | bound | before | after |\n|---|---|---|---|\n";
  for (size_t i = 0; i < evaluator.constraints().size() && i < run.evaluation.constraints.size(); ++i) {
    const DesignConstraint& constraint = evaluator.constraints()[i];
    out << "| " << describeConstraint(constraint) << " | at " << (constraint.at_least ? "least " : "most ")
        << format(constraint.bound) << " | " << formatConstraint(constraint, evaluator.start().constraints[i]) << " | "
        << formatConstraint(constraint, run.evaluation.constraints[i]) << " |\n";
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
    writeRow(out, describeConstraint(constraint), search.constraints[i], usual.constraints[i]);
  }
  for (size_t i = 0; i < std::min(search.goals.size(), usual.goals.size()); ++i)
    out << "| " << describeGoal(usual.goals[i]) << " | " << formatAchieved(search.goals[i].outcome) << " | "
        << formatAchieved(usual.goals[i].outcome) << " | |\n";
  if (run.usual_start && isMeasured(run.usual_start->status)) {
    out << "\n| `bielle solve` | before | after | change |\n|---|---|---|---|\n";
    for (size_t i = 0; i < evaluator.objective().size(); ++i)
      writeRow(out, describeTerm(evaluator.objective()[i]), run.usual_start->terms[i], usual.terms[i]);
  }
}

void writeVariables(std::ostream& out, const Parametrization& robot, const VectorXd& best) {
  out << "| variable | unit | bounds | before | after |\n|---|---|---|---|---|\n";
  for (size_t i = 0; i < robot.variables().size(); ++i) {
    const DesignVariable& v = robot.variables()[i];
    out << "| " << v.name << " | " << (v.isChoice() ? "" : v.unit) << " | " << formatBounds(v) << " | "
        << formatOwn(robot, robot.start(), i) << " | " << formatOwn(robot, best, i) << " |\n";
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
    out << "| " << getNumberName(i);
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
  for (const DesignConstraint& constraint : evaluator.constraints())
    if (constraint.measure != Measure::Margin) out << " | " << describeConstraint(constraint);
  out << " | margin |\n|---";
  size_t columns = evaluator.objective().size() + robot.variables().size() + 1;
  for (const DesignConstraint& constraint : evaluator.constraints()) columns += constraint.measure != Measure::Margin;
  for (size_t i = 0; i < columns; ++i) out << "|---";
  out << "|\n";
  const auto write = [&](const std::string& name, const FrontDesign& design) {
    out << "| " << name;
    for (double measure : design.measures) out << " | " << format(measure);
    for (size_t i = 0; i < robot.variables().size(); ++i) out << " | " << formatOwn(robot, design.x, i);
    for (size_t i = 0; i < evaluator.constraints().size(); ++i)
      if (evaluator.constraints()[i].measure != Measure::Margin)
        out << " | " << formatConstraint(evaluator.constraints()[i], design.constraints[i]);
    out << " | " << formatMargin(design.margin) << " |\n";
  };
  const Evaluation& start = evaluator.start();
  write("start", {robot.start(), start.terms, start.goals, start.constraints, start.margin});
  for (size_t i = 0; i < run.front.size(); ++i) write(getNumberName(i), run.front[i]);
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

// Joints whose ranges or ratios change through their linkages.
void writeReaches(std::ostream& out, const std::vector<ReachChange>& changes) {
  if (changes.empty()) return;
  out << "\n| joint, through its linkage | before | after |\n|---|---|---|\n";
  for (const ReachChange& change : changes) {
    out << "| " << change.before.joint << ": range | " << formatRange(change.before) << " | "
        << formatRange(change.after) << " |\n";
    if (change.before.ratio && change.after.ratio)
      out << "| " << change.before.joint << ": ratio | " << formatRatio(change.before) << " | "
          << formatRatio(change.after) << " |\n";
  }
}

std::string formatPage(const DesignEvaluator& evaluator, const DesignSpec& spec, const DesignRun& run) {
  const Parametrization& robot = evaluator.robot();
  TextStream out;
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
  if (evaluator.start().margin && run.evaluation.margin)
    writeRow(out, "margin from dead points", *evaluator.start().margin, *run.evaluation.margin);
  writeReaches(out, listReachChanges(robot.startModel(), robot.make(run.best)));
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

// The mechanism found, with the names and distances of its pivots, over that of the start.
std::string drawChange(const DesignEvaluator& evaluator, const DesignRun& run) {
  const Model start = evaluator.robot().startModel(), best = evaluator.robot().make(run.best);
  const MechanismFigure before = makeMechanismFigure(start, makeDrawnPosture(start)),
                        after = makeMechanismFigure(best, makeDrawnPosture(best));
  MechanismPicture picture;
  picture.title = best.name() + ", grey: the start";
  picture.behind = &before;
  return formatMechanism(after, picture);
}

}  // namespace

double calcMassInLinks(const Parametrization& robot, const VectorXd& x) {
  const Model model = robot.make(x);
  double mass = 0;
  for (const Motor& motor : model.motors()) mass += motor.drive.mass;
  for (const DesignVariable& variable : robot.variables())
    if (!variable.masses.empty() || (robot.isGiven() && !variable.types.empty()))
      for (const int m : findMotors(model, variable.motors)) mass -= model.motors()[static_cast<size_t>(m)].drive.mass;
  return dropNoise(mass);
}

std::vector<std::string> writeDesign(const std::string& directory, const DesignEvaluator& evaluator,
                                     const DesignSpec& spec, const DesignRun& run) {
  const std::string best = directory + "/best", page = directory + "/design.md";
  writeRobot(makeWritten(evaluator.robot(), run.best), best, "Written by `bielle design`.");
  writeTextFile(page, formatPage(evaluator, spec, run));
  std::vector<std::string> paths = {best, page};
  const std::string mechanism = directory + "/design_mechanism.svg";
  writeTextFile(mechanism, drawChange(evaluator, run));
  paths.push_back(mechanism);
  for (const DesignFigure& figure : makeDesignFigures(evaluator, run)) {
    const std::string path = directory + "/" + figure.name + ".svg";
    if (drawPlots(path, figure.plots)) paths.push_back(path);
  }
  return paths;
}

}  // namespace bielle
